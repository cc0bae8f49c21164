//! Linear stability of steady sliding by rate-and-state friction: Ruina (1983), Rice and Ruina (1983) with inertia and
//! damping.
//!
//! A mode of a block or a chain that slides steadily at `V` has the stiffness `kappa`, the damping `eta` and, per
//! block, the mass `m` and the load `p`. With `theta = D_c / V` both laws of the state linearise alike, to the cubic
//!
//! `m s^3 + (m V / D_c + a p / V + eta) s^2 + (kappa - k_0 + eta V / D_c) s + kappa V / D_c = 0`,
//!
//! where `k_0 = (b - a) p / D_c`. By Routh and Hurwitz two of its roots have a positive real part if and only if
//! `kappa < k_c`, and none otherwise, with
//!
//! `k_c = (k_0 - eta V / D_c) [1 + (m V / D_c) / (a p / V + eta)]`.
//!
//! In a uniform chain of `N` blocks with free ends and the same `K_n` on each, mode `j` from 0 to `N - 1` has
//! `kappa = K_n + 4 k sin^2(q a / 2)` and `eta = E + 4 eta_v sin^2(q a / 2)` with `q a = pi j / N`.

use serde::Serialize;

use crate::plan::Plan;
use crate::rate_and_state::RateAndState;

/// Fewest blocks in the nucleation length; below it blocks fail one by one, and numbers depend on their size.
pub const FEWEST_NUCLEATION_BLOCKS: f64 = 3.0;

/// The stability of steady sliding at the velocity of the drive, of a chain with the mean load, `b` and driving spring
/// of its blocks, and the length over which slip nucleates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Stability {
    /// Number of modes: of blocks.
    pub modes: u32,
    /// Number of modes that grow; 0 if steady sliding is stable.
    pub unstable_modes: u32,
    /// The stiffness per block below which a block that slides alone is unstable, `k_c` without viscosity, N/m; below 0
    /// if it never is.
    pub critical_stiffness_n_per_m: f64,
    /// The nucleation length `sqrt(k D_c / (b p))` in blocks, the shortest of all blocks; `None` for a single block.
    pub nucleation_blocks: Option<f64>,
}

impl RateAndState {
    /// `k_c`, N/m: steady sliding at a velocity is unstable where the stiffness is below, of a block of mass `m` (0
    /// without inertia) that bears `normal_load_n`, with the evolution effect `b` and the damping `eta`. Below 0 where
    /// no spring is unstable.
    pub fn critical_stiffness_n_per_m(
        &self,
        velocity_m_per_s: f64,
        normal_load_n: f64,
        b: f64,
        mass_kg: f64,
        damping_kg_per_s: f64,
    ) -> f64 {
        let rate_per_s = velocity_m_per_s / self.critical_slip_m;
        let weakening_n_per_m = (b - self.direct_effect) * normal_load_n / self.critical_slip_m;
        let slowing_kg_per_s = self.direct_effect * normal_load_n / velocity_m_per_s + damping_kg_per_s;
        (weakening_n_per_m - damping_kg_per_s * rate_per_s) * (1.0 + mass_kg * rate_per_s / slowing_kg_per_s)
    }
}

impl Stability {
    /// That of a plan; `None` by other laws.
    pub fn of(plan: &Plan) -> Option<Stability> {
        let law = plan.friction.law.rate_and_state()?;
        let effects = &plan.friction.evolution_effects;
        let count = plan.blocks as f64;
        let load_n = plan.normal_load_n.iter().sum::<f64>() / count;
        let b = effects.iter().sum::<f64>() / count;
        let drive_n_per_m =
            plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum::<f64>() / count;
        let (k, eta) = (plan.elastic.stiffness_n_per_m(), plan.elastic.damping_kg_per_s());
        let mass_kg = if law.inertia { plan.block_mass_kg } else { 0.0 };
        let velocity_m_per_s = plan.drive.velocity_m_per_s;
        let critical_n_per_m = |damping_kg_per_s: f64| {
            law.critical_stiffness_n_per_m(velocity_m_per_s, load_n, b, mass_kg, damping_kg_per_s)
        };
        let grows = |mode: &usize| {
            let half = libm::sin(0.5 * std::f64::consts::PI * *mode as f64 / count);
            let bent = 4.0 * half * half;
            drive_n_per_m + k * bent < critical_n_per_m(law.radiation_kg_per_s + eta * bent)
        };
        let weakest = |(b, p): (&f64, &f64)| b * p;
        let most_n = effects.iter().zip(&plan.normal_load_n).map(weakest).fold(0.0, f64::max);
        Some(Stability {
            modes: plan.blocks as u32,
            unstable_modes: (0..plan.blocks).filter(grows).count() as u32,
            critical_stiffness_n_per_m: critical_n_per_m(law.radiation_kg_per_s),
            nucleation_blocks: (plan.blocks > 1).then(|| (k * law.critical_slip_m / most_n).sqrt()),
        })
    }
}
