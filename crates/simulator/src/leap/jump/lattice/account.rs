//! Energies of a jump ([`super`]).
//!
//! The work of drive and load are geometric sums over the steps. The work of the scheme is a difference
//! of a potential ([`Energies`]), and the viscous loss is the remainder of the balance.

use asperity_model::{Plan, SliderState};

use crate::energy::lattice_energy::stored_j;
use crate::kernels::{self, product};
use crate::leap::jump::Forced;
use crate::leap::jump::certificate::Part;
use crate::leap::jump::lattice::LatticeJump;
use crate::modes::complex::Complex;
use crate::modes::slow_modes::top_loads;

/// Largest number of orders for the work of the scheme, and the share of it that is negligible.
const MOST_ORDERS: usize = 12;
const NEGLIGIBLE_WORK: f64 = 1e-13;

/// Energies of a state: kinetic and elastic energy, the potential whose differences are the work of the
/// scheme, and the part of it that a ledger leaves to the state.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Energies {
    kinetic_j: f64,
    elastic_j: f64,
    scheme_j: f64,
    ahead_j: f64,
}

impl<const D: usize> LatticeJump<D> {
    /// Brings the ledger of a state up to `into` steps of the jump, the step of the state.
    pub(crate) fn bring_up(&mut self, plan: &Plan, into: u64, state: &mut SliderState) {
        let (mut ledger, start) = self.start;
        let here = self.energies(plan, state, into);
        let (drive_j, load_j) = (self.drive_work_j(plan, into), self.load_work_j(plan, into));
        let scheme_j = here.scheme_j - start.scheme_j;
        let stored_j = (here.kinetic_j - start.kinetic_j) + (here.elastic_j - start.elastic_j);
        ledger.drive_work_j.add(drive_j);
        ledger.load_work_j.add(load_j);
        // Without dampers the rest is rounding.
        if plan.elastic.damping_kg_per_s > 0.0 {
            ledger.viscous_loss_j.add((drive_j + load_j) + scheme_j - stored_j);
        }
        ledger.scheme_work_j.add(scheme_j + (here.ahead_j - start.ahead_j));
        state.energy = ledger;
    }

    /// Adds to a sum a function of every mode: of its rate, its coordinate, and the growth of that over a
    /// number of steps.
    fn add_modes(&self, sum: f64, steps: u64, of: impl Fn(&Part<D>, usize, [Complex; 3]) -> f64) -> f64 {
        self.parts.iter().fold(sum, |sum, part| {
            let growth = part.modes.slow.powers.growth(steps);
            part.modes.slow.rates.iter().enumerate().fold(sum, |sum, (mode, s)| {
                sum + of(part, mode, [*s, part.coordinates.at(mode), growth.at(mode)])
            })
        })
    }

    fn drive_work_j(&self, plan: &Plan, into: u64) -> f64 {
        let Forced { position_m, from_step, hold_step, .. } = &self.forced;
        let moving = into.min(hold_step.saturating_sub(*from_step));
        let advance_m = plan.drive.velocity_m_per_s * self.stuck.step_s;
        if moving == 0 || advance_m == 0.0 {
            return 0.0;
        }
        // If the point stops within the jump, it does so in the first step.
        let count = moving as f64;
        let point_m = plan.outside(from_step + 1, u64::MAX).point_m - 0.5 * advance_m;
        let force = plan.drive.total_force_n(point_m, position_m);
        let rate = self.forced.drive_rate_n(plan);
        // `sum z^i` of each mode over the steps, times its effect.
        let swung = self.add_modes(0.0, moving, |part, mode, [s, c, grown]| {
            (c * part.modes.drive_n[mode] * grown / s).re
        });
        advance_m * (count * (force + 0.5 * (count - 1.0) * rate) + swung)
    }

    /// `-sum L_j (U_j - U_{j - 1})` with `U = sum F_n u_z` and `L` the load over that of the start,
    /// linear in time.
    fn load_work_j(&self, plan: &Plan, into: u64) -> f64 {
        let count = into as f64;
        let (first, rate) = (self.forced.ramp.load.scaled_n(1.0), self.forced.ramp.change_n(1.0));
        let parts = top_loads(plan, &self.stuck.lattice);
        let advance_j: f64 = parts.map(|(freedom, load_n)| load_n * self.forced.advance_m[freedom]).sum();
        let work_j = advance_j * (count * first + rate * (count * (count - 1.0) / 2.0));
        let work_j = self.add_modes(work_j, into, |part, mode, [s, c, grown]| {
            // `sum_{j=1}^k s z^(j-1) = z^k - 1`, and with `j - 1` before it `k z^k - z (z^k - 1) / s`.
            let rising = (Complex::ONE + grown).scale(count) - (Complex::ONE + s) * grown / s;
            (c * part.modes.load_work_j[mode] * (grown.scale(first) + rising.scale(rate))).re
        });
        -work_j
    }

