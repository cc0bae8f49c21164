//! Energies: accounts for the work of the drive, computed alongside the steps.
//!
//! A step goes from `u, v` to `u' = u + w`, `v' = v + d` with `w = dt v'` and `m d = dt F`, where `F`
//! are the forces of the step, taken at the old nodes. Each force does the work `F_n w_n`, split as
//! follows:
//!
//! - *drive work* `dX sum_n (K_n (X - u_n) - K_n dX / 2)`, the point `X` of the step moved by `dX`
//!   from that of the step before, the nodes fixed;
//! - *prestress work* `P w`; *friction heat* `f w` over the sliding contacts, without the part `E v` of `f`
//!   that radiates, and of it *fracture energy*, by what contacts that weaken by slip rub more than `mu_d p`; *radiated energy* `E v w` over them and `Z v w` of the dashpots of absorbing ends; *viscous loss*
//!   `v C w`, with the dampers of the other ends;
//! - *anchor change*: energy of friction springs at re-attachment, less their energy at detachment;
//! - *scheme work* `w M w / 2 - m d d / 2`, with `M` the stiffness of chain, ends, drive and friction springs:
//!   the error of the scheme, whose springs keep their initial pull for the whole step, and whose
//!   velocities change at its beginning.
//!
//! The balance of these and the changes of kinetic and elastic energy is an identity. The plain solver
//! adds all terms in every step ([`StepWork`](crate::kernels)).
//!
//! **Spans.** The fast solver does not take every step. In a *span* of steps nothing switches, and the
//! outer forces `G` (drive, prestress, anchors, sliding friction) change by the same `g` in every step.
//! The heat is then `f` times the displacement, summed by parts where the load changes. With `D v` the
//! difference of `v` between a step and the next, the work of the scheme from the state `a` to the state
//! `b` is `S(b) - S(a)`,
//!
//! ```text
//! S = -m/2 v Dv - dt/4 v C v + g u / 2 - (R_1 + R_2 / 4 + R_3 / 16 + ...) / 4,
//! R_p = [p = 1] g D u - m/2 |D^p v|^2 - D^p u M D^p u / 2 - m/2 D^p v D^(p+1) v - 3 dt/4 D^p v C D^p v.
//! ```
//!
//! All but the last term follows from `m D v = dt (G - M u - C v)` by summation by parts; what remains is
//! `-dt/4` times the sum of `Dv C Dv`. Differences obey the same scheme with the force `g`, so that sum is
//! their own viscous loss, which follows from their own balance up to that of the second differences, and
//! so on. Orders decrease as `(dt w)^2 / 4` with `w` the highest rate of the chain: [`Accounts`] uses
//! enough of them to omit at most [`NEGLIGIBLE`] of the viscous loss. The viscous loss itself follows from
//! the balance. Radiation is part of `C`, as `E` on the diagonal of sliding blocks, so what follows is the sum
//! of both losses: the radiated energy where there are no dampers between blocks. The same holds for the dashpots of
//! absorbing ends. Where there are dampers, spans and
//! windows would leave the two apart undetermined, and there are none ([`Radiated::Apart`]). The work of the drive needs
//! sums, over the steps, of the displacements of the driven blocks, which windows and jumps have in closed form.

pub(crate) mod instability_stop;
pub(crate) mod lattice_energy;

use asperity_model::body::elastic::Chain;
use asperity_model::body::ends::absorbing_kg_per_s;
use asperity_model::plan::load::Ramp;
use asperity_model::{Ledger, Plan, SliderState, Span};
use asperity_record::Energy;

use crate::kernels::{self, Changing, Forms, Held, StepWork};
use crate::leap::cost::span_steps;

/// Share of the viscous loss that the orders of a span may leave out of the scheme's work.
const NEGLIGIBLE: f64 = 1e-10;

/// Most orders that cost less than adding up single steps.
const MOST_ORDERS: usize = 4;

/// Most orders in any case, for steps so long that orders hardly decrease.
const LAST_ORDER: usize = 40;

/// A remainder of the balance below this share of its terms is rounding.
const ROUNDING: f64 = 1e-13;

