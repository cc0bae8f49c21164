//! The leaps of a lattice: jumps while all contacts are stuck.
//!
//! It takes single steps while any contact slides, and afterwards until the fast modes have died away. Then
//! it jumps ([`crate::leap::jump`]) by the slow modes (`modes/slow_modes/arnoldi.rs`, found with the
//! factor of the stiffness, `modes/slow_modes/stuck.rs`) of the stuck lattice as far as is certified.

use asperity_model::{Lattice, Plan};

use crate::leap::cost;
use crate::leap::fast::{Leaps, Open};
use crate::leap::jump::{Jump, lattice};
use crate::modes::slow_modes::{StuckLattice, SystemSizes};
use crate::records::stop::Stop;
use crate::step::body::{LatticeBody, OfPlan};
use crate::step::single_step::SingleSteps;
use crate::step::stepper::Stepper;
use crate::step::strength::age;

/// Fewest and most steps of Arnoldi's iteration, if there are as many modes: a quarter to a half of them end as
/// modes and their conjugates.
const LEAST_ITERATIONS: usize = 80;
const MOST_ITERATIONS: usize = 200;
const MOST_ITERATIONS_OF_BODY: usize = 300;
const MOST_ITERATIONS_OF_SHEET: usize = 400;

/// By how many iterations fewer are tried where a run is too short for the most.
const ITERATIONS_LESS: usize = 20;

/// Modes are computed if that costs at most this fraction of a run's steps: one in eight.
const RUNS_OF_MODES: u64 = 8;

/// Most memory that the factors of a stiffness and the iteration may take, in numbers: 1 GB for a slab, 1.5 GB
/// over an area.
const MOST_NUMBERS: [usize; 2] = [1 << 27, 3 << 26];

/// Why a run has no jumps.
const TOO_SHORT: &str =
    "single steps instead of jumps: the modes of the stuck slider would take longer than so few steps";
const TOO_LARGE: &str =
    "single steps instead of jumps: the modes of so large a slider would take too much memory";
const NO_MODES: &str =
    "single steps instead of jumps: the stuck slider has no modes that last and that doubles can tell";

/// Leaps over the steps of a lattice whose contacts have `D` tangential freedoms.
#[derive(Debug)]
pub(crate) struct LatticeLeaps<const D: usize = 1> {
    /// Steps of Arnoldi's iteration for each class of motions.
    iterations: usize,
    /// Made at the first attempt to jump; or why there are none.
    jumps: Option<Result<Jump<D>, &'static str>>,
}

impl<const D: usize> LatticeLeaps<D> {
    /// Computes the modes at the first attempt to jump; `None` if there are none, or the stop comes.
    fn made(&mut self, plan: &Plan, stop: &Stop<'_>) -> Option<&mut Jump<D>> {
        if self.jumps.is_none() {
            let jump = lattice::jump(plan, self.iterations, stop);
            if stop.has_come() {
                return None;
            }
            self.jumps = Some(jump.ok_or(NO_MODES));
        }
        self.jump()
    }

    fn jump(&mut self) -> Option<&mut Jump<D>> {
        self.jumps.as_mut()?.as_mut().ok()
    }

    /// The jump that is open.
    fn opened(&mut self) -> &mut Jump<D> {
        self.jump().expect("only a solver with jumps opens one")
    }
}

