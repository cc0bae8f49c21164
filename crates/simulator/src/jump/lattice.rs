//! Jumps of a lattice, by its slow modes ([`crate::slow_modes`]), once the others have died away.
//!
//! A jump assumes that every contact sticks and bears load. The load on the top is part of the outer
//! forces.
//!
//! **Missed.** The norm `sqrt(I)` of the residue that the modes do not span never grows, and the errors of
//! the modes themselves are summed over the jump. A jump is taken once the total is below [`MISSED`] of the
//! thresholds, or at the level of rounding: the fast modes have died away.
//!
//! **Certificate.** A contact stays as it is while `mu_s p_n - |tau_n|` and `p_n` are positive. For the
//! forced part, `tau_n = k_t (u - u_stick)` and `p_n = -k_f u_z` are linear in time. The sizes of the modes
//! fall; so as soon as a stretch is certified, the next begins with smaller ones. Where that is not enough,
//! both ends of a short stretch are evaluated exactly, and between them no value deviates by more than
//! `h^2 / 8` times the sum of the modes' second differences. The residue and the reserves for rounding of
//! [`crate::norms`] must fit in as well. An ageing contact is assumed to be no stronger than at the start
//! of the jump.

use std::sync::Arc;

use asperity_model::Plan;

use crate::clearance::Clearance;
use crate::complex::Complex;
use crate::jump::Forced;
use crate::lattice_energy::stored_j;
use crate::ledger::Ledger;
use crate::modes::Coordinates;
use crate::norms::{ROUNDING, invariant_of_products};
use crate::slow_modes::{Precomputed, sizes};
use crate::state::SliderState;
use crate::strength::{StopForce, static_coefficient};

/// Below this many steps a jump is not worth it.
const SHORTEST: u64 = 256;

/// Steps after which it may be worth trying again.
const PATIENCE_STEPS: u64 = 256;

/// Costs in single steps: of the forced part, besides the nodes along the shorter side, and of projecting
/// a state on one mode.
const STEPS_OF_FORCED: u64 = 10;
const STEPS_OF_MODE: u64 = 2;

/// Limit on the residue of a jump, and likewise on the error of its modes, as a share of the mean
/// threshold: the reserve for rounding.
const MISSED: f64 = ROUNDING;

/// How often a state is projected on the modes.
const ROUNDS: usize = 2;

/// Modes below this share of the largest displacement do not affect a sample.
const NEGLIGIBLE: f64 = 1e-17;

/// Length in steps of a stretch whose ends are evaluated exactly, and the largest number of such stretches.
const STRETCH: u64 = 32;
const MOST_STRETCHES: u64 = 2048;

/// Largest number of orders for the work of the scheme, and the share of it that is negligible.
const MOST_ORDERS: usize = 12;
const NEGLIGIBLE_WORK: f64 = 1e-13;

/// Outcome of an attempt to jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Attempt {
    /// This number of steps is certified.
    Jump(u64),
    /// None; the next attempt is due after this number of steps.
    Wait(u64),
}

/// The jump that is open.
#[derive(Debug, Clone)]
pub(crate) struct Jump {
    precomputed: Arc<Precomputed>,
    forced: Forced,
    coordinates: Coordinates,
    /// Cost of the last attempt, in single steps.
    cost_steps: u64,
    /// Static coefficients at its start.
    coefficients: Vec<f64>,
    /// Energies at its start.
    start: Start,
    u: Vec<f64>,
    w: Vec<f64>,
    stiff: Vec<f64>,
    damped: Vec<f64>,
    scratch: Vec<f64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Start {
    ledger: Ledger,
    here: Worth,
}

/// Energies of a state: kinetic and elastic energy, the function whose differences are the work of the
/// scheme, and the part of it that a ledger leaves to the state.
#[derive(Debug, Clone, Copy, Default)]
struct Worth {
    kinetic_j: f64,
    elastic_j: f64,
    scheme_j: f64,
    ahead_j: f64,
}

/// Sizes of the modes, and bounds on what they and the residue may add at each contact.
struct Swing {
    force_n: Vec<f64>,
    load_n: Vec<f64>,
    drive_n: f64,
}

impl Jump {
    pub(crate) fn new(precomputed: Arc<Precomputed>) -> Jump {
        let freedoms = precomputed.stuck.freedoms();
        let zeros = || vec![0.0; freedoms];
        Jump {
            precomputed,
            forced: Forced::of_freedoms(freedoms),
            coordinates: Coordinates::default(),
            cost_steps: 0,
            coefficients: Vec::new(),
            start: Start::default(),
            u: zeros(),
            w: zeros(),
            stiff: zeros(),
            damped: zeros(),
            scratch: zeros(),
        }
    }

