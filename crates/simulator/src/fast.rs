//! The solver whose cost follows the switches, not the steps.
//!
//! It computes the plain stepper's discrete trajectory, up to rounding: windows
//! ([`crate::window`]) cover many steps at once where they are certified free of
//! switches, jumps ([`crate::jump`]) most of each stick phase, and the plain stepper
//! takes the rest, so that every switch happens in a plain step. How the run is
//! cut up depends on the trajectory alone. What is to be recorded inside a window
//! or jump is evaluated on the side.
//!
//! Where windows are refused or short, they cost more than the steps that they cover. So accounts
//! are kept ([`crate::cost`]): what leaps save pays for tries in vain, and once nothing is left, a
//! try is followed by many single steps with nothing beside them.

use std::sync::Arc;

use asperity_model::{Law, Plan};
use asperity_record::Record;

use crate::contacts::age;
use crate::cost::{self, Costs};
use crate::counters::Counters;
use crate::energy::{Accounts, Bookkeeping};
use crate::jump::Jump;
use crate::recorder::Recorder;
use crate::rest::rest_steps;
use crate::solver::{SimulationError, Solver};
use crate::state::ChainState;
use crate::stepper::{Driving, Stepper};
use crate::sweep::Sweeps;
use crate::window::Window;

/// Single steps of a long chain without windows before it is asked again whether it may jump.
const LOOK_ROUND_STEPS: u64 = 32;

/// Many certified steps, still to be taken.
#[derive(Debug, Clone, Copy)]
enum Leap {
    Jump {
        steps: u64,
    },
    /// Nothing moves, by the laws without friction springs.
    Rest {
        steps: u64,
    },
    /// By the index of the window's length.
    Window(usize),
}

/// The solver that takes certified windows where it can.
#[derive(Debug, Clone)]
pub struct Fast {
    plan: Arc<Plan>,
    stepper: Stepper,
    recorder: Recorder,
    window: Window,
    /// For chains whose modes are known.
    jump: Option<Jump>,
    /// For what is recorded inside a window or jump.
    aside: Stepper,
    /// Whether it stands where the last record inside the open one was made.
    is_inside: bool,
    /// The jump or window that is open: the state stays at its start until all
    /// that is due within it has been handed out.
    leap: Option<Leap>,
    counters: Counters,
    costs: Costs,
}

impl Fast {
    /// The solver's name in run headers and on the command line.
    pub const NAME: &'static str = "fast";

    /// A solver at the start of a plan.
    pub fn new(plan: impl Into<Arc<Plan>>) -> Fast {
        Fast::with_sweeps(plan.into(), Sweeps::detect())
    }

    /// The same with sweeps for a certain instruction set.
    fn with_sweeps(plan: Arc<Plan>, sweeps: Sweeps) -> Fast {
        let stepper = Stepper::new(Arc::clone(&plan), sweeps, Bookkeeping::Spans);
        Fast {
            costs: Costs::of(&plan),
            recorder: Recorder::new(&plan, stepper.state()),
            window: Window::new(&plan, sweeps),
            jump: if Jump::may_pay(&plan) { Jump::new(&plan, sweeps) } else { None },
            aside: stepper.clone(),
            is_inside: false,
            plan,
            stepper,
            leap: None,
            counters: Counters::default(),
        }
    }

    /// Takes the steps that are best taken one by one, with nothing beside them, up to the last of
    /// them or to one that is recorded.
    fn take_single_steps(&mut self) -> Result<(), SimulationError> {
        while self.recorder.is_empty() && self.stepper.state().step < self.plan.steps {
            let state = self.stepper.state_mut();
            let was_sliding = state.sliding > 0;
            if state.single_steps <= 1 {
                break;
            }
            let driving = self.stepper.take_step();
            self.stepper.state_mut().single_steps -= 1;
            self.pay_for_spans();
            self.recorder.observe(&self.plan, &mut self.stepper, was_sliding, driving)?;
        }
        Ok(())
    }

