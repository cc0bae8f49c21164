//! Forces of pinned junctions along the slider at chosen instants: their mean and their width on each contact,
//! over the load that a junction bears. Where none is pinned, nothing is shown.

use asperity_numbers::fronts::FROM_BLOCKS;
use asperity_numbers::precursors::one_by_one;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::FieldRecord;

use super::kind::{Figure, coefficient_lines, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Panel, Pen, Sheet};
use super::stress::length_mm;

keys! {
    JunctionForces: run;

    /// Instants, s; the recorded state nearest to each is shown.
    at_s: Vec<f64>,
    /// Whether to show as well the states after the first precursor of five blocks or more, and after the
    /// first global slip, among slip events.
    #[serde(default)]
    after_slips: bool,
}

/// Looks of instants, by the number of the pen: lines across, for the coefficients, are grey.
const PENS: [usize; 4] = [0, 1, 2, 4];

impl Figure for JunctionForces {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { states: self.after_slips, states_near_s: self.at_s.clone(), ..RequiredData::NOTHING }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let law = run.plan.friction.law.junctions().ok_or_else(|| {
            format!("run {} has no junctions (accepted: friction.law = \"junctions\")", run.name)
        })?;
        let to_mm = length_mm(run)?;
        let mut means = coefficient_lines(run, to_mm);
        means.iter_mut().for_each(|line| line.colour = GREY);
        let at_start = vec![(0.0, law.width), (to_mm, law.width)];
        let mut widths = vec![Layer::line("w at the start", at_start, Dash::Dashed, GREY)];
        for (index, state) in self.states(run)?.into_iter().enumerate() {
            let along = |values: &[f64]| {
                let pinned = state.junctions_slipping.iter().map(|slipping| (*slipping as usize) < law.count);
                let places = (0..).map(|n| f64::from(n) * run.plan.spacing_m * 1e3);
                let shown = values.iter().zip(pinned).map(|(value, is)| if is { *value } else { f64::NAN });
                places.zip(shown).collect()
            };
            let label = format!("t = {:.4} s", state.time_s);
            let pen = Pen::nth(PENS[index % PENS.len()], &label);
            means.push(pen.line(along(&state.pinned_mean_ratio)));
            widths.push(pen.unlabelled().line(along(&state.pinned_width_ratio)));
        }
        let panel = |x: &str, y: &str, series: Vec<Layer>| {
            Panel::new(Scale::between(x, 0.0, to_mm), Scale::free(y), series)
        };
        let upper = panel("", "mean force/(p_n/N_s)", means);
        Ok(Sheet::stacked(upper, panel("x (mm)", "width", widths)))
    }
}

impl JunctionForces {
    /// The states to show, each once, in time.
    fn states<'a>(&self, run: &'a RunData) -> Result<Vec<&'a FieldRecord>, String> {
        let recorded = run.states()?;
        let mut states: Vec<&FieldRecord> =
            self.at_s.iter().filter_map(|at_s| recorded.near(*at_s)).collect();
        if self.after_slips {
            let precursors = one_by_one(run);
            let long = precursors.iter().find(|precursor| precursor.blocks_slipped >= FROM_BLOCKS);
            let global = precursors.iter().find(|precursor| precursor.blocks_slipped == run.header.blocks);
            let ends = [long, global].into_iter().flatten().filter_map(|precursor| precursor.end.end_step);
            states.extend(ends.filter_map(|step| recorded.at_precursor_end(step)));
        }
        states.retain(|state| !state.junctions_slipping.is_empty());
        states.sort_by_key(|state| state.step);
        states.dedup_by_key(|state| state.step);
        if states.is_empty() {
            return Err(format!("run {} has no states with junctions at these instants", run.name));
        }
        Ok(states)
    }
}

#[cfg(test)]
mod tests {
    use super::{Figure, JunctionForces};
    use asperity_numbers::run_data::RunData;
    use asperity_record::FieldRecord;
    use asperity_testkit::made_up::{self, EVENTS};

    const LAW: &str = "friction.law = \"junctions\"\nfriction.dynamic_coefficient = 0.2";

    fn panels(figure: &JunctionForces, run: &RunData) -> Result<Vec<super::Panel>, String> {
        Ok(figure.part(&RunData { kept: figure.required_data(), ..run.clone() })?.panels)
    }

    #[test]
    fn each_instant_has_a_line_with_gaps_where_no_junction_is_pinned() {
        let mut run = made_up::run(LAW, &EVENTS);
        let state = |step: u64, slipping: u32| FieldRecord {
            step,
            time_s: run.plan.grid.time_s(step),
            junctions_slipping: vec![0, slipping, 3],
            pinned_mean_ratio: vec![0.1, 0.2, 0.3],
            pinned_width_ratio: vec![0.05, 0.06, step as f64],
            ..FieldRecord::default()
        };
        let states = [state(0, 0), state(510, 100), state(700, 7)];
        let figure: JunctionForces =
            toml::from_str("file = 'f.png'\nrun = 'a'\nat_s = [0.0, 1.0, 2.0]\nafter_slips = true").unwrap();
        run.kept = figure.required_data();
        made_up::with_states(&mut run, &states);
        // The first global slip ends in step 510; no precursor has five blocks. Two instants share the last state.
        let panels = panels(&figure, &run).unwrap();
        let [upper, lower] = &panels[..] else { panic!("two panels") };
        let labels: Vec<&str> = upper.layers.iter().map(|series| series.label.as_str()).collect();
        assert_eq!(labels, ["μ_s", "μ_d", "t = 0.0000 s", "t = 0.0001 s", "t = 0.0001 s"]);
        assert_eq!(upper.layers[2].points(), [(0.0, 0.1), (50.0, 0.2), (100.0, 0.3)]);
        assert!(upper.layers[3].points()[1].1.is_nan() && upper.layers[3].points()[2].1 == 0.3);
        assert_eq!((lower.layers[0].points()[0].1, lower.layers[3].points()[2].1), (0.05, 700.0));
    }

    #[test]
    fn runs_without_junctions_or_states_of_them_are_refused() {
        let figure: JunctionForces = toml::from_str("file = 'f.png'\nrun = 'a'\nat_s = [0.0]").unwrap();
        for (toml, why) in [
            ("", "run test has no junctions (accepted: friction.law = \"junctions\")"),
            (LAW, "run test has no states with junctions at these instants"),
        ] {
            assert_eq!(panels(&figure, &made_up::run(toml, &EVENTS)).unwrap_err(), why);
        }
        let mut one = made_up::run(LAW, &[]);
        one.run.plan.blocks = 1;
        assert!(panels(&figure, &one).unwrap_err().starts_with("run test has one block"));
    }
}
