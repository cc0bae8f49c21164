//! What a checkpoint saves of the adaptive solver.

use asperity_model::Plan;
use serde::{Deserialize, Serialize};

use crate::adaptive::equations::{ENERGIES, Equations};
use crate::ledger::Sum;

/// Length of the first step, over the time in which the drive moves by `Dc`.
const FIRST_STEP: f64 = 1e-6;

/// The beginning of the step in which a slider is, its length, and what it has found ahead: a solver takes the same
/// step from there to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveState {
    /// Where the step begins, s.
    pub time_s: Sum,
    /// Its length; 0 before the first one.
    pub step_s: f64,
    /// The length to try next.
    pub next_step_s: f64,
    /// `u_n - X` of each block, X the drive point, m; friction over `a p_n`; the states `psi_n`; and work of the drive,
    /// friction heat, radiation and viscous loss, J.
    pub unknowns: Vec<f64>,
    /// Crossings of the event speed after the last grid step, up to the end of the step.
    pub crossings: Vec<Crossing>,
}

/// A block whose speed crosses the event speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crossing {
    /// The grid step by whose end it has crossed.
    pub step: u64,
    /// The block, counted from 0.
    pub block: u32,
}

impl AdaptiveState {
    /// At the start of a plan.
    pub(super) fn initial(plan: &Plan, equations: &Equations) -> AdaptiveState {
        let (law, initial) = (&equations.law, &plan.initial);
        let point_m = plan.drive_point_m(initial.step, plan.drive.hold_from_step.unwrap_or(u64::MAX));
        let behind_m = initial.displacement_m.iter().map(|u| u - point_m);
        let at_start = initial.velocity_m_per_s.iter().zip(&initial.state);
        let friction =
            at_start.map(|(velocity, state)| law.coefficient(*velocity, *state) / law.direct_effect);
        let fastest = initial.velocity_m_per_s.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let speeds = [plan.drive.velocity_m_per_s, fastest, law.reference_velocity_m_per_s];
        let speed = speeds.into_iter().find(|speed| *speed > 0.0).unwrap_or(1.0);
        AdaptiveState {
            time_s: Sum { total: plan.grid.time_s(initial.step), rest: 0.0 },
            step_s: 0.0,
            next_step_s: FIRST_STEP * law.critical_slip_m / speed,
            unknowns: behind_m
                .chain(friction)
                .chain(initial.state.iter().copied())
                .chain([0.0; ENERGIES])
                .collect(),
            crossings: Vec::new(),
        }
    }

    /// Checks a loaded state, of a slider after `step`, against the plan.
    pub(crate) fn fits(&self, plan: &Plan, step: u64) -> bool {
        let ahead = |crossing: &Crossing| crossing.step > step && (crossing.block as usize) < plan.blocks;
        let is_length = |seconds: f64| seconds.is_finite() && seconds >= 0.0;
        let from_s = plan.grid.time_s(plan.initial.step);
        self.time_s.total.is_finite()
            && self.time_s.rest.abs() <= 1e-6 * self.time_s.total.abs()
            && self.time_s.value() >= from_s
            && self.time_s.value() <= plan.grid.time_s(step) * (1.0 + 1e-12)
            && is_length(self.step_s)
            && is_length(self.next_step_s)
            && self.next_step_s > 0.0
            && self.unknowns.len() == 3 * plan.blocks + ENERGIES
            && self.unknowns.iter().all(|value| value.is_finite())
            && self.crossings.iter().all(ahead)
            && self.crossings.is_sorted_by(|a, b| a < b)
    }
}
