//! The refinement of a scenario: what its numbers are worth.
//!
//! The slider is simulated as given, on a finer mesh, with a shorter step, and on a coarser mesh, each three times, with
//! moduli that differ by a kick too small to see. A chain keeps its decay length, a lattice the shape of its meshes.

use asperity_model::{ADVISED_SHARE, Scenario};
use asperity_numbers::{Convergence, Number, Summary, median};
use asperity_record::{Cell, Column, ColumnKind};
use asperity_tables::Table;
use toml::Value;

use crate::error::StudyError;
use crate::plan::Plan;
use crate::results::Results;
use crate::study::Study;

/// By how much the moduli of the three runs of a mesh differ, over the modulus: less than any number is known to, and far
/// more than a rounding.
const KICK: f64 = 1e-6;

const KICKS: usize = 3;

const STIFFNESS_RATIO: &str = "friction.interfacial_stiffness_ratio";

/// The keys that count nodes.
const NODES: [&str; 3] = ["slider.blocks", "slider.across", "slider.rows"];

/// A scenario's refinement.
#[derive(Debug)]
pub struct Refinement {
    /// Its runs: the variants, each with its kicks.
    pub study: Study,
    /// Its work, over that of the scenario itself.
    pub work_ratio: f64,
}

impl Refinement {
    /// That of a scenario. A lattice that has no node halfway along a side gets no coarser mesh.
    ///
    /// # Errors
    /// In words, of a single block.
    pub fn of(scenario: &Scenario) -> Result<Refinement, String> {
        let slider = &scenario.slider;
        if slider.contacts() == 1 {
            return Err("a single block has no mesh (accepted: two blocks or more)".to_owned());
        }
        let preview = scenario.preview();
        let decay_length_m = preview.decay_length_m.filter(|_| scenario.friction.law.uses(STIFFNESS_RATIO));
        let nodes = [slider.blocks, slider.across, slider.rows].map(u64::from);
        let gaps = nodes.map(|nodes| nodes - 1);
        let has_coarser = !slider.is_lattice() || gaps.iter().all(|gaps| gaps % 2 == 0);
        let coarser = gaps.map(|gaps| gaps.div_ceil(2) + 1);
        let finer = gaps.map(|gaps| 2 * gaps + 1);
        // The adaptive solver chooses its steps by the tolerance.
        let (step_key, step, shorter) = match scenario.friction.law.sticks() {
            true => ("time.step_s", scenario.time.step_s, scenario.time.step_s / 2.0),
            false => ("time.tolerance", scenario.time.tolerance, scenario.time.tolerance / 10.0),
        };
        let is_near = preview.step_ratio.is_some_and(|share| 2.0 * share > ADVISED_SHARE);
        let for_finer = if is_near && scenario.friction.law.sticks() { shorter } else { step };
        let mut variants = vec![(nodes, step), (finer, for_finer), (nodes, shorter)];
        let work = |(nodes, step): &([u64; 3], f64)| nodes.iter().product::<u64>() as f64 / step;
        let as_given = work(&variants[0]);
        variants.extend(has_coarser.then_some((coarser, step)));
        let varied: Vec<usize> = (0..3).filter(|side| gaps[*side] > 0).collect();
        let mut keys: Vec<&str> = varied.iter().map(|side| NODES[*side]).collect();
        keys.push(step_key);
        keys.extend(decay_length_m.map(|_| "friction.decay_length_m"));
        let row = |(nodes, step): &([u64; 3], f64)| {
            let mut row: Vec<Value> = varied.iter().map(|side| Value::Integer(nodes[*side] as i64)).collect();
            row.push(Value::Float(*step));
            row.extend(decay_length_m.map(Value::Float));
            Value::Array(row)
        };
        let modulus_pa = slider.youngs_modulus_pa;
        let moduli_pa = [0.0, KICK, -KICK].map(|kick| Value::Float(modulus_pa * (1.0 + kick)));
        let [mesh, kicks] = [
            toml::Table::from_iter([
                ("keys".to_owned(), Value::from(keys)),
                ("rows".to_owned(), Value::Array(variants.iter().map(row).collect())),
            ]),
            toml::Table::from_iter([
                ("key".to_owned(), Value::from("slider.youngs_modulus_pa")),
                ("values".to_owned(), Value::Array(moduli_pa.to_vec())),
            ]),
        ];
        let text = toml::Table::from_iter([
            ("title".to_owned(), Value::from(format!("Refinement of {}", scenario.name))),
            ("scenario".to_owned(), Value::from("default")),
            ("keep".to_owned(), Value::Array(Vec::new())),
            ("axis".to_owned(), Value::Array(vec![Value::Table(mesh), Value::Table(kicks)])),
        ]);
        let mut study = Study::parse(&text.to_string(), std::path::Path::new("."))?;
        if let Some(grid) = &mut study.grid {
            grid.scenario.clone_from(&scenario.name);
            grid.scenario_toml = scenario.to_editable_toml();
        }
        let work_ratio = KICKS as f64 * variants.iter().map(work).sum::<f64>() / as_given;
        Ok(Refinement { study, work_ratio })
    }
}

