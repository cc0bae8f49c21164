//! The step that the adaptive solver is in, as part of the state.

use asperity_record::MOST_STEPS;
use serde::{Deserialize, Serialize};

use crate::plan::Plan;
use crate::plan::ledger::Sum;

/// How many energies the equations add up: work of the drive, friction heat, what radiation damping and what dashpots
/// take, work of the prestress.
pub const ENERGIES: usize = 5;

/// Likewise in a medium: work of drive and prestress, friction heat, what waves carry away.
pub const POWERS: usize = 3;

/// Length of the first step in a medium, s.
const FIRST_STEP_S: f64 = 1e-3;

/// Length of the first step of a chain, over the time in which the drive moves by `Dc`.
const FIRST_STEP: f64 = 1e-6;

/// The beginning of the step in which a slider is, its length, and what it has found ahead: a solver takes the same
/// step from there to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveState {
    /// Where the step begins, s.
    pub time_s: Sum,
    /// How many accepted steps end up to there, from the start of the first run in a chain of them.
    pub accepted_steps: u64,
    /// Its length; 0 before the first one.
    pub step_s: f64,
    /// The length to try next; in a medium, that without the bound of stability.
    pub next_step_s: f64,
    /// `u_n - X` of each block, X the drive point, m; friction over `a p_n`; the states `psi_n`; and work of the drive,
    /// friction heat, radiation, viscous loss and work of the prestress, J. In a medium `u_n - X`, the states `phi_n`, and
    /// [`POWERS`] energies, J per metre of strike.
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
    /// At the start of a plan, before the first step; `None` by laws other than rate-and-state.
    pub(crate) fn initial(plan: &Plan) -> Option<Box<AdaptiveState>> {
        let law = plan.friction.law.rate_and_state()?;
        let initial = &plan.initial;
        let point_m = plan.outside(initial.step, initial.hold_step).point_m;
        let behind_m = initial.displacement_m.iter().map(|u| u - point_m);
        let at_start = initial.velocity_m_per_s.iter().zip(&initial.friction_state);
        let friction =
            at_start.map(|(velocity, state)| law.coefficient(*velocity, *state) / law.direct_effect);
        let fastest = initial.velocity_m_per_s.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let friction = friction.filter(|_| plan.medium.is_none());
        let speeds = [plan.drive.velocity_m_per_s, fastest, law.reference_velocity_m_per_s];
        let speed = speeds.into_iter().find(|speed| *speed > 0.0).unwrap_or(1.0);
        let first_s = FIRST_STEP * law.critical_slip_m / speed;
        Some(Box::new(AdaptiveState {
            time_s: Sum { total: plan.grid.time_s(initial.step), rest: 0.0 },
            accepted_steps: 0,
            step_s: 0.0,
            next_step_s: if plan.medium.is_some() { FIRST_STEP_S } else { first_s },
            unknowns: behind_m
                .chain(friction)
                .chain(initial.friction_state.iter().copied())
                .chain([0.0; ENERGIES])
                .take(AdaptiveState::unknowns(plan))
                .collect(),
            crossings: Vec::new(),
        }))
    }

    /// The place of the first energy among the unknowns; the states of the blocks are before it.
    pub fn energies_from(plan: &Plan) -> usize {
        if plan.medium.is_some() { 2 * plan.blocks } else { 3 * plan.blocks }
    }

    /// How many unknowns there are.
    pub fn unknowns(plan: &Plan) -> usize {
        AdaptiveState::energies_from(plan) + if plan.medium.is_some() { POWERS } else { ENERGIES }
    }

    /// Checks a loaded state, of a slider after `step`, against the plan.
    pub(crate) fn fits(&self, plan: &Plan, step: u64) -> bool {
        let Sum { total, rest } = self.time_s;
        let is_ahead = |crossing: &Crossing| {
            crossing.step > step && crossing.step <= MOST_STEPS && (crossing.block as usize) < plan.blocks
        };
        // A given state may be in a step that began before.
        plan.initial.adaptive.as_ref().is_some_and(|first| self.time_s.value() >= first.time_s.value())
            && total >= 0.0
            && rest.abs() <= 1e-6 * total
            && total + rest <= plan.grid.time_s(step) * (1.0 + 1e-12)
            && self.accepted_steps < u64::MAX / 2
            && self.step_s.is_finite()
            && self.step_s >= 0.0
            && self.next_step_s.is_finite()
            && self.next_step_s > 0.0
            && self.unknowns.len() == AdaptiveState::unknowns(plan)
            && self.unknowns.iter().all(|value| value.is_finite())
            && self.crossings.iter().all(is_ahead)
            && self.crossings.is_sorted_by(|a, b| a < b)
    }
}
