//! When the slider first slips as a whole, against the time step, beside the value that the
//! source gives: how far such a time is an outcome of the parameters, and how far it is one
//! draw among many.

use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Group, Parts, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Panel, RED, Sheet};
use super::study::groups;

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
        if parts.is_empty() {
            return Err("panel: there are no runs to show".to_owned());
        }
        // All cases share their axes.
        let stated = self.panel.iter().map(|case| case.stated_s);
        let x = Scale::free_powers("Δt (s)").fitted(parts.values().map(|(step_s, _)| *step_s));
        let times = parts.values().map(|(_, time_s)| *time_s).chain(stated);
        let y = Scale::free("t of first global slip (s)").fitted(times);
        let ends = x.ends();
        let mut panels = Vec::new();
        for case in &self.panel {
            let stated = vec![(ends.0, case.stated_s), (ends.1, case.stated_s)];
            let mut layers = vec![Layer::line("thesis", stated, Dash::Dashed, RED)];
            let groups = groups(&case.series, &parts)?.into_iter();
            layers.extend(groups.map(|(pen, runs)| pen.marks(runs.into_iter().copied().collect())));
            panels.push(Panel::new(x.clone(), y.clone(), layers).titled(&case.label));
        }
        Ok(Sheet::of(panels))
    }
}
