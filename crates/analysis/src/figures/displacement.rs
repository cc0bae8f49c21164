//! Displacement of chosen blocks against time (Figure 6.7).

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, find};
use super::plot::{Axis, Corner, Look, Panel, Series, Sheet, nth};
use crate::run_data::RunData;

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Displacement {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The run.
    run: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// The blocks, counted from 1.
    blocks: Vec<u32>,
}

impl Figure for Displacement {
    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        vec![&self.run]
    }

    fn sheet(&self, runs: &BTreeMap<String, RunData>) -> Result<Sheet, String> {
        let run = find(runs, &self.run)?;
        let mut series = Vec::new();
        for (index, &block) in self.blocks.iter().enumerate() {
            if !(1..=run.header.blocks).contains(&block) {
                return Err(format!(
                    "blocks: {block} is not in run {} (accepted: 1 to {})",
                    run.name, run.header.blocks
                ));
            }
            let (_, dash, color) = nth(index);
            let at = |displacement_m: &[f64]| displacement_m[block as usize - 1] * 1e3;
            series.push(Series {
                label: format!("block {block}"),
                points: run.fields.iter().map(|record| (record.time_s, at(&record.displacement_m))).collect(),
                look: Look::Line(dash, color),
            });
        }
        let all =
            || series.iter().flat_map(|series| &series.points).map(|(_, displacement_mm)| *displacement_mm);
        let (lowest, highest) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
        if highest <= lowest {
            return Err(format!("no displacement of its blocks is recorded in run {}", run.name));
        }
        Ok(Sheet::Single(Box::new(Panel {
            title: self.title.clone(),
            x: Axis::new("t (s)", 0.0, run.plan.grid.time_s(run.header.steps)),
            y: Axis::new("u_n (mm)", lowest - 0.03 * highest, highest * 1.1),
            series,
            legend: Corner::TopLeft,
            note: String::new(),
        })))
    }
}