/// A number under refinement.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The number.
    pub number: Number,
    /// The median of its runs as given, on the finer mesh, with the shorter step, and on the coarser mesh; `None` if one of
    /// them lacks it.
    pub medians: [Option<f64>; 4],
    /// Its changes, each over the larger value: on the finer mesh, with the shorter step, and the largest between runs that
    /// differ by a kick.
    pub changes: Option<[f64; 3]>,
}

impl Refined {
    /// All numbers of a refinement that is done, but for those that say what was run.
    ///
    /// # Errors
    /// If results cannot be read.
    pub fn all(plan: &Plan, results: &Results) -> Result<Vec<Refined>, StudyError> {
        let mut summaries: Vec<Option<Summary>> = Vec::new();
        for row in &plan.rows {
            let outcome = results.outcome(plan, row.run)?;
            summaries.push(outcome.and_then(Result::ok).map(|outcome| outcome.summary));
        }
        let is_found = |number: &Number| number.is_of_summary() && number.key.group != Summary::KEYS[0].group;
        let numbers = Number::all().filter(is_found);
        Ok(numbers.map(|number| Refined::of(number, &summaries)).collect())
    }

    fn of(number: Number, summaries: &[Option<Summary>]) -> Refined {
        let value = |summary: &Option<Summary>| number.of_summary(summary.as_ref()?);
        let runs: Vec<Option<Vec<f64>>> =
            summaries.chunks(KICKS).map(|kicks| kicks.iter().map(value).collect()).collect();
        let variant = |n: usize| runs.get(n)?.as_ref();
        let medians = [0, 1, 2, 3].map(|n| median(variant(n)?.iter().copied()));
        let spread = |values: &Vec<f64>| {
            values.iter().flat_map(|a| values.iter().map(|b| change(*a, *b))).fold(0.0, f64::max)
        };
        let changes = || {
            let [given, finer, shorter, _] = medians;
            let spreads = [0, 1, 2].map(|n| variant(n).map(spread));
            let kicks = spreads.into_iter().collect::<Option<Vec<f64>>>()?.into_iter().fold(0.0, f64::max);
            Some([change(given?, finer?), change(given?, shorter?), kicks])
        };
        Refined { number, medians, changes: changes() }
    }

    /// What it is worth, as found; `None` if not all runs have it.
    pub fn found(&self) -> Option<Convergence> {
        self.changes.map(|[mesh, step, kicks]| Convergence::of_changes(mesh, step, kicks))
    }

    /// Whether it was found worth less than its class says.
    pub fn is_worse_than_stated(&self) -> bool {
        let stated = self.number.key.convergence;
        stated == Convergence::Robust && self.found().is_some_and(|found| found != Convergence::Robust)
    }
}

/// The difference of two values over the larger of them.
fn change(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) }
}

