//! When the slider first slips as a whole, against the time step, beside the value that the
//! source gives: how far such a time is an outcome of the parameters, and how far it is one
//! draw among many.

use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Group, Parts, find, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Panel, Pen, RED, Sheet};

keys! {
    Spread;

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
        Ok((run.header.time_step_s, slip.onset_s))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let all =
            self.runs().into_iter().map(|name| find(&parts, name).copied()).collect::<Result<Vec<_>, _>>()?;
        if all.is_empty() {
            return Err("panel: there are no runs to show".to_owned());
        }
        // All cases share their axes.
        let stated = self.panel.iter().map(|case| case.stated_s);
        let times = all.iter().map(|(_, time_s)| *time_s).chain(stated);
        let x = Scale::free_powers("Δt (s)").fitted(all.iter().map(|(step_s, _)| *step_s));
        let y = Scale::free("t of first global slip (s)").fitted(times);
        let ends = x.ends();
        let mut drawn = all.iter();
        let panels = self
            .panel
            .iter()
            .map(|case| {
                let mut series = vec![Layer::line(
                    "thesis",
                    vec![(ends.0, case.stated_s), (ends.1, case.stated_s)],
                    Dash::Dashed,
                    RED,
                )];
                for (index, steps) in case.series.iter().enumerate() {
                    let points = drawn.by_ref().take(steps.runs.len()).copied().collect();
                    series.push(Pen::nth(index, &steps.label).marks(points));
                }
                Panel::new(x.clone(), y.clone(), series).titled(&case.label)
            })
            .collect();
        Ok(Sheet::of(panels))
    }
}
