//! The leaps of a chain: windows while some blocks slide ([`crate::leap::window`]), jumps while all are stuck
//! ([`crate::leap::jump::chain`]), and rests where stuck blocks do not move ([`crate::leap::rest`]).

use asperity_model::Plan;
use asperity_model::body::elastic::Chain;
use asperity_model::body::ends::absorbing_kg_per_s;

use crate::leap::cost::{self, Costs, LONG_CHAIN};
use crate::leap::fast::{Leaps, Open};
use crate::leap::jump::{Jump, chain};
use crate::leap::rest::{rest, rest_steps};
use crate::leap::window::Window;
use crate::step::body::{Body, ChainBody};
use crate::step::single_step::SingleSteps;
use crate::step::stepper::Stepper;
use crate::step::strength::age;

/// Single steps of a long chain without windows between attempts to jump.
const LOOK_ROUND_STEPS: u64 = 32;

/// Why a run with absorbing ends has no windows.
const ABSORBING: &str = "single steps while any block slides: they alone tell what absorbing ends radiate from what dampers between blocks lose";

/// Many certified steps, still to be taken.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Leap {
    Jump,
    /// Nothing moves.
    Rest,
    /// By the index of the window's length.
    Window(usize),
}

/// Leaps over the steps of a chain.
#[derive(Debug)]
pub(crate) struct ChainLeaps {
    window: Window,
    /// For chains whose modes are known.
    jump: Option<Jump<1>>,
    costs: Costs,
}

impl ChainLeaps {
    /// Number of single steps to take, where no window pays, before the next check. While no switch is
    /// near, the energies treat them as one span.
    fn single_steps_of_long_chain(&mut self, solver: &mut Open<'_, ChainBody>) -> u64 {
        let (body, state) = solver.stepper.body_mut();
        let accounts = body.accounts_mut();
        let is_stuck = state.detached == 0;
        let steps_to_jump = solver.pace.no_jump_before_step.saturating_sub(state.step).max(1);
        let needs_span = !accounts.by_steps() && state.energy.span.is_none();
        if is_stuck && needs_span && self.window.foresee(solver.plan, state) > cost::STEPS_WORTH_A_SPAN {
            let next_step = state.step + 1;
            accounts.begin(solver.plan, state, next_step);
            self.pay_for_spans(solver);
        }
        if is_stuck && self.jump.is_some() { LOOK_ROUND_STEPS.min(steps_to_jump) } else { LOOK_ROUND_STEPS }
    }

    /// Begins a span of the energies no later than a leap; it lasts to the end of the leap.
    fn begin_span(&mut self, solver: &mut Open<'_, ChainBody>, steps: u64) {
        let (body, state) = solver.stepper.body_mut();
        let until_step = state.step + steps;
        body.accounts_mut().begin(solver.plan, state, until_step);
        self.pay_for_spans(solver);
    }

    /// Goes on by some steps of a leap, to its end or for a sample, and adds the energies of the steps.
    fn advance(
        &mut self,
        leap: Leap,
        steps: u64,
        lands: bool,
        plan: &Plan,
        stepper: &mut Stepper<ChainBody>,
    ) {
        let (body, state) = stepper.body_mut();
        let accounts = body.accounts_mut();
        match leap {
            Leap::Window(_) => self.window.advance(plan, steps, state, accounts),
            Leap::Jump if lands => opened(&mut self.jump).land(plan, steps, state),
            Leap::Jump => opened(&mut self.jump).sample(plan, steps, state),
            Leap::Rest => rest(plan, steps, state),
        }
        if accounts.by_steps() {
            accounts.end(plan, state);
        }
    }

    fn pay_for_spans(&mut self, solver: &mut Open<'_, ChainBody>) {
        let cost_steps = self.take_cost_steps(solver.stepper);
        solver.pace.pay_or_pause(cost_steps);
    }
}

/// The jump that a leap was opened with.
fn opened(jump: &mut Option<Jump<1>>) -> &mut Jump<1> {
    jump.as_mut().expect("only a solver with jumps opens one")
}

impl Leaps for ChainLeaps {
    type Body = ChainBody;
    type Leap = Leap;

    fn of(plan: &Plan, elastic: &Chain) -> ChainLeaps {
        ChainLeaps {
            window: Window::new(plan, elastic),
            jump: if chain::may_pay(plan) { chain::jump(plan, elastic) } else { None },
            costs: Costs::of(plan),
        }
    }

    fn open(&mut self, solver: &mut Open<'_, ChainBody>, most_steps: u64) -> Result<(Leap, u64), u64> {
        let plan = solver.plan;
        age(plan, solver.stepper.state_mut());
        let state = solver.stepper.state();
        if plan.friction.law.holds() && state.detached == 0 {
            let steps = rest_steps(plan, state).min(most_steps);
            if steps == 0 {
                solver.pace.pay_or_pause(cost::REST_STEPS);
                return Err(1);
            }
            return Ok((Leap::Rest, steps));
        }
        if let Some(jump) = &mut self.jump
            && state.detached == 0
            && state.step >= solver.pace.no_jump_before_step
        {
            match jump.open(plan, state, most_steps, solver.stop) {
                Ok(steps) => {
                    self.begin_span(solver, steps);
                    return Ok((Leap::Jump, steps));
                }
                Err(patience_steps) => {
                    solver.counters.refused_jumps += 1;
                    solver.pace.wait_for_jump(state.step, patience_steps, jump.cost_steps);
                }
            }
        }
        if self.window.never_pays {
            return Err(self.single_steps_of_long_chain(solver));
        }
        match self.window.open(plan, solver.stepper.state(), most_steps) {
            Ok(index) => {
                let steps = self.window.steps(index);
                self.begin_span(solver, steps);
                Ok((Leap::Window(index), steps))
            }
            Err(single_steps) => {
                solver.counters.refused_windows += 1;
                solver.pace.pay_or_pause(self.costs.window_steps(self.window.work()));
                Err(single_steps)
            }
        }
    }