/// How the work of single steps is added up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bookkeeping {
    /// All terms in every step.
    EveryStep,
    /// By spans where they pay; the viscous loss follows from the balance.
    Spans,
}

/// How a fast run knows the energy that it radiates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Radiated {
    /// There is none.
    None,
    /// It is all that is lost, and follows from the balance.
    Rest,
    /// Step by step; the viscous loss follows from the balance.
    Apart,
}

impl Radiated {
    pub(crate) fn of(plan: &Plan, chain: &Chain) -> Radiated {
        let radiates =
            plan.friction.law.radiation_kg_per_s() > 0.0 || absorbing_kg_per_s(&plan.end_bonds) > 0.0;
        match (radiates, chain.damping_kg_per_s > 0.0) {
            (false, _) => Radiated::None,
            (true, false) => Radiated::Rest,
            (true, true) => Radiated::Apart,
        }
    }
}

/// Keeps the ledger of a state.
#[derive(Debug, Clone)]
pub(crate) struct Accounts {
    chain: Chain,
    /// Whether single steps add their terms one by one.
    by_steps: bool,
    /// Whether the viscous loss, or the radiated energy, follows from the balance.
    balances: bool,
    /// Whether there are dampers between blocks, or to a wall or around the end.
    has_dampers: bool,
    radiated: Radiated,
    orders: usize,
    /// Cost of spans since [`Accounts::take_cost_steps`] was last called.
    cost_steps: u64,
    /// The stiffness of all driving springs together.
    driving_n_per_m: f64,
    initial_kinetic_j: f64,
    initial_elastic_j: f64,
    map: Map,
    force_n: Vec<f64>,
    zeros: Vec<f64>,
    /// Differences of the state of one order, and of the next: displacements and velocities.
    now: [Vec<f64>; 2],
    next: [Vec<f64>; 2],
}

/// Quantities that are constant in the open span.
#[derive(Debug, Clone)]
struct Map {
    from_step: u64,
    /// The last step that it may include.
    until_step: u64,
    /// The step in which the drive point stops, as known in the first.
    hold_step: u64,
    ramp: Ramp,
    /// Sign of the velocity of each sliding block, 0 for stuck ones.
    sigma: Vec<f64>,
    /// `k_t` of stuck blocks, 0 for sliding ones.
    spring: Vec<f64>,
    /// Sliding friction in the next step.
    drag_n: Vec<f64>,
    slides: bool,
    /// Whether each sliding block moves in the direction in which it will keep sliding.
    is_directed: bool,
}

impl Accounts {
    pub(crate) fn new(plan: &Plan, chain: Chain, state: &SliderState, keeping: Bookkeeping) -> Accounts {
        let orders = orders(plan);
        let zeros = || vec![0.0; plan.blocks];
        let mut accounts = Accounts {
            chain,
            by_steps: keeping == Bookkeeping::EveryStep
                || plan.friction.law.holds()
                || plan.friction.weakens()
                || plan.friction.law.junctions().is_some()
                || Radiated::of(plan, &chain) == Radiated::Apart
                || plan.drive.course.is_some()
                || plan.has_contact_courses()
                || orders > MOST_ORDERS,
            balances: keeping == Bookkeeping::Spans,
            has_dampers: chain.damping_kg_per_s > 0.0 && plan.blocks > 1,
            radiated: Radiated::of(plan, &chain),
            orders,
            cost_steps: 0,
            driving_n_per_m: plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum(),
            initial_kinetic_j: 0.0,
            initial_elastic_j: 0.0,
            map: Map {
                from_step: 0,
                until_step: 0,
                hold_step: u64::MAX,
                ramp: Ramp::FLAT,
                sigma: zeros(),
                spring: zeros(),
                drag_n: plan.friction.dynamic_friction_n.clone(),
                slides: false,
                is_directed: true,
            },
            force_n: zeros(),
            zeros: zeros(),
            now: [zeros(), zeros()],
            next: [zeros(), zeros()],
        };
        (accounts.initial_kinetic_j, accounts.initial_elastic_j) = accounts.stored_j(plan, state);
        accounts
    }

    /// Whether single steps add their terms one by one, with spans for leaps only.
    pub(crate) fn by_steps(&self) -> bool {
        self.by_steps
    }

