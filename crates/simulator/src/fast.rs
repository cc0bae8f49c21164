//! The solver whose cost follows the switches, not the steps.
//!
//! It computes the plain stepper's discrete trajectory, up to rounding: windows
//! ([`crate::window`]) cover many steps at once where they are certified free of
//! switches, jumps ([`crate::jump`]) most of each stick phase, and the plain stepper
//! takes the rest, so that every switch happens in a plain step. How the run is
//! cut up depends on the trajectory alone. What is to be recorded inside a window
//! or jump is evaluated on the side.

use asperity_model::Plan;
use asperity_record::Record;

use crate::jump::{Jump, LARGEST_CHAIN};
use crate::plain::Plain;
use crate::recorder::Recorder;
use crate::state::ChainState;
use crate::sweep::Sweeps;
use crate::window::Window;
use crate::{Counters, SimulationError, Solver, SolverKind};

/// Below this many steps a window costs more than the steps it covers.
const SHORTEST_WINDOW: u64 = 24;

/// Below this many steps windows are cheaper than a jump.
const SHORTEST_JUMP: u64 = 10_000;

/// Many certified steps, still to be taken.
#[derive(Debug, Clone, Copy)]
struct Leap {
    steps: u64,
    is_jump: bool,
}

/// The solver that takes certified windows where it can.
#[derive(Debug, Clone)]
pub struct Fast {
    plan: Plan,
    plain: Plain,
    recorder: Recorder,
    window: Window,
    /// For chains small enough for it.
    jump: Option<Jump>,
    /// For what is recorded inside a window or jump.
    aside: Plain,
    /// The jump or window that is open: the state stays at its start until all
    /// that is due within it has been handed out.
    leap: Option<Leap>,
    counters: Counters,
}

impl Fast {
    /// A solver at the start of a plan.
    pub fn new(plan: Plan) -> Fast {
        Fast::with_sweeps(plan, Sweeps::detect())
    }

    /// The same with sweeps for a certain instruction set.
    fn with_sweeps(plan: Plan, sweeps: Sweeps) -> Fast {
        let plain = Plain::with_sweeps(plan.clone(), sweeps);
        let recorder = Recorder::new(&plan, plain.state());
        Fast {
            window: Window::new(&plan, sweeps),
            jump: (plan.blocks <= LARGEST_CHAIN).then(|| Jump::new(&plan, sweeps)),
            aside: plain.clone(),
            plan,
            plain,
            recorder,
            leap: None,
            counters: Counters::default(),
        }
    }

    fn take_plain_step(&mut self) -> Result<(), SimulationError> {
        let was_sliding = self.plain.state().sliding > 0;
        let driving_force_n = self.plain.take_step();
        let left = &mut self.plain.state_mut().single_steps;
        *left = left.saturating_sub(1);
        let (state, switched) = (self.plain.state(), self.plain.switched());
        self.recorder.observe(&self.plan, state, was_sliding, driving_force_n, switched)
    }

    /// Opens a jump or a window, if one is certified and long enough.
    fn open_leap(&mut self) -> Option<Leap> {
        let state = self.plain.state();
        let left = self.plan.steps - state.step;
        if let Some(jump) = &mut self.jump
            && state.detached == 0
        {
            // One step less than is certified, and than are left: the last is taken
            // plainly, for the forces that go with the state.
            let steps = jump.open(&self.plan, state, left).saturating_sub(1);
            if steps >= SHORTEST_JUMP {
                self.counters.jumps += 1;
                self.counters.jump_steps += steps;
                return Some(Leap { steps, is_jump: true });
            }
        }
        if left < SHORTEST_WINDOW || !self.window.open(&self.plan, state, left) {
            return None;
        }
        let steps = self.window.certified_steps(&self.plan, left);
        (steps >= SHORTEST_WINDOW).then(|| {
            self.counters.windows += 1;
            self.counters.window_steps += steps;
            Leap { steps, is_jump: false }
        })
    }

    /// Records the next step of the leap that is due, or lands behind it.
    fn continue_leap(&mut self, leap: Leap) -> Result<(), SimulationError> {
        let from_step = self.plain.state().step;
        if self.recorder.due_step() <= from_step + leap.steps {
            let into = self.recorder.due_step() - from_step;
            self.aside.state_mut().clone_from(self.plain.state());
            let driving_force_n = match &mut self.jump {
                Some(jump) if leap.is_jump => {
                    jump.sample(&self.plan, into - 1, self.aside.state_mut());
                    self.aside.take_step()
                }
                _ => {
                    self.window.evaluate(from_step, into, self.aside.state_mut());
                    self.window.driving_force_n(&self.plan, from_step, into)
                }
            };
            return self.recorder.record(&self.plan, self.aside.state(), driving_force_n, &[], false);
        }
        self.leap = None;
        match &mut self.jump {
            Some(jump) if leap.is_jump => {
                jump.land(&self.plan, leap.steps, self.plain.state_mut());
                self.take_plain_step()
            }
            _ => {
                self.window.evaluate(from_step, leap.steps, self.plain.state_mut());
                Ok(())
            }
        }
    }
}

impl Solver for Fast {
    fn name(&self) -> &'static str {
        SolverKind::Fast.name()
    }

    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        loop {
            if let Some(record) = self.recorder.pop() {
                return Ok(Some(record));
            }
            if self.plain.state().step == self.plan.steps {
                return Ok(None);
            }
            if let Some(leap) = self.leap {
                self.continue_leap(leap)?;
                continue;
            }
            // The first and the first-after step of an event are taken plainly, and
            // recorded.
            let state = self.plain.state();
            let edge_ahead = (state.sliding > 0) != (state.detached > 0);
            if state.single_steps == 0 && !edge_ahead {
                self.leap = self.open_leap();
                if self.leap.is_some() {
                    continue;
                }
                self.plain.state_mut().single_steps = SHORTEST_WINDOW;
            }
            self.take_plain_step()?;
        }
    }

    fn step(&self) -> u64 {
        self.plain.state().step
    }

    fn counters(&self) -> Counters {
        let Counters { plain_steps, switches, .. } = self.plain.counters();
        Counters { plain_steps, switches, applications: self.window.applications, ..self.counters }
    }

    fn snapshot(&self) -> ChainState {
        self.plain.snapshot()
    }

    fn restore(&mut self, state: &ChainState) {
        self.plain.restore(state);
        self.leap = None;
        self.recorder.continue_after(&self.plan, state.step);
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::Fast;
    use crate::Solver;
    use crate::sweep::Sweeps;

    #[test]
    fn all_instruction_sets_give_the_same_records_to_the_bit() {
        for set in ["as-coded", "as-stated"] {
            let source = ScenarioSource::new("test", "time.duration_s = 0.25")
                .with_override(&format!("parameter_set={set}"));
            let plan = Plan::new(&Scenario::resolve(&source).unwrap());
            let run = |sweeps| {
                let mut solver = Fast::with_sweeps(plan.clone(), sweeps);
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
                assert!(run(sweeps) == baseline, "{set}, {sweeps:?}");
            }
        }
    }
}
