//! Normal load and driving force against time, in one plot (Figures 6.3, 6.14, 6.16, 6.18,
//! 6.20, 6.22).

use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, of_one_run};
use super::plot::{Axis, BLUE, Corner, Dash, Look, Panel, RED, Series, Sheet};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Loads {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The run.
    run: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
}

impl Figure for Loads {
    of_one_run!();

    fn wants(&self) -> Wants {
        Wants::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let normal: Vec<(f64, f64)> =
            run.loads()?.iter().map(|record| (record.time_s, record.normal_load_n)).collect();
        let driving: Vec<(f64, f64)> =
            run.loads()?.iter().map(|record| (record.time_s, record.driving_force_n)).collect();
        let both = || normal.iter().chain(&driving).map(|(_, force_n)| *force_n);
        let (lowest, highest) = (both().fold(0.0, f64::min), both().fold(0.0, f64::max));
        Ok(Sheet::Single(Box::new(Panel {
            title: self.title.clone(),
            x: Axis::new("t (s)", 0.0, run.plan.grid.time_s(run.header.steps)),
            y: Axis::new("force (N)", lowest * 1.1, highest * 1.08),
            series: vec![
                Series { label: "F_N".to_owned(), points: normal, look: Look::Line(Dash::Dashed, BLUE) },
                Series { label: "F_T".to_owned(), points: driving, look: Look::Line(Dash::Solid, RED) },
            ],
            legend: Corner::TopRight,
            note: String::new(),
        })))
    }
}
