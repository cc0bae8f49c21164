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

use std::sync::{Arc, OnceLock};

use asperity_model::{Ledger, Plan, SliderState};

use crate::kernels;
use crate::leap::jump::Forced;
use crate::leap::jump::certificate::{Certificate, Part};
use crate::leap::jump::lattice::account::Energies;
use crate::leap::norms::{Norms, ROUNDING, invariant_of_products};
use crate::modes::Coordinates;
use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::{ClassModes, Motions, SlowModes, StuckLattice, top_loads};
use crate::records::stop::Stop;
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

/// Limit on the residue of a jump, and on the error of its modes, as a share of the mean
/// threshold: the reserve for rounding.
const MISSED: f64 = ROUNDING;

/// Rounding errors of displacements that make up a state's noise, relative to the largest.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// How often a state is projected on the modes.
const ROUNDS: usize = 2;

/// Modes below this share of the largest displacement do not affect a sample.
const NEGLIGIBLE: f64 = 1e-17;

/// How long the next attempt waits for fast modes to decay: at least, and where they decay too slowly for a forecast.
const LEAST_WAIT_STEPS: u64 = PATIENCE_STEPS / 4;
const LONGEST_FORECAST_STEPS: f64 = (1 << 20) as f64;
const WAIT_BEYOND_FORECAST_STEPS: u64 = 1 << 12;

/// The stuck lattice with its slow modes, and the jump that is open. Contacts have `D` tangential freedoms.
#[derive(Debug)]
pub(crate) struct LatticeJump<const D: usize> {
    stuck: StuckLattice,
    norms: Norms,
    /// `M^-1` times the change of the forces in a step due to a moving drive, and due to a load that grows
    /// by its initial value.
    by_drive_m: Vec<f64>,
    by_load_m: Vec<f64>,
    /// The modes of each class of motions, found when a state first has such a motion.
    modes: Vec<OnceLock<Option<Arc<ClassModes<D>>>>>,
    /// Steps of Arnoldi's iteration for each.
    iterations: usize,
    forced: Forced,
    parts: Vec<Part<D>>,
    /// Cost of the last attempt, including landing, in single steps.
    pub(crate) cost_steps: u64,
    /// Static coefficients at its start.
    coefficients: Vec<f64>,
    /// The ledger at its start, and energies of the state there.
    start: (Ledger, Energies),
}

impl<const D: usize> LatticeJump<D> {
    /// `None` if the stiffness cannot be solved with, there are no slow modes, or the stop comes.
    pub(crate) fn of(
        plan: &Plan,
        stuck: StuckLattice,
        iterations: usize,
        stop: &Stop<'_>,
    ) -> Option<LatticeJump<D>> {
        let lattice = stuck.lattice;
        let mut by_drive_m = vec![0.0; stuck.freedoms()];
        let advance_m = plan.drive.velocity_m_per_s * stuck.step_s;
        for spring in &plan.drive.springs {
            by_drive_m[spring.block] += spring.stiffness_n_per_m * spring.direction * advance_m;
        }
        let mut by_load_m = vec![0.0; stuck.freedoms()];
        for (freedom, load_n) in top_loads(plan, &lattice) {
            by_load_m[freedom] = -load_n;
        }
        let are_solved = stuck.solve(&mut by_drive_m, stop) && stuck.solve(&mut by_load_m, stop);
        let jump = are_solved.then(|| LatticeJump {
            norms: Norms::of(plan),
            by_drive_m,
            by_load_m,
            modes: stuck.classes().iter().map(|_| OnceLock::new()).collect(),
            iterations,
            forced: Forced::of_nodes(lattice.nodes(), lattice.axes()),
            parts: Vec::new(),
            cost_steps: 0,
            coefficients: Vec::new(),
            start: Default::default(),
            stuck,
        })?;
        jump.modes(plan, 0, stop).is_some().then_some(jump)
    }

