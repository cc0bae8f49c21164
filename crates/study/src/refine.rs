//! The refinement of a scenario: what its numbers are worth.
//!
//! The slider is simulated as given, on a finer mesh, with a shorter step, and on a coarser mesh, each three times, with
//! moduli that differ by a perturbation too small to see. A chain keeps its decay length, a lattice the shape of its meshes.

use std::path::Path;

use asperity_figures::Figure;
use asperity_files::{Existing, FileSet, Inputs};
use asperity_model::{ADVISED_SHARE, Scenario};
use asperity_numbers::Convergence;
use asperity_numbers::refined::{PERTURBED, Refined};
use asperity_record::{Cell, Column, ColumnKind};
use asperity_tables::{Table, table_files};
use toml::Value;

use crate::error::StudyError;
use crate::outputs::{Outputs, TABLES};
use crate::plan::{Plan, Row};
use crate::results::Results;
use crate::study::Study;
use crate::work::Making;

/// By how much the moduli of the three runs of a mesh differ, over the modulus: less than any number is known to, and far
/// more than a rounding.
const PERTURBATION: f64 = 1e-6;

const STIFFNESS_RATIO: &str = "friction.interfacial_stiffness_ratio";

/// The keys that count nodes.
const NODES: [&str; 3] = ["slider.blocks", "slider.across", "slider.rows"];

