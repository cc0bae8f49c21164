//! What a checkpoint saves of the adaptive solver.

use asperity_model::Plan;
use asperity_model::plan::initial_state::CarriedStep;
use serde::{Deserialize, Serialize};

use crate::adaptive::equations::{ENERGIES, Equations};
use crate::energy::ledger::Sum;

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

/// The step that the given state of a plan is in, if it has one.
fn carried_step(plan: &Plan) -> Option<&CarriedStep> {
    let solver = plan.initial.carried.as_ref()?.solver.as_ref()?;
    solver.adaptive.as_ref().map(|(_, open)| open)
}

impl AdaptiveState {
    /// As the state of a run that begins here, whose energies are counted from there.
    pub(crate) fn carried(&self, blocks: usize) -> CarriedStep {
        CarriedStep {
            time_s: [self.time_s.total, self.time_s.rest],
            lengths_s: [self.step_s, self.next_step_s],
            unknowns: self.unknowns[..3 * blocks].to_vec(),
            crossing_steps: self.crossings.iter().map(|crossing| crossing.step).collect(),
            crossing_blocks: self.crossings.iter().map(|crossing| u64::from(crossing.block)).collect(),
        }
    }

    /// At the start of a plan: before the first step, or in the one that a given state is in.
    pub(super) fn initial(plan: &Plan, equations: &Equations) -> AdaptiveState {
        if let Some(open) = carried_step(plan) {
            let ([total, rest], [step_s, next_step_s]) = (open.time_s, open.lengths_s);
            let crossings = open.crossing_steps.iter().zip(&open.crossing_blocks);
            let crossings = crossings.map(|(step, block)| Crossing { step: *step, block: *block as u32 });
            return AdaptiveState {
                time_s: Sum { total, rest },
                step_s,
                next_step_s,
                unknowns: open.unknowns.iter().copied().chain([0.0; ENERGIES]).collect(),
                crossings: crossings.collect(),
            };
        }
        let (law, initial) = (&equations.law, &plan.initial);
        let point_m = plan.outside(initial.step, plan.hold_step_at_start()).point_m;
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
        // A given state may be in a step that began before.
        let from_s = carried_step(plan)
            .map_or(plan.grid.time_s(plan.initial.step), |open| open.time_s[0] + open.time_s[1]);
        self.time_s.value() >= from_s
            && self.unknowns.len() == 3 * plan.blocks + ENERGIES
            && self.unknowns.iter().all(|value| value.is_finite())
            && self.carried(plan.blocks).fits(plan, step)
    }
}