    fn take_plain_step(&mut self) -> Result<(), SimulationError> {
        let was_sliding = self.stepper.state().sliding > 0;
        let driving = self.stepper.take_step();
        let left = self.stepper.state().single_steps;
        if left > 1 {
            self.stepper.state_mut().single_steps = left - 1;
        } else {
            let (next, cost_steps) = match left {
                _ if !self.stepper.switched().is_empty() => (1, 0),
                0 => (0, 0),
                // What two steps without a switch between them foresee costs a fraction of
                // opening a window in vain.
                _ => match self.window.refused_by(self.stepper.foreseen_steps()) {
                    Some(steps) => (steps, cost::FORESIGHT_STEPS),
                    // Part of what the window costs that is tried now.
                    None => (0, 0),
                },
            };
            self.stepper.state_mut().single_steps = next;
            self.pay(cost_steps);
        }
        self.pay_for_spans();
        self.recorder.observe(&self.plan, &mut self.stepper, was_sliding, driving)
    }

    /// Pays for what was done beside the steps; what leaps have not saved up to now is made up for
    /// by single steps.
    fn pay(&mut self, cost_steps: u64) {
        let state = self.stepper.state_mut();
        let debt_steps = cost::pay(&mut state.saved_steps, cost_steps);
        state.single_steps = state.single_steps.max(cost::pause_steps(debt_steps));
    }

    /// The same for the spans of the energies that were closed.
    fn pay_for_spans(&mut self) {
        let cost_steps = self.stepper.accounts_mut().0.take_cost_steps();
        if cost_steps > 0 {
            self.pay(cost_steps);
        }
    }

    /// Opens a jump or a window, if one is certified; or else the steps that are best
    /// taken one by one. The step after it is taken plainly, for the forces that go
    /// with the state.
    fn open_leap(&mut self) -> Result<Leap, u64> {
        if self.plan.friction.ageing.is_some() {
            age(&self.plan, self.stepper.state_mut());
        }
        let state = self.stepper.state();
        // Not beyond where drive or load change their course, nor to the last step.
        let last_step = (self.plan.steps - 1).min(self.plan.steady_until_step(state.step, state.hold_step));
        let left = last_step - state.step;
        if self.plan.friction.law != Law::Springs && state.detached == 0 {
            let steps = rest_steps(&self.plan, state).min(left);
            if steps == 0 {
                self.pay(cost::REST_STEPS);
                return Err(1);
            }
            return Ok(Leap::Rest { steps });
        }
        if let Some(jump) = &mut self.jump
            && state.detached == 0
            && state.step >= state.no_jump_before_step
        {
            let steps = jump.open(&self.plan, state, left);
            if steps > 0 {
                return Ok(Leap::Jump { steps });
            }
            self.counters.refused_jumps += 1;
            let (patience_steps, cost_steps) = (jump.patience_steps(), jump.cost_steps());
            let state = self.stepper.state_mut();
            let debt_steps = cost::pay(&mut state.saved_steps, cost_steps);
            state.no_jump_before_step = state.step + patience_steps.max(cost::pause_steps(debt_steps));
        }
        if self.window.never_pays() {
            return Err(self.single_steps_of_long_chain());
        }
        let state = self.stepper.state();
        match self.window.open(&self.plan, state, left) {
            Ok(index) => Ok(Leap::Window(index)),
            Err(single_steps) => {
                self.counters.refused_windows += 1;
                self.pay(self.costs.window_steps(self.window.work()));
                Err(single_steps)
            }
        }
    }

    /// How many steps to take one by one, where no window pays, before looking round. While no switch is
    /// near, the energies take a span for it.
    fn single_steps_of_long_chain(&mut self) -> u64 {
        let adds_up = self.stepper.accounts_mut().0.by_steps();
        let state = self.stepper.state();
        let is_stuck = state.detached == 0;
        let steps_to_jump = state.no_jump_before_step.saturating_sub(state.step).max(1);
        let needs_span = !adds_up && state.energy.span.is_none();
        if is_stuck && needs_span && self.window.foresee(&self.plan, state) > cost::STEPS_WORTH_A_SPAN {
            let (accounts, state) = self.stepper.accounts_mut();
            let next_step = state.step + 1;
            accounts.begin(&self.plan, state, next_step);
            self.pay_for_spans();
        }
        if is_stuck && self.jump.is_some() { LOOK_ROUND_STEPS.min(steps_to_jump) } else { LOOK_ROUND_STEPS }
    }

    /// Has a span of the energies begin no later than a leap, which goes on to its end.
    fn begin_span(&mut self, leap: Leap) {
        let steps = match leap {
            Leap::Jump { steps } => steps,
            Leap::Window(index) => self.window.steps(index),
            // Nothing moves.
            Leap::Rest { .. } => return,
        };
        let (accounts, state) = self.stepper.accounts_mut();
        let until_step = state.step + steps;
        accounts.begin(&self.plan, state, until_step);
        self.pay_for_spans();
    }

