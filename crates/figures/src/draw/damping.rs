//! How the shortest wave dies away: undamped, under-damped, critical and
//! over-damped, simulated and after (5.28) (Figure 5.5).

use asperity_numbers::curves::ring_down;
use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, Parts, run_names};
use super::plot::{Axis, Corner, Look, Panel, Series, Sheet, nth};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Damping {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The runs, each with what the legend calls it.
    series: Vec<Labelled>,
}

/// How many marks a series bears.
const MARKS: usize = 40;

impl Figure for Damping {
    type Part = Vec<(f64, f64, f64)>;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn wants(&self) -> Wants {
        Wants::WINDOWS
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        Ok(ring_down(run, run.windows()?))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut longest: f64 = 0.0;
        for (index, labelled) in self.series.iter().enumerate() {
            let points = labelled.find(&parts)?;
            let (marker, dash, color) = nth(index);
            longest = points.iter().fold(longest, |longest, (phase, ..)| longest.max(*phase));
            series.push(Series {
                label: labelled.label.clone(),
                points: points.iter().map(|&(phase, _, theory)| (phase, theory)).collect(),
                look: Look::Line(dash, color),
            });
            let every = points.len().div_ceil(MARKS).max(1);
            series.push(Series {
                label: labelled.label.clone(),
                points: points.iter().step_by(every).map(|&(phase, ours, _)| (phase, ours)).collect(),
                look: Look::Marks(marker, color),
            });
        }
        Ok(Sheet::Single(Box::new(Panel {
            title: String::new(),
            x: Axis::new("t √(k/m)", 0.0, longest),
            y: Axis::new("v_1(t)/v_1(0)", -1.1, 1.1),
            series,
            legend: Corner::TopRight,
            note: "marks: simulated, lines: eq. (5.28)".to_owned(),
        })))
    }
}
