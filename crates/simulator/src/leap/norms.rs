//! The basis of all bounds: a norm in which a step's map does not expand, and the reach of rounding.
//!
//! **Remainder.** With `M` the chain's stiffness (springs, drive, friction springs
//! of stuck blocks) and `C` its damping, `-eta` times the second difference, the scheme reads
//! `(m - dt C / 2)(v' - v) / dt = -M u - C (v + v') / 2`, and
//!
//! ```text
//! I(u, v) = v (m - dt C / 2) v + u M u - dt v M u
//! ```
//!
//! changes by `-(dt / 2) (v + v') C (v + v') <= 0` in a step: `A` does not expand
//! the norm `sqrt(I)`, in which [`crate::leap::chebyshev`] bounds what is left out.
//! With `w = u - dt v / 2`, `I = w M w + v (m - dt C / 2 - dt^2 M / 4) v`, positive
//! within the stability of the scheme, which gives the bounds of
//! [`Norms`] on forces and velocities.
//!
//! Radiation, `E v` on sliding blocks, adds `E` to their diagonal of `C`, for the argument as for the bounds.
//!
//! Without friction springs a stuck block does not move: `M` and `C` are then those of the sliding blocks
//! alone, submatrices of the chain's, and the argument applies unchanged.
//!
//! **Rounding.** The plain stepper rounds as well, differently. The bounds keep [`ROUNDING`] of the
//! threshold and of the largest velocity in reserve, and [`ROUNDING_ERRORS`] times the rounding of the
//! terms of a force, including those that cancel: for the slider of the thesis 1e-8 N of 2.8 N, where the
//! plain stepper's own forms differ by 4e-11 N.

use asperity_model::Plan;
use asperity_model::body::ends::absorbing_kg_per_s;

/// Share of thresholds and velocities that bounds keep in reserve for rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Rounding errors of the terms of a force that they keep in reserve besides.
const ROUNDING_ERRORS: f64 = 64.0;

/// Constants that turn the norm `sqrt(I)` into bounds on forces and velocities.
#[derive(Debug, Clone, Copy)]
pub struct Norms {
    /// `|tau_n| <= force * sqrt(I)` for every block, in N / sqrt(J).
    pub(crate) force: f64,
    /// `|v_n| <= velocity * sqrt(I)` for every block, in (m/s) / sqrt(J).
    pub(crate) velocity: f64,
    /// `|sum_n K_n u_n| <= drive * sqrt(I)`, in N / sqrt(J).
    pub(crate) drive: f64,
    /// `|p_n| <= load * sqrt(I)` for the normal load `-k_f u_z` of a contact, in N / sqrt(J); 0 without a
    /// foundation.
    pub(crate) load: f64,
    /// Largest sums of stiffness and damping in a force.
    stiffness_n_per_m: f64,
    damping_kg_per_s: f64,
    mass_kg: f64,
    half_step_s: f64,
    /// Largest force from outside besides the drive.
    prestress_n: f64,
}