    /// As [`crate::energy`] derives the work of the scheme, for any stiffness and damping.
    pub(super) fn energies(&self, plan: &Plan, state: &SliderState, into: u64) -> Energies {
        let LatticeJump { stuck, forced: Forced { moves, hold_step, ramp, .. }, .. } = self;
        let (dt, mass, nodes) = (stuck.step_s, stuck.mass_kg, stuck.lattice.nodes());
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let (kinetic_j, elastic_j) = stored_j(plan, &stuck.lattice, state);
        // The outer forces of the next step, as if the jump continued.
        let hold_step = if *moves { u64::MAX } else { *hold_step };
        let point_m = plan.outside(state.step + 1, hold_step).point_m;
        let advance_m = if *moves { plan.drive.velocity_m_per_s * dt } else { 0.0 };
        let (load, load_change) = (ramp.ahead(into as f64), ramp.change_n(1.0));
        let (mut stiff, mut damped) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        kernels::lattice_pull(&mut stiff, &mut damped, u, v, &stuck.lattice);
        let ahead_j = 0.5 * dt * product(&stiff, v);
        // `g x`.
        let steady_j = |x: &[f64]| {
            let springs = plan.drive.springs.iter();
            let drive: f64 = springs
                .map(|spring| spring.stiffness_n_per_m * spring.direction * advance_m * x[spring.block])
                .sum();
            let parts = top_loads(plan, &stuck.lattice);
            let on_top: f64 = parts.map(|(freedom, load_n)| load_n * x[freedom]).sum();
            drive - load_change * on_top
        };
        let loss = -product(&damped, v);
        // `D v` and `D u`.
        let by_force = dt / mass;
        let mut dv: Vec<f64> = stiff.iter().zip(&damped).map(|(stiff, damped)| stiff + damped).collect();
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        for n in 0..plan.blocks {
            for axis in 0..D {
                let (freedom, place) = (axis * nodes + n, axis * plan.blocks + n);
                dv[freedom] -= kt * (u[freedom] - state.stick_position_m[place]);
            }
            if let Some(normal) = stuck.lattice.first_normal() {
                dv[normal + n] -= stuck.lattice.foundation_n_per_m * u[normal + n];
            }
        }
        for spring in &plan.drive.springs {
            dv[spring.block] += spring.force_n(point_m, u[spring.block]);
        }
        for (freedom, load_n) in top_loads(plan, &stuck.lattice) {
            dv[freedom] -= load.scaled_n(load_n);
        }
        dv.iter_mut().for_each(|dv| *dv *= by_force);
        let mut du: Vec<f64> = v.iter().zip(&dv).map(|(v, dv)| dt * (v + dv)).collect();
        let mut scheme_j = -0.5 * mass * product(v, &dv) - 0.25 * dt * loss + 0.5 * steady_j(u);
        let mut share = 0.25;
        for order in 1..=MOST_ORDERS {
            let [stiff, damped] = stuck.products(&du, &dv);
            let square = product(&dv, &dv);
            let (strain_j, loss) = (0.5 * product(&du, &stiff), product(&dv, &damped));
            let steady = if order == 1 { steady_j(&du) } else { 0.0 };
            // The differences of the next order.
            let next = stiff.iter().zip(&damped).map(|(stiff, damped)| -by_force * (stiff + damped));
            let mut next: Vec<f64> = next.collect();
            if order == 1 {
                for spring in &plan.drive.springs {
                    next[spring.block] +=
                        by_force * (spring.stiffness_n_per_m * spring.direction * advance_m);
                }
                for (freedom, load_n) in top_loads(plan, &stuck.lattice) {
                    next[freedom] -= by_force * (load_change * load_n);
                }
            }
            let mixed = product(&dv, &next);
            let part = share * (steady - 0.5 * mass * (square + mixed) - strain_j - 0.75 * dt * loss);
            scheme_j -= part;
            if part.abs() <= NEGLIGIBLE_WORK * scheme_j.abs() {
                break;
            }
            share *= 0.25;
            for ((du, dv), next) in du.iter_mut().zip(&dv).zip(&next) {
                *du = dt * (dv + next);
            }
            dv = next;
        }
        Energies { kinetic_j, elastic_j, scheme_j, ahead_j }
    }
}