    /// The modes of a class of motions; `None` if it has no slow modes, or the stop comes.
    fn modes(&self, plan: &Plan, class: usize, stop: &Stop<'_>) -> Option<Arc<ClassModes<D>>> {
        let find = || ClassModes::of(plan, &self.stuck, class, self.iterations, stop).map(Arc::new);
        stop.get_or_find(&self.modes[class], find).cloned()
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
        let lattice = self.stuck.lattice;
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
        let arrays = [&state.displacement_m, &state.velocity_m_per_s, &self.forced.position_m];
        let has_component = |motions: &Motions| !arrays.iter().all(|all| motions.has_no_component(all));
        for (class, motions) in self.stuck.classes().iter().enumerate() {
            if class > 0 && !has_component(motions) {
                continue;
            }
            let Some(modes) = self.modes(plan, class, stop) else {
                return Err(WITHOUT_MODES_STEPS);
            };
            let count = modes.slow.rates.len();
            self.cost_steps += STEPS_OF_MODE * count as u64;
            self.parts.push(Part { modes, coordinates: Coordinates::zero(count) });
        }
        let left_out = self.project(state);
        let norms = self.norms;
        let mean_n = plan.friction.static_threshold_n.iter().sum::<f64>() / plan.blocks as f64;
        let enough =
            MISSED * mean_n / norms.force + norms.at_most(self.stuck.freedoms(), NOISE * u_scale, 0.0);
        let defect_over = |steps: u64| {
            let parts = self.parts.iter();
            parts.map(|part| defect(&part.modes.slow, &part.coordinates, steps)).sum::<f64>()
        };
        let (mut most_steps, mut defect) = (most_steps, defect_over(most_steps));
        // The swing of a sheet hardly decays, and its error grows with the length of the jump.
        while lattice.first_normal().is_none() && defect > enough && most_steps > SHORTEST {
            most_steps /= 2;
            defect = defect_over(most_steps);
        }
        let excess = left_out.max(defect) / enough;
        if excess > 1.0 {
            // Steps until the modes that are not used have decayed to that level.
            let rates = self.parts.iter().map(|part| part.modes.slow.next_falls_by);
            let rate = DECAY[D - 1] * rates.fold(f64::INFINITY, f64::min);
            let steps = if D == 1 || left_out > enough { libm::log(excess) / rate } else { 0.0 };
            let steps = match steps < LONGEST_FORECAST_STEPS {
                true => (steps as u64).max(LEAST_WAIT_STEPS),
                false => WAIT_BEYOND_FORECAST_STEPS,
            };
            return Err(if D == 1 { steps } else { self.until_exact(most_steps, enough, steps) });
        }
        let missed = left_out + defect;
        let reach_m = u_scale + kernels::largest(&self.forced.advance_m) * most_steps as f64;
        let rounding_n = norms.force_rounding(reach_m, v_scale);
        let reserves = [
            norms.force * missed + rounding_n * (D as f64).sqrt(),
            norms.load * missed + rounding_n,
            norms.drive * missed + rounding_n * plan.drive.springs.len() as f64,
        ];
        let steps = self.certificate(plan, state, reserves).longest(most_steps);
        if steps < SHORTEST {
            return refused;
        }
        self.start = (state.energy, self.energies(plan, state, 0));
        Ok(steps)
    }

