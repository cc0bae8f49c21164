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
//! **Energies.** The work of the scheme is a difference of a potential, and the viscous loss is the remainder of the
//! balance.

use std::sync::{Arc, OnceLock};

use asperity_model::{Plan, SliderState};

use crate::energy::lattice_energy::stored_j;
use crate::kernels::{self, product};
use crate::leap::jump::certificate::Part;
use crate::leap::jump::{Attempt, Forced, Jump, Limits, Stuck, WITHOUT_MODES_STEPS};
use crate::leap::norms::{ROUNDING, invariant};
use crate::modes::Coordinates;
use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::{ClassModes, StuckLattice};
use crate::records::stop::Stop;

/// Below this many steps a jump is not worth it.
const SHORTEST: u64 = 256;

/// Steps after which it may be worth trying again.
const PATIENCE_STEPS: u64 = 256;

/// Decay of the residue over that of the slowest mode that it has, as the next attempt assumes: of a slab, and over
/// an area, where the modes that are found are those that decay last.
const DECAY: [f64; 2] = [0.75, 1.0];

/// Costs in single steps: of the forced part, besides the nodes along the shorter side, of projecting
/// a state on one mode, and of composing one.
const STEPS_OF_FORCED: u64 = 10;
const STEPS_OF_MODE: u64 = 2;
const STEPS_OF_STATE: u64 = 32;

/// Limit on the residue of a jump, and on the error of its modes, as a share of the mean
/// threshold: the reserve for rounding.
const MISSED: f64 = ROUNDING;

/// Rounding errors of displacements that make up a state's noise, relative to the largest.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// How often a state is projected on the modes.
const ROUNDS: usize = 2;

/// How long the next attempt waits for fast modes to decay: at least, and where they decay too slowly for a forecast.
const LEAST_WAIT_STEPS: u64 = PATIENCE_STEPS / 4;
const LONGEST_FORECAST_STEPS: f64 = (1 << 20) as f64;
const WAIT_BEYOND_FORECAST_STEPS: u64 = 1 << 12;

/// Largest number of orders for the work of the scheme, and the share of it that is negligible.
const MOST_ORDERS: usize = 12;
const NEGLIGIBLE_WORK: f64 = 1e-13;

/// The stuck lattice with its slow modes.
#[derive(Debug)]
struct SlowLattice<const D: usize> {
    stuck: StuckLattice,
    /// The modes of each class of motions, found when a state first has such a motion.
    modes: Vec<OnceLock<Option<Arc<ClassModes<D>>>>>,
    /// Steps of Arnoldi's iteration for each.
    iterations: usize,
    parts: Vec<Part<D>>,
    /// [`SlowLattice::potentials_j`] of the state where the jump begins.
    start_j: [f64; 2],
}

/// The jumps of a lattice; `None` if its stiffness cannot be solved with, there are no slow modes, or the stop comes.
pub(crate) fn jump<const D: usize>(plan: &Plan, iterations: usize, stop: &Stop<'_>) -> Option<Jump<D>> {
    let lattice = plan.elastic;
    let stuck = StuckLattice::of(plan, lattice, stop)?;
    let modes = stuck.classes().iter().map(|_| OnceLock::new()).collect();
    let slow = SlowLattice { stuck, modes, iterations, parts: Vec::new(), start_j: [0.0; 2] };
    slow.modes(plan, 0, stop)?;
    let limits = Limits {
        shortest_steps: SHORTEST,
        refused_steps: PATIENCE_STEPS,
        forced_steps: STEPS_OF_FORCED + lattice.rows.min(lattice.columns) as u64,
        composed_steps: STEPS_OF_STATE,
        solves_in_sweeps: false,
    };
    Some(Jump::of(plan, Box::new(slow), limits))
}

impl<const D: usize> Stuck<D> for SlowLattice<D> {
    fn solve(&self, force: &mut [f64], stop: &Stop<'_>) -> bool {
        self.stuck.solve(force, stop)
    }

