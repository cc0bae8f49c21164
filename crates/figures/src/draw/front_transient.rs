//! Speed of fronts from block to block along the slider: how they become steady; beyond the last
//! block in grey, what theory says of it.

use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, Parts, run_names};
use super::plot::{Axis, Corner, Dash, GREY, Look, Panel, Series, Sheet, nth};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrontTransient {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// Stands above the legend.
    #[serde(default)]
    note: String,
    /// The lower end of the axis of speeds, over `c`.
    from_speed: f64,
    /// The upper end of the axis of speeds, over `c`.
    to_speed: f64,
    /// The runs, each with what the legend calls it.
    series: Vec<Labelled>,
}

/// What is shown of a run.
pub(crate) struct Part {
    blocks: f64,
    /// The logarithm of the block, and the speed there.
    local: Vec<(f64, f64)>,
    steady: Option<f64>,
}

impl Figure for FrontTransient {
    type Part = Part;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let local: Vec<(f64, f64)> =
            fronts::local_speeds(run).iter().map(|(block, speed)| (block.log10(), *speed)).collect();
        if local.is_empty() {
            return Err(format!("run {} has no front from block 1", run.name));
        }
        let steady = fronts::theory(run).and_then(|theory| theory.speed_over_c());
        Ok(Part { blocks: run.plan.blocks as f64, local, steady })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let longest = parts.values().map(|part| part.blocks).fold(1.0, f64::max).log10();
        for (index, labelled) in self.series.iter().enumerate() {
            let part = labelled.find(&parts)?;
            let (_, dash, color) = nth(index);
            if let Some(steady) = part.steady {
                series.push(Series {
                    label: String::new(),
                    points: vec![(longest, steady), (longest.ceil(), steady)],
                    look: Look::Line(Dash::Solid, GREY),
                });
            }
            series.push(Series {
                label: labelled.label.clone(),
                points: part.local.clone(),
                look: Look::Line(dash, color),
            });
        }
        Ok(Sheet::Single(Box::new(Panel {
            title: self.title.clone(),
            x: Axis::decades("block n", 0.0, longest.ceil()),
            y: Axis::new("v/c between n − 1 and n", self.from_speed, self.to_speed),
            series,
            legend: Corner::BottomRight,
            note: self.note.clone(),
        })))
    }
}
