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
use crate::{Counters, SimulationError, Solver};

/// Below this many steps a window costs more than the steps it covers.
const SHORTEST_WINDOW: u64 = 24;

/// Below this many steps windows are cheaper than a jump.
const SHORTEST_JUMP: u64 = 10_000;

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
    /// Plain steps to take before the next window is tried.
    patience: u64,
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
            patience: 0,
            counters: Counters::default(),
        }
    }

    fn take_plain_step(&mut self) -> Result<(), SimulationError> {
        let was_sliding = self.plain.state().sliding > 0;
        let driving_force_n = self.plain.take_step();
        self.patience = self.patience.saturating_sub(1);
        let state = self.plain.state();
        let edge = was_sliding != (state.sliding > 0);
        if edge || !self.plain.switched().is_empty() || self.recorder.is_due(state.step) {
            self.recorder.record(&self.plan, state, driving_force_n, self.plain.switched(), edge)?;
        }
        Ok(())
    }

    /// Jumps ahead if every block is stuck and stays so for long enough; false if not.
    fn take_jump(&mut self) -> Result<bool, SimulationError> {
        let Some(jump) = &mut self.jump else { return Ok(false) };
        let state = self.plain.state();
        if state.detached > 0 {
            return Ok(false);
        }
        let from_step = state.step;
        // One step less than is certified, and than are left: the last is taken
        // plainly, for the forces that go with the state.
        let steps = jump.open(&self.plan, state, self.plan.steps - from_step).saturating_sub(1);
        if steps < SHORTEST_JUMP {
            return Ok(false);
        }
        self.counters.jumps += 1;
        self.counters.jump_steps += steps;
        while self.recorder.due_step() <= from_step + steps {
            let into = self.recorder.due_step() - from_step;
            let aside = self.aside.state_mut();
            aside.clone_from(self.plain.state());
            jump.sample(&self.plan, into - 1, aside);
            let driving_force_n = self.aside.take_step();
            self.recorder.record(&self.plan, self.aside.state(), driving_force_n, &[], false)?;
        }
        jump.land(&self.plan, steps, self.plain.state_mut());
        self.take_plain_step()?;
        Ok(true)
    }

    /// Takes a window if one is certified; false if plain steps must be taken.
    fn take_window(&mut self) -> Result<bool, SimulationError> {
        let state = self.plain.state();
        let from_step = state.step;
        let left = self.plan.steps - from_step;
        if left < SHORTEST_WINDOW || !self.window.open(&self.plan, state, left) {
            return Ok(false);
        }
        let steps = self.window.certified_steps(&self.plan, left);
        if steps < SHORTEST_WINDOW {
            return Ok(false);
        }
        self.counters.windows += 1;
        self.counters.window_steps += steps;
        while self.recorder.due_step() <= from_step + steps {
            let into = self.recorder.due_step() - from_step;
            let aside = self.aside.state_mut();
            aside.clone_from(self.plain.state());
            self.window.evaluate(&self.plan, from_step, into, aside);
            let driving_force_n = self.window.driving_force_n(&self.plan, from_step, into);
            self.recorder.record(&self.plan, aside, driving_force_n, &[], false)?;
        }
        self.window.evaluate(&self.plan, from_step, steps, self.plain.state_mut());
        Ok(true)
    }
}

impl Solver for Fast {
    fn name(&self) -> &'static str {
        "fast"
    }

    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        loop {
            if let Some(record) = self.recorder.pop() {
                return Ok(Some(record));
            }
            if self.plain.state().step == self.plan.steps {
                return Ok(None);
            }
            // The first and the first-after step of an event are taken plainly, and
            // recorded.
            let state = self.plain.state();
            let edge_ahead = (state.sliding > 0) != (state.detached > 0);
            if self.patience == 0 && !edge_ahead {
                if self.take_jump()? || self.take_window()? {
                    continue;
                }
                self.patience = SHORTEST_WINDOW;
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
        self.patience = 0;
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
