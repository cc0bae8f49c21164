//! When the slider first slips as a whole, against the time step, beside the value that the
//! source gives: how far such a time is an outcome of the parameters, and how far it is one
//! draw among many.

use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Group, Parts, find, keys, of_runs_in};
use super::plot::{Axis, Corner, Dash, Panel, Pen, RED, Series, Sheet};

keys! {
    Spread: file;

    /// A panel for each case.
    panel: Vec<Case>,
}

/// Runs of one case.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Case {
    /// Label in the legend; `k_t` and `k_{t}` set subscripts.
    label: String,
    /// The time that the source gives, s.
    stated_s: f64,
    /// Its runs, in one or several series.
    series: Vec<Group>,
}

impl Case {
    fn runs(&self) -> impl Iterator<Item = &str> {
        self.series.iter().flat_map(Group::runs)
    }
}

impl Spread {
    /// Its lists of runs.
    pub(super) fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<String>> {
        self.panel.iter_mut().flat_map(|case| &mut case.series).map(|steps| &mut steps.runs)
    }
}

impl Figure for Spread {
    of_runs_in!(panel, (f64, f64));

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        let slip = run.first_global_slip();
        let slip = slip.ok_or_else(|| format!("run {} has no slip of the whole slider", run.name))?;
        Ok((run.header.time_step_s.log10(), slip.onset_s))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let all =
            self.runs().into_iter().map(|name| find(&parts, name).copied()).collect::<Result<Vec<_>, _>>()?;
        if all.is_empty() {
            return Err("panel: there are no runs to show".to_owned());
        }
        let stated = || self.panel.iter().map(|case| case.stated_s);
        let low = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let high = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::NEG_INFINITY, f64::max);
        // All cases share their axes.
        let x = Axis::decades(
            "Δt (s)",
            low(&mut all.iter().map(|(step, _)| *step)) - 0.3,
            high(&mut all.iter().map(|(step, _)| *step)) + 0.3,
        );
        let (lowest, highest) = (
            low(&mut all.iter().map(|(_, time)| *time).chain(stated())),
            high(&mut all.iter().map(|(_, time)| *time).chain(stated())),
        );
        let span = (highest - lowest).max(0.1 * highest);
        let y = Axis::new("t of first global slip (s)", lowest - 0.1 * span, highest + 0.1 * span);
        let mut drawn = all.iter();
        let panels = self
            .panel
            .iter()
            .map(|case| {
                let mut series = vec![Series::line(
                    "thesis",
                    vec![(x.from, case.stated_s), (x.to, case.stated_s)],
                    Dash::Dashed,
                    RED,
                )];
                for (index, steps) in case.series.iter().enumerate() {
                    let points = drawn.by_ref().take(steps.runs.len()).copied().collect();
                    series.push(Pen::nth(index, &steps.label).marks(points));
                }
                Panel::new(x.clone(), y.clone(), Corner::TopRight, series).titled(&case.label)
            })
            .collect();
        Ok(Sheet::Grid(panels))
    }
}