    fn project(&mut self, attempt: &mut Attempt<'_, D>) -> Result<f64, u64> {
        let Attempt { norms, motion, stop, .. } = *attempt;
        let plan = attempt.certificate.plan;
        let (u, v) = motion.split_at(self.stuck.freedoms());
        self.parts.clear();
        for (class, motions) in self.stuck.classes().iter().enumerate() {
            if class > 0 && motions.has_no_component(u) && motions.has_no_component(v) {
                continue;
            }
            let modes = self.modes(plan, class, stop).ok_or(WITHOUT_MODES_STEPS)?;
            let count = modes.slow.rates.len();
            attempt.cost_steps += STEPS_OF_MODE * count as u64;
            self.parts.push(Part { modes, coordinates: Coordinates::zero(count) });
        }
        let left_out = self.take_coordinates(u.to_vec(), v.iter().map(|v| self.stuck.step_s * v).collect());
        let mean_n = plan.friction.static_threshold_n.iter().sum::<f64>() / plan.blocks as f64;
        let noise = norms.at_most(self.stuck.freedoms(), NOISE * attempt.scales[0], 0.0);
        let enough = MISSED * mean_n / norms.force + noise;
        let most_steps = &mut attempt.most_steps;
        let mut defect = self.defect(0, *most_steps);
        // The swing of a sheet hardly decays, and its error grows with the length of the jump.
        while plan.elastic.first_normal().is_none() && defect > enough && *most_steps > SHORTEST {
            *most_steps /= 2;
            defect = self.defect(0, *most_steps);
        }
        let excess = left_out.max(defect) / enough;
        if excess <= 1.0 {
            attempt.certificate.parts.clone_from(&self.parts);
            return Ok(left_out + defect);
        }
        // Steps until the modes that are not used have decayed to that level.
        let rates = self.parts.iter().map(|part| part.modes.slow.next_falls_by);
        let rate = DECAY[D - 1] * rates.fold(f64::INFINITY, f64::min);
        let steps = if D == 1 || left_out > enough { libm::log(excess) / rate } else { 0.0 };
        let mut steps = match steps < LONGEST_FORECAST_STEPS {
            true => (steps as u64).max(LEAST_WAIT_STEPS),
            false => WAIT_BEYOND_FORECAST_STEPS,
        };
        // Hardly more than the most, until the error of the modes is small enough: it falls as they do.
        while D > 1 && steps < *most_steps && self.defect(steps, *most_steps) > enough {
            steps += steps / 8;
        }
        Err(steps)
    }

    /// Only modes behind the last one that is larger are left out.
    fn compose(&mut self, into: u64, least: f64, motion: &mut [f64]) {
        motion.fill(0.0);
        let (u, w) = motion.split_at_mut(self.stuck.freedoms());
        for part in &self.parts {
            let coordinates = part.grown(into);
            let modes = coordinates.count_above(least);
            part.modes.slow.add(&self.stuck, &coordinates, modes, u, w);
        }
        w.iter_mut().for_each(|w| *w /= self.stuck.step_s);
    }

    fn begin_energies(&mut self, plan: &Plan, forced: &Forced, motion: &[f64], state: &SliderState) {
        self.start_j = self.potentials_j(plan, forced, motion, state);
    }

    fn add_energies(
        &self,
        plan: &Plan,
        forced: &Forced,
        [_, motion]: [&[f64]; 2],
        work_j: f64,
        state: &mut SliderState,
    ) {
        let [lost_j, scheme_j] = self.potentials_j(plan, forced, motion, state);
        // Without dampers the rest is rounding.
        if plan.elastic.damping_kg_per_s > 0.0 {
            state.energy.viscous_loss_j.add(work_j + (lost_j - self.start_j[0]));
        }
        state.energy.scheme_work_j.add(scheme_j - self.start_j[1]);
    }
}

impl<const D: usize> SlowLattice<D> {
    /// The modes of a class of motions; `None` if it has no slow modes, or the stop comes.
    fn modes(&self, plan: &Plan, class: usize, stop: &Stop<'_>) -> Option<Arc<ClassModes<D>>> {
        let find = || ClassModes::of(plan, &self.stuck, class, self.iterations, stop).map(Arc::new);
        stop.get_or_find(&self.modes[class], find).cloned()
    }

