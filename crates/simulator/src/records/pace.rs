//! How a solver takes its steps, and what a checkpoint saves of it.

use asperity_model::plan::given_state::{GivenDrive, GivenState};
use asperity_model::{Plan, Scenario, SliderState};
use serde::{Deserialize, Serialize};

use crate::leap::cost::{self, FIRST_SAVED_STEPS};
use crate::modes::slow_modes::mirrors_itself;

/// A solver between two records: the slider, and the accounts that decide how the solver divides the
/// following steps. The accounts are no physics, but a resumed run must round as the run that it continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snapshot {
    /// The state of the slider.
    pub slider: SliderState,
    /// The accounts of the solver.
    pub pace: Pace,
}

impl Snapshot {
    /// Checks a loaded snapshot against the plan ([`SliderState::fits`]). Any accounts are possible.
    pub fn fits(&self, plan: &Plan) -> bool {
        self.slider.fits(plan)
    }

    /// The state in which another run can begin, from the scenario and the plan of this one.
    pub fn to_given(self, scenario: &Scenario, plan: &Plan) -> GivenState {
        let Snapshot { slider, pace } = self;
        GivenState {
            keys: scenario.keys_of_states().map(|(key, value)| (key.to_owned(), value)).into(),
            motion: scenario.motion_hash(),
            drive: Some(GivenDrive {
                point_m: plan.outside(slider.step, slider.hold_step).point_m,
                offset_m: plan.drive.offset_m,
                until_load_ratio: plan.drive.until_load_ratio,
                rest_m: plan.drive.springs.iter().map(|spring| spring.rest_m).collect(),
                ends_m: plan.end_bonds.iter().map(|bond| bond.rest_m).collect(),
            }),
            mirrors: plan.elastic.as_chain().is_none() && mirrors_itself(plan, &plan.elastic),
            pace: [pace.single_steps, pace.no_jump_before_step, pace.saved_steps],
            slider,
        }
    }
}

impl From<SliderState> for Snapshot {
    /// A slider that a solver takes over.
    fn from(slider: SliderState) -> Snapshot {
        Snapshot { slider, pace: Pace::default() }
    }
}

/// The accounts on which the fast solver bases its choice of steps (`cost.rs`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pace {
    /// Pending single steps before the next attempt to leap.
    pub single_steps: u64,
    /// No jump is tried before this step.
    pub no_jump_before_step: u64,
    /// Net steps saved by leaps, after their cost, up to a limit.
    pub saved_steps: u64,
}

impl Default for Pace {
    fn default() -> Pace {
        Pace { single_steps: 0, no_jump_before_step: 0, saved_steps: FIRST_SAVED_STEPS }
    }
}

impl Pace {
    /// At the start of a plan, which may go on from another run.
    pub(crate) fn at_start(plan: &Plan) -> Pace {
        let pace = plan.given.and_then(|given| given.pace);
        pace.map_or_else(Pace::default, |[single_steps, no_jump_before_step, saved_steps]| Pace {
            single_steps,
            no_jump_before_step,
            saved_steps,
        })
    }

    /// Pays for overhead from the steps that leaps have saved; returns the steps that are not covered.
    pub(crate) fn pay(&mut self, cost_steps: u64) -> u64 {
        cost::pay(&mut self.saved_steps, cost_steps)
    }

    /// Pays, and schedules single steps for the part that is not covered.
    pub(crate) fn pay_or_pause(&mut self, cost_steps: u64) {
        let debt_steps = self.pay(cost_steps);
        self.take_singly(cost::pause_steps(debt_steps));
    }

    /// Requires at least this number of single steps.
    pub(crate) fn take_singly(&mut self, steps: u64) {
        self.single_steps = self.single_steps.max(steps);
    }

    /// Has a refused jump wait, for longer if it was not paid for.
    pub(crate) fn wait_for_jump(&mut self, step: u64, patience_steps: u64, cost_steps: u64) {
        let pause_steps = cost::pause_steps(self.pay(cost_steps));
        self.no_jump_before_step = step + patience_steps.max(pause_steps);
    }
}
