//! `F_X / F_N` against time with the friction coefficients and, where there is one, the theory
//! of its rise; and the number of sliding blocks beneath (Figures 5.13, 5.15 to 5.18, 6.5, 6.8
//! to 6.12).

use asperity_model::analytic::LoadCurve;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{DYNAMIC, Figure, Parts, all_of_one, coefficient_lines};
use super::plot::{Axis, Corner, Dash, GREEN, INK, Look, Panel, Series, Sheet};
use crate::run_data::RunData;
use crate::wants::Wants;

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Load {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The run.
    run: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// Whether to show the number of sliding blocks beneath.
    sliding: bool,
    /// What the legend calls the dynamic coefficient.
    #[serde(default = "dynamic")]
    dynamic: String,
}

fn dynamic() -> String {
    DYNAMIC.to_owned()
}

impl Load {
    pub(super) fn of_run(file: &str, run: &str) -> Load {
        Load {
            file: file.to_owned(),
            run: run.to_owned(),
            title: String::new(),
            sliding: true,
            dynamic: dynamic(),
        }
    }
}

impl Figure for Load {
    type Part = Sheet;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        vec![&self.run]
    }

    fn wants(&self) -> Wants {
        Wants::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let duration_s = run.plan.grid.time_s(run.header.steps);
        let mu_s = run.plan.friction.static_coefficient;
        let load: Vec<(f64, f64)> =
            run.loads().iter().map(|record| (record.time_s, record.load_ratio())).collect();
        let lowest = load.iter().fold(0.0f64, |low, (_, ratio)| low.min(*ratio));
        let highest = load.iter().fold(mu_s, |high, (_, ratio)| high.max(*ratio));
        // While the normal load falls the curve swings across the whole panel, and the
        // legend needs room of its own above it.
        let (headroom, legend) = if run.plan.load_course.is_constant() {
            (1.12, Corner::BottomRight)
        } else {
            (1.42, Corner::TopLeft)
        };
        let simulated =
            Series { label: "F_X/F_N".to_owned(), points: load, look: Look::Line(Dash::Solid, INK) };
        // Upon the simulated curve, which it follows closely.
        let theory = LoadCurve::of(&run.scenario).map(|curve| Series {
            label: "theory".to_owned(),
            points: curve.points(),
            look: Look::Line(Dash::Dashed, GREEN),
        });
        let upper = Panel {
            title: self.title.clone(),
            x: Axis::new(if self.sliding { "" } else { "t (s)" }, 0.0, duration_s),
            y: Axis::new("F_X/F_N", lowest * 1.1, highest * headroom),
            series: coefficient_lines(run, duration_s, &self.dynamic)
                .into_iter()
                .chain([simulated])
                .chain(theory)
                .collect(),
            legend,
            note: String::new(),
        };
        if !self.sliding {
            return Ok(Sheet::Single(Box::new(upper)));
        }
        let sliding = run.loads().iter().filter(|record| record.sliding > 0);
        let lower = Panel {
            title: String::new(),
            x: Axis::new("t (s)", 0.0, duration_s),
            y: Axis::new("blocks sliding", 0.0, f64::from(run.header.blocks) * 1.08),
            series: vec![Series {
                label: String::new(),
                points: sliding.map(|record| (record.time_s, f64::from(record.sliding))).collect(),
                look: Look::Impulses(INK),
            }],
            legend: Corner::TopLeft,
            note: String::new(),
        };
        Ok(Sheet::Stacked(Box::new([upper, lower])))
    }

    fn sheet(&self, parts: Parts<Sheet>) -> Result<Sheet, String> {
        all_of_one(parts, &self.run)
    }
}