    /// Adds to the coordinates those of a motion, `u` and `w = dt v`; returns the norm of the residue.
    fn take_coordinates(&mut self, mut u: Vec<f64>, mut w: Vec<f64>) -> f64 {
        let SlowLattice { stuck, parts, .. } = self;
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
        invariant((stuck.mass_kg, stuck.step_s), [&u, &w], [&stiff, &damped]).sqrt()
    }

    /// The error of the modes, summed over a jump of `steps` steps that begins `after` steps.
    fn defect(&self, after: u64, steps: u64) -> f64 {
        let of_part = |part: &Part<D>| {
            let sizes = part.grown(after).sizes().into_iter();
            let modes = sizes.zip(&part.modes.slow.defects).zip(&part.modes.slow.rates);
            let defects = modes.map(|((size, defect), s)| {
                let falls_by = 1.0 - (Complex::ONE + *s).size();
                size * defect * (steps as f64).min(1.0 / falls_by.max(f64::MIN_POSITIVE))
            });
            defects.sum::<f64>()
        };
        self.parts.iter().map(of_part).sum()
    }

    /// Two functions of a state: the differences of the first are what drive and load lose to dampers, less their work;
    /// those of the second the work of the scheme that a ledger counts, as [`crate::energy`] derives it for any
    /// stiffness and damping. The outer forces are those of the forced part, so that only the free motion pulls:
    /// `m D v = -dt (M r_u + C r_v)`.
    fn potentials_j(&self, plan: &Plan, forced: &Forced, motion: &[f64], state: &SliderState) -> [f64; 2] {
        let (dt, mass) = (self.stuck.step_s, self.stuck.mass_kg);
        let (u, v, steady_n) = (&state.displacement_m, &state.velocity_m_per_s, &forced.rate_n);
        let (mut pulls, mut damping) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        kernels::lattice_springs(&mut pulls, u, &plan.elastic);
        kernels::lattice_dashpots(&mut damping, v, &plan.elastic);
        let difference = |[stiff, damped]: [Vec<f64>; 2], steady: f64| -> Vec<f64> {
            let forces = stiff.iter().zip(&damped).zip(steady_n);
            forces.map(|((stiff, damped), g)| dt / mass * (steady * g - (stiff + damped))).collect()
        };
        let (free_u, free_v) = motion.split_at(u.len());
        let mut dv = difference(self.stuck.products(free_u, free_v), 0.0);
        let mut du: Vec<f64> = v.iter().zip(&dv).map(|(v, dv)| dt * (v + dv)).collect();
        let loss = -product(&damping, v);
        let mut scheme_j = -0.5 * mass * product(v, &dv) - 0.25 * dt * loss + 0.5 * product(steady_n, u);
        let (mut share, mut steady) = (0.25, 1.0);
        for _ in 0..MOST_ORDERS {
            let [stiff, damped] = self.stuck.products(&du, &dv);
            let (strain_j, loss) = (0.5 * product(&du, &stiff), product(&dv, &damped));
            let next = difference([stiff, damped], steady);
            let kinetic_j = 0.5 * mass * (product(&dv, &dv) + product(&dv, &next));
            let part = share * (steady * product(steady_n, &du) - kinetic_j - strain_j - 0.75 * dt * loss);
            scheme_j -= part;
            if part.abs() <= NEGLIGIBLE_WORK * scheme_j.abs() {
                break;
            }
            (share, steady) = (0.25 * share, 0.0);
            for ((du, dv), next) in du.iter_mut().zip(&dv).zip(&next) {
                *du = dt * (dv + next);
            }
            dv = next;
        }
        let (kinetic_j, elastic_j) = stored_j(plan, &plan.elastic, state);
        [scheme_j - (kinetic_j + elastic_j), scheme_j + 0.5 * dt * product(&pulls, v)]
    }
}
