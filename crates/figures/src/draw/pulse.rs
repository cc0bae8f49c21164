//! What blocks do while a slip pulse passes: velocity and slip against the time since it came.
//! Those of one run lie on each other where the pulse is steady.

use std::collections::BTreeMap;

use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, Parts, run_names};
use super::plot::{Axis, Corner, Dash, GREY, Look, Panel, Series, Sheet, nth};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Pulse {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// How much time is shown before a pulse comes to a block, over `a / c`.
    before: f64,
    /// How much time is shown after a pulse has come to a block, over `a / c`.
    after: f64,
    /// Runs; all blocks of their dense windows are shown.
    series: Vec<Labelled>,
}

/// What is shown of a run.
pub(crate) struct Part {
    /// Velocity and slip of each block.
    traces: Vec<[Vec<(f64, f64)>; 2]>,
    slip_in_theory: Option<f64>,
}

impl Figure for Pulse {
    type Part = Part;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn wants(&self) -> Wants {
        Wants::WINDOWS
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let (from, to) = (-self.before, self.after);
        let (unit_m, crossing_s) = (fronts::unit_m(run), fronts::crossing_s(run));
        let passages = fronts::passages(run);
        let mut traces: BTreeMap<u32, [Vec<(f64, f64)>; 2]> = BTreeMap::new();
        for record in run.windows()? {
            let moved = record.displacement_m.iter().zip(&record.velocity_m_per_s);
            for (block, (displacement_m, velocity_m_per_s)) in (record.first_block..).zip(moved) {
                let Some(passage) = passages.get(block as usize - 1) else { continue };
                let since = (record.time_s - passage.arrival_s) / crossing_s;
                if (from..=to).contains(&since) {
                    let [velocity, slip] = traces.entry(block).or_default();
                    velocity.push((since, velocity_m_per_s / unit_m * crossing_s));
                    let rest_m = run.plan.initial.displacement_m[block as usize - 1];
                    slip.push((since, (displacement_m - rest_m) / unit_m));
                }
            }
        }
        if traces.is_empty() {
            return Err(format!("run {} has no dense window of blocks that a pulse passes", run.name));
        }
        let theory = fronts::theory(run).and_then(|theory| theory.pulse_slip());
        Ok(Part { traces: traces.into_values().collect(), slip_in_theory: theory })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let (mut velocities, mut slips) = (Vec::new(), Vec::new());
        let (from, to) = (-self.before, self.after);
        let mut is_held = false;
        for (index, labelled) in self.series.iter().enumerate() {
            let Part { traces, slip_in_theory } = labelled.find(&parts)?;
            let (_, dash, color) = nth(index);
            for [velocity, slip] in traces {
                let series = |label: &str, points: &[(f64, f64)]| Series {
                    label: label.to_owned(),
                    points: points.to_vec(),
                    look: Look::Line(dash, color),
                };
                velocities.push(series(&labelled.label, velocity));
                slips.push(series("", slip));
            }
            if let Some(slip) = *slip_in_theory {
                is_held = true;
                let points = vec![(from, slip), (to, slip)];
                slips.push(Series { label: String::new(), points, look: Look::Line(Dash::Dotted, GREY) });
            }
        }
        let top = |series: &[Series]| {
            series.iter().flat_map(|series| &series.points).map(|(_, y)| *y).fold(0.0, f64::max)
        };
        let (fastest, farthest) = (top(&velocities), top(&slips));
        let upper = Panel {
            title: self.title.clone(),
            x: Axis::new("", from, to),
            y: Axis::new("velocity × √(km)/[(μ_s − μ_d)p]", -0.05 * fastest, 1.1 * fastest),
            series: velocities,
            legend: Corner::TopRight,
            note: String::new(),
        };
        let lower = Panel {
            title: String::new(),
            x: Axis::new("time since the pulse came, over a/c", from, to),
            y: Axis::new("slip × k/[(μ_s − μ_d)p]", -0.05 * farthest, 1.1 * farthest),
            series: slips,
            legend: Corner::TopLeft,
            note: if is_held { "dotted: 2τ/γ".to_owned() } else { String::new() },
        };
        Ok(Sheet::Stacked(Box::new([upper, lower])))
    }
}