    /// Decomposes a state in which every contact sticks.
    pub(crate) fn open(&mut self, plan: &Plan, state: &SliderState, most_steps: u64) -> Attempt {
        let nodes = self.precomputed.stuck.lattice.nodes();
        let refused = Attempt::Wait(PATIENCE_STEPS);
        let rise_m = &state.displacement_m[nodes..][..plan.blocks];
        self.cost_steps = 0;
        if most_steps < SHORTEST || rise_m.iter().any(|rise_m| *rise_m >= 0.0) {
            return refused;
        }
        let lattice = &self.precomputed.stuck.lattice;
        self.cost_steps = STEPS_OF_FORCED + lattice.rows.min(lattice.columns) as u64;
        self.forced.begin(plan, state);
        self.coefficients.clear();
        self.coefficients.extend((0..plan.blocks).map(|n| static_coefficient(plan, state, n)));
        self.find_forced(plan, state);
        let simd = self.precomputed.stuck.simd;
        let largest = |values: &[f64]| simd.largest(values);
        // If the forced part alone rules out the jump, the modes need not be checked.
        let calm = Swing { force_n: vec![0.0; plan.blocks], load_n: vec![0.0; plan.blocks], drive_n: 0.0 };
        if self.certified(plan, state, 0, &calm, [0.0; 3]) < SHORTEST {
            return refused;
        }
        let (u_scale, v_scale) = (largest(&state.displacement_m), largest(&state.velocity_m_per_s));
        self.cost_steps += STEPS_OF_MODE * self.precomputed.modes.rates.len() as u64;
        let left_out = self.take_apart(state);
        let norms = self.precomputed.norms;
        let mean_n = plan.friction.static_threshold_n.iter().sum::<f64>() / plan.blocks as f64;
        let enough = MISSED * mean_n / norms.force + norms.of_rounding(self.u.len(), u_scale);
        let off = self.off(most_steps);
        let excess = left_out.max(off) / enough;
        if excess > 1.0 {
            // Steps until the modes that are not used have decayed to that level.
            let steps = libm::log(excess) / (0.75 * self.precomputed.modes.next_falls_by);
            let is_told = steps < (1 << 20) as f64;
            return Attempt::Wait(if is_told { (steps as u64).max(PATIENCE_STEPS / 4) } else { 1 << 12 });
        }
        let missed = left_out + off;
        let reach_m = u_scale + largest(&self.forced.advance_m) * most_steps as f64;
        let rounding_n = norms.force_rounding(reach_m, v_scale);
        let reserves = [
            norms.force * missed + rounding_n,
            norms.load * missed + rounding_n,
            norms.drive * missed + rounding_n * plan.drive.springs.len() as f64,
        ];
        let steps = self.march(plan, state, most_steps, reserves);
        if steps < SHORTEST {
            return refused;
        }
        self.start = Start { ledger: state.energy, here: self.worth(plan, state, 0) };
        Attempt::Jump(steps)
    }

    /// Cost of the last attempt, including landing, in single steps.
    pub(crate) fn cost_steps(&self) -> u64 {
        self.cost_steps
    }

    /// `a` and `b`.
    fn find_forced(&mut self, plan: &Plan, state: &SliderState) {
        let Jump { precomputed, forced, stiff, damped, scratch, .. } = self;
        let Forced { position_m, advance_m, moves, ramp, .. } = forced;
        let nodes = precomputed.stuck.lattice.nodes();
        let (drives, loads) = (f64::from(u8::from(*moves)), ramp.change_n(1.0));
        for ((b, drive), load) in
            advance_m.iter_mut().zip(&precomputed.by_drive_m).zip(&precomputed.by_load_m)
        {
            *b = drives * drive + loads * load;
        }
        precomputed.stuck.products(stiff, damped, advance_m, advance_m);
        for (a, damped) in position_m.iter_mut().zip(&*damped) {
            *a = -damped / precomputed.stuck.step_s;
        }
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        for (a, anchor_m) in position_m.iter_mut().zip(&state.stick_position_m) {
            *a += kt * anchor_m;
        }
        let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
        for spring in &plan.drive.springs {
            position_m[spring.block] += spring.force_n(point_m, 0.0);
        }
        for (node, load_n) in precomputed.stuck.lattice.top_row().zip(&plan.top_load_n) {
            position_m[nodes + node] -= ramp.load.scaled_n(*load_n);
        }
        precomputed.stuck.solve(position_m, scratch);
    }