impl Norms {
    /// From the plan's constants alone, for any set of sliding contacts. For the springs between nodes it
    /// uses the bounds of [`asperity_model::Lattice`], given here with their values for a chain.
    ///
    /// The velocity part of `I` is at least
    /// `s = m - dt (4 eta + E) / 2 - dt^2 (4 k + k_t + K) / 4 > 0` times `|v|^2`, by the largest eigenvalues
    /// of damping and stiffness. A force is
    /// `tau = -P w - (C + dt P / 2) v` with `P` the stiffness without friction
    /// springs; a row of it is bounded by `sqrt(P_nn) sqrt(w M w)`, since `P <= M`,
    /// and a row of a second difference has length `sqrt(6)`.
    pub fn of(plan: &Plan) -> Norms {
        let (elastic, dt) = (&plan.elastic, plan.grid.step_s());
        let (kt, drive) = (plan.friction.stiffest_spring_n_per_m(), plan.drive.stiffest_n_per_m());
        let all = plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum::<f64>();
        let radiation = plan.friction.law.radiation_kg_per_s() + absorbing_kg_per_s(&plan.end_bonds);
        let stiffest = elastic.stiffest_n_per_m(kt, drive);
        let most_damped = elastic.damping_spectral_bound_kg_per_s() + radiation;
        let foundation = elastic.foundation_n_per_m;
        let inertia = plan.block_mass_kg - dt * most_damped / 2.0 - dt * dt * stiffest / 4.0;
        assert!(inertia > 0.0, "the time step is within the stability of the scheme");
        let velocity = 1.0 / inertia.sqrt();
        // Two blocks with joined ends have two bonds, so a row is `(2, -2)` and not `(1, -2, 1)`.
        let is_pair = plan.blocks == 2 && plan.end_bonds.iter().any(|bond| bond.other.is_some());
        let of_bonds = elastic.row_length_kg_per_s(dt) * if is_pair { (8.0f64 / 6.0).sqrt() } else { 1.0 };
        let row = of_bonds + absorbing_kg_per_s(&plan.end_bonds) + dt * drive / 2.0;
        // `k_t u` with `u = w + dt v / 2`.
        let by_spring = match plan.friction.law.detaches_by_spring() {
            true => kt.sqrt() + 0.5 * dt * kt * velocity,
            false => 0.0,
        };
        Norms {
            force: f64::max((elastic.largest_diagonal_n_per_m() + drive).sqrt() + row * velocity, by_spring),
            velocity,
            // `u = w + dt v / 2`, and `(sum K_n w_n)^2 <= (sum K_n) w M w`.
            drive: all.sqrt() + dt / 2.0 * all * velocity,
            // `k_f` is part of `M`.
            load: foundation.sqrt() + 0.5 * dt * foundation * velocity,
            stiffness_n_per_m: elastic.row_bound_n_per_m() + kt + drive,
            damping_kg_per_s: elastic.damping_row_bound_kg_per_s() + radiation,
            mass_kg: plan.block_mass_kg,
            half_step_s: dt / 2.0,
            prestress_n: plan.prestress_n.iter().fold(0.0, |largest, force| force.abs().max(largest)),
        }
    }

    /// `sqrt(I)` of numbers of at most this size, for any set of sliding blocks: with
    /// `w = u - dt v / 2`, `w M w <= (4 k + k_t + K) |w|^2`, and the velocity part is at most
    /// `m |v|^2`.
    pub(crate) fn at_most(&self, blocks: usize, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        let position = displacement_m + self.half_step_s * velocity_m_per_s;
        let square =
            self.stiffness_n_per_m * position * position + self.mass_kg * velocity_m_per_s * velocity_m_per_s;
        (blocks as f64 * square).sqrt()
    }

    /// How far the rounding of displacements and velocities of this size may
    /// move a force, generously.
    pub fn force_rounding(&self, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        ROUNDING_ERRORS
            * f64::EPSILON
            * (self.stiffness_n_per_m * displacement_m
                + self.damping_kg_per_s * velocity_m_per_s
                + self.prestress_n)
    }

    /// How far rounding may move a velocity: by one of the same energy.
    pub fn velocity_rounding(&self, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        let rate = (self.stiffness_n_per_m / self.mass_kg).sqrt();
        ROUNDING_ERRORS * f64::EPSILON * (rate * displacement_m + velocity_m_per_s)
    }
}

/// `I` of displacements and `w = dt v`, whose `M u` and `C w` are given.
pub(crate) fn invariant(
    (mass_kg, step_s): (f64, f64),
    [u, w]: [&[f64]; 2],
    [stiff, damped]: [&[f64]; 2],
) -> f64 {
    let mut sum = 0.0;
    let (inertia, rate) = (mass_kg / (step_s * step_s), 0.5 / step_s);
    for n in 0..u.len() {
        sum += w[n] * (inertia * w[n] - rate * damped[n]) + (u[n] - w[n]) * stiff[n];
    }
    // Rounding may turn 0 into a small negative number.
    sum.max(0.0)
}
