//! The solver whose cost follows the switches, not the steps.
//!
//! It computes the plain solver's discrete trajectory, up to rounding: *leaps* cover many steps at
//! once where they are certified free of switches, and the stepper takes the rest, so that every
//! switch happens in a single step. Which leaps there are depends on the body ([`Leaps`]); how the run
//! is cut up depends on the trajectory alone. What is to be recorded inside a leap is evaluated on the
//! side.
//!
//! Leaps that are refused or short cost more than the steps that they cover. So the solver keeps accounts
//! ([`crate::leap::cost`]): the steps that leaps save pay for attempts in vain, and once nothing is left, an attempt is
//! followed by many single steps.

mod chain;
mod lattice;

pub(crate) use chain::ChainLeaps;
pub(crate) use lattice::LatticeLeaps;

use std::fmt::Debug;
use std::sync::Arc;

use asperity_model::Plan;
use asperity_model::plan::outside::Driving;

use crate::energy::Bookkeeping;
use crate::records::counters::Counters;
use crate::records::pace::{Pace, Snapshot};
use crate::records::recorder::Recorder;
use crate::records::solver::{Next, SimulationError, Solver};
use crate::records::stop::{Stop, steps_between_looks};
use crate::step::body::OfPlan;
use crate::step::single_step::SingleSteps;
use crate::step::stepper::Stepper;

/// The many steps at once that a body allows.
pub(crate) trait Leaps: Debug + Send + 'static {
    /// The stepper for single steps.
    type Body: OfPlan;
    /// A leap that was opened.
    type Leap: Copy + Debug + Send;

    /// For the runs of a plan.
    fn of(plan: &Plan, elastic: &<Self::Body as OfPlan>::Elastic) -> Self;

    /// Opens a leap of at most `most_steps` steps, if one is certified, and returns how many it covers; otherwise the
    /// number of single steps to take before the next attempt. If the stop has come meanwhile, nothing has happened.
    fn open(&mut self, solver: &mut Open<'_, Self::Body>, most_steps: u64) -> Result<(Self::Leap, u64), u64>;

    /// Takes a leap, counts it and pays for it. A single step follows it, to compute the forces of the new
    /// state.
    fn land(&mut self, leap: Self::Leap, steps: u64, solver: &mut Open<'_, Self::Body>);

    /// The cost of a state inside a leap, in single steps.
    fn steps_of_sample(&self, leap: Self::Leap) -> u64;

    /// Writes the state `into` steps into the leap.
    fn sample(&mut self, leap: Self::Leap, into: u64, plan: &Plan, sampler: &mut Stepper<Self::Body>);

    /// Prepares the energies for the few steps from a sample to the next; returns for how many single steps
    /// that is.
    fn go_on(&mut self, _steps: u64, _plan: &Plan, _aside: &mut Stepper<Self::Body>) -> u64 {
        0
    }

    /// Number of single steps to take after one without a switch, and the cost of that prediction; `(0, 0)`
    /// to try a leap.
    fn foresee(&self, _plan: &Plan, _stepper: &Stepper<Self::Body>) -> (u64, u64) {
        (0, 0)
    }

    /// Cost beyond single steps since the last call.
    fn take_cost_steps(&mut self, _stepper: &mut Stepper<Self::Body>) -> u64 {
        0
    }

    /// Applications of a step's map, for the counters.
    fn applications(&self) -> u64 {
        0
    }

    /// Shortcuts that cannot be taken in this run at all.
    fn fallbacks(&self, plan: &Plan) -> Vec<&'static str>;
}

/// A solver while it opens or takes a leap.
pub(crate) struct Open<'a, B> {
    pub(crate) plan: &'a Plan,
    pub(crate) stepper: &'a mut Stepper<B>,
    pub(crate) pace: &'a mut Pace,
    pub(crate) counters: &'a mut Counters,
    pub(crate) stop: &'a Stop<'a>,
}