    /// Computes the coordinates of the free part; returns the norm of the residue.
    fn take_apart(&mut self, state: &SliderState) -> f64 {
        let Jump { precomputed, forced, coordinates, u, w, stiff, damped, scratch, .. } = self;
        let (stuck, modes) = (&precomputed.stuck, &precomputed.modes);
        for n in 0..u.len() {
            u[n] = state.displacement_m[n] - forced.position_m[n];
            w[n] = stuck.step_s * state.velocity_m_per_s[n] - forced.advance_m[n];
        }
        coordinates.re.clear();
        coordinates.im.clear();
        coordinates.re.resize(modes.rates.len(), 0.0);
        coordinates.im.resize(modes.rates.len(), 0.0);
        // Slightly inaccurate modes mix slightly: a second pass removes what remains of them.
        let mut found = Coordinates::default();
        for _ in 0..ROUNDS {
            for (scratch, (u, w)) in scratch.iter_mut().zip(u.iter().zip(&*w)) {
                *scratch = u - w;
            }
            stuck.products(stiff, damped, scratch, w);
            modes.project(stuck, w, stiff, &mut found);
            for (own, found) in [(&mut coordinates.re, &mut found.re), (&mut coordinates.im, &mut found.im)] {
                for (own, found) in own.iter_mut().zip(found) {
                    *own += *found;
                    *found = -*found;
                }
            }
            modes.add(stuck, &found, modes.rates.len(), u, w);
        }
        stuck.products(stiff, damped, u, w);
        invariant_of_products((stuck.mass_kg, stuck.step_s), [u, w], [stiff, damped]).sqrt()
    }

    /// The error of the modes, summed over a number of steps.
    fn off(&self, steps: u64) -> f64 {
        let modes = &self.precomputed.modes;
        let sizes = sizes(&self.coordinates);
        let parts = sizes.iter().zip(&modes.off).zip(&modes.rates).map(|((size, off), s)| {
            let falls_by = 1.0 - (Complex::ONE + *s).size();
            size * off * (steps as f64).min(1.0 / falls_by.max(f64::MIN_POSITIVE))
        });
        parts.sum()
    }

    /// The largest number of steps that is certified.
    fn march(&self, plan: &Plan, state: &SliderState, most_steps: u64, reserves: [f64; 3]) -> u64 {
        let (mut steps, mut stretches) = (0, 0);
        while steps < most_steps {
            let coordinates = self.grown(steps);
            let swing = self.swing(plan, &coordinates);
            let certified = self.certified(plan, state, steps, &swing, reserves).min(most_steps);
            if certified >= steps + STRETCH || certified == most_steps {
                steps = certified;
                continue;
            }
            // One stretch with its ends evaluated exactly.
            let to = (steps + STRETCH).min(most_steps);
            stretches += 1;
            if stretches > MOST_STRETCHES || !self.stays(plan, state, [steps, to], &coordinates, reserves) {
                break;
            }
            steps = to;
        }
        steps
    }

    fn grown(&self, steps: u64) -> Coordinates {
        let mut coordinates = self.coordinates.clone();
        coordinates.grow_by(&self.precomputed.modes.powers.growth(steps));
        coordinates
    }

    /// How much the modes may add from there on.
    fn swing(&self, plan: &Plan, coordinates: &Coordinates) -> Swing {
        let Precomputed { most_force_n, most_load_n, drive_n, .. } = &*self.precomputed;
        let contacts = plan.blocks;
        let mut swing = Swing { force_n: vec![0.0; contacts], load_n: vec![0.0; contacts], drive_n: 0.0 };
        for (mode, size) in sizes(coordinates).into_iter().enumerate() {
            let row = mode * contacts..(mode + 1) * contacts;
            for (n, (force, load)) in most_force_n[row.clone()].iter().zip(&most_load_n[row]).enumerate() {
                swing.force_n[n] += size * force;
                swing.load_n[n] += size * load;
            }
            swing.drive_n += size * drive_n[mode].size();
        }
        swing
    }

