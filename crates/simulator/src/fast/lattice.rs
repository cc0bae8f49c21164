//! The leaps of a lattice: jumps while all contacts are stuck.
//!
//! It takes single steps while any contact slides, and afterwards until the fast modes have died away. Then
//! it jumps ([`crate::jump::lattice`]) by the slow modes ([`crate::slow_modes::arnoldi`], found with the
//! factor of the stiffness, [`crate::slow_modes::stuck`]) of the stuck lattice as far as is certified.

use std::sync::Arc;

use asperity_model::{Lattice, Plan};
use asperity_record::Energy;

use crate::body::LatticeBody;
use crate::cost;
use crate::fast::{Leaps, Open};
use crate::jump::lattice::{Attempt, Jump};
use crate::kernels::Simd;
use crate::slow_modes::{Precomputed, StuckLattice};
use crate::stepper::Stepper;

/// Most steps of Arnoldi's iteration: half of them end as modes and their conjugates.
const MOST_ITERATIONS: usize = 200;

/// Fewest steps of the iteration, if there are as many modes.
const LEAST_ITERATIONS: usize = 80;

/// Modes are computed if that costs at most this fraction of a run's steps: one in eight.
const RUNS_OF_MODES: u64 = 8;

/// Most memory that the factor of a slab's stiffness and the iteration may take, in numbers: 1 GB.
const MOST_NUMBERS: usize = 1 << 27;

/// Number of single steps that cost as much as composing a sample.
const STEPS_OF_SAMPLE: u64 = 32;

/// Why a run of a slab has no jumps.
const TOO_SHORT: &str =
    "single steps instead of jumps: the modes of the stuck slab would take longer than so few steps";
const TOO_LARGE: &str =
    "single steps instead of jumps: the modes of so large a slab would take too much memory";
const NO_MODES: &str =
    "single steps instead of jumps: the stuck slab has no slow modes that doubles can tell";

/// Leaps over the steps of a lattice.
#[derive(Debug, Clone)]
pub(crate) struct LatticeLeaps {
    lattice: Lattice,
    simd: Simd,
    jumps: Jumps,
}

/// Computes the jumps.
#[derive(Debug, Clone)]
enum Jumps {
    /// It is created at the first attempt to jump.
    Unmade,
    Made(Box<Jump>),
    None(&'static str),
}

impl LatticeLeaps {
    /// Computes the modes at the first attempt to jump.
    fn made(&mut self, plan: &Plan) -> Option<&mut Jump> {
        if let Jumps::Unmade = self.jumps {
            let stuck = StuckLattice::of(plan, self.lattice, self.simd);
            let precomputed = stuck.and_then(|stuck| {
                let iterations = iterations(&stuck.lattice);
                Precomputed::of(plan, stuck, iterations)
            });
            self.jumps = match precomputed {
                Some(precomputed) => Jumps::Made(Box::new(Jump::new(Arc::new(precomputed)))),
                None => Jumps::None(NO_MODES),
            };
        }
        match &mut self.jumps {
            Jumps::Made(jump) => Some(jump),
            Jumps::Unmade | Jumps::None(_) => None,
        }
    }

    /// The jump that is open.
    fn opened(&mut self) -> &mut Jump {
        match &mut self.jumps {
            Jumps::Made(jump) => jump,
            Jumps::Unmade | Jumps::None(_) => unreachable!("only a solver with jumps opens one"),
        }
    }
}

impl Leaps for LatticeLeaps {
    type Body = LatticeBody;
    /// Steps of a jump.
    type Leap = u64;

    fn of(plan: &Plan, lattice: &Lattice, simd: Simd) -> LatticeLeaps {
        let jumps = if numbers(lattice) > MOST_NUMBERS {
            Jumps::None(TOO_LARGE)
        } else if RUNS_OF_MODES * modes_steps(lattice) > plan.steps {
            Jumps::None(TOO_SHORT)
        } else {
            Jumps::Unmade
        };
        LatticeLeaps { lattice: *lattice, simd, jumps }
    }

    fn open(&mut self, solver: &mut Open<'_, LatticeBody>, most_steps: u64) -> Result<u64, u64> {
        let state = solver.stepper.state();
        if state.detached > 0 {
            return Err(1);
        }
        let early_steps = solver.pace.no_jump_before_step.saturating_sub(state.step);
        if early_steps > 0 {
            return Err(early_steps);
        }
        let Some(jump) = self.made(solver.plan) else { return Err(1) };
        match jump.open(solver.plan, state, most_steps) {
            Attempt::Jump(steps) => Ok(steps),
            Attempt::Wait(steps) => {
                solver.counters.refused_jumps += 1;
                solver.pace.wait_for_jump(state.step, steps, jump.cost_steps());
                Err(solver.pace.no_jump_before_step - state.step)
            }
        }
    }

    fn steps(&self, steps: u64) -> u64 {
        steps
    }

    fn land(&mut self, steps: u64, solver: &mut Open<'_, LatticeBody>) {
        let jump = self.opened();
        solver.counters.jumps += 1;
        solver.counters.jump_steps += steps;
        let state = solver.stepper.state_mut();
        jump.land(steps, state);
        jump.account(solver.plan, steps, state);
        cost::earn(&mut solver.pace.saved_steps, steps);
        // A jump that is taken is no failed attempt: a shortfall of saved steps need not be made up.
        solver.pace.pay(jump.cost_steps());
    }

    fn steps_of_sample(&self, _: u64) -> u64 {
        STEPS_OF_SAMPLE
    }

    fn sample(&mut self, _: u64, into: u64, _: &Plan, aside: &mut Stepper<LatticeBody>) {
        self.opened().sample(into, aside.state_mut());
    }

    /// From the jump, not from the steps behind the sample.
    fn energy(&mut self, _: u64, into: u64, plan: &Plan, aside: &mut Stepper<LatticeBody>) -> Energy {
        self.opened().account(plan, into, aside.state_mut());
        aside.energy()
    }

    fn fallbacks(&self, _: &Plan) -> Vec<&'static str> {
        match self.jumps {
            Jumps::None(why) => vec![why],
            Jumps::Unmade | Jumps::Made(_) => Vec::new(),
        }
    }
}

/// Steps of Arnoldi's iteration for a slab.
fn iterations(lattice: &Lattice) -> usize {
    MOST_ITERATIONS.min(lattice.freedoms().max(LEAST_ITERATIONS))
}

/// Memory for the factor of a slab's stiffness and the iteration, in numbers.
fn numbers(lattice: &Lattice) -> usize {
    StuckLattice::numbers(lattice) + 3 * iterations(lattice) * lattice.freedoms()
}

/// Cost of finding the modes, in single steps: orthogonalisation, solving, the factor, and the remaining
/// small matrix, which has the same size for all slabs but the smallest.
fn modes_steps(lattice: &Lattice) -> u64 {
    let (iterations, shorter) = (iterations(lattice) as u64, lattice.rows.min(lattice.columns) as u64);
    let small = iterations * iterations * iterations / (4 * lattice.nodes() as u64);
    iterations * iterations / 4 + iterations * shorter + shorter * shorter / 2 + small
}