    /// Returns the cost of the spans that ended since the last call.
    pub(crate) fn take_cost_steps(&mut self) -> u64 {
        std::mem::take(&mut self.cost_steps)
    }

    /// Whether to add single steps one by one rather than begin a span, when at least `steps_ahead` single
    /// steps follow and blocks may switch in some of them.
    pub(crate) fn adds_single_steps(&self, state: &SliderState, steps_ahead: u64) -> bool {
        self.by_steps || (state.energy.span.is_none() && !self.adds_so_few(steps_ahead))
    }

    /// Whether this number of single steps costs no more than both ends of a span.
    pub(crate) fn adds_so_few(&self, steps: u64) -> bool {
        steps <= span_steps(self.orders)
    }

    /// Continues the open span in a state that was not reached by the last step.
    pub(crate) fn follow(&mut self, plan: &Plan, state: &SliderState) {
        if let Some(span) = state.energy.span {
            self.set_map(plan, state, span.from_step);
        }
    }

    /// Ensures that a span up to `until_step` is open.
    pub(crate) fn begin(&mut self, plan: &Plan, state: &mut SliderState, until_step: u64) {
        if state.energy.span.is_some() {
            if until_step <= self.map.until_step {
                return;
            }
            self.end(plan, state);
        }
        self.set_map(plan, state, state.step);
        state.energy.span = Some(self.potential(plan, state));
    }

    /// Closes the span that is open.
    pub(crate) fn end(&mut self, plan: &Plan, state: &mut SliderState) {
        let Some(span) = state.energy.span else { return };
        self.cost_steps += span_steps(self.orders);
        let here = self.potential(plan, state);
        let ledger = &mut state.energy;
        ledger.friction_heat_j.add(here.heat_j - span.heat_j);
        ledger.scheme_work_j.add(here.scheme_j - span.scheme_j);
        ledger.span = None;
    }

    /// After a single step in a span: closes it if the step was the last of it.
    pub(crate) fn end_single_step(&mut self, plan: &Plan, state: &mut SliderState, is_last: bool) {
        self.correct_heat(plan, &mut state.energy, &state.displacement_m, 1.0);
        if is_last || !self.map.is_directed {
            self.end(plan, state);
        }
    }

    /// Adds the terms of a single step, given the contacts that slid in it and the velocities before and after
    /// it: those computed by the kernels, and the energy of the driving springs.
    pub(crate) fn add_step(
        &self,
        plan: &Plan,
        ledger: &mut Ledger,
        work: &StepWork,
        slip: &[f64],
        [before, after]: [&[f64]; 2],
    ) {
        let dt = plan.grid.step_s();
        let (mut viscous_w, mut absorbed_w, mut ends) = (work.dampers_w, 0.0, 0.0);
        for bond in &plan.end_bonds {
            *if bond.radiates { &mut absorbed_w } else { &mut viscous_w } += bond.loss_w(before, after);
            ends += bond.half_form(after);
        }
        let mut heat_w = work.friction_w;
        if self.radiated != Radiated::None {
            let radiated_w =
                plan.friction.law.radiation_kg_per_s() * kernels::sliding_product(slip, before, after);
            heat_w -= radiated_w;
            let radiated_w = radiated_w + absorbed_w;
            if !self.balances || self.radiated == Radiated::Apart {
                ledger.radiated_j.add(dt * radiated_w);
            }
        }
        ledger.friction_heat_j.add(dt * heat_w);
        if !self.balances {
            ledger.viscous_loss_j.add(dt * viscous_w);
        }
        ledger.scheme_work_j.add(work.scheme_j + dt * dt * (plan.drive.half_form(after) + ends));
    }

    /// Adds the work of the drive point in a single step, from its pull along its way.
    #[inline]
    pub(crate) fn add_drive_step(&self, ledger: &mut Ledger, along_n: f64, moved_m: f64) {
        if moved_m != 0.0 {
            ledger.drive_work_j.add(moved_m * (along_n - 0.5 * moved_m * self.driving_n_per_m));
        }
    }