impl<const D: usize> Leaps for LatticeLeaps<D>
where
    LatticeBody<D>: OfPlan<Elastic = Lattice>,
{
    type Body = LatticeBody<D>;
    type Leap = ();

    fn of(plan: &Plan, elastic: &Lattice) -> LatticeLeaps<D> {
        let effort = Effort::of(plan, elastic);
        let jumps = if effort.numbers > MOST_NUMBERS[D - 1] {
            Some(Err(TOO_LARGE))
        } else if RUNS_OF_MODES * effort.steps > plan.steps {
            Some(Err(TOO_SHORT))
        } else {
            None
        };
        LatticeLeaps { iterations: effort.iterations, jumps }
    }

    fn open(&mut self, solver: &mut Open<'_, LatticeBody<D>>, most_steps: u64) -> Result<((), u64), u64> {
        age(solver.plan, solver.stepper.state_mut());
        let state = solver.stepper.state();
        if state.detached > 0 {
            return Err(1);
        }
        let early_steps = solver.pace.no_jump_before_step.saturating_sub(state.step);
        if early_steps > 0 {
            return Err(early_steps);
        }
        let Some(jump) = self.made(solver.plan, solver.stop) else { return Err(1) };
        match jump.open(solver.plan, state, most_steps, solver.stop) {
            _ if solver.stop.has_come() => Err(1),
            Ok(steps) => Ok(((), steps)),
            Err(steps) => {
                solver.counters.refused_jumps += 1;
                solver.pace.wait_for_jump(state.step, steps, jump.cost_steps);
                Err(solver.pace.no_jump_before_step - state.step)
            }
        }
    }

    fn land(&mut self, (): (), steps: u64, solver: &mut Open<'_, LatticeBody<D>>) {
        let jump = self.opened();
        solver.counters.jumps += 1;
        solver.counters.jump_steps += steps;
        jump.land(solver.plan, steps, solver.stepper.state_mut());
        cost::earn(&mut solver.pace.saved_steps, steps);
        // A jump that is taken is no failed attempt: a shortfall of saved steps need not be made up.
        solver.pace.pay(jump.cost_steps);
    }

    fn steps_of_sample(&self, (): ()) -> u64 {
        self.jumps.iter().flatten().map(Jump::steps_of_sample).sum()
    }

    fn sample(&mut self, (): (), into: u64, plan: &Plan, sampler: &mut Stepper<LatticeBody<D>>) {
        self.opened().sample(plan, into, sampler.state_mut());
    }

    fn fallbacks(&self, _: &Plan) -> Vec<&'static str> {
        match self.jumps {
            Some(Err(why)) => vec![why],
            _ => Vec::new(),
        }
    }
}

/// What finding the modes takes.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Steps of Arnoldi's iteration for each class of motions.
    iterations: usize,
    /// Cost in single steps.
    steps: u64,
    /// Memory in numbers.
    numbers: usize,
}

impl Effort {
    fn of(plan: &Plan, lattice: &Lattice) -> Effort {
        if lattice.lanes == 1 {
            return Effort::of_slab(lattice);
        }
        let sizes = SystemSizes::of(plan, lattice);
        let most = match lattice.table.upward() {
            Some(_) => MOST_ITERATIONS_OF_BODY,
            None => MOST_ITERATIONS_OF_SHEET,
        };
        // As many as the run pays for.
        let pays = |effort: &Effort| RUNS_OF_MODES * effort.steps <= plan.steps;
        let fewer = (LEAST_ITERATIONS..=most).rev().step_by(ITERATIONS_LESS);
        let mut efforts = fewer.map(|iterations| Effort::over_area(lattice, &sizes, iterations));
        efforts.find(pays).unwrap_or_else(|| Effort::over_area(lattice, &sizes, LEAST_ITERATIONS))
    }

    /// Operations over those of a step, from measurements of sheets of 150 to 600 nodes and bodies of 2,000 to
    /// 16,000.
    fn over_area(lattice: &Lattice, sizes: &SystemSizes, iterations: usize) -> Effort {
        let &SystemSizes { classes, freedoms, factors, width } = sizes;
        // There are no more.
        let iterations = iterations.min(2 * freedoms);
        let (nodes, count) = (lattice.nodes() as u64, iterations as u64);
        let factored = lattice.freedoms() * width / 2;
        let of_factor = (factored * width) as u64 / (200 * nodes);
        let of_solution = (factored * factors) as u64 / (16 * nodes) + 1;
        let of_class = count * of_solution
            + count * count * freedoms as u64 / (16 * nodes)
            + count * count * count / (2 * nodes);
        Effort {
            iterations,
            steps: classes as u64 * (of_factor * factors as u64 + of_class),
            numbers: classes * (factored * factors + 3 * iterations * freedoms),
        }
    }

    /// Orthogonalisation, solving, the factor, and the remaining small matrix, which has the same size for all
    /// slabs but the smallest.
    fn of_slab(lattice: &Lattice) -> Effort {
        let iterations = MOST_ITERATIONS.min(lattice.freedoms().max(LEAST_ITERATIONS));
        let numbers = StuckLattice::numbers(lattice) + 3 * iterations * lattice.freedoms();
        let (count, shorter) = (iterations as u64, lattice.rows.min(lattice.columns) as u64);
        let small = count * count * count / (4 * lattice.nodes() as u64);
        let steps = count * count / 4 + count * shorter + shorter * shorter / 2 + small;
        Effort { iterations, steps, numbers }
    }
}