    /// Steps from the start of the jump for which this swing neither switches a contact nor stops the
    /// drive, provided that the state at `from` is certified; otherwise `from`.
    fn certified(
        &self,
        plan: &Plan,
        state: &SliderState,
        from: u64,
        swing: &Swing,
        reserves: [f64; 3],
    ) -> u64 {
        let [of_force, of_load, of_drive] = reserves;
        let mut clearance = Clearance::ENDLESS;
        for n in 0..plan.blocks {
            let (force, rate) = self.forced.friction_n(plan, state, n, from as f64);
            let (load, load_rate) = self.forced_load_n(n, from as f64);
            let mu = self.coefficients[n];
            let bears = load - swing.load_n[n] - of_load;
            let room = mu * bears * (1.0 - ROUNDING) - swing.force_n[n] - of_force;
            let stays = clearance.stays_above(bears, -load_rate)
                && clearance.stays_between(force, rate, room, -mu * load_rate);
            if !stays {
                return from;
            }
        }
        let swing = [swing.drive_n, of_drive];
        if !self.forced.stays_below_stop(plan, from as f64, swing, &mut clearance) {
            return from;
        }
        from.saturating_add(clearance.steps())
    }

    /// Normal load of a contact in the forced part `into` steps after the first, and its change in a step.
    fn forced_load_n(&self, contact: usize, into: f64) -> (f64, f64) {
        let lattice = &self.precomputed.stuck.lattice;
        let (kf, z) = (lattice.foundation_n_per_m, lattice.nodes() + contact);
        let rate = -kf * self.forced.advance_m[z];
        (-kf * self.forced.position_m[z] + into * rate, rate)
    }

    /// Whether nothing switches on a short stretch, with the modes at both ends of it.
    fn stays(
        &self,
        plan: &Plan,
        state: &SliderState,
        [from, to]: [u64; 2],
        coordinates: &Coordinates,
        [of_force, of_load, of_drive]: [f64; 3],
    ) -> bool {
        let Precomputed { modes, force_n, load_n, most_force_n, most_load_n, drive_n, .. } =
            &*self.precomputed;
        let contacts = plan.blocks;
        let ends = [coordinates.clone(), self.grown(to)];
        let bend = (to - from) as f64 * (to - from) as f64 / 8.0;
        let bends: Vec<f64> = sizes(coordinates)
            .iter()
            .zip(&modes.rates)
            .map(|(size, s)| bend * size * (s.re * s.re + s.im * s.im))
            .collect();
        let part = |of: &Complex, c: &Coordinates, mode: usize| of.re * c.re[mode] - of.im * c.im[mode];
        let are_clear = (0..contacts).all(|n| {
            let (mut forces, mut loads, mut bent) = ([0.0; 2], [0.0; 2], [of_force, of_load]);
            for (mode, more) in bends.iter().enumerate() {
                let at = mode * contacts + n;
                for (end, c) in ends.iter().enumerate() {
                    forces[end] += part(&force_n[at], c, mode);
                    loads[end] += part(&load_n[at], c, mode);
                }
                bent[0] += more * most_force_n[at];
                bent[1] += more * most_load_n[at];
            }
            [from, to].into_iter().enumerate().all(|(end, into)| {
                let (force, _) = self.forced.friction_n(plan, state, n, into as f64);
                let (load, _) = self.forced_load_n(n, into as f64);
                let bears = load + loads[end] - bent[1];
                let room = self.coefficients[n] * bears * (1.0 - ROUNDING) - bent[0];
                bears > 0.0 && (force + forces[end]).abs() < room
            })
        });
        let Some(stop) = StopForce::of(plan, state.hold_step) else { return are_clear };
        let bent: f64 = bends.iter().zip(drive_n).map(|(bend, drive)| bend * drive.size()).sum();
        are_clear
            && [from, to].into_iter().zip(&ends).all(|(into, c)| {
                let swing: f64 = (0..drive_n.len()).map(|mode| part(&drive_n[mode], c, mode)).sum();
                let (force, _) = self.forced.drive_n(plan, into as f64);
                let goal = stop.under_n(self.forced.ramp.ahead(into as f64)) * (1.0 - ROUNDING);
                force + swing + bent + of_drive < goal
            })
    }

    /// Writes the state after `into` steps of the jump, without forces.
    pub(crate) fn land(&mut self, into: u64, state: &mut SliderState) {
        let modes = self.precomputed.modes.rates.len();
        let coordinates = self.grown(into);
        self.compose(into, &coordinates, modes, state);
    }

    /// Writes the state for a sample, without modes that change nothing.
    pub(crate) fn sample(&mut self, into: u64, state: &mut SliderState) {
        let coordinates = self.grown(into);
        let least = NEGLIGIBLE * self.precomputed.stuck.simd.largest(&self.forced.position_m);
        let last = sizes(&coordinates).iter().rposition(|size| *size > least);
        self.compose(into, &coordinates, last.map_or(0, |last| last + 1), state);
    }

