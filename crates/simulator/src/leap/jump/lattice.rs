//! Jumps of a lattice, by its slow modes ([`crate::modes::slow_modes`]), once the others have died away.
//!
//! A jump assumes that every contact sticks and bears load. The load on the top is part of the outer
//! forces.
//!
//! **Missed.** The norm `sqrt(I)` of the residue that the modes do not span never grows, and the errors of
//! the modes themselves are summed over the jump. A jump is taken once the total is below [`MISSED`] of the
//! thresholds, or at the level of rounding: the fast modes have died away.
//!
//! **Classes.** Even and odd motions have modes of their own. Those of odd ones are found and used only if the
//! state has an odd part at all, to the bit; where drive and contacts are mirror images of themselves, it never
//! has.
//!
//! How long a jump may be: [`super::certificate`]. Its energies: [`account`].

mod account;

use std::sync::Arc;

use asperity_model::Plan;

use crate::kernels;
use crate::leap::jump::Forced;
use crate::leap::jump::certificate::{Certificate, Part};
use crate::leap::jump::lattice::account::Start;
use crate::leap::norms::{ROUNDING, invariant_of_products};
use crate::modes::Coordinates;
use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::{Precomputed, pressed};
use crate::records::stop::Stop;
use crate::step::state::SliderState;
use crate::step::strength::static_coefficient;

/// Below this many steps a jump is not worth it.
const SHORTEST: u64 = 256;

/// Steps after which it may be worth trying again.
const PATIENCE_STEPS: u64 = 256;

/// Steps after which it is tried again where the modes cannot be found.
const WITHOUT_MODES_STEPS: u64 = 1 << 40;

/// Decay of the residue over that of the slowest mode that it has, as the next attempt assumes: of a slab, and over
/// an area, where the modes that are found are those that decay last.
const DECAY: [f64; 2] = [0.75, 1.0];

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

