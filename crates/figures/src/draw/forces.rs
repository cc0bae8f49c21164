//! `F_T`, `F_N`, `mu_s F_N` and `mu_d F_N` against time.

use asperity_numbers::curves::pull_ratio;
use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, of_one_run};
use super::plot::{Axis, BLUE, Corner, Dash, GREY, INK, Look, Panel, RED, Series, Sheet};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Forces {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The run.
    run: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// Where the time axis begins; with the run if absent.
    from_s: Option<f64>,
    /// Where the time axis ends; with the run if absent.
    to_s: Option<f64>,
}

impl Figure for Forces {
    of_one_run!();

    fn wants(&self) -> Wants {
        Wants::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let from_s = self.from_s.unwrap_or(0.0);
        let to_s = self.to_s.unwrap_or(run.plan.grid.time_s(run.header.steps));
        let shown: Vec<_> =
            run.loads()?.iter().filter(|record| (from_s..=to_s).contains(&record.time_s)).collect();
        if shown.len() < 2 {
            return Err(format!("run {} has no records from {from_s} s to {to_s} s", run.name));
        }
        let friction = &run.plan.friction;
        let load =
            |factor: f64| shown.iter().map(|record| (record.time_s, factor * record.normal_load_n)).collect();
        let pull: Vec<(f64, f64)> =
            shown.iter().map(|record| (record.time_s, pull_ratio(record) * record.normal_load_n)).collect();
        let highest =
            shown.iter().map(|record| record.normal_load_n).chain(pull.iter().map(|(_, pull)| *pull));
        let highest = highest.fold(0.0, f64::max);
        let lowest = pull.iter().map(|(_, pull)| *pull).fold(0.0, f64::min);
        let both_ways = run.plan.drive.pulls_both_ways();
        let curve = |label: &str, points: Vec<(f64, f64)>, look: Look| Series {
            label: label.to_owned(),
            points,
            look,
        };
        Ok(Sheet::Single(Box::new(Panel {
            title: self.title.clone(),
            x: Axis::new("t (s)", from_s, to_s),
            y: Axis::new("force (N)", lowest * 1.1, highest * 1.08),
            series: vec![
                curve("F_N", load(1.0), Look::Line(Dash::Solid, GREY)),
                curve("μ_s F_N", load(friction.static_coefficient), Look::Line(Dash::Dashed, BLUE)),
                curve("μ_d F_N", load(friction.dynamic_coefficient), Look::Line(Dash::DotDashed, RED)),
                curve(
                    if both_ways { "F_T, both ends added" } else { "F_T" },
                    pull,
                    Look::Line(Dash::Solid, INK),
                ),
            ],
            legend: Corner::TopRight,
            note: String::new(),
        })))
    }
}
