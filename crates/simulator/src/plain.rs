//! The solver that takes every step: the oracle that [`crate::Fast`] is compared with.

use std::sync::Arc;

use asperity_model::{Elastic, Plan};
use asperity_record::Record;

use crate::counters::Counters;
use crate::energy::Bookkeeping;
use crate::lattice::LatticeStepper;
use crate::recorder::Recorder;
use crate::solver::{SimulationError, Solver};
use crate::state::ChainState;
use crate::stepper::{Driving, Stepper};
use crate::sweep::Sweeps;

/// The solver that takes every step.
#[derive(Debug, Clone)]
pub struct Plain {
    plan: Arc<Plan>,
    steps: Steps,
    recorder: Recorder,
}

/// What takes the steps, by what holds the slider together.
#[derive(Debug, Clone)]
enum Steps {
    Chain(Box<Stepper>),
    Lattice(Box<LatticeStepper>),
}

/// The same of either.
macro_rules! either {
    ($steps:expr, $stepper:ident => $what:expr) => {
        match $steps {
            Steps::Chain($stepper) => $what,
            Steps::Lattice($stepper) => $what,
        }
    };
}

impl Plain {
    /// The solver's name in run headers and on the command line.
    pub const NAME: &'static str = "plain";

    /// A solver at the start of a plan.
    pub fn new(plan: impl Into<Arc<Plan>>) -> Plain {
        let (plan, sweeps) = (plan.into(), Sweeps::detect());
        let steps = match &plan.elastic {
            Elastic::Chain(_) => {
                let stepper = Stepper::new(Arc::clone(&plan), sweeps, Bookkeeping::EveryStep);
                Steps::Chain(Box::new(stepper))
            }
            Elastic::Lattice(_) => Steps::Lattice(Box::new(LatticeStepper::new(Arc::clone(&plan), sweeps))),
        };
        let recorder = Recorder::new(&plan, either!(&steps, stepper => stepper.state()));
        Plain { recorder, steps, plan }
    }

    /// The state after the last step taken.
    pub fn state(&self) -> &ChainState {
        either!(&self.steps, stepper => stepper.state())
    }

    /// The contacts that switched in the last step, counted from 0.
    pub fn switched(&self) -> &[usize] {
        either!(&self.steps, stepper => stepper.switched())
    }

    /// Takes one step; returns the driving forces that it used.
    pub fn take_step(&mut self) -> Driving {
        either!(&mut self.steps, stepper => stepper.take_step())
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
            let state = self.state();
            if state.step == self.plan.steps {
                return Ok(None);
            }
            let was_sliding = state.sliding > 0;
            let driving = self.take_step();
            let (plan, recorder) = (&self.plan, &mut self.recorder);
            either!(&mut self.steps, stepper => recorder.observe(plan, &mut **stepper, was_sliding, driving))?;
        }
    }

    fn step(&self) -> u64 {
        self.state().step
    }

    fn is_between_records(&self) -> bool {
        self.recorder.is_empty()
    }

    fn counters(&self) -> Counters {
        either!(&self.steps, stepper => stepper.counters())
    }

    fn snapshot(&self) -> ChainState {
        self.state().clone()
    }

    fn restore(&mut self, state: &ChainState) {
        either!(&mut self.steps, stepper => stepper.restore(state));
        self.recorder.continue_after(&self.plan, state);
    }
}
