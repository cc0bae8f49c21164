//! What blocks do while a slip pulse passes: velocity and slip against the time since it came.
//! Those of one run lie on each other where the pulse is steady.

use std::collections::BTreeMap;

use asperity_numbers::fronts;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Labelled, Parts, keys, of_one_row, of_runs_in, with_pens};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Panel, Sheet};

keys! {
    Pulse;

    /// Time shown before a pulse reaches a block, over `a / c`.
    before: f64,
    /// Time shown after a pulse reaches a block, over `a / c`.
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
    of_runs_in!(series, Part);

    fn required_data(&self) -> RequiredData {
        RequiredData::WINDOWS
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        of_one_row(run)?;
        let (from, to) = (-self.before, self.after);
        let crossing_s = fronts::crossing_s(run);
        let unit_m = fronts::unit_m(run)
            .ok_or_else(|| format!("run {} has no difference of static and sliding friction", run.name))?;
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
        for (pen, Part { traces, slip_in_theory }) in with_pens(&self.series, &parts)? {
            for [velocity, slip] in traces {
                velocities.push(pen.line(velocity.clone()));
                slips.push(pen.unlabelled().line(slip.clone()));
            }
            if let Some(slip) = *slip_in_theory {
                is_held = true;
                let points = vec![(from, slip), (to, slip)];
                slips.push(Layer::line("", points, Dash::Dotted, GREY));
            }
        }
        let upper = Panel::new(
            Scale::between("", from, to),
            Scale::free("velocity × √(km)/[(μ_s − μ_d)p]"),
            velocities,
        );
        let x = Scale::between("time since the pulse came, over a/c", from, to);
        let lower = Panel::new(x, Scale::free("slip × k/[(μ_s − μ_d)p]"), slips);
        Ok(Sheet::stacked(upper, lower.noted(if is_held { "dotted: 2τ/γ" } else { "" })))
    }
}