    fn land(&mut self, leap: Leap, steps: u64, solver: &mut Open<'_, ChainBody>) {
        let Open { plan, stepper, pace, counters, .. } = solver;
        let (leaps, leap_steps) = match leap {
            Leap::Window(_) => (&mut counters.windows, &mut counters.window_steps),
            Leap::Jump | Leap::Rest => (&mut counters.jumps, &mut counters.jump_steps),
        };
        *leaps += 1;
        *leap_steps += steps;
        cost::earn(&mut pace.saved_steps, steps);
        pace.pay_or_pause(match leap {
            Leap::Window(_) => self.costs.window_steps(self.window.work()),
            Leap::Jump => opened(&mut self.jump).cost_steps,
            Leap::Rest => cost::REST_STEPS,
        });
        if let Leap::Window(index) = leap
            && self.window.ends_near_switch(index)
        {
            // This one, and one to foresee from.
            pace.take_singly(2);
        }
        self.advance(leap, steps, true, plan, stepper);
    }

    fn steps_of_sample(&self, leap: Leap) -> u64 {
        match leap {
            Leap::Window(_) => self.costs.window_sample_steps(self.window.work()),
            Leap::Jump => self.jump.as_ref().map_or(0, Jump::steps_of_sample),
            Leap::Rest => 0,
        }
    }

    fn sample(&mut self, leap: Leap, into: u64, plan: &Plan, sampler: &mut Stepper<ChainBody>) {
        let (body, state) = sampler.body_mut();
        body.follow(plan, state);
        self.advance(leap, into, false, plan, sampler);
    }

    /// Adds steps one by one where they are too few to pay for the ends of a span.
    fn go_on(&mut self, steps: u64, plan: &Plan, sampler: &mut Stepper<ChainBody>) -> u64 {
        let (body, state) = sampler.body_mut();
        let accounts = body.accounts_mut();
        if !accounts.adds_so_few(steps) {
            return 0;
        }
        accounts.end(plan, state);
        u64::MAX
    }

    /// Extrapolating two steps without a switch costs a fraction of opening a window in vain; if no switch
    /// is foreseen, the cost is added to that of the window tried next.
    fn foresee(&self, plan: &Plan, stepper: &Stepper<ChainBody>) -> (u64, u64) {
        let foreseen_steps = stepper.body().foreseen_steps(plan, stepper.state());
        self.window.refused_by(foreseen_steps).map_or((0, 0), |steps| (steps, cost::FORESIGHT_STEPS))
    }

    fn take_cost_steps(&mut self, stepper: &mut Stepper<ChainBody>) -> u64 {
        stepper.body_mut().0.accounts_mut().take_cost_steps()
    }

    fn applications(&self) -> u64 {
        self.window.applications()
    }

    fn fallbacks(&self, plan: &Plan) -> Vec<&'static str> {
        let law = plan.friction.law;
        let mut fallbacks = Vec::new();
        if law.affine().is_none() {
            fallbacks.push(
                "single steps while any block slides: friction that depends on velocity, or on the pull at rest, has no windows; at rest the run jumps all the same",
            );
        }
        let (bonds, damped) = (&plan.end_bonds, plan.elastic.damping_kg_per_s > 0.0);
        let absorbs = absorbing_kg_per_s(bonds) > 0.0;
        if absorbs && damped && law.affine().is_some() {
            fallbacks.push(ABSORBING);
        }
        if law.affine().is_some() && law.radiation_kg_per_s() > 0.0 && damped {
            fallbacks.push(
                "single steps while any block slides: windows would not tell what is radiated from what dampers between blocks lose",
            );
        }
        if law.holds() {
            // A chain that rests needs no modes to jump.
            return fallbacks;
        }
        if !chain::may_pay(plan) {
            fallbacks.push(
                "windows instead of jumps: the modes of the stuck chain would take longer than so few steps",
            );
            return fallbacks;
        }
        if self.jump.is_none() {
            fallbacks.push(if bonds.iter().any(|bond| bond.other.is_some()) {
                "windows instead of jumps: no modes are computed of a chain whose ends are joined"
            } else if !bonds.is_empty() && plan.blocks > LONG_CHAIN {
                "windows instead of jumps: the waves of so long a chain are known for free ends"
            } else {
                "windows instead of jumps: the stuck chain has no full set of modes, or none that doubles can tell apart (critical damping, very soft friction springs)"
            });
        }
        let is_too_long = !(damped && (absorbs || law.radiation_kg_per_s() > 0.0));
        if law.affine().is_some() && is_too_long && self.window.shortest() == u64::MAX {
            fallbacks.push("single steps instead of windows: the time step is too long for them");
        }
        fallbacks
    }
}
