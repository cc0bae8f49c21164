//! Lengths that a fault line in a medium must resolve, and how long its run may take.

use std::f64::consts::PI;

use serde::Serialize;

use crate::body::medium::MediumKind;
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
    /// About how long ruptures run in all, s.
    pub rupture_time_s: f64,
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
    /// after two and a half times that. Each takes 2,000 steps, and 14 more for each node there, and runs over that part
    /// at `c_s / 28`. An evaluation, of which a step takes six, takes 52 ns per node for friction, and 1 ns times
    /// `M log2 M` for two transforms of length `M`.
    pub fn of(plan: &Plan) -> Option<FaultEstimate> {
        let (medium, law) = (plan.medium.as_ref()?, plan.friction.law.rate_and_state()?);
        let (mu, dz) = (medium.shear_modulus_pa, medium.spacing_m);
        let numbers = |n: usize| {
            let (a, b) = (medium.direct_effect[n], medium.evolution_effect[n]);
            (b, b - a, medium.critical_slip_m[n], medium.normal_stress_pa[n])
        };
        let least = |length_m: &dyn Fn(usize) -> f64| {
            let least_m = (0..medium.nodes()).map(length_m).fold(f64::INFINITY, f64::min);
            Some(least_m / dz).filter(|cells| cells.is_finite())
        };
        let cohesive_m = |n: usize| {
            let (b, _, slip_m, sigma_pa) = numbers(n);
            9.0 * PI / 32.0 * mu * slip_m / (b * sigma_pa)
        };
        let nucleation_m = |n: usize| match numbers(n) {
            (b, weakening, slip_m, sigma_pa) if weakening > 0.0 => {
                2.0 * mu * b * slip_m / (PI * sigma_pa * weakening * weakening)
            }
            _ => f64::INFINITY,
        };
        let weakening = (0..medium.nodes()).map(|n| (numbers(n).1 * numbers(n).3).max(0.0));
        let (count, sum_pa) =
            weakening.filter(|of| *of > 0.0).fold((0.0, 0.0), |(n, sum), of| (n + 1.0, sum + of));
        let velocity = plan.drive.velocity_m_per_s;
        // The mean drop times the length is the sum times `dz`.
        let ln_ratio = (law.event_speed_m_per_s / velocity).ln().max(1.0);
        let slip_m = 1.5 * sum_pa * dz * ln_ratio / mu;
        let duration_s = plan.grid.time_s(plan.steps) - plan.grid.time_s(plan.initial.step);
        let recurrences = if slip_m > 0.0 { velocity * duration_s / slip_m } else { 0.0 };
        let events = (recurrences - 1.5).max(0.5);
        let steps = events * (2000.0 + 14.0 * count);
        let nodes = medium.nodes() as f64;
        let length = match medium.kind {
            MediumKind::Periodic { .. } => nodes,
            MediumKind::HalfSpace | MediumKind::WholeSpace => (4.0 * nodes).log2().ceil().exp2(),
        };
        Some(FaultEstimate {
            spacing_m: dz,
            shear_speed_m_per_s: medium.shear_speed_m_per_s(),
            radiation_pa_s_per_m: medium.radiation_pa_s_per_m(),
            cohesive_zone_cells: least(&cohesive_m),
            nucleation_cells: least(&nucleation_m),
            rupture_time_s: events * 28.0 * count * dz / medium.shear_speed_m_per_s(),
            steps,
            run_time_s: steps * 6.0 * (52e-9 * nodes + 1e-9 * length * length.log2()),
        })
    }
}