/// The solver that leaps where it can.
#[derive(Debug)]
pub(crate) struct Fast<L: Leaps> {
    plan: Arc<Plan>,
    stepper: Stepper<L::Body>,
    pace: Pace,
    recorder: Recorder,
    leaps: L,
    /// For records inside a leap, and for the number of single steps that computing them costs.
    sampler: Stepper<L::Body>,
    sampler_steps: u64,
    /// Whether `sampler` is the state of the last record inside the open leap.
    is_inside: bool,
    /// The leap that is open, and the steps that it covers: the state stays at its start until all that is due within
    /// it has been handed out.
    leap: Option<(L::Leap, u64)>,
    counters: Counters,
}

/// Why a run with courses of single contacts has no leaps.
const COURSES: &str = "single steps instead of leaps: forces or loads of single contacts follow courses";

/// Why a run with junctions has no leaps.
const JUNCTIONS: &str = "single steps instead of leaps: junctions break or are pinned every few dozen steps";

impl<L: Leaps> Fast<L> {
    /// A solver at the start of a plan, with kernels for a certain instruction set.
    pub(crate) fn new(plan: Arc<Plan>, elastic: &<L::Body as OfPlan>::Elastic) -> Fast<L> {
        let mut stepper = Stepper::new(Arc::clone(&plan), elastic, Bookkeeping::Spans);
        Fast {
            recorder: Recorder::at_start(&plan, &mut stepper),
            leaps: L::of(&plan, elastic),
            sampler: stepper.clone(),
            sampler_steps: 0,
            is_inside: false,
            pace: Pace::at_start(&plan),
            plan,
            stepper,
            leap: None,
            counters: Counters::default(),
        }
    }

    fn open<'a>(&'a mut self, stop: &'a Stop<'_>) -> (&'a mut L, Open<'a, L::Body>) {
        let Fast { plan, stepper, pace, counters, leaps, .. } = self;
        (leaps, Open { plan, stepper, pace, counters, stop })
    }

    /// Takes the pending single steps without further checks, up to the last of them, to one that is
    /// recorded, or to `until_step`.
    fn take_single_steps(&mut self, until_step: u64) -> Result<(), SimulationError> {
        while self.recorder.is_empty() && self.stepper.state().step < until_step && self.pace.single_steps > 1
        {
            self.take_step(|_| {})?;
        }
        Ok(())
    }

    /// Takes a single step, and decides whether another one follows.
    fn take_plain_step(&mut self) -> Result<(), SimulationError> {
        self.take_step(|solver| {
            let (next, cost_steps) = match solver.pace.single_steps {
                _ if !solver.stepper.switched().is_empty() => (1, 0),
                0 => (0, 0),
                _ => solver.leaps.foresee(&solver.plan, &solver.stepper),
            };
            solver.pace.single_steps = next;
            solver.pace.pay_or_pause(cost_steps);
        })
    }

    /// Takes a single step; calls `decide` after the last pending one.
    fn take_step(&mut self, decide: impl FnOnce(&mut Self)) -> Result<(), SimulationError> {
        let was_sliding = self.stepper.state().sliding > 0;
        let driving = self.stepper.take_step(self.pace.single_steps);
        if self.pace.single_steps > 1 {
            self.pace.single_steps -= 1;
        } else {
            decide(self);
        }
        let cost_steps = self.leaps.take_cost_steps(&mut self.stepper);
        self.pace.pay_or_pause(cost_steps);
        self.recorder.observe(&self.plan, &mut self.stepper, was_sliding, driving)
    }

    /// Records the next step of the leap that is due, or lands at its end.
    fn continue_leap(&mut self, leap: L::Leap, steps: u64, stop: &Stop<'_>) -> Result<(), SimulationError> {
        let from_step = self.stepper.state().step;
        let due_step = self.recorder.due_step();
        if due_step <= from_step + steps {
            return self.record_within(leap, due_step - from_step);
        }
        self.leap = None;
        self.is_inside = false;
        let (leaps, mut solver) = self.open(stop);
        leaps.land(leap, steps, &mut solver);
        self.take_plain_step()
    }

    /// Records the step that is `into` steps into the leap.
    fn record_within(&mut self, leap: L::Leap, into: u64) -> Result<(), SimulationError> {
        let due_step = self.stepper.state().step + into;
        let steps_on = due_step.saturating_sub(self.sampler.state().step);
        self.sampler_steps = if self.is_inside && steps_on <= self.leaps.steps_of_sample(leap) {
            self.sampler_steps.max(self.leaps.go_on(steps_on, &self.plan, &mut self.sampler))
        } else {
            self.sampler.state_mut().clone_from(self.stepper.state());
            self.leaps.sample(leap, into - 1, &self.plan, &mut self.sampler);
            0
        };
        let mut driving = Driving::default();
        while self.sampler.state().step < due_step {
            driving = self.sampler.take_step(self.sampler_steps);
        }
        self.is_inside = true;
        let energy = self.sampler.energy();
        self.recorder.record(&self.plan, self.sampler.state(), driving, energy, &[], false).map(drop)
    }
}