/// The jump that is open.
#[derive(Debug, Clone)]
pub(crate) struct Jump<const D: usize> {
    precomputed: Arc<Precomputed<D>>,
    forced: Forced,
    parts: Vec<Part<D>>,
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

impl<const D: usize> Jump<D> {
    pub(crate) fn new(precomputed: Arc<Precomputed<D>>) -> Jump<D> {
        let lattice = &precomputed.stuck.lattice;
        let (nodes, axes) = (lattice.nodes(), lattice.axes());
        let zeros = || vec![0.0; axes * nodes];
        Jump {
            precomputed,
            forced: Forced::of_nodes(nodes, axes),
            parts: Vec::new(),
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

    /// Decomposes a state in which every contact sticks, and returns the number of steps that is certified; if none
    /// is, the number after which the next attempt is due. Without meaning once the stop has come.
    pub(crate) fn open(
        &mut self,
        plan: &Plan,
        state: &SliderState,
        most_steps: u64,
        stop: &Stop<'_>,
    ) -> Result<u64, u64> {
        let refused = Err(PATIENCE_STEPS);
        let lattice = self.precomputed.stuck.lattice;
        let are_lifted = lattice.first_normal().is_some_and(|normal| {
            state.displacement_m[normal..][..plan.blocks].iter().any(|rise_m| *rise_m >= 0.0)
        });
        self.cost_steps = 0;
        if most_steps < SHORTEST || are_lifted {
            return refused;
        }
        self.cost_steps = STEPS_OF_FORCED + lattice.rows.min(lattice.columns) as u64;
        self.forced.begin(plan, state);
        self.coefficients.clear();
        self.coefficients.extend((0..plan.blocks).map(|n| static_coefficient(plan, state, n)));
        self.parts.clear();
        if !self.find_forced(plan, state, stop) {
            return Err(WITHOUT_MODES_STEPS);
        }
        // If the forced part alone rules out the jump, the modes need not be checked.
        if self.certificate(plan, state, [0.0; 3]).of_forced() < SHORTEST {
            return refused;
        }
        let (u_scale, v_scale) =
            (kernels::largest(&state.displacement_m), kernels::largest(&state.velocity_m_per_s));
        let precomputed = Arc::clone(&self.precomputed);
        let arrays = [&state.displacement_m[..], &state.velocity_m_per_s, &self.forced.position_m];
        for class in precomputed.classes_of(arrays).collect::<Vec<usize>>() {
            let Some(modes) = precomputed.modes(plan, class, stop) else {
                return Err(WITHOUT_MODES_STEPS);
            };
            self.cost_steps += STEPS_OF_MODE * modes.slow.rates.len() as u64;
            self.parts.push(Part { modes, coordinates: Coordinates::default() });
        }
        let left_out = self.take_apart(state);
        let norms = self.precomputed.norms;
        let mean_n = plan.friction.static_threshold_n.iter().sum::<f64>() / plan.blocks as f64;
        let enough = MISSED * mean_n / norms.force + norms.of_rounding(self.u.len(), u_scale);
        let off_after = |steps: u64| self.parts.iter().map(|part| off(part, steps)).sum::<f64>();
        let (mut most_steps, mut off) = (most_steps, off_after(most_steps));
        // The swing of a sheet hardly decays, and its error grows with the length of the jump.
        while lattice.first_normal().is_none() && off > enough && most_steps > SHORTEST {
            most_steps /= 2;
            off = off_after(most_steps);
        }
        let excess = left_out.max(off) / enough;
        if excess > 1.0 {
            // Steps until the modes that are not used have decayed to that level.
            let rates = self.parts.iter().map(|part| part.modes.slow.next_falls_by);
            let rate = DECAY[D - 1] * rates.fold(f64::INFINITY, f64::min);
            let steps = if D == 1 || left_out > enough { libm::log(excess) / rate } else { 0.0 };
            let is_told = steps < (1 << 20) as f64;
            let steps = if is_told { (steps as u64).max(PATIENCE_STEPS / 4) } else { 1 << 12 };
            return Err(if D == 1 { steps } else { self.until_exact(most_steps, enough, steps) });
        }
        let missed = left_out + off;
        let reach_m = u_scale + kernels::largest(&self.forced.advance_m) * most_steps as f64;
        let rounding_n = norms.force_rounding(reach_m, v_scale);
        let reserves = [
            norms.force * missed + rounding_n * (D as f64).sqrt(),
            norms.load * missed + rounding_n,
            norms.drive * missed + rounding_n * plan.drive.springs.len() as f64,
        ];
        let steps = self.certificate(plan, state, reserves).march(most_steps);
        if steps < SHORTEST {
            return refused;
        }
        self.start = self.energies_at_start(plan, state);
        Ok(steps)
    }

    /// Steps, at least as many as given and hardly more than the most, until the error of the modes over the most
    /// steps is small enough: it falls as they do.
    fn until_exact(&self, most_steps: u64, enough: f64, least_steps: u64) -> u64 {
        let off_behind = |steps: u64| {
            let parts = self.parts.iter().map(|part| {
                let fallen = part.grown(steps);
                off(&Part { modes: Arc::clone(&part.modes), coordinates: fallen }, most_steps)
            });
            parts.sum::<f64>()
        };
        let mut steps = least_steps;
        while steps < most_steps && off_behind(steps) > enough {
            steps += steps / 8;
        }
        steps
    }

    /// Cost of the last attempt, including landing, in single steps.
    pub(crate) fn cost_steps(&self) -> u64 {
        self.cost_steps
    }

    fn certificate<'a>(
        &'a self,
        plan: &'a Plan,
        state: &'a SliderState,
        reserves: [f64; 3],
    ) -> Certificate<'a, D> {
        Certificate {
            plan,
            state,
            lattice: self.precomputed.stuck.lattice,
            forced: &self.forced,
            parts: &self.parts,
            coefficients: &self.coefficients,
            reserves,
        }
    }