/// The table of a refinement: a row for each number.
pub fn table(refined: &[Refined]) -> Table {
    let word = |name: &'static str, about: &'static str| Column::new(name, ColumnKind::Word, about);
    let ratio = |name: &'static str, about: &'static str| Column::new(name, ColumnKind::Number, about);
    let number = |name: &'static str, about: &'static str| {
        Column::with_unit(name, ColumnKind::Number, "of the number", about)
    };
    let cell = |value: Option<f64>| value.map_or(Cell::Empty, Cell::Number);
    let class =
        |class: Option<Convergence>| class.map_or(Cell::Empty, |class| Cell::Word(class.word().into()));
    let change = |n: usize| move |one: &Refined| cell(one.changes.map(|changes| changes[n]));
    Table::of(
        "refinement",
        refined,
        &[
            (word("number", "The number, as in a summary."), &|one| Cell::Word(one.number.name().into())),
            (number("coarser_mesh", "Median of its values on the coarser mesh."), &|one| {
                cell(one.medians[3])
            }),
            (number("as_given", "Median of its values on the mesh as given."), &|one| cell(one.medians[0])),
            (number("finer_mesh", "Median of its values on the finer mesh."), &|one| cell(one.medians[1])),
            (number("shorter_step", "Median of its values with the shorter step."), &|one| {
                cell(one.medians[2])
            }),
            (ratio("mesh_change_ratio", "Its change on the finer mesh, over the larger value."), &change(0)),
            (ratio("step_change_ratio", "Its change with the shorter step, likewise."), &change(1)),
            (
                ratio("kick_change_ratio", "Its largest change between runs that differ by a kick."),
                &change(2),
            ),
            (word("found", "Its class as found; empty if not all runs have it."), &|one| class(one.found())),
            (word("stated", "Its class as the program states it."), &|one| {
                class(Some(one.number.key.convergence))
            }),
        ],
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use asperity_model::resolve;
    use asperity_numbers::{Convergence, Number, Summary};

    use super::{Refined, Refinement};

    /// A refinement by its name: for each number its class as found, and its largest change.
    type Stored = (&'static str, BTreeMap<String, (String, f64)>);

    /// Refinements that `asperity refine` has made.
    fn stored() -> Vec<Stored> {
        let read = |(name, text): (&'static str, &str)| {
            let rows = text.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
            let found = rows.filter(|cells| !cells[8].is_empty()).map(|cells| {
                let changes = cells[5..8].iter().map(|cell| cell.parse::<f64>().expect("it is a number"));
                (cells[0].to_owned(), (cells[8].to_owned(), changes.fold(0.0, f64::max)))
            });
            (name, found.collect())
        };
        [
            ("default", include_str!("../../../fixtures/refinement/default.csv")),
            ("slab-coarse", include_str!("../../../fixtures/refinement/slab-coarse.csv")),
            ("rate-and-state", include_str!("../../../fixtures/refinement/rate-and-state.csv")),
            ("chain-junctions", include_str!("../../../fixtures/refinement/chain-junctions.csv")),
        ]
        .map(read)
        .to_vec()
    }

    #[test]
    fn classes_agree_with_what_refinements_find() {
        let stored = stored();
        let mut checked = 0;
        for number in Number::all().filter(|number| number.is_of_summary()) {
            let of_number = stored.iter().filter_map(|(name, found)| Some((name, found.get(number.name())?)));
            let found: Vec<_> = of_number.collect();
            let robust = |class: &str| class == Convergence::Robust.word();
            if number.key.convergence == Convergence::Robust {
                let other = found.iter().find(|(_, (class, _))| !robust(class));
                assert_eq!(other, None, "{} is stated as robust", number.name());
            } else if found.iter().any(|(name, (_, change))| **name == "default" && *change > 0.0) {
                let is_justified = found.iter().any(|(_, (class, _))| !robust(class));
                assert!(is_justified, "{} is robust everywhere: {found:?}", number.name());
            }
            checked += found.len();
        }
        assert!(checked > 200, "{checked}");
    }

    #[test]
    fn meshes_keep_the_shape_of_lattices_and_the_decay_length_of_chains() {
        let runs = |name: &str, set: &[&str]| {
            let refinement = Refinement::of(&resolve(name, set).unwrap()).unwrap();
            let plan = crate::Plan::of(&refinement.study, false, None).unwrap();
            let scenarios: Vec<_> = plan.rows.iter().map(|row| plan.scenario(row).unwrap().0).collect();
            (scenarios, refinement.work_ratio)
        };
        let (chain, work_ratio) = runs("default", &[]);
        // Three times 1, 199 / 100, 2 and 51 / 100.
        assert!(chain.len() == 12 && (work_ratio - 16.5).abs() < 1e-9, "{work_ratio}");
        let l_0 = chain[0].preview().decay_length_m.unwrap();
        for scenario in &chain {
            assert!((scenario.preview().decay_length_m.unwrap() / l_0 - 1.0).abs() < 1e-9);
        }
        let blocks = |n: usize| chain[n].slider.blocks;
        assert_eq!([blocks(0), blocks(3), blocks(6), blocks(9)], [100, 199, 100, 51]);
        assert_eq!(chain[6].time.step_s, chain[0].time.step_s / 2.0);
        let moduli = [0, 1, 2].map(|n| chain[n].slider.youngs_modulus_pa / 2.5e9 - 1.0);
        assert!(moduli[0] == 0.0 && (moduli[1] / 1e-6 - 1.0).abs() < 1e-6 && moduli[2] < 0.0);

        // A lattice near its longest step takes half of it on the finer mesh.
        let (slab, _) = runs("pmma-block", &[]);
        let of_slab = |n: usize| (slab[n].slider.blocks, slab[n].slider.rows, slab[n].time.step_s);
        assert_eq!([of_slab(3), of_slab(9)], [(113, 61, 1e-7), (29, 16, 2e-7)]);
        assert_eq!(runs("slab", &["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7"]).0.len(), 9);
        // An adaptive solver has a tolerance, and a single block no mesh.
        let (chain, _) = runs("rate-and-state", &["friction.evolution_offsets=[]"]);
        assert_eq!(chain[6].time.tolerance, chain[0].time.tolerance / 10.0);
        assert!(Refinement::of(&resolve::<&str>("spring-slider", &[]).unwrap()).is_err());
    }

    #[test]
    fn a_number_that_a_run_lacks_is_not_judged() {
        let number = Number::find("precursor_count").unwrap();
        let with = |count: u64| Some(Summary { precursor_count: Some(count), ..Summary::default() });
        let all = [40, 44, 42, 50, 54, 52, 40, 42, 41, 20, 20, 20].map(with);
        let refined = Refined::of(number, &all);
        assert_eq!(refined.medians, [Some(42.0), Some(52.0), Some(41.0), Some(20.0)]);
        let [mesh, step, kicks] = refined.changes.unwrap();
        assert_eq!([mesh, step, kicks], [10.0 / 52.0, 1.0 / 42.0, 4.0 / 44.0]);
        assert_eq!(refined.found(), Some(Convergence::OfTheMesh));
        let mut without = all.to_vec();
        without[4] = None;
        assert_eq!(Refined::of(number, &without).found(), None);
        // Without a coarser mesh it is judged all the same.
        assert_eq!(Refined::of(number, &all[..9]).found(), Some(Convergence::OfTheMesh));
    }
}
