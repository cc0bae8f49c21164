//! `tau_n / p_n` along the slider before and after each precursor, each over the normal load of its
//! instant.
//!
//! States are recorded at the onsets and ends of slip events, so the precursors are those among slip
//! events: what a precursor leaves behind is then what the next one finds, but for the load that the
//! drive has added meanwhile.

use asperity_numbers::precursors::one_by_one;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::FieldRecord;

use super::colours::{Colours, On};
use super::kind::{Figure, coefficient_lines, keys, of_one_run, place_name};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Panel, Sheet};
use super::stress::loads;
use asperity_numbers::curve_list::along;

keys! {
    StressSequence: run;

    /// Fewest blocks of a precursor that is shown.
    #[serde(default = "super::outlines::one")]
    from_blocks: u32,
    /// Whether to show the first global slip, which ends the sequence, as well.
    #[serde(default)]
    global_slip: bool,
}

impl Figure for StressSequence {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { states: true, precursor_onsets: true, ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let states = run.states()?;
        let (mut loads, mut before, mut after) = (Vec::new(), Vec::new(), Vec::new());
        for precursor in one_by_one(run) {
            let is_global = precursor.blocks_slipped == run.header.blocks;
            if precursor.blocks_slipped < self.from_blocks || is_global && !self.global_slip {
                continue;
            }
            let at_onset = states.at_precursor_onset(precursor.start.onset_step);
            let at_end = precursor.end.end_step.and_then(|end_step| states.at_precursor_end(end_step));
            if let Some((at_onset, at_end)) = at_onset.zip(at_end) {
                loads.push(precursor.start.ft_fn_onset);
                before.push(profile(run, at_onset)?);
                after.push(profile(run, at_end)?);
            }
        }
        if loads.is_empty() {
            return Err(format!(
                "run {} has no precursor of {} blocks or more with states at its onset and its end \
                 (recording.event_fields = true has them recorded)",
                run.name, self.from_blocks
            ));
        }
        let scale = Scale::of("F_T/F_N at the onset", false, 0.0, loads.iter().copied());
        let colours = Colours::of(scale, On::Lines);
        let end = f64::from(run.columns()) + 0.5;
        let panels = [("before each precursor", before), ("after each precursor", after)];
        let panels = panels.map(|(title, profiles)| {
            let profiles = profiles.into_iter().zip(&loads);
            let profiles =
                profiles.map(|(points, load)| Layer::line("", points, Dash::Solid, colours.nearest(*load)));
            let layers = profiles.chain(coefficient_lines(run, end)).collect();
            Panel::new(Scale::between(place_name(run), 0.5, end), Scale::free("τ_n/p_n"), layers)
                .titled(title)
        });
        Ok(Sheet { bar: Some(colours), ..Sheet::of(panels.to_vec()) })
    }
}

/// `tau_n / p_n` of every block in a state, over an area that of the sums over each column; where a contact bears
/// nothing, nothing is shown.
fn profile(run: &RunData, state: &FieldRecord) -> Result<Vec<(f64, f64)>, String> {
    let [tau_n, p_n] = [&state.tangential_force_n, &loads(run, state)?.1].map(|of| along(run, of));
    let ratios = tau_n.iter().zip(&p_n).zip(1..).filter(|((_, p_n), _)| **p_n != 0.0);
    Ok(ratios.map(|((tau_n, p_n), n)| (f64::from(n), tau_n / p_n)).collect())
}

#[cfg(test)]
mod tests {
    use asperity_record::FieldRecord;

    use super::{Figure, StressSequence};
    use crate::draw::sheet::Shape;
    use asperity_numbers::required_data::RequiredData;
    use asperity_testkit::made_up::{self, EVENTS};

    fn figure(toml: &str) -> StressSequence {
        toml::from_str(&format!("file = 'f.png'\nrun = 'a'\n{toml}")).unwrap()
    }

    #[test]
    fn each_precursor_has_the_state_at_its_onset_and_at_its_end() {
        let mut run = made_up::run("", &EVENTS);
        run.kept = RequiredData { states: true, precursor_onsets: true, ..RequiredData::LOADS };
        let state = |step: u64| FieldRecord {
            step,
            time_s: run.plan.grid.time_s(step),
            displacement_m: vec![0.0; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![step as f64; 3],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 3],
            detached: vec![0; 3],
            ..FieldRecord::default()
        };
        let steps = EVENTS.iter().flat_map(|(onset, end, _)| [*onset, *end]);
        let states: Vec<FieldRecord> = steps.map(state).collect();
        made_up::with_states(&mut run, &states);
        // 400 N on three blocks; the precursors are events 0, 1 and 4, and event 5 is of all blocks.
        let levels = |toml: &str, panel: usize| -> Vec<f64> {
            let sheet = figure(toml).part(&run).unwrap();
            let first = |shape: &Shape| match shape {
                Shape::Line(points, _) if points.len() == 3 => Some((points[0].1 * 400.0 / 3.0).round()),
                _ => None,
            };
            sheet.panels[panel].layers.iter().filter_map(|layer| first(&layer.shape)).collect()
        };
        assert_eq!((levels("", 0), levels("", 1)), (vec![100.0, 200.0, 412.0], vec![101.0, 210.0, 420.0]));
        assert_eq!(levels("from_blocks = 2\nglobal_slip = true", 0), [200.0, 412.0, 500.0]);
        let refused = figure("from_blocks = 3").part(&run).unwrap_err();
        assert!(refused.contains("no precursor of 3 blocks or more") && refused.contains("event_fields"));
    }
}
