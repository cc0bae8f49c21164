//! Initial shear profiles: as set up, and as (5.50) asks (Figure 5.7).

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, run_names};
use super::plot::{Axis, Corner, Look, Panel, Series, Sheet, nth};
use crate::run_data::RunData;

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct InitialShear {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The runs, each with what the legend calls it.
    series: Vec<Labelled>,
}

/// One block in this many is marked, so that the lines beneath can be seen.
const MARKED: usize = 6;

impl Figure for InitialShear {
    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn sheet(&self, runs: &BTreeMap<String, RunData>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut largest: f64 = 0.1;
        for (index, labelled) in self.series.iter().enumerate() {
            let run = labelled.find(runs)?;
            let fields = run.fields_at(0).ok_or_else(|| format!("run {} has no initial fields", run.name))?;
            let (marker, dash, color) = nth(index);
            let beta = run.scenario.initial_shear.beta;
            largest = largest.max(beta.abs());
            series.push(Series {
                label: labelled.label.clone(),
                points: vec![(0.0, -beta), (1.0, beta)],
                look: Look::Line(dash, color),
            });
            let x = |n: usize| n as f64 * run.plan.spacing_m / run.plan.length_m;
            series.push(Series {
                label: labelled.label.clone(),
                points: fields
                    .tangential_force_n
                    .iter()
                    .zip(&run.plan.normal_load_n)
                    .enumerate()
                    .step_by(MARKED)
                    .map(|(n, (tau, p))| (x(n), tau / p))
                    .collect(),
                look: Look::Marks(marker, color),
            });
        }
        Ok(Sheet::Single(Box::new(Panel {
            title: String::new(),
            x: Axis::new("x/L", 0.0, 1.0),
            y: Axis::new("τ_0/p", -1.15 * largest, 1.15 * largest),
            series,
            legend: Corner::TopLeft,
            note: "marks: set up, lines: eq. (5.50)".to_owned(),
        })))
    }
}
