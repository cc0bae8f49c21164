//! The solver that takes every step: the reference for the fast solver.

use std::sync::Arc;

use asperity_model::plan::outside::Driving;
use asperity_model::{Plan, SliderState};

use crate::energy::Bookkeeping;
use crate::records::counters::Counters;
use crate::records::pace::{Pace, Snapshot};
use crate::records::recorder::Recorder;
use crate::records::solver::{Next, SimulationError, Solver};
use crate::records::stop::{Stop, steps_between_looks};
use crate::step::body::{ChainBody, LatticeBody, OfPlan};
use crate::step::single_step::SingleSteps;
use crate::step::stepper::Stepper;

/// Takes every step singly.
#[derive(Debug)]
pub struct Plain {
    plan: Arc<Plan>,
    stepper: Box<dyn SingleSteps>,
    recorder: Recorder,
}

impl Plain {
    /// A solver at the start of a plan.
    pub fn new(plan: impl Into<Arc<Plan>>) -> Plain {
        Plain::at_start(plan.into())
    }

    /// Without type parameters: a function with them is compiled, loops and all, in the crate that calls it,
    /// which may not be optimised.
    fn at_start(plan: Arc<Plan>) -> Plain {
        fn of<B: OfPlan>(plan: &Arc<Plan>, elastic: &B::Elastic) -> Box<dyn SingleSteps> {
            Box::new(Stepper::<B>::new(Arc::clone(plan), elastic, Bookkeeping::EveryStep))
        }
        let lattice = plan.elastic;
        let mut stepper = match lattice.as_chain() {
            Some(chain) => of::<ChainBody>(&plan, &chain),
            None if lattice.tangential_axes() > 1 => of::<LatticeBody<2>>(&plan, &lattice),
            None => of::<LatticeBody>(&plan, &lattice),
        };
        Plain { recorder: Recorder::at_start(&plan, &mut *stepper), stepper, plan }
    }

    /// The state after the last step taken.
    pub fn state(&self) -> &SliderState {
        self.stepper.state()
    }

    /// The contacts that switched in the last step, counted from 0.
    pub fn switched(&self) -> &[usize] {
        self.stepper.switched()
    }

    /// Takes one step; returns the driving forces that it used.
    pub fn take_step(&mut self) -> Driving {
        self.stepper.take_step(u64::MAX)
    }
}

impl Solver for Plain {
    fn next_record_unless(&mut self, stop: &Stop<'_>) -> Result<Next, SimulationError> {
        let steps = steps_between_looks(&self.plan);
        let until_step = |plan: &Plan, step: u64| plan.steps.min(step.saturating_add(steps));
        let mut look_step = until_step(&self.plan, self.step());
        loop {
            if !self.recorder.is_empty() {
                return self.recorder.next();
            }
            let state = self.state();
            if state.step == look_step {
                if look_step == self.plan.steps {
                    return Ok(Next::End);
                }
                if stop.look() {
                    return Ok(Next::Stopped);
                }
                look_step = until_step(&self.plan, look_step);
                continue;
            }
            let was_sliding = state.sliding > 0;
            let driving = self.take_step();
            self.recorder.observe(&self.plan, &mut *self.stepper, was_sliding, driving)?;
        }
    }

    fn step(&self) -> u64 {
        self.state().step
    }

    fn is_between_records(&self) -> bool {
        self.recorder.is_empty()
    }

    fn counters(&self) -> Counters {
        self.stepper.counters()
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot { slider: self.state().clone(), pace: Pace::default() }
    }

    fn restore(&mut self, snapshot: &Snapshot) {
        self.stepper.restore(&snapshot.slider);
        self.recorder.continue_after(&self.plan, &snapshot.slider);
    }
}