    /// Adds the work of the drive over the `steps` steps after `from_step`. `sum_m` gives the sum of a
    /// block's displacements over as many states, the first that of `from_step`; `first_m` gives the
    /// first displacement.
    pub(crate) fn add_drive(
        plan: &Plan,
        state: &mut SliderState,
        from_step: u64,
        steps: u64,
        sum_m: impl Fn(usize) -> f64,
        first_m: impl Fn(usize) -> f64,
    ) {
        let moving = steps.min(state.hold_step.saturating_sub(from_step));
        let outside = plan.outside(from_step + 1, u64::MAX);
        let advance_m = outside.advance_m();
        if moving == 0 || advance_m == 0.0 {
            return;
        }
        let count = moving as f64;
        // Sum over the midpoints of the point's way in each step.
        let points_m = count * (outside.point_m + 0.5 * advance_m * (count - 2.0));
        let mut force_n = 0.0;
        for spring in &plan.drive.springs {
            // If the point stops within the span, it does so in the first step.
            let nodes_m = if moving == steps { sum_m(spring.block) } else { count * first_m(spring.block) };
            force_n +=
                spring.stiffness_n_per_m * (points_m - spring.direction * (nodes_m - count * spring.rest_m));
        }
        state.energy.drive_work_j.add(advance_m * force_n);
    }

    /// Corrects the heat for the change of the load in each step. `displacement_m` is the sum of
    /// displacements after each step.
    pub(crate) fn correct_heat(&self, plan: &Plan, ledger: &mut Ledger, displacement_m: &[f64], times: f64) {
        if self.corrects_heat() {
            let friction_n = &plan.friction.dynamic_friction_n;
            let way_j = kernels::directed(&self.map.sigma, friction_n, displacement_m);
            ledger.friction_heat_j.add(-times * self.map.ramp.change_n(way_j));
        }
    }

    /// Whether heat needs the sum of displacements over all steps: contacts slide while the load
    /// changes.
    pub(crate) fn corrects_heat(&self) -> bool {
        self.map.slides && !self.map.ramp.is_flat()
    }

    /// All energies at the end of the last step.
    pub(crate) fn energy(&mut self, plan: &Plan, state: &SliderState) -> Energy {
        let ledger = state.energy;
        let (mut heat_j, mut scheme_j) = (ledger.friction_heat_j.value(), ledger.scheme_work_j.value());
        if let Some(span) = ledger.span {
            let here = self.potential(plan, state);
            heat_j += here.heat_j - span.heat_j;
            scheme_j += here.scheme_j - span.scheme_j;
        }
        let (kinetic_j, elastic_j) = self.stored_j(plan, state);
        let mut energy = Energy {
            drive_work_j: ledger.drive_work_j.value(),
            prestress_work_j: match plan.prestress_course {
                Some(_) => ledger.load_work_j.value(),
                None => {
                    let ways = state.displacement_m.iter().zip(&plan.initial.displacement_m);
                    let parts = plan.prestress_n.iter().zip(ways);
                    parts.fold(0.0, |sum, (force, (u, initial))| sum + force * (u - initial))
                }
            },
            friction_heat_j: heat_j,
            anchor_change_j: ledger.anchor_change_j.value(),
            viscous_loss_j: ledger.viscous_loss_j.value(),
            kinetic_j,
            elastic_j,
            scheme_work_j: scheme_j,
            radiated_j: (self.radiated != Radiated::None).then(|| ledger.radiated_j.value()),
            fracture_energy_j: plan.friction.weakens().then(|| ledger.fracture_energy_j.value()),
        };
        if self.balances {
            self.balance(&mut energy);
        }
        energy
    }

    /// Sets the viscous loss, or the radiated energy, to the remainder of the balance, and to 0 where that is rounding.
    /// Without any damper the loss stays as it is counted, 0.
    fn balance(&self, energy: &mut Energy) {
        if self.radiated != Radiated::Rest && !self.has_dampers {
            return;
        }
        let terms_j = [
            energy.drive_work_j + energy.prestress_work_j,
            energy.anchor_change_j + energy.scheme_work_j,
            -(energy.friction_heat_j + energy.radiated_j.unwrap_or(0.0)),
            -(energy.kinetic_j - self.initial_kinetic_j),
            -(energy.elastic_j - self.initial_elastic_j),
        ];
        let rest_j = terms_j.iter().sum::<f64>();
        let size_j = terms_j.iter().map(|term_j| term_j.abs()).sum::<f64>();
        let lost_j = if rest_j.abs() <= ROUNDING * size_j { 0.0 } else { rest_j };
        match self.radiated {
            Radiated::Rest => energy.radiated_j = Some(lost_j),
            Radiated::None | Radiated::Apart => energy.viscous_loss_j = lost_j,
        }
    }

