//! The solver of slabs whose cost follows the switches, not the steps.
//!
//! It takes single steps ([`crate::lattice`]) while any contact slides, and until what is fast has
//! died away after that. Then it jumps ([`jump`]) by the slow modes of the stuck slab ([`modes`],
//! found with the factor of its stiffness, [`stuck`], and [`eigen`]) as far as is certified. Every
//! switch happens in a single step. Attempts that come to nothing are paid for from what jumps have saved
//! ([`crate::cost`]), so that a slab that rattles takes no longer than plainly. When it tries to jump depends on the state and the plan alone, and
//! what is to be recorded inside a jump is evaluated on the side.

mod eigen;
mod ground;
mod jump;
mod modes;
mod norms;
mod stuck;

use std::sync::Arc;

use asperity_model::{Lattice, Plan};
use asperity_record::Record;

use crate::cost;
use crate::counters::Counters;
use crate::fast::Fast;
use crate::lattice::LatticeStepper;
use crate::recorder::Recorder;
use crate::slab::ground::Ground;
use crate::slab::jump::{Attempt, Jump};
use crate::slab::stuck::StuckSlab;
use crate::solver::{SimulationError, Solver};
use crate::state::ChainState;
use crate::sweep::Sweeps;

/// Most steps of Arnoldi's iteration: half of them end as modes and their conjugates.
const MOST_ITERATIONS: usize = 200;

/// The same, and at least so many, as far as there are so many modes.
const LEAST_ITERATIONS: usize = 80;

/// Modes are found if that takes no more than such a part of a run's steps.
const RUNS_OF_MODES: u64 = 8;

/// Most memory that the factor of a slab's stiffness and the iteration may take, in numbers: 1 GB.
const MOST_NUMBERS: usize = 1 << 27;

/// Single steps that take no longer than putting a sample together.
const STEPS_OF_SAMPLE: u64 = 32;

/// Why a run of a slab has no jumps.
const TOO_SHORT: &str =
    "single steps instead of jumps: the modes of the stuck slab would take longer than so few steps";
const TOO_LARGE: &str =
    "single steps instead of jumps: the modes of so large a slab would take too much memory";
const NO_MODES: &str =
    "single steps instead of jumps: the stuck slab has no slow modes that doubles can tell";

/// The fast solver of a slab.
#[derive(Debug, Clone)]
pub(crate) struct FastSlab {
    plan: Arc<Plan>,
    sweeps: Sweeps,
    stepper: LatticeStepper,
    recorder: Recorder,
    jumps: Jumps,
    /// For what is recorded inside a jump, and whether it stands where the last record inside the
    /// open one was made.
    aside: LatticeStepper,
    is_inside: bool,
    /// Steps of the jump that is open: the state stays at its start until all that is due within it
    /// has been handed out.
    open_steps: Option<u64>,
    counters: Counters,
}

/// What takes the jumps.
#[derive(Debug, Clone)]
enum Jumps {
    /// It is made where a jump is tried first.
    Unmade,
    Made(Box<Jump>),
    None(&'static str),
}

impl FastSlab {
    /// A solver at the start of a plan.
    ///
    /// # Panics
    /// If the plan is of a chain.
    pub(crate) fn new(plan: Arc<Plan>) -> FastSlab {
        FastSlab::with_sweeps(plan, Sweeps::detect())
    }

    fn with_sweeps(plan: Arc<Plan>, sweeps: Sweeps) -> FastSlab {
        let stepper = LatticeStepper::new(Arc::clone(&plan), sweeps);
        let lattice = plan.elastic.lattice().expect("a plan of a slab");
        FastSlab {
            recorder: Recorder::new(&plan, stepper.state()),
            jumps: if numbers(lattice) > MOST_NUMBERS {
                Jumps::None(TOO_LARGE)
            } else if RUNS_OF_MODES * modes_steps(lattice) > plan.steps {
                Jumps::None(TOO_SHORT)
            } else {
                Jumps::Unmade
            },
            aside: stepper.clone(),
            is_inside: false,
            open_steps: None,
            counters: Counters::default(),
            stepper,
            sweeps,
            plan,
        }
    }

    fn take_single_step(&mut self) -> Result<(), SimulationError> {
        let was_sliding = self.stepper.state().sliding > 0;
        let driving = self.stepper.take_step();
        self.recorder.observe(&self.plan, &mut self.stepper, was_sliding, driving)
    }

    /// Opens a jump if one is certified, or else says when to try again.
    fn open_jump(&mut self) {
        if let Jumps::Unmade = self.jumps {
            let stuck = StuckSlab::of(&self.plan, self.sweeps);
            let ground = stuck.and_then(|stuck| {
                let iterations = iterations(&stuck.lattice);
                Ground::of(&self.plan, stuck, iterations)
            });
            self.jumps = match ground {
                Some(ground) => Jumps::Made(Box::new(Jump::new(Arc::new(ground)))),
                None => Jumps::None(NO_MODES),
            };
        }
        let Jumps::Made(jump) = &mut self.jumps else { return };
        let state = self.stepper.state();
        // Not beyond where drive or load change their course, nor to the last step.
        let last_step = (self.plan.steps - 1).min(self.plan.steady_until_step(state.step, state.hold_step));
        match jump.open(&self.plan, state, last_step - state.step) {
            Attempt::Jump(steps) => self.open_steps = Some(steps),
            Attempt::Wait(steps) => {
                self.counters.refused_jumps += 1;
                // What was not saved before is made up for by single steps.
                let cost_steps = jump.cost_steps();
                let state = self.stepper.state_mut();
                let debt_steps = cost::pay(&mut state.saved_steps, cost_steps);
                state.no_jump_before_step = state.step + steps.max(cost::pause_steps(debt_steps));
            }
        }
    }

