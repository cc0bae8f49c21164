//! Speed of fronts from block to block along the slider: how they become steady; beyond the last
//! block in grey, what theory says of it.

use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Parts, keys, of_one_row, of_runs_in, with_pens};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Sheet};

keys! {
    FrontTransient: series;

    /// Text above the legend.
    #[serde(default)]
    note: String,
    /// The lower end of the axis of speeds, over `c`.
    from_speed: f64,
    /// The upper end of the axis of speeds, over `c`.
    to_speed: f64,
}

/// What is shown of a run.
pub(crate) struct Part {
    blocks: f64,
    /// The block, and the speed there.
    local: Vec<(f64, f64)>,
    steady: Option<f64>,
}

impl Figure for FrontTransient {
    of_runs_in!(series, Part);

    fn part(&self, run: &RunData) -> Result<Part, String> {
        of_one_row(run)?;
        let local: Vec<(f64, f64)> =
            fronts::local_speeds(run).iter().map(|(block, speed)| (*block, *speed)).collect();
        if local.is_empty() {
            return Err(format!("run {} has no front from block 1", run.name));
        }
        let steady = fronts::theory(run).and_then(|theory| theory.speed_over_c());
        Ok(Part { blocks: run.plan.blocks as f64, local, steady })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let longest = parts.values().map(|part| part.blocks).fold(1.0, f64::max);
        let end = 10f64.powf(longest.log10().ceil());
        for (pen, part) in with_pens(&self.series, &parts)? {
            if let Some(steady) = part.steady {
                let beyond = vec![(longest, steady), (end, steady)];
                series.push(Layer::line("", beyond, Dash::Solid, GREY));
            }
            series.push(pen.line(part.local.clone()));
        }
        let x = Scale::powers_between("block n", 1.0, end);
        let y = Scale::between("v/c between n − 1 and n", self.from_speed, self.to_speed);
        Ok(Sheet::single(x, y, series).noted(&self.note))
    }
}