    /// Energy at the start.
    pub(crate) fn initial_j(&self) -> f64 {
        self.initial_kinetic_j + self.initial_elastic_j
    }

    /// Kinetic and elastic energy of a state after a step.
    fn stored_j(&self, plan: &Plan, state: &SliderState) -> (f64, f64) {
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let kt = if state.junctions.is_some() { &self.zeros } else { &plan.friction.springs_n_per_m };
        let [square, elastic_j] =
            kernels::stored(&self.chain, u, v, &state.stick_position_m, &state.slip, kt);
        let drive_j: f64 = plan.outside(state.step, state.hold_step).springs_j(u).sum();
        let junctions = state.junctions.iter();
        let held_j: f64 = junctions
            .map(|junctions| (0..plan.blocks).map(|n| junctions.energy_j(plan, n, u[n])).sum::<f64>())
            .sum();
        let ends_j: f64 = plan.end_bonds.iter().map(|bond| bond.energy_j(u)).sum();
        (0.5 * plan.block_mass_kg * square, elastic_j + held_j + (drive_j + ends_j))
    }

    fn set_map(&mut self, plan: &Plan, state: &SliderState, from_step: u64) {
        let one_way = plan.friction.law.affine().is_some_and(|form| form.forward_only);
        let map = &mut self.map;
        map.from_step = from_step;
        map.hold_step = state.hold_step;
        let outside = plan.outside(from_step + 1, map.hold_step);
        map.until_step = outside.steady_until_step();
        map.ramp = outside.ramp();
        map.slides = state.detached > 0;
        map.is_directed = kernels::classify(
            &mut map.sigma,
            &mut map.spring,
            &state.velocity_m_per_s,
            &state.slip,
            &plan.friction.springs_n_per_m,
            one_way,
        );
    }

