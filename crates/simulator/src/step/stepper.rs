//! The stepper: one step after the other, as the equations of Chapter 5 read, for any body and
//! contact law. Both solvers take their single steps with it.
//!
//! Nodes move, contacts rub. One step from `t - dt` to `t`, everything from the old state:
//!
//! 1. the tangential force on a contact without friction: of a chain (5.6, 5.7, 5.8)
//!    `tau_n = k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1}) + F_n`, of a lattice the
//!    pull of its bonds and dashpots ([`asperity_model::body::lattice`]); with the drive at the new time, the
//!    nodes at their old positions, the bonds at the ends of a chain and the constant prestress if any;
//! 2. friction, by the contact's law: the spring of a stuck contact pulls with
//!    `-k_t (u_n - u_stick,n)` (5.12), a sliding one resists with `-mu_d p_n sign(v_n)` (5.14),
//!    or more as it weakens by slip;
//! 3. Euler-Cromer (4.13, 4.14): `v_n += dt (tau_n + f_n) / m`, then `u_n += dt v_n`;
//! 4. switches, in force from the next step: a stuck contact detaches at `|tau_n| >= mu_s p_n` (5.13), or
//!    where the law says so at `k_t |u_n - u_stick,n| >= mu_s p_n`, with the old position; a
//!    sliding one whose new velocity has come to rest re-attaches at `u_stick,n = u_n - tau_n / k_t`
//!    (5.15), with the new position, this step's `tau_n`, and its velocity kept. Under a law without
//!    friction springs it stays at rest, at its position before the step that would have reversed it.
//!
//! Over an area positions, forces and anchors of contacts are vectors (docs/bodies.md).
//!
//! For `mu_s p_n` and `mu_d p_n` in a step see [`crate::step::strength`]. A [`Body`] does 1 to 3 for all of its
//! freedoms at once.

use std::sync::Arc;

use asperity_model::plan::outside::{Driving, Outside};
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use crate::energy::Bookkeeping;
use crate::records::counters::Counters;
use crate::step::body::{Body, OfPlan};
use crate::step::single_step::SingleSteps;
use crate::step::strength::{self, StopForce};

/// A slider, and how it gets from one step to the next.
#[derive(Debug, Clone)]
pub(crate) struct Stepper<B> {
    plan: Arc<Plan>,
    state: SliderState,
    body: B,
    /// The contacts that may switch, as bits.
    marks: Vec<u64>,
    /// The contacts that switched in the last step, counted from 0, ascending.
    switched: Vec<usize>,
    counters: Counters,
}

impl<B: OfPlan> Stepper<B> {
    /// The slider at the start of a plan, with kernels for a certain instruction set.
    pub(crate) fn new(plan: Arc<Plan>, elastic: &B::Elastic, keeping: Bookkeeping) -> Stepper<B> {
        let mut state = plan.initial.clone();
        let mut body = B::of_plan(&plan, elastic, &state, keeping);
        if plan.given.is_some() {
            body.begin_in(&plan, &mut state);
        }
        Stepper::of(plan, state, body)
    }
}

impl<B: Body> Stepper<B> {
    /// A body in a state.
    pub(crate) fn of(plan: Arc<Plan>, state: SliderState, body: B) -> Stepper<B> {
        Stepper {
            body,
            marks: vec![0; plan.blocks.div_ceil(64)],
            switched: Vec::new(),
            counters: Counters::default(),
            state,
            plan,
        }
    }

    /// The state, for a solver that takes many steps at once.
    pub(crate) fn state_mut(&mut self) -> &mut SliderState {
        &mut self.state
    }

    /// The body, and the state whose energies it tracks.
    pub(crate) fn body_mut(&mut self) -> (&mut B, &mut SliderState) {
        (&mut self.body, &mut self.state)
    }

    /// The body.
    pub(crate) fn body(&self) -> &B {
        &self.body
    }

    /// Puts the switches of this step in force for the next.
    fn switch_contacts(&mut self) {
        let Stepper { plan, state, body, marks, switched, .. } = self;
        body.mark_switches(plan, state, marks);
        // Energy of the friction springs that attach, less that of those that detach.
        let mut anchored_j = 0.0;
        for (group, mark) in marks.iter().enumerate() {
            let mut mark = *mark;
            while mark != 0 {
                let n = group * 64 + mark.trailing_zeros() as usize;
                mark &= mark - 1;
                if state.junctions.is_some() {
                    let detaches = state.slip[n] == 0.0;
                    state.slip[n] = if detaches { 1.0 } else { 0.0 };
                    state.detached = if detaches { state.detached + 1 } else { state.detached - 1 };
                } else if state.slip[n] != 0.0 {
                    re_attach(plan, state, body, n);
                    anchored_j += held_j(plan, state, n);
                } else {
                    // The strength of a contact that ages may be behind.
                    let strength_n = strength::aged_up_to_now_n(plan, state, n);
                    if strength_n
                        .is_some_and(|strength_n| body.detaching_force_n(plan, state, n) < strength_n)
                    {
                        continue;
                    }
                    anchored_j -= held_j(plan, state, n);
                    state.slip[n] = 1.0;
                    state.detached += 1;
                    if state.tangential_force_n.len() > plan.blocks {
                        state.just_detached.push(n as u32);
                    }
                }
                switched.push(n);
            }
        }
        if !switched.is_empty() {
            state.energy.anchor_change_j.add(anchored_j);
        }
    }
}