    fn compose(&mut self, into: u64, coordinates: &Coordinates, modes: usize, state: &mut SliderState) {
        let Jump { precomputed, forced, u, w, .. } = self;
        u.fill(0.0);
        w.copy_from_slice(&forced.advance_m);
        precomputed.modes.add(&precomputed.stuck, coordinates, modes, u, w);
        for (velocity_m_per_s, w) in state.velocity_m_per_s.iter_mut().zip(&*w) {
            *velocity_m_per_s = w / precomputed.stuck.step_s;
        }
        forced.write(into, u, state);
    }

    /// Brings the ledger of a state up to `into` steps of the jump, the step of the state.
    ///
    /// The work of drive and load are geometric sums over the steps. The work of the scheme is a difference
    /// of [`Worth`], and the viscous loss is the remainder of the balance.
    pub(crate) fn account(&mut self, plan: &Plan, into: u64, state: &mut SliderState) {
        let Start { mut ledger, here: start } = self.start;
        let here = self.worth(plan, state, into);
        let (drive_j, load_j) = (self.drive_work_j(plan, into), self.load_work_j(plan, into));
        let scheme_j = here.scheme_j - start.scheme_j;
        let stored_j = (here.kinetic_j - start.kinetic_j) + (here.elastic_j - start.elastic_j);
        ledger.drive_work_j.add(drive_j);
        ledger.load_work_j.add(load_j);
        ledger.viscous_loss_j.add((drive_j + load_j) + scheme_j - stored_j);
        ledger.scheme_work_j.add(scheme_j + (here.ahead_j - start.ahead_j));
        state.energy = ledger;
    }

    /// `sum z^i` of each mode over the steps of `growth`, times its effect.
    fn summed(&self, growth: &Coordinates, of: &[Complex]) -> f64 {
        let rates = self.precomputed.modes.rates.iter();
        let parts = rates.zip(of).enumerate().map(|(mode, (s, of))| {
            let c = Complex { re: self.coordinates.re[mode], im: self.coordinates.im[mode] };
            let grown = Complex { re: growth.re[mode], im: growth.im[mode] };
            (c * *of * grown / *s).re
        });
        parts.sum()
    }

    fn drive_work_j(&self, plan: &Plan, into: u64) -> f64 {
        let Forced { position_m, from_step, hold_step, .. } = &self.forced;
        let moving = into.min(hold_step.saturating_sub(*from_step));
        let advance_m = plan.drive.velocity_m_per_s * self.precomputed.stuck.step_s;
        if moving == 0 || advance_m == 0.0 {
            return 0.0;
        }
        // If the point stops within the jump, it does so in the first step.
        let count = moving as f64;
        let growth = self.precomputed.modes.powers.growth(moving);
        let point_m = plan.drive_point_m(from_step + 1, u64::MAX) - 0.5 * advance_m;
        let force = plan.drive.total_force_n(point_m, position_m);
        let rate = self.forced.drive_rate_n(plan);
        advance_m
            * (count * (force + 0.5 * (count - 1.0) * rate) + self.summed(&growth, &self.precomputed.drive_n))
    }

    /// `-sum L_j (U_j - U_{j - 1})` with `U = sum F_n u_z` and `L` the load over that of the start,
    /// linear in time.
    fn load_work_j(&self, plan: &Plan, into: u64) -> f64 {
        let Precomputed { stuck, modes, pressed_j, .. } = &*self.precomputed;
        let nodes = stuck.lattice.nodes();
        let count = into as f64;
        let (first, rate) = (self.forced.ramp.load.scaled_n(1.0), self.forced.ramp.change_n(1.0));
        let parts = stuck.lattice.top_row().zip(&plan.top_load_n);
        let advance_j: f64 = parts.map(|(node, load_n)| load_n * self.forced.advance_m[nodes + node]).sum();
        let mut work_j = advance_j * (count * first + rate * (count * (count - 1.0) / 2.0));
        let growth = modes.powers.growth(into);
        for (mode, (&s, &pressed)) in modes.rates.iter().zip(pressed_j).enumerate() {
            let c = Complex { re: self.coordinates.re[mode], im: self.coordinates.im[mode] };
            let grown = Complex { re: growth.re[mode], im: growth.im[mode] };
            // `sum_{j=1}^k s z^(j-1) = z^k - 1`, and with `j - 1` before it `k z^k - z (z^k - 1) / s`.
            let rising = (Complex::ONE + grown).scaled(count) - (Complex::ONE + s) * grown / s;
            work_j += (c * pressed * (grown.scaled(first) + rising.scaled(rate))).re;
        }
        -work_j
    }

