//! `tau_n / p_n` along the slider after a precursor (Figure 5.6).

use asperity_numbers::curves::front_profile;
use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, coefficient_lines, of_one_run};
use super::plot::{Axis, Corner, Dash, GREY, INK, Look, Panel, Series, Sheet};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Front {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The run.
    run: String,
    /// The length of the precursor; the nearest one is shown.
    blocks: u32,
}

impl Figure for Front {
    of_one_run!();

    fn wants(&self) -> Wants {
        Wants::LOADS | Wants::STATES
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let (precursor, profile) = front_profile(run, run.loads()?, run.states()?, f64::from(self.blocks))
            .ok_or_else(|| format!("run {} has no precursor with fields at its end", run.name))?;
        let last = f64::from(run.header.blocks);
        let friction = &run.plan.friction;
        let lowest = profile.iter().fold(0.0f64, |low, ratio| low.min(*ratio)) - 0.05;
        let highest = friction.static_coefficient * 1.08;
        let tip = f64::from(precursor.last_block) + 0.5;
        Ok(Sheet::Single(Box::new(Panel {
            title: String::new(),
            x: Axis::new("block n", 0.0, last),
            y: Axis::new("τ_n/p_n", lowest, highest),
            series: Vec::from_iter(coefficient_lines(run, last).into_iter().chain([
                Series {
                    label: format!("front, block {}", precursor.last_block),
                    points: vec![(tip, lowest), (tip, highest)],
                    look: Look::Line(Dash::Dotted, GREY),
                },
                Series {
                    label: format!(
                        "simulated, t = {:.3} s",
                        precursor.end.end_s.unwrap_or(precursor.end.onset_s)
                    ),
                    points: profile.iter().enumerate().map(|(n, ratio)| (n as f64 + 1.0, *ratio)).collect(),
                    look: Look::Line(Dash::Solid, INK),
                },
            ])),
            legend: Corner::TopRight,
            note: String::new(),
        })))
    }
}
