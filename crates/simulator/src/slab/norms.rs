//! How far what is left out of a slab's state may move what decides a switch.
//!
//! With `M` the stiffness of the stuck slab and `C` its damping the scheme never expands
//!
//! ```text
//! I(u, v) = v (m - dt C / 2) v + u M u - dt v M u = w M w + v (m - dt C / 2 - dt^2 M / 4) v,
//! ```
//!
//! `w = u - dt v / 2`, as [`crate::window::norms`] shows for any symmetric and positive `M` and `C`.
//! So a force on a contact, `-P w - (C + dt P / 2) v` with `P <= M` the stiffness without friction
//! springs, is at most `sqrt(P_nn) + |row of C + dt P / 2| / sqrt(s)` times `sqrt(I)`, with `s` the
//! least that `m - dt C / 2 - dt^2 M / 4` can be; and what a contact bears, `-k_f u_z`, since `k_f` is
//! part of `M`, at most `sqrt(k_f) + k_f dt / (2 sqrt(s))` times.

use asperity_model::Plan;

use crate::slab::stuck::StuckSlab;
use crate::window::norms::Norms;

/// Bounds for states of a stuck slab.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlabNorms {
    pub(crate) of_forces: Norms,
    /// `|p_n| <= load * sqrt(I)`, in N / sqrt(J).
    pub(crate) load: f64,
    freedoms: usize,
}

impl SlabNorms {
    pub(crate) fn of(plan: &Plan, stuck: &StuckSlab) -> SlabNorms {
        let of_forces = Norms::of(plan);
        let k = stuck.lattice.foundation_n_per_m;
        SlabNorms {
            load: k.sqrt() + 0.5 * stuck.step_s * k * of_forces.velocity,
            of_forces,
            freedoms: stuck.freedoms(),
        }
    }

    /// `sqrt(I)` of the rounding of displacements of at most this size, in so many steps as it stays.
    pub(crate) fn rounding(&self, displacement_m: f64) -> f64 {
        self.of_forces.at_most(self.freedoms, ROUNDING_ERRORS * f64::EPSILON * displacement_m, 0.0)
    }
}

/// Rounding errors of displacements that make up a state's noise.
const ROUNDING_ERRORS: f64 = 8.0;

/// `I` of displacements and `w = dt v`, whose `M u` and `C w` are given.
pub(crate) fn invariant(stuck: &StuckSlab, u: &[f64], w: &[f64], stiff: &[f64], damped: &[f64]) -> f64 {
    let mut sum = 0.0;
    let (inertia, rate) = (stuck.mass_kg / (stuck.step_s * stuck.step_s), 0.5 / stuck.step_s);
    for n in 0..u.len() {
        sum += w[n] * (inertia * w[n] - rate * damped[n]) + (u[n] - w[n]) * stiff[n];
    }
    // Rounding may leave less than nothing of nothing.
    sum.max(0.0)
}
