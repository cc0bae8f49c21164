//! What the kinds of figures have in common.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::plot::{BLUE, Dash, Look, RED, Series, Sheet};
use crate::run_data::RunData;

/// A kind of figure.
pub(super) trait Figure: Sync {
    /// The file to write, without folder.
    fn file(&self) -> &str;

    /// The runs it is made of.
    fn runs(&self) -> Vec<&str>;

    /// What is on it; in words, what its runs lack.
    fn sheet(&self, runs: &BTreeMap<String, RunData>) -> Result<Sheet, String>;
}

/// A run and what the legend calls it; `k_t` and `k_{t}` set subscripts.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Labelled {
    /// The run.
    pub(super) run: String,
    /// What the legend calls it; `k_t` and `k_{t}` set subscripts.
    pub(super) label: String,
}

impl Labelled {
    pub(super) fn find<'a>(&self, runs: &'a BTreeMap<String, RunData>) -> Result<&'a RunData, String> {
        find(runs, &self.run)
    }
}

/// The runs of a figure's series or panels.
pub(super) fn run_names(labelled: &[Labelled]) -> Vec<&str> {
    labelled.iter().map(|labelled| labelled.run.as_str()).collect()
}

/// What the legend calls the dynamic coefficient, where the figure does not say: chapter 5
/// of the thesis writes `mu_k`, chapter 6 `mu_d`.
pub(super) const DYNAMIC: &str = "μ_k";

/// The friction coefficients as lines across a figure.
pub(super) fn coefficient_lines(run: &RunData, to_x: f64, dynamic: &str) -> [Series; 2] {
    let friction = &run.plan.friction;
    let line = |label: &str, mu: f64, look: Look| Series {
        label: label.to_owned(),
        points: vec![(0.0, mu), (to_x, mu)],
        look,
    };
    [
        line("μ_s", friction.static_coefficient, Look::Line(Dash::Dashed, BLUE)),
        line(dynamic, friction.dynamic_coefficient, Look::Line(Dash::DotDashed, RED)),
    ]
}

/// The run of this name.
pub(super) fn find<'a>(runs: &'a BTreeMap<String, RunData>, name: &str) -> Result<&'a RunData, String> {
    runs.get(name).ok_or_else(|| format!("there is no run {name}"))
}
