//! The linear system of a stage: `(sigma - J) k = r`, with the exact derivatives `J` at the beginning of a step.
//!
//! Its elimination to one tridiagonal system in the changes `z` of the velocities is derived in
//! [`super::equations`]. With `q = g_V / (sigma - g_psi)`, the row of `y'` times `m V_y` becomes
//!
//! ```text
//! (alpha / V_y + kappa q + E + n eta + (n k + K) / sigma) z - (k / sigma + eta) (z_left + z_right)
//!     = m V_y r_y - kappa r_psi / (sigma - g_psi) + (k (r_w left + r_w right) - (n k + K) r_w) / sigma,
//! alpha = m V_y (sigma - tanh(y) g_V V_y / a - g / a) + p a + tanh(y) m V_y y',
//! kappa = (tanh(y) (m V_y (sigma - g_psi) + p a) - m V_y y' / cosh^2 y) / a,
//! ```
//!
//! where `n` is the number of neighbours. Without inertia (`m = 0`) it is the derivative of `T = p a y + E V`.

use asperity_model::plan::adaptive_state::ENERGIES;

use super::equations::{Contact, Equations};
use super::motion::{StepEnd, Unknowns};

/// The system of a step.
#[derive(Debug, Clone)]
pub(super) struct StageSystem {
    sigma: f64,
    kappa: Vec<f64>,
    /// `1 / (sigma - g_psi)`.
    state_share: Vec<f64>,
    /// Reciprocals of the pivots, and minus the off-diagonal.
    pivot: Vec<f64>,
    beside: f64,
    /// `a p_n`, and its change by a stage times `y`.
    direct_n: Vec<f64>,
    eased_n: Vec<f64>,
    /// `z`.
    change: Vec<f64>,
}

impl StageSystem {
    pub(super) fn of(blocks: usize) -> StageSystem {
        let zeros = || vec![0.0; blocks];
        StageSystem {
            sigma: 0.0,
            kappa: zeros(),
            state_share: zeros(),
            pivot: zeros(),
            beside: 0.0,
            direct_n: zeros(),
            eased_n: zeros(),
            change: zeros(),
        }
    }

    /// Factorises the derivatives at `begin` for this `sigma`.
    pub(super) fn factorise(&mut self, equations: &Equations, begin: &StepEnd<Equations>, sigma: f64) {
        let (_, friction_rate, ..) = begin.rates.parts();
        let (a, mass_kg) = (equations.law.direct_effect, equations.mass_kg);
        let beside = equations.chain.stiffness_n_per_m / sigma + equations.chain.damping_kg_per_s;
        let mut before = 0.0;
        for (n, contact) in begin.contacts.iter().enumerate() {
            let Contact { velocity_of_friction: v_y, slope, .. } = *contact;
            let direct_n = equations.direct_n(n, begin.outside);
            let share = 1.0 / (sigma - contact.rate_of_state);
            let inertia = mass_kg * v_y;
            let net_n = inertia * friction_rate[n];
            let turning = slope * contact.rate_of_velocity * v_y / a + contact.state_rate / a;
            let alpha = inertia * (sigma - turning) + direct_n + slope * net_n;
            let kappa = (slope * (inertia / share + direct_n) - (1.0 - slope * slope) * net_n) / a;
            let neighbours = equations.chain.neighbours(n);
            let damping = equations.law.radiation_kg_per_s + neighbours * equations.chain.damping_kg_per_s;
            let diagonal = alpha / v_y
                + kappa * contact.rate_of_velocity * share
                + damping
                + equations.springs_n_per_m[n] / sigma;
            let pivot = 1.0 / (diagonal - beside * beside * before);
            (self.kappa[n], self.state_share[n], self.pivot[n], self.direct_n[n]) =
                (kappa, share, pivot, direct_n);
            before = pivot;
        }
        (self.sigma, self.beside) = (sigma, beside);
    }

    /// Replaces the right side `r` by the solution `k`. `ahead_s` is the stage's change of time, which drive and load
    /// follow at their rates.
    pub(super) fn solve(
        &mut self,
        equations: &Equations,
        begin: &StepEnd<Equations>,
        ahead_s: f64,
        r: &mut Unknowns,
    ) {
        let StageSystem { sigma, kappa, state_share, pivot, beside, direct_n, eased_n, change } = self;
        let (sigma, beside, a) = (*sigma, *beside, equations.law.direct_effect);
        let StepEnd { at, contacts, outside, .. } = begin;
        let ((behind_m, friction, ..), blocks) = (at.parts(), contacts.len());
        let (r_w, r_y, r_psi, r_work) = r.parts_mut();
        let [r_w, r_y, r_psi, direct_n, eased_n, change] =
            [r_w, r_y, r_psi, direct_n, eased_n, change].map(|of| &mut of[..blocks]);
        let [kappa, state_share, pivot, behind_m, friction] =
            [kappa, state_share, pivot, behind_m, friction].map(|of| &of[..blocks]);
        for r_w in &mut *r_w {
            *r_w -= outside.drive_m_per_s2 * ahead_s;
        }
        let mut before = 0.0;
        for n in 0..contacts.len() {
            let pulled_n = equations.chain.stiffness_n_per_m * equations.beside(n, |m| r_w[m])
                - equations.springs_n_per_m[n] * r_w[n];
            eased_n[n] = equations.direct_change_n(n, *outside, ahead_s) * friction[n];
            let right = equations.mass_kg * contacts[n].velocity_of_friction * r_y[n]
                - eased_n[n]
                - kappa[n] * state_share[n] * r_psi[n]
                + equations.prestress_n(n, *outside)[1] * ahead_s
                + pulled_n / sigma;
            before = (right + beside * before) * pivot[n];
            change[n] = before;
        }
        let mut after = 0.0;
        let mut work_w = [0.0; ENERGIES];
        for n in (0..contacts.len()).rev() {
            let Contact { velocity: v, velocity_of_friction: v_y, rate_of_velocity, .. } = contacts[n];
            change[n] += beside * pivot[n] * after;
            let z = change[n];
            r_w[n] = (r_w[n] + z) / sigma;
            r_psi[n] = (r_psi[n] + rate_of_velocity * z) * state_share[n];
            r_y[n] = (z + v / a * r_psi[n]) / v_y;
            // Derivatives of the rates of work.
            work_w[0] -= equations.drive_n_per_m[n]
                * (outside.drive_m_per_s * r_w[n] + outside.drive_m_per_s2 * ahead_s * behind_m[n]);
            work_w[1] += direct_n[n] * (v * r_y[n] + friction[n] * z) + eased_n[n] * v;
            work_w[2] += 2.0 * equations.law.radiation_kg_per_s * v * z;
            let [prestress_n, n_per_s] = equations.prestress_n(n, *outside);
            work_w[4] += prestress_n * z + n_per_s * ahead_s * v;
            if let Some(next) = contacts.get(n + 1) {
                work_w[3] += 2.0 * equations.chain.damping_kg_per_s * (next.velocity - v) * (after - z);
            }
            after = z;
        }
        for (r, work_w) in r_work.iter_mut().zip(work_w) {
            *r = (*r + work_w) / sigma;
        }
    }
}