    /// The functions of the state whose differences over the span are heat and scheme work.
    fn potential(&mut self, plan: &Plan, state: &SliderState) -> Span {
        let Accounts { chain, map, force_n, zeros, now, next, orders, .. } = self;
        let radiation = plan.friction.law.radiation_kg_per_s();
        let radiated_w = |v: &[f64], sigma: &[f64]| match radiation > 0.0 {
            true => radiation * kernels::sliding_product(sigma, v, v),
            false => 0.0,
        };
        let (dt, mass) = (plan.grid.step_s(), plan.block_mass_kg);
        let dt_over_m = dt / mass;
        let rigid = plan.friction.law.holds();
        let friction_n = &plan.friction.dynamic_friction_n;
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let load = map.ramp.ahead((state.step - map.from_step) as f64);
        if !plan.load_course.is_constant() {
            for (drag, friction) in map.drag_n.iter_mut().zip(friction_n) {
                *drag = load.scaled_n(*friction);
            }
        }
        // The next step, as if the span continued.
        let outside = plan.outside(map.from_step + 1, map.hold_step);
        let advance_m = outside.advance_m();
        let difference = |force_n: &mut [f64], held: &Held<'_>, [d_u, d_v]: [&mut Vec<f64>; 2]| {
            if radiation > 0.0 {
                kernels::radiate(force_n, held.v, held.sigma, radiation);
            }
            kernels::first_difference(d_u, d_v, force_n, held);
            if rigid {
                hold_stuck(held.sigma, [d_u, d_v]);
            }
        };
        kernels::pull(force_n, u, v, chain);
        outside.continued(state.step - map.from_step).add_n(force_n, [u, v]);
        let held = Held {
            u,
            v,
            anchor: &state.stick_position_m,
            drag: &map.drag_n,
            spring: &map.spring,
            sigma: &map.sigma,
            dt,
            dt_over_m,
        };
        let [d_u, d_v] = now;
        difference(force_n, &held, [d_u, d_v]);
        // `g x`.
        let steady_j = |x: &[f64]| {
            let drive: f64 = plan
                .drive
                .springs
                .iter()
                .map(|spring| spring.force_n(advance_m, 0.0) * x[spring.block])
                .sum();
            let load = match map.slides && !map.ramp.is_flat() {
                true => map.ramp.change_n(kernels::directed(&map.sigma, friction_n, x)),
                false => 0.0,
            };
            drive - load
        };
        let Forms { mixed, loss, .. } = kernels::forms(&Changing { chain, u, v, d_v, spring: &map.spring });
        let at_ends_w = |v: &[f64]| plan.end_bonds.iter().map(|bond| bond.loss_w(v, v)).sum::<f64>();
        let loss = loss + radiated_w(v, &map.sigma) + at_ends_w(v);
        let mut scheme_j = -0.5 * mass * mixed - 0.25 * dt * loss + 0.5 * steady_j(u);
        let mut share = 0.25;
        for order in 1..=*orders {
            let [d_u, d_v] = &*now;
            let advance_m = if order == 1 { advance_m } else { 0.0 };
            kernels::pull(force_n, d_u, d_v, chain);
            plan.add_change_n(force_n, [d_u, d_v], advance_m);
            if order == 1 && map.slides && !map.ramp.is_flat() {
                for ((force, friction), sigma) in force_n.iter_mut().zip(friction_n).zip(&map.sigma) {
                    *force -= map.ramp.change_n(*friction) * sigma;
                }
            }
            let held = Held { u: d_u, v: d_v, anchor: zeros, drag: zeros, ..held };
            let [next_u, next_v] = next;
            difference(force_n, &held, [next_u, next_v]);
            let Forms { square, mixed, loss, elastic: strain_j } =
                kernels::forms(&Changing { chain, u: d_u, v: d_v, d_v: next_v, spring: &map.spring });
            let loss = loss + radiated_w(d_v, &map.sigma) + at_ends_w(d_v);
            let strain_j = strain_j + plan.end_bonds.iter().map(|bond| bond.half_form(d_u)).sum::<f64>();
            let drive_j = plan.drive.half_form(d_u);
            let steady = if order == 1 { steady_j(d_u) } else { 0.0 };
            scheme_j -=
                share * (steady - 0.5 * mass * (square + mixed) - strain_j - drive_j - 0.75 * dt * loss);
            share *= 0.25;
            std::mem::swap(now, next);
        }
        let heat_j = match map.slides {
            true => load.scaled_n(kernels::directed(&map.sigma, friction_n, u)),
            false => 0.0,
        };
        Span { from_step: state.step, heat_j, scheme_j }
    }
}

/// Stops stuck contacts, for the laws without friction springs.
pub(crate) fn hold_stuck(sigma: &[f64], [u, v]: [&mut [f64]; 2]) {
    for (sigma, (u, v)) in sigma.iter().zip(u.iter_mut().zip(v)) {
        if *sigma == 0.0 {
            (*u, *v) = (0.0, 0.0);
        }
    }
}

/// Number of orders beyond which terms are negligible: a difference of the chain's fastest mode is at
/// most `max(dt w, 4 eta dt / m + (dt w)^2)` of it, with `w` its frequency.
fn orders(plan: &Plan) -> usize {
    let (elastic, dt, mass) = (&plan.elastic, plan.grid.step_s(), plan.block_mass_kg);
    let stiffest = elastic.spectral_bound_n_per_m()
        + plan.friction.stiffest_spring_n_per_m()
        + plan.drive.stiffest_n_per_m();
    let square = dt * dt * stiffest / mass;
    let damped = square
        + dt * elastic.damping_spectral_bound_kg_per_s() / mass
        + dt * plan.friction.law.radiation_kg_per_s() / mass
        + dt * absorbing_kg_per_s(&plan.end_bonds) / mass;
    let falls = 0.25 * square.max(damped * damped);
    let mut left_out = falls * falls;
    let mut orders = 1;
    while left_out > NEGLIGIBLE && orders < LAST_ORDER {
        left_out *= falls;
        orders += 1;
    }
    orders
}