    /// Steps, at least as many as given and hardly more than the most, until the error of the modes over the most
    /// steps is small enough: it falls as they do.
    fn until_exact(&self, most_steps: u64, enough: f64, least_steps: u64) -> u64 {
        let defect_after = |steps: u64| {
            let parts = self.parts.iter();
            parts.map(|part| defect(&part.modes.slow, &part.grown(steps), most_steps)).sum::<f64>()
        };
        let mut steps = least_steps;
        while steps < most_steps && defect_after(steps) > enough {
            steps += steps / 8;
        }
        steps
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
            lattice: self.stuck.lattice,
            forced: &self.forced,
            parts: &self.parts,
            coefficients: &self.coefficients,
            reserves,
        }
    }

    /// `a` and `b`; `false` if the stiffness cannot be solved with.
    fn find_forced(&mut self, plan: &Plan, state: &SliderState, stop: &Stop<'_>) -> bool {
        let LatticeJump { stuck, by_drive_m, by_load_m, forced, .. } = self;
        let Forced { position_m, advance_m, moves, ramp, nodes, .. } = forced;
        let (drives, loads) = (f64::from(u8::from(*moves)), ramp.change_n(1.0));
        for ((b, drive), load) in advance_m.iter_mut().zip(&*by_drive_m).zip(&*by_load_m) {
            *b = drives * drive + loads * load;
        }
        let [_, damped] = stuck.products(advance_m, advance_m);
        for (a, damped) in position_m.iter_mut().zip(damped) {
            *a = -damped / stuck.step_s;
        }
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let along = position_m.chunks_exact_mut(*nodes).zip(state.stick_position_m.chunks_exact(plan.blocks));
        for (position_m, anchors_m) in along {
            for (a, anchor_m) in position_m.iter_mut().zip(anchors_m) {
                *a += kt * anchor_m;
            }
        }
        let point_m = plan.outside(state.step + 1, state.hold_step).point_m;
        for spring in &plan.drive.springs {
            position_m[spring.block] += spring.force_n(point_m, 0.0);
        }
        for (freedom, load_n) in top_loads(plan, &stuck.lattice) {
            position_m[freedom] -= ramp.load.scaled_n(load_n);
        }
        stuck.solve(position_m, stop)
    }

    /// Computes the coordinates of the free part; returns the norm of the residue.
    fn project(&mut self, state: &SliderState) -> f64 {
        let LatticeJump { stuck, forced, parts, .. } = self;
        let free = |of: &[f64], forced: &[f64], unit: f64| -> Vec<f64> {
            of.iter().zip(forced).map(|(of, forced)| unit * of - forced).collect()
        };
        let mut u = free(&state.displacement_m, &forced.position_m, 1.0);
        let mut w = free(&state.velocity_m_per_s, &forced.advance_m, stuck.step_s);
        // Slightly inaccurate modes mix slightly: a second pass removes what remains of them.
        for _ in 0..ROUNDS {
            let before: Vec<f64> = u.iter().zip(&w).map(|(u, w)| u - w).collect();
            let [stiff, _] = stuck.products(&before, &w);
            for Part { modes, coordinates } in parts.iter_mut() {
                let mut found = modes.slow.project(stuck, &w, &stiff);
                for (own, found) in
                    [(&mut coordinates.re, &mut found.re), (&mut coordinates.im, &mut found.im)]
                {
                    for (own, found) in own.iter_mut().zip(found) {
                        *own += *found;
                        *found = -*found;
                    }
                }
                modes.slow.add(stuck, &found, modes.slow.rates.len(), &mut u, &mut w);
            }
        }
        let [stiff, damped] = stuck.products(&u, &w);
        invariant_of_products((stuck.mass_kg, stuck.step_s), [&u, &w], [&stiff, &damped]).sqrt()
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
        let LatticeJump { stuck, forced, parts, .. } = self;
        let (mut u, mut w) = (vec![0.0; stuck.freedoms()], forced.advance_m.clone());
        for part in parts {
            let coordinates = part.grown(into);
            let modes = coordinates.count_above(least);
            part.modes.slow.add(stuck, &coordinates, modes, &mut u, &mut w);
        }
        for (velocity_m_per_s, w) in state.velocity_m_per_s.iter_mut().zip(w) {
            *velocity_m_per_s = w / stuck.step_s;
        }
        forced.write(into, &u, state);
    }
}

/// The error of modes with these coordinates, summed over a number of steps.
fn defect(modes: &SlowModes, coordinates: &Coordinates, steps: u64) -> f64 {
    let parts = coordinates.sizes().into_iter().zip(&modes.defects).zip(&modes.rates);
    let parts = parts.map(|((size, defect), s)| {
        let falls_by = 1.0 - (Complex::ONE + *s).size();
        size * defect * (steps as f64).min(1.0 / falls_by.max(f64::MIN_POSITIVE))
    });
    parts.sum()
}
