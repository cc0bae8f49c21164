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
use super::kind::{Figure, keys, levels, of_one_run, place_name};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Panel, Sheet};
use asperity_numbers::curve_list::along;

keys! {
    StressSequence: run;

    /// Fewest blocks of a precursor that is shown.
    #[serde(default = "one")]
    from_blocks: u32,
    /// Whether to show the first global slip, which ends the sequence, as well.
    #[serde(default)]
    global_slip: bool,
}

fn one() -> u32 {
    1
}

impl Figure for StressSequence {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { states: true, precursor_onsets: true, ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let precursors = one_by_one(run);
        let shown = precursors.iter().filter(|precursor| {
            let is_global = precursor.blocks_slipped == run.header.blocks;
            precursor.blocks_slipped >= self.from_blocks && (self.global_slip || !is_global)
        });
        let mut pairs = Vec::new();
        for precursor in shown {
            let states = run.states()?;
            let before = states.at_precursor_onset(precursor.start.onset_step);
            let after = precursor.end.end_step.and_then(|end_step| states.at_precursor_end(end_step));
            if let (Some(before), Some(after)) = (before, after) {
                pairs.push((precursor.start.ft_fn_onset, [profile(run, before)?, profile(run, after)?]));
            }
        }
        if pairs.is_empty() {
            return Err(format!(
                "run {} has no precursor of {} blocks or more with states at its onset and its end \
                 (recording.event_fields = true has them recorded)",
                run.name, self.from_blocks
            ));
        }
        let scale = Scale::of("F_T/F_N at the onset", false, 0.0, pairs.iter().map(|(load, _)| *load));
        let colours = Colours::of(scale, On::Lines);
        let last = f64::from(run.columns());
        let lines = levels(run);
        let panel = |title: &str, which: usize| {
            let profiles = pairs.iter().map(|(load, both)| {
                let color = colours.at(colours.scale.nearest_share(*load));
                Layer::line("", both[which].clone(), Dash::Solid, color)
            });
            let levels = lines.iter().map(|&(level, dash, color, label)| {
                Layer::line(label, vec![(0.5, level), (last + 0.5, level)], dash, color)
            });
            let x = Scale::between(place_name(run), 0.5, last + 0.5);
            Panel::new(x, Scale::free("τ_n/p_n"), profiles.chain(levels).collect()).titled(title)
        };
        let panels = vec![panel("before each precursor", 0), panel("after each precursor", 1)];
        Ok(Sheet { bar: Some(colours), ..Sheet::of(panels) })
    }
}

/// `tau_n / p_n` of every block in a state, over an area that of the sums over each column; where a contact bears
/// nothing, nothing is shown.
fn profile(run: &RunData, state: &FieldRecord) -> Result<Vec<(f64, f64)>, String> {
    let normal_load_n = run.normal_load_n(run.loads()?, state);
    let normal_load_n = normal_load_n.ok_or_else(|| format!("run {} has no step records", run.name))?;
    let (tau_n, normal_load_n) = (along(run, &state.tangential_force_n), along(run, &normal_load_n));
    let ratios = tau_n.iter().zip(&normal_load_n).enumerate();
    let borne = ratios.filter(|(_, (_, p_n))| **p_n != 0.0);
    Ok(borne.map(|(n, (tau_n, p_n))| (n as f64 + 1.0, tau_n / p_n)).collect())
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