/// The runs of a scenario's refinement, the variants each with its perturbations, and their work over that of the scenario
/// itself. A lattice that has no node halfway along a side gets no coarser mesh.
///
/// # Errors
/// In words, of a single block, or of a list of blocks by their numbers.
pub fn study_of(scenario: &Scenario) -> Result<(Study, f64), String> {
    let slider = &scenario.slider;
    if slider.contacts() == 1 {
        return Err("a single block has no mesh (accepted: two blocks or more)".to_owned());
    }
    let (stuck, steps) = (&scenario.friction.stuck_blocks, &scenario.prestress.from_blocks);
    if !stuck.is_empty() || !steps.is_empty() || scenario.initial.is_given() {
        let of_mesh = "friction.stuck_blocks, prestress.from_blocks and a given start are of one mesh";
        return Err(format!("{of_mesh} (accepted: none of them)"));
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
    variants.extend(has_coarser.then_some((coarser, step)));
    let varied: Vec<usize> = (0..3).filter(|side| gaps[*side] > 0).collect();
    let mut keys: Vec<&str> = varied.iter().map(|side| NODES[*side]).collect();
    keys.push(step_key);
    keys.extend(decay_length_m.map(|_| "friction.decay_length_m"));
    // Keys of whole numbers take 100.0 for 100.
    let row = |(nodes, step): &([u64; 3], f64)| -> Vec<f64> {
        let counts = varied.iter().map(|side| nodes[*side] as f64);
        counts.chain([*step]).chain(decay_length_m).collect()
    };
    let rows: Vec<Vec<f64>> = variants.iter().map(row).collect();
    let moduli_pa = [0.0, PERTURBATION, -PERTURBATION].map(|ratio| slider.youngs_modulus_pa * (1.0 + ratio));
    let title = Value::from(format!("Refinement of {}", scenario.name));
    let text = format!(
        "title = {title}\nscenario = 'default'\nkeep = []\n[[axis]]\nkeys = {keys:?}\nrows = {rows:?}\n\
         [[axis]]\nkey = 'slider.youngs_modulus_pa'\nvalues = {moduli_pa:?}\n"
    );
    let mut study = Study::parse(&text, Path::new("."))?;
    if let Some(grid) = &mut study.grid {
        grid.scenario.clone_from(&scenario.name);
        grid.scenario_toml = scenario.to_editable_toml();
    }
    study.figures.push(Figure::refinement());
    let work_ratio = PERTURBED as f64 * variants.iter().map(work).sum::<f64>() / work(&variants[0]);
    Ok((study, work_ratio))
}

/// A list by block on another mesh: each block gets the mean over its part of the slider.
pub(crate) fn resampled(list: &[f64], blocks: usize) -> Vec<f64> {
    let width = list.len() as f64 / blocks as f64;
    let of_block = |block: usize| {
        let (from, to) = (width * block as f64, width * (block + 1) as f64);
        let parts = (from as usize..list.len().min(to.ceil() as usize))
            .map(|n| list[n] * (to.min((n + 1) as f64) - from.max(n as f64)));
        parts.sum::<f64>() / width
    };
    (0..blocks).map(of_block).collect()
}

/// Makes the runs of a refinement that its folder lacks, and its table, its figure and its page, in place of those of an
/// earlier call. Returns what these show, and the results.
///
/// # Errors
/// As [`Plan::begun`] and [`Making::make`]; if results contradict each other, or a file cannot be written.
pub fn make(study: &Study, file: &Path, making: &Making<'_>) -> Result<(Vec<Refined>, Results), StudyError> {
    let &Making { folder, jobs, watcher, .. } = making;
    let (plan, _) = Plan::begun(study, file, folder, false, jobs)?;
    let results = making.make_missing(&plan, |_| true)?;
    results.check()?;
    let of_run = |row: &Row| {
        let summary = results.outcome(&plan, row.run)?.and_then(Result::ok).map(|outcome| outcome.summary);
        Ok(Refined::numbers().map(|number| number.of_summary(summary.as_ref()?)).collect())
    };
    let runs = plan.rows.iter().map(of_run).collect::<Result<Vec<_>, StudyError>>()?;
    let refined = Refined::all(&runs);
    let files = FileSet::new(Existing::Replace, Inputs::default());
    table_files::write(&files, &folder.join(TABLES), "refinement", table(&refined))?;
    files.publish()?;
    Outputs { plan: &plan, results: &results, folder, provenance: true, watcher }.figures(None, None)?;
    Ok((refined, results))
}

/// The table of a refinement: a row for each number.
pub fn table(refined: &[Refined]) -> Table {
    let word = |name: &'static str, about: &'static str| Column::new(name, ColumnKind::Word, about);
    let ratio = |name: &'static str, about: &'static str| Column::new(name, ColumnKind::Number, about);
    let number = |name: &'static str, about: &'static str| {
        Column::with_unit(name, ColumnKind::Number, "of the number", about)
    };
    let cell = |value: Option<f64>| value.map_or(Cell::Empty, Cell::Number);
    let class = |class: Convergence| Cell::Word(class.word().into());
    let median = |n: usize| move |one: &Refined| cell(one.medians[n]);
    let change = |n: usize| move |one: &Refined| cell(one.changes.map(|changes| changes[n]));
    let name = |one: &Refined| Cell::Word(one.number.name().into());
    let found = |one: &Refined| one.found().map_or(Cell::Empty, class);
    let stated = |one: &Refined| class(one.number.key.convergence);
    Table::of(
        "refinement",
        refined,
        &[
            (word("number", "The number, as in a summary."), &name),
            (number("coarser_mesh", "Median of its values on the coarser mesh."), &median(3)),
            (number("as_given", "Median of its values on the mesh as given."), &median(0)),
            (number("finer_mesh", "Median of its values on the finer mesh."), &median(1)),
            (number("shorter_step", "Median of its values with the shorter step."), &median(2)),
            (ratio("mesh_change_ratio", "Its change on the finer mesh, over the larger value."), &change(0)),
            (ratio("step_change_ratio", "Its change with the shorter step, likewise."), &change(1)),
            (
                ratio("perturbation_change_ratio", "Largest change between runs with perturbed moduli."),
                &change(2),
            ),
            (word("found", "Its class as found; empty if not all runs have it."), &found),
            (word("stated", "Its class as the program states it."), &stated),
        ],
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use asperity_model::resolve;
    use asperity_numbers::{Convergence, Number};

    use super::{resampled, study_of};

    /// A refinement by its name: for each number its class as found, its largest change, and its values on the coarser
    /// mesh, as given, and on the finer mesh.
    type Stored = (&'static str, BTreeMap<String, (String, f64, [Option<f64>; 3])>);

    /// Refinements that `asperity refine` has made.
    fn stored() -> Vec<Stored> {
        let read = |(name, text): (&'static str, &str)| {
            let rows = text.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
            let found = rows.filter(|cells| !cells[8].is_empty()).map(|cells| {
                let changes = cells[5..8].iter().map(|cell| cell.parse::<f64>().expect("it is a number"));
                let values = [1, 2, 3].map(|n| cells[n].parse().ok());
                (cells[0].to_owned(), (cells[8].to_owned(), changes.fold(0.0, f64::max), values))
            });
            (name, found.collect())
        };
        [
            ("default", include_str!("../../../fixtures/refinement/default.csv")),
            ("slab-coarse", include_str!("../../../fixtures/refinement/slab-coarse.csv")),
            ("pmma-block", include_str!("../../../fixtures/refinement/pmma-block.csv")),
            ("rate-and-state", include_str!("../../../fixtures/refinement/rate-and-state.csv")),
            ("chain-junctions", include_str!("../../../fixtures/refinement/chain-junctions.csv")),
        ]
        .map(read)
        .to_vec()
    }

    #[test]
    fn classes_agree_with_what_refinements_find() {
        let stored = stored();
        let (mut checked, mut converging) = (0, 0);
        for number in Number::all().filter(|number| number.is_of_summary()) {
            let of_number = stored.iter().filter_map(|(name, found)| Some((name, found.get(number.name())?)));
            let found: Vec<_> = of_number.collect();
            let robust = |class: &str| class == Convergence::Robust.word();
            if number.key.convergence == Convergence::Robust {
                let other = found.iter().find(|(_, (class, ..))| !robust(class));
                assert_eq!(other, None, "{} is stated as robust", number.name());
            } else if found.iter().any(|(name, (_, change, _))| **name == "default" && *change > 0.0) {
                let is_justified = found.iter().any(|(_, (class, ..))| !robust(class));
                assert!(is_justified, "{} is robust everywhere: {found:?}", number.name());
            }
            // All refinements keep the decay length: what converges at that changes less and less, unless it is robust.
            for (name, (class, _, values)) in &found {
                if let (Convergence::AtDecayLength, [Some(coarse), Some(given), Some(fine)]) =
                    (number.key.convergence, values)
                {
                    let is_shrinking = (fine - given).abs() <= (given - coarse).abs();
                    assert!(is_shrinking || robust(class), "{} of {name}: {values:?}", number.name());
                    converging += 1;
                }
            }
            checked += found.len();
        }
        assert!(checked > 200 && converging >= 6, "{checked} {converging}");
    }

    #[test]
    fn a_resampled_list_has_the_mean_of_each_part() {
        let list = [1.0, 3.0, 5.0, 7.0];
        assert_eq!(resampled(&list, 8), [1.0, 1.0, 3.0, 3.0, 5.0, 5.0, 7.0, 7.0]);
        assert_eq!(resampled(&list, 2), [2.0, 6.0]);
        let odd = resampled(&list, 3);
        assert!((odd[0] - 1.5).abs() < 1e-12 && (odd[1] - 4.0).abs() < 1e-12 && (odd[2] - 6.5).abs() < 1e-12);
    }

    #[test]
    fn meshes_keep_the_shape_of_lattices_and_the_decay_length_of_chains() {
        let runs = |name: &str, set: &[&str]| {
            let (study, work_ratio) = study_of(&resolve(name, set).unwrap()).unwrap();
            let plan = crate::Plan::of(&study, false, None).unwrap();
            let scenarios: Vec<_> = plan.rows.iter().map(|row| plan.scenario(row).unwrap().0).collect();
            (scenarios, work_ratio)
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
        let (chain, _) = runs("rate-and-state", &[]);
        assert_eq!(chain[6].time.tolerance, chain[0].time.tolerance / 10.0);
        // Its list of offsets is resampled where there are other blocks, and what lists blocks is refused.
        let offsets = |n: usize| &chain[n].friction.evolution_offsets;
        assert_eq!(offsets(6), offsets(0));
        assert_eq!([0, 3, 9].map(|n| offsets(n).len()), [16, 31, 9]);
        let stuck = study_of(&resolve("default", &["friction.stuck_blocks=[3]"]).unwrap()).unwrap_err();
        assert!(stuck.starts_with("friction.stuck_blocks, "), "{stuck}");
        assert!(study_of(&resolve::<&str>("spring-slider", &[]).unwrap()).is_err());
    }
}