    /// Records the next step of the jump that is due, or lands at its end.
    fn continue_jump(&mut self, steps: u64) -> Result<(), SimulationError> {
        let Jumps::Made(jump) = &mut self.jumps else { unreachable!("it is open") };
        let from_step = self.stepper.state().step;
        let due_step = self.recorder.due_step();
        if due_step > from_step + steps {
            self.open_steps = None;
            self.is_inside = false;
            self.counters.jumps += 1;
            self.counters.jump_steps += steps;
            let state = self.stepper.state_mut();
            jump.land(steps, state);
            jump.account(&self.plan, steps, state);
            cost::earn(&mut state.saved_steps, steps);
            cost::pay(&mut state.saved_steps, jump.cost_steps());
            // For the forces that go with the state.
            return self.take_single_step();
        }
        let into = due_step - from_step;
        let steps_on = due_step.saturating_sub(self.aside.state().step);
        if !(self.is_inside && steps_on <= STEPS_OF_SAMPLE) {
            let state = self.aside.state_mut();
            state.clone_from(self.stepper.state());
            jump.sample(into - 1, state);
        }
        let mut driving = self.aside.take_step();
        while self.aside.state().step < due_step {
            driving = self.aside.take_step();
        }
        self.is_inside = true;
        jump.account(&self.plan, into, self.aside.state_mut());
        let energy = self.aside.energy();
        self.recorder.record(&self.plan, self.aside.state(), driving, energy, &[], false)
    }
}

/// Steps of Arnoldi's iteration for a slab.
fn iterations(lattice: &Lattice) -> usize {
    MOST_ITERATIONS.min(lattice.freedoms().max(LEAST_ITERATIONS))
}

/// Numbers that the factor of a slab's stiffness and the iteration take.
fn numbers(lattice: &Lattice) -> usize {
    StuckSlab::numbers(lattice) + 3 * iterations(lattice) * lattice.freedoms()
}

/// What finding the modes takes, in single steps: to orthogonalise, to solve, the factor, and the small
/// matrix that is left, which is as large for all slabs but the smallest.
fn modes_steps(lattice: &Lattice) -> u64 {
    let (iterations, shorter) = (iterations(lattice) as u64, lattice.rows.min(lattice.columns) as u64);
    let small = iterations * iterations * iterations / (4 * lattice.nodes() as u64);
    iterations * iterations / 4 + iterations * shorter + shorter * shorter / 2 + small
}

impl Solver for FastSlab {
    fn name(&self) -> &'static str {
        Fast::NAME
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
            if let Some(steps) = self.open_steps {
                self.continue_jump(steps)?;
                continue;
            }
            // The first and the first-after step of an event are taken one by one, and recorded.
            let is_stuck = state.detached == 0 && state.sliding == 0;
            if is_stuck && state.step >= state.no_jump_before_step && !matches!(self.jumps, Jumps::None(_)) {
                self.open_jump();
                if self.open_steps.is_some() {
                    continue;
                }
            }
            self.take_single_step()?;
        }
    }

    fn step(&self) -> u64 {
        self.stepper.state().step
    }

    fn is_between_records(&self) -> bool {
        self.recorder.is_empty()
    }

    fn counters(&self) -> Counters {
        let Counters { plain_steps, switches, contact_steps_in_air, .. } = self.stepper.counters();
        Counters { plain_steps, switches, contact_steps_in_air, ..self.counters }
    }

    fn fallbacks(&self) -> Vec<&'static str> {
        match self.jumps {
            Jumps::None(why) => vec![why],
            Jumps::Unmade | Jumps::Made(_) => Vec::new(),
        }
    }

    fn snapshot(&self) -> ChainState {
        self.stepper.state().clone()
    }

    fn restore(&mut self, state: &ChainState) {
        self.stepper.restore(state);
        self.open_steps = None;
        self.is_inside = false;
        self.recorder.continue_after(&self.plan, state);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::{Plan, resolve};

    use super::FastSlab;
    use crate::solver::Solver;
    use crate::sweep::Sweeps;

    #[test]
    fn all_instruction_sets_give_the_same_records_to_the_bit() {
        let coarse = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.26"];
        let plan = Arc::new(Plan::new(&resolve("slab", &coarse).unwrap_or_else(|error| panic!("{error}"))));
        let run = |sweeps| {
            let mut solver = FastSlab::with_sweeps(Arc::clone(&plan), sweeps);
            // Debug output tells doubles apart to the bit, but for the sign of zero.
            let mut records = Vec::new();
            while let Some(record) = solver.next_record().unwrap() {
                records.push(format!("{record:?}"));
            }
            (records, solver.counters())
        };
        let baseline = run(Sweeps::Baseline);
        assert!(baseline.1.jumps > 1 && baseline.1.switches > 5, "{:?}", baseline.1);
        for sweeps in Sweeps::available() {
            assert!(run(sweeps) == baseline, "{sweeps:?}");
        }
    }
}
