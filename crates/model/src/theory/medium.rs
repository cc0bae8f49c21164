//! Lengths that a fault line in a medium must resolve, and how long its run may take.

use std::f64::consts::PI;

use serde::Serialize;

use crate::plan::Plan;

/// Fewest cells in the cohesive zone; with fewer, numbers depend on the spacing of nodes (Day et al., J. Geophys. Res.
/// 110, B12307, 2005).
pub const FEWEST_COHESIVE_CELLS: f64 = 3.0;

/// Numbers of a fault line from its plan alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FaultEstimate {
    /// `dz`, m.
    pub spacing_m: f64,
    /// `c_s`.
    pub shear_speed_m_per_s: f64,
    /// `eta = mu / (2 c_s)`.
    pub radiation_pa_s_per_m: f64,
    /// The cohesive zone `Lambda_0 = (9 pi / 32) mu D_c / (b sigma)` over `dz`, the least of all nodes; `None` if `b` is 0
    /// everywhere.
    pub cohesive_zone_cells: Option<f64>,
    /// The nucleation length `h* = 2 mu b D_c / (pi sigma (b - a)^2)` (Rubin and Ampuero 2005) over `dz`, the least of all
    /// nodes at which friction weakens with velocity; `None` without any.
    pub nucleation_cells: Option<f64>,
    /// About how many steps the solver takes, within a factor of 3.
    pub steps: f64,
    /// About how long they take on one core, s, within a factor of 3.
    pub run_time_s: f64,
}

impl FaultEstimate {
    /// That of a plan; `None` without a medium.
    ///
    /// Fitted to BP1-QD at 25 to 200 m. Events come after three quarters of the slip of an edge crack as long as the part
    /// of the fault where friction weakens, over which the stress drops by `sigma (b - a) ln(V_th / V_p)`, the first one
    /// after two and a half times that. Each takes 2,000 steps, and 14 more for each node there. An evaluation, of which a
    /// step takes six, takes 52 ns per node for friction, and 1 ns times `M log2 M` for two transforms of length `M`.
    pub fn of(plan: &Plan) -> Option<FaultEstimate> {
        let (medium, law) = (plan.medium.as_ref()?, plan.friction.law.rate_and_state()?);
        let (mu, dz, velocity) = (medium.shear_modulus_pa, medium.spacing_m, plan.drive.velocity_m_per_s);
        let (mut cohesive_m, mut nucleation_m) = (f64::INFINITY, f64::INFINITY);
        let (mut weak_nodes, mut weakening_pa) = (0.0, 0.0);
        for n in 0..medium.nodes() {
            let (b, weakening) =
                (medium.evolution_effect[n], medium.evolution_effect[n] - medium.direct_effect[n]);
            let (stiff_m, sigma_pa) = (mu * medium.critical_slip_m[n], medium.normal_stress_pa[n]);
            cohesive_m = cohesive_m.min(9.0 * PI / 32.0 * stiff_m / (b * sigma_pa));
            if weakening > 0.0 {
                nucleation_m = nucleation_m.min(2.0 * stiff_m * b / (PI * sigma_pa * weakening * weakening));
                weak_nodes += 1.0;
                weakening_pa += weakening * sigma_pa;
            }
        }
        let ln_ratio = libm::log(law.event_speed_m_per_s / velocity).max(1.0);
        let duration_s = plan.grid.time_s(plan.steps - plan.initial.step);
        let recurrences =
            velocity * duration_s * mu / (1.5 * weakening_pa * dz * ln_ratio).max(f64::MIN_POSITIVE);
        let events = if weak_nodes > 0.0 { (recurrences - 1.5).max(0.5) } else { 0.5 };
        let (steps, nodes) = (events * (2000.0 + 14.0 * weak_nodes), medium.nodes() as f64);
        let length = medium.transform_length() as f64;
        Some(FaultEstimate {
            spacing_m: dz,
            shear_speed_m_per_s: medium.shear_speed_m_per_s(),
            radiation_pa_s_per_m: medium.radiation_pa_s_per_m(),
            cohesive_zone_cells: Some(cohesive_m / dz).filter(|cells| cells.is_finite()),
            nucleation_cells: Some(nucleation_m / dz).filter(|cells| cells.is_finite()),
            steps,
            run_time_s: steps * 6.0 * (52e-9 * nodes + 1e-9 * length * length.log2()),
        })
    }
}
