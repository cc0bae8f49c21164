//! The solver that takes every step: the oracle that [`crate::Fast`] is compared with.

use std::sync::Arc;

use asperity_model::Plan;
use asperity_record::Record;

use crate::counters::Counters;
use crate::energy::Bookkeeping;
use crate::recorder::Recorder;
use crate::solver::{SimulationError, Solver};
use crate::state::ChainState;
use crate::stepper::{Driving, Stepper};
use crate::sweep::Sweeps;

/// The solver that takes every step.
#[derive(Debug, Clone)]
pub struct Plain {
    plan: Arc<Plan>,
    stepper: Stepper,
    recorder: Recorder,
}

impl Plain {
    /// The solver's name in run headers and on the command line.
    pub const NAME: &'static str = "plain";

    /// A solver at the start of a plan.
    pub fn new(plan: impl Into<Arc<Plan>>) -> Plain {
        let plan = plan.into();
        let stepper = Stepper::new(Arc::clone(&plan), Sweeps::detect(), Bookkeeping::EveryStep);
        Plain { recorder: Recorder::new(&plan, stepper.state()), stepper, plan }
    }

    /// The state after the last step taken.
    pub fn state(&self) -> &ChainState {
        self.stepper.state()
    }

    /// The contacts that switched in the last step, counted from 0.
    pub fn switched(&self) -> &[usize] {
        self.stepper.switched()
    }

    /// Takes one step; returns the driving forces that it used.
    pub fn take_step(&mut self) -> Driving {
        self.stepper.take_step()
    }
}

impl Solver for Plain {
    fn name(&self) -> &'static str {
        Plain::NAME
    }

    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        loop {
            if !self.recorder.is_empty() {
                return self.recorder.next();
            }
            let state = self.stepper.state();
            if state.step == self.plan.steps {
                return Ok(None);
            }
            let was_sliding = state.sliding > 0;
            let driving = self.stepper.take_step();
            self.recorder.observe(&self.plan, &mut self.stepper, was_sliding, driving)?;
        }
    }

    fn step(&self) -> u64 {
        self.stepper.state().step
    }

    fn is_between_records(&self) -> bool {
        self.recorder.is_empty()
    }

    fn counters(&self) -> Counters {
        self.stepper.counters()
    }

    fn snapshot(&self) -> ChainState {
        self.stepper.state().clone()
    }

    fn restore(&mut self, state: &ChainState) {
        self.stepper.restore(state);
        self.recorder.continue_after(&self.plan, state);
    }
}