    /// As [`crate::energy`] derives the work of the scheme, for any stiffness and damping.
    fn worth(&mut self, plan: &Plan, state: &SliderState, into: u64) -> Worth {
        let Forced { moves, hold_step, ramp, .. } = self.forced;
        let Jump { precomputed, stiff, damped, scratch, u: du, w: dv, .. } = self;
        let stuck = &precomputed.stuck;
        let (dt, mass, nodes) = (stuck.step_s, stuck.mass_kg, stuck.lattice.nodes());
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let simd = stuck.simd;
        let product = |a: &[f64], b: &[f64]| {
            let mut product = [0.0];
            simd.dots(&mut product, a, b);
            product[0]
        };
        let (kinetic_j, elastic_j) = stored_j(plan, &stuck.lattice, state);
        // The outer forces of the next step, as if the jump continued.
        let hold_step = if moves { u64::MAX } else { hold_step };
        let point_m = plan.drive_point_m(state.step + 1, hold_step);
        let advance_m = if moves { plan.drive.velocity_m_per_s * dt } else { 0.0 };
        let (load, load_change) = (ramp.ahead(into as f64), ramp.change_n(1.0));
        simd.lattice_pull(stiff, damped, u, v, &stuck.lattice);
        let ahead_j = 0.5 * dt * product(stiff, v);
        // `g x`.
        let steady_j = |x: &[f64]| {
            let springs = plan.drive.springs.iter();
            let drive: f64 = springs
                .map(|spring| spring.stiffness_n_per_m * spring.direction * advance_m * x[spring.block])
                .sum();
            let parts = stuck.lattice.top_row().zip(&plan.top_load_n);
            let pressed: f64 = parts.map(|(node, load_n)| load_n * x[nodes + node]).sum();
            drive - load_change * pressed
        };
        let loss = -product(damped, v);
        // `D v` and `D u`.
        let by_force = dt / mass;
        for ((dv, stiff), damped) in dv.iter_mut().zip(&*stiff).zip(&*damped) {
            *dv = stiff + damped;
        }
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        for n in 0..plan.blocks {
            dv[n] -= kt * (u[n] - state.stick_position_m[n]);
            dv[nodes + n] -= stuck.lattice.foundation_n_per_m * u[nodes + n];
        }
        for spring in &plan.drive.springs {
            dv[spring.block] += spring.force_n(point_m, u[spring.block]);
        }
        for (node, load_n) in stuck.lattice.top_row().zip(&plan.top_load_n) {
            dv[nodes + node] -= load.scaled_n(*load_n);
        }
        for n in 0..dv.len() {
            dv[n] *= by_force;
            du[n] = dt * (v[n] + dv[n]);
        }
        let mut scheme_j = -0.5 * mass * product(v, dv) - 0.25 * dt * loss + 0.5 * steady_j(u);
        let mut share = 0.25;
        for order in 1..=MOST_ORDERS {
            stuck.products(stiff, damped, du, dv);
            let square = product(dv, dv);
            let (strain_j, loss) = (0.5 * product(du, stiff), product(dv, damped));
            let steady = if order == 1 { steady_j(du) } else { 0.0 };
            // The differences of the next order.
            for n in 0..dv.len() {
                scratch[n] = -by_force * (stiff[n] + damped[n]);
            }
            if order == 1 {
                for spring in &plan.drive.springs {
                    scratch[spring.block] +=
                        by_force * (spring.stiffness_n_per_m * spring.direction * advance_m);
                }
                for (node, load_n) in stuck.lattice.top_row().zip(&plan.top_load_n) {
                    scratch[nodes + node] -= by_force * (load_change * load_n);
                }
            }
            let mixed = product(dv, scratch);
            let part = share * (steady - 0.5 * mass * (square + mixed) - strain_j - 0.75 * dt * loss);
            scheme_j -= part;
            if part.abs() <= NEGLIGIBLE_WORK * scheme_j.abs() {
                break;
            }
            share *= 0.25;
            for n in 0..dv.len() {
                du[n] = dt * (dv[n] + scratch[n]);
            }
            dv.copy_from_slice(scratch);
        }
        Worth { kinetic_j, elastic_j, scheme_j, ahead_j }
    }
}