    /// `a` and `b`; `false` if the stiffness cannot be solved with.
    fn find_forced(&mut self, plan: &Plan, state: &SliderState, stop: &Stop<'_>) -> bool {
        let Jump { precomputed, forced, stiff, damped, .. } = self;
        let Forced { position_m, advance_m, moves, ramp, nodes, .. } = forced;
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
        let along = position_m.chunks_exact_mut(*nodes).zip(state.stick_position_m.chunks_exact(plan.blocks));
        for (position_m, anchors_m) in along {
            for (a, anchor_m) in position_m.iter_mut().zip(anchors_m) {
                *a += kt * anchor_m;
            }
        }
        let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
        for spring in &plan.drive.springs {
            position_m[spring.block] += spring.force_n(point_m, 0.0);
        }
        for (freedom, load_n) in pressed(plan, &precomputed.stuck.lattice) {
            position_m[freedom] -= ramp.load.scaled_n(load_n);
        }
        precomputed.stuck.solve(position_m, stop)
    }

    /// Computes the coordinates of the free part; returns the norm of the residue.
    fn take_apart(&mut self, state: &SliderState) -> f64 {
        let Jump { precomputed, forced, parts, u, w, stiff, damped, scratch, .. } = self;
        let stuck = &precomputed.stuck;
        for n in 0..u.len() {
            u[n] = state.displacement_m[n] - forced.position_m[n];
            w[n] = stuck.step_s * state.velocity_m_per_s[n] - forced.advance_m[n];
        }
        for Part { modes, coordinates } in parts.iter_mut() {
            for own in [&mut coordinates.re, &mut coordinates.im] {
                own.resize(modes.slow.rates.len(), 0.0);
            }
        }
        // Slightly inaccurate modes mix slightly: a second pass removes what remains of them.
        for _ in 0..ROUNDS {
            for (scratch, (u, w)) in scratch.iter_mut().zip(u.iter().zip(&*w)) {
                *scratch = u - w;
            }
            stuck.products(stiff, damped, scratch, w);
            for Part { modes, coordinates } in parts.iter_mut() {
                let mut found = modes.slow.project(stuck, w, stiff);
                for (own, found) in
                    [(&mut coordinates.re, &mut found.re), (&mut coordinates.im, &mut found.im)]
                {
                    for (own, found) in own.iter_mut().zip(found) {
                        *own += *found;
                        *found = -*found;
                    }
                }
                modes.slow.add(stuck, &found, modes.slow.rates.len(), u, w);
            }
        }
        stuck.products(stiff, damped, u, w);
        invariant_of_products((stuck.mass_kg, stuck.step_s), [u, w], [stiff, damped]).sqrt()
    }

    /// Writes the state after `into` steps of the jump, without forces.
    pub(crate) fn land(&mut self, into: u64, state: &mut SliderState) {
        self.compose(into, f64::NEG_INFINITY, state);
    }

    /// Writes the state for a sample, without modes that change nothing.
    pub(crate) fn sample(&mut self, into: u64, state: &mut SliderState) {
        let least = NEGLIGIBLE * kernels::largest(&self.forced.position_m);
        self.compose(into, least, state);
    }

    /// Without the modes no larger than `least` behind the last that is.
    fn compose(&mut self, into: u64, least: f64, state: &mut SliderState) {
        let Jump { precomputed, forced, parts, u, w, .. } = self;
        let stuck = &precomputed.stuck;
        u.fill(0.0);
        w.copy_from_slice(&forced.advance_m);
        for part in parts {
            let coordinates = part.grown(into);
            let modes = coordinates.count_above(least);
            part.modes.slow.add(stuck, &coordinates, modes, u, w);
        }
        for (velocity_m_per_s, w) in state.velocity_m_per_s.iter_mut().zip(&*w) {
            *velocity_m_per_s = w / stuck.step_s;
        }
        forced.write(into, u, state);
    }
}

/// The error of some modes, summed over a number of steps.
fn off<const D: usize>(part: &Part<D>, steps: u64) -> f64 {
    let modes = &part.modes.slow;
    let sizes = part.coordinates.sizes();
    let parts = sizes.iter().zip(&modes.off).zip(&modes.rates).map(|((size, off), s)| {
        let falls_by = 1.0 - (Complex::ONE + *s).size();
        size * off * (steps as f64).min(1.0 / falls_by.max(f64::MIN_POSITIVE))
    });
    parts.sum()
}
