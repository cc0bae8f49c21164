//! Initial shear profiles: as set up, and as (5.50) asks (Figure 5.7).

use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, Parts, run_names};
use super::plot::{Axis, Corner, Look, Panel, Series, Sheet, nth};
use crate::run_data::RunData;
use crate::wants::Wants;

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

/// What is shown of a run.
pub(crate) struct Part {
    beta: f64,
    shear: Vec<(f64, f64)>,
}

impl Figure for InitialShear {
    type Part = Part;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn wants(&self) -> Wants {
        Wants::STATES
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let fields = run.states().first().ok_or_else(|| format!("run {} has no initial fields", run.name))?;
        let x = |n: usize| n as f64 * run.plan.spacing_m / run.plan.length_m;
        let shear = fields.tangential_force_n.iter().zip(&run.plan.normal_load_n).enumerate();
        Ok(Part {
            beta: run.scenario.initial_shear.beta,
            shear: shear.step_by(MARKED).map(|(n, (tau, p))| (x(n), tau / p)).collect(),
        })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut largest: f64 = 0.1;
        for (index, labelled) in self.series.iter().enumerate() {
            let Part { beta, shear } = labelled.find(&parts)?;
            let (marker, dash, color) = nth(index);
            largest = largest.max(beta.abs());
            series.push(Series {
                label: labelled.label.clone(),
                points: vec![(0.0, -beta), (1.0, *beta)],
                look: Look::Line(dash, color),
            });
            series.push(Series {
                label: labelled.label.clone(),
                points: shear.clone(),
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