    /// Records the next step of the leap that is due, or lands at its end.
    fn continue_leap(&mut self, leap: Leap) -> Result<(), SimulationError> {
        let from_step = self.stepper.state().step;
        let steps = match leap {
            Leap::Jump { steps } | Leap::Rest { steps } => steps,
            Leap::Window(index) => self.window.steps(index),
        };
        let due_step = self.recorder.due_step();
        if due_step <= from_step + steps {
            return self.record_within(leap, due_step - from_step);
        }
        self.leap = None;
        self.is_inside = false;
        // Counted as they land: a state that is saved before is one that has not taken them.
        let (leaps, leap_steps) = match leap {
            Leap::Window(_) => (&mut self.counters.windows, &mut self.counters.window_steps),
            Leap::Jump { .. } | Leap::Rest { .. } => {
                (&mut self.counters.jumps, &mut self.counters.jump_steps)
            }
        };
        *leaps += 1;
        *leap_steps += steps;
        let cost_steps = match leap {
            Leap::Window(_) => self.costs.window_steps(self.window.work()),
            Leap::Jump { .. } => opened(&mut self.jump).cost_steps(),
            Leap::Rest { .. } => cost::REST_STEPS,
        };
        cost::earn(&mut self.stepper.state_mut().saved_steps, steps);
        self.pay(cost_steps);
        let (accounts, state) = self.stepper.accounts_mut();
        match leap {
            Leap::Window(index) => {
                self.window.land(&self.plan, index, state);
                self.window.account(&self.plan, index, state, accounts);
                if self.window.ends_near_switch(index) {
                    // This one, and one to foresee from.
                    state.single_steps = state.single_steps.max(2);
                }
            }
            Leap::Jump { steps } => {
                let jump = opened(&mut self.jump);
                jump.land(steps, state);
                jump.account(&self.plan, state, accounts);
            }
            Leap::Rest { steps } => rest(&self.plan, steps, state, accounts),
        }
        if accounts.by_steps() {
            accounts.end(&self.plan, state);
        }
        self.take_plain_step()
    }

    /// Records the step that is `into` steps into the leap.
    fn record_within(&mut self, leap: Leap, into: u64) -> Result<(), SimulationError> {
        let due_step = self.stepper.state().step + into;
        let steps_on = due_step.saturating_sub(self.aside.state().step);
        if !(self.is_inside && steps_on <= self.steps_of_sample(leap)) {
            self.put_aside(leap, into);
        } else {
            self.aside.add_up(steps_on);
        }
        let mut driving = Driving { total_n: 0.0, ends_n: None };
        while self.aside.state().step < due_step {
            driving = self.aside.take_step();
        }
        self.is_inside = true;
        let energy = self.aside.energy();
        self.recorder.record(&self.plan, self.aside.state(), driving, energy, &[], false)
    }

    /// So many single steps take no longer than putting a sample together.
    fn steps_of_sample(&self, leap: Leap) -> u64 {
        match leap {
            Leap::Window(_) => self.costs.window_sample_steps(self.window.work()),
            Leap::Jump { .. } => self.jump.as_ref().map_or(0, Jump::modes_steps),
            Leap::Rest { .. } => 0,
        }
    }

    /// Puts together the state some steps before the one that is `into` steps into the leap.
    fn put_aside(&mut self, leap: Leap, into: u64) {
        self.aside.state_mut().clone_from(self.stepper.state());
        let (accounts, state) = self.aside.accounts_mut();
        accounts.follow(&self.plan, state);
        match leap {
            Leap::Window(_) => {
                self.window.sample(&self.plan, into - 1, state);
                self.window.account_sample(&self.plan, into - 1, state, accounts);
            }
            Leap::Jump { .. } => {
                let jump = opened(&mut self.jump);
                jump.sample(into - 1, state);
                jump.account(&self.plan, state, accounts);
            }
            Leap::Rest { .. } => rest(&self.plan, into - 1, state, accounts),
        }
        if accounts.by_steps() {
            accounts.end(&self.plan, state);
        }
    }
}