impl<L: Leaps> Solver for Fast<L> {
    fn next_record_unless(&mut self, stop: &Stop<'_>) -> Result<Next, SimulationError> {
        let steps = steps_between_looks(&self.plan);
        // Also after each attempt to leap.
        let mut look_step = self.step().saturating_add(steps);
        loop {
            if !self.recorder.is_empty() {
                return self.recorder.next();
            }
            if self.stepper.state().step >= self.plan.steps {
                return Ok(Next::End);
            }
            if let Some((leap, steps)) = self.leap {
                self.continue_leap(leap, steps, stop)?;
                continue;
            }
            if self.step() >= look_step {
                if stop.look() {
                    return Ok(Next::Stopped);
                }
                look_step = self.step().saturating_add(steps);
            }
            if self.pace.single_steps > 1 {
                self.take_single_steps(self.plan.steps.min(look_step))?;
                continue;
            }
            // The first and the first-after step of an event are taken singly, and recorded.
            if self.plan.friction.law.junctions().is_some() || self.plan.has_contact_courses() {
                self.pace.take_singly(u64::MAX);
                continue;
            }
            let state = self.stepper.state();
            let weak_until_step = self.plan.friction.law.weak_until_step(&state.memory);
            if weak_until_step > state.step {
                self.pace.take_singly(weak_until_step - state.step);
                self.take_plain_step()?;
                continue;
            }
            let edge_ahead = (state.sliding > 0) != (state.detached > 0);
            let [here, next] = [0, 1].map(|ahead| self.plan.outside(state.step + ahead, state.hold_step));
            if here.acceleration() != 0.0 {
                // Leaps are for a drive of constant velocity.
                self.pace.take_singly(here.until_step() - state.step);
            } else if self.pace.single_steps == 0 && !edge_ahead {
                // Ends before drive or load change their course, before the next step in which a contact
                // changes by itself, and before the last step.
                let steady_step = next.steady_until_step().min(here.drive_knot_step());
                let change_step = self.plan.friction.law.next_change_step(&state.memory);
                let until_step = (self.plan.steps - 1).min(steady_step).min(change_step.saturating_sub(1));
                let most_steps = until_step.saturating_sub(state.step);
                let (leaps, mut solver) = self.open(stop);
                let opened = leaps.open(&mut solver, most_steps);
                if stop.has_come() {
                    return Ok(Next::Stopped);
                }
                look_step = 0;
                match opened {
                    Ok(leap) => {
                        self.leap = Some(leap);
                        continue;
                    }
                    Err(single_steps) => self.pace.take_singly(single_steps),
                }
            }
            self.take_plain_step()?;
        }
    }

    fn step(&self) -> u64 {
        self.stepper.state().step
    }

    fn is_between_records(&self) -> bool {
        self.recorder.is_empty()
    }

    fn counters(&self) -> Counters {
        let applications = self.leaps.applications();
        self.counters + self.stepper.counters() + Counters { applications, ..Counters::default() }
    }

    fn fallbacks(&self) -> Vec<&'static str> {
        match self.plan.friction.law.junctions() {
            Some(_) => vec![JUNCTIONS],
            None if self.plan.has_contact_courses() => vec![COURSES],
            None => self.leaps.fallbacks(&self.plan),
        }
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot { slider: self.stepper.state().clone(), pace: self.pace }
    }

    fn restore(&mut self, snapshot: &Snapshot) {
        self.stepper.restore(&snapshot.slider);
        self.pace = snapshot.pace;
        self.leap = None;
        self.is_inside = false;
        self.recorder.continue_after(&self.plan, &snapshot.slider);
    }
}