/// Passes the forces from outside on to a body, with the drive at the new time and the nodes at their old positions.
fn pull<B: Body>(body: &mut B, state: &mut SliderState, outside: Outside<'_>) -> Driving {
    let at = [&state.displacement_m[..], &state.velocity_m_per_s];
    let driving = outside.pull(at, |node, pull_n| body.add_force(node, pull_n));
    body.add_drive(state, driving.along_n, outside.moved_m());
    driving
}

/// Energy of the friction spring of contact `n`.
fn held_j(plan: &Plan, state: &SliderState, n: usize) -> f64 {
    let kt = plan.friction.springs_n_per_m[n];
    let part_j = |(place, freedom): (usize, usize)| {
        let stretch_m = state.displacement_m[freedom] - state.stick_position_m[place];
        0.5 * kt * stretch_m * stretch_m
    };
    tangential(plan, state, n).map(part_j).sum()
}

/// Indices of the tangential components of contact `n`, by axis: in arrays over contacts and in arrays over
/// freedoms.
fn tangential(plan: &Plan, state: &SliderState, n: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (contacts, nodes) = (plan.blocks, plan.elastic.nodes());
    (0..state.stick_position_m.len() / contacts).map(move |axis| (axis * contacts + n, axis * nodes + n))
}

/// Puts a sliding contact back on its friction spring, or at rest.
fn re_attach<B: Body>(plan: &Plan, state: &mut SliderState, body: &B, n: usize) {
    state.slip[n] = 0.0;
    state.detached -= 1;
    for (place, freedom) in tangential(plan, state, n) {
        if plan.friction.law.holds() {
            state.velocity_m_per_s[freedom] = 0.0;
            state.displacement_m[freedom] = body.former_displacement_m(freedom);
            state.stick_position_m[place] = state.displacement_m[freedom];
        } else {
            let stretch_m = state.tangential_force_n[place] / plan.friction.springs_n_per_m[n];
            state.stick_position_m[place] = state.displacement_m[freedom] - stretch_m;
        }
    }
    strength::reset_age(plan, state, n);
}

impl<B: Body> SingleSteps for Stepper<B> {
    fn state(&self) -> &SliderState {
        &self.state
    }

    fn switched(&self) -> &[usize] {
        &self.switched
    }

    fn energy(&mut self) -> Energy {
        self.body.energy(&self.plan, &self.state)
    }

    fn initial_j(&self) -> f64 {
        self.body.initial_j()
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn take_step(&mut self, steps_ahead: u64) -> Driving {
        let Stepper { plan, state, body, .. } = self;
        let hold_step = state.hold_step;
        body.begin_step(plan, state, steps_ahead);
        state.step += 1;
        state.sliding = state.detached;
        let outside = plan.outside(state.step, state.hold_step);
        body.apply_load(plan, state, outside);
        let driving = pull(body, state, outside);
        let may_switch = body.advance(plan, state);
        // Under a law without friction springs, contacts stop within this step.
        let holds = plan.friction.law.holds();
        if !holds {
            body.add_step(plan, state, outside);
        }
        state.just_detached.clear();
        self.switched.clear();
        if may_switch {
            self.switch_contacts();
        }
        let Stepper { plan, state, body, .. } = self;
        if holds {
            body.add_step(plan, state, plan.outside(state.step, state.hold_step));
        }
        self.counters.plain_steps += 1;
        self.counters.switches += self.switched.len() as u64;
        let in_air = state.normal_load_n.iter().filter(|load_n| **load_n == 0.0).count();
        self.counters.contact_steps_in_air += in_air as u64;
        if !state.memory.is_empty() {
            body.remember(plan, state, &self.switched);
        }
        let stop = StopForce::of(plan, state.hold_step);
        let total = || plan.outside(state.step, state.hold_step).total_load();
        if stop.is_some_and(|stop| driving.total_n >= stop.under_n(total())) {
            state.hold_step = state.step;
        }
        let is_last = !self.switched.is_empty() || state.hold_step != hold_step;
        body.end_step(plan, state, is_last);
        driving
    }

    fn restore(&mut self, state: &SliderState) {
        let freedoms = self.state.displacement_m.len();
        assert_eq!(state.displacement_m.len(), freedoms, "the state of a slider of another size");
        self.state = state.clone();
        self.switched.clear();
        self.body.follow(&self.plan, &self.state);
    }
}