/// Takes steps in which nothing moves but the drive point.
fn rest(plan: &Plan, steps: u64, state: &mut ChainState, accounts: &Accounts) {
    let from_step = state.step;
    state.step += steps;
    state.sliding = 0;
    let displacement_m = std::mem::take(&mut state.displacement_m);
    let sum_m = |n: usize| steps as f64 * displacement_m[n];
    accounts.add_drive(plan, state, from_step, steps, sum_m, |n| displacement_m[n]);
    state.displacement_m = displacement_m;
}

/// The jump that a leap was opened with.
fn opened(jump: &mut Option<Jump>) -> &mut Jump {
    jump.as_mut().expect("only a solver with jumps opens one")
}

impl Solver for Fast {
    fn name(&self) -> &'static str {
        Fast::NAME
    }

    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        loop {
            if !self.recorder.is_empty() {
                return self.recorder.next();
            }
            if self.stepper.state().step >= self.plan.steps {
                return Ok(None);
            }
            if let Some(leap) = self.leap {
                self.continue_leap(leap)?;
                continue;
            }
            if self.stepper.state().single_steps > 1 {
                self.take_single_steps()?;
                continue;
            }
            // The first and the first-after step of an event are taken plainly, and
            // recorded.
            let state = self.stepper.state();
            let edge_ahead = (state.sliding > 0) != (state.detached > 0);
            if state.single_steps == 0 && !edge_ahead {
                match self.open_leap() {
                    Ok(leap) => {
                        self.begin_span(leap);
                        self.leap = Some(leap);
                        continue;
                    }
                    Err(single_steps) => {
                        let state = self.stepper.state_mut();
                        state.single_steps = state.single_steps.max(single_steps);
                    }
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
        let Counters { plain_steps, switches, .. } = self.stepper.counters();
        let applications = self.window.applications();
        Counters { plain_steps, switches, applications, ..self.counters }
    }

    fn fallbacks(&self) -> Vec<&'static str> {
        if !self.plan.friction.law.is_affine() {
            return vec![
                "single steps while any block slides: friction that depends on velocity has no windows; at rest the run jumps all the same",
            ];
        }
        if self.plan.friction.law != Law::Springs {
            // A chain that rests needs no modes to jump.
            return Vec::new();
        }
        if !Jump::may_pay(&self.plan) {
            return vec![
                "windows instead of jumps: the modes of the stuck chain would take longer than so few steps",
            ];
        }
        let jumps = self.jump.is_none().then_some(
            "windows instead of jumps: the stuck chain has no full set of modes, or none that doubles can tell apart (critical damping, very soft friction springs)",
        );
        let windows = (self.window.shortest() == u64::MAX)
            .then_some("single steps instead of windows: the time step is too long for them");
        jumps.into_iter().chain(windows).collect()
    }

    fn snapshot(&self) -> ChainState {
        self.stepper.state().clone()
    }

    fn restore(&mut self, state: &ChainState) {
        self.stepper.restore(state);
        self.leap = None;
        self.is_inside = false;
        self.recorder.continue_after(&self.plan, state);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::Fast;
    use crate::solver::Solver;
    use crate::sweep::Sweeps;

    #[test]
    fn all_instruction_sets_give_the_same_records_to_the_bit() {
        for set in [
            &["parameter_set=as-coded", "time.duration_s=0.25"][..],
            &["parameter_set=as-stated", "time.duration_s=0.25"],
            // A long chain, which jumps by waves.
            &["slider.blocks=300", "time.duration_s=0.08"],
        ] {
            let source = ScenarioSource::new("test", "");
            let source = set.iter().fold(source, |source, value| source.with_override(value));
            let plan = Arc::new(Plan::new(&Scenario::resolve(&source).unwrap()));
            let run = |sweeps| {
                let mut solver = Fast::with_sweeps(Arc::clone(&plan), sweeps);
                // Debug output tells doubles apart to the bit, but for the sign of zero.
                let mut records = Vec::new();
                while let Some(record) = solver.next_record().unwrap() {
                    records.push(format!("{record:?}"));
                }
                (records, solver.counters())
            };
            let baseline = run(Sweeps::Baseline);
            assert!(baseline.1.jumps > 3 && baseline.1.switches > 50, "{:?}", baseline.1);
            for sweeps in Sweeps::available() {
                assert!(run(sweeps) == baseline, "{set:?}, {sweeps:?}");
            }
        }
    }
}
