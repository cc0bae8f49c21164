//! A fault line in a medium as a scenario describes it, and how it starts.

use crate::body::medium::{Medium, MediumKind};
use crate::law::rate_and_state::RateAndState;
use crate::scenario::Scenario;
use crate::scenario::choices::{MediumChoice, Start};

/// From this on, `ln sinh x` is `x - ln 2` to `e^(-2 x)`, less than rounding.
const LARGE: f64 = 20.0;

/// A fault line before its first step.
pub(crate) struct FaultLine {
    /// The medium, and the nodes in it.
    pub(crate) medium: Medium,
    /// The velocity of all nodes.
    pub(crate) velocity_m_per_s: f64,
    /// `phi = ln(V_0 theta / D_c)` of each.
    pub(crate) states: Vec<f64>,
}

impl FaultLine {
    /// That of a scenario; `None` without a medium, and with lists that are refused.
    ///
    /// By a uniform start all nodes begin at `V` under the stress `tau_0` at which the node with the largest `a` slides
    /// steadily at `V`, with `phi` from the balance `sigma a asinh[(V / 2 V_0) e^((f_0 + b phi) / a)] = tau_0 - eta V`
    /// (BP1-QD, equations 14 and 16); by a steady one `phi` is given, and `tau_0` follows from this balance.
    pub(crate) fn of(scenario: &Scenario) -> Option<FaultLine> {
        let (keys, slider, velocity) = (&scenario.medium, &scenario.slider, scenario.drive.velocity_m_per_s);
        let law = scenario.contact_law().rate_and_state()?;
        let kind = match slider.medium {
            MediumChoice::None => return None,
            MediumChoice::HalfSpace => MediumKind::HalfSpace,
            MediumChoice::WholeSpace => MediumKind::WholeSpace,
            MediumChoice::Periodic => MediumKind::Periodic { width_m: keys.width_m },
        };
        let lists = [&keys.direct_effect, &keys.evolution_effect, &keys.critical_slip_m, &keys.normal_stress_pa];
        let knots = keys.profile_m.len();
        if lists.iter().any(|list| list.len() != 1 && (list.is_empty() || list.len() != knots)) {
            return None;
        }
        let mut medium = Medium {
            kind,
            first_node: keys.first_node,
            shear_modulus_pa: keys.shear_modulus_pa,
            density_kg_per_m3: keys.density_kg_per_m3,
            spacing_m: slider.spacing_m(),
            direct_effect: vec![0.0; slider.blocks as usize],
            evolution_effect: Vec::new(),
            critical_slip_m: Vec::new(),
            normal_stress_pa: Vec::new(),
            prestress_pa: Vec::new(),
        };
        let nodes = 0..slider.blocks as usize;
        let by_node = |values: &[f64]| {
            nodes.clone().map(|n| at_depth(&keys.profile_m, values, medium.depth_m(n))).collect::<Vec<f64>>()
        };
        let [a, b, slip_m, sigma_pa] = lists.map(|list| by_node(list));
        let is_uniform = scenario.time.start == Start::Uniform;
        let velocity_m_per_s = match scenario.friction.initial_velocity_m_per_s {
            0.0 if is_uniform => velocity,
            0.0 => velocity * libm::exp(law.initial_kick),
            given_m_per_s => given_m_per_s,
        };
        let (v0, f0) = (law.reference_velocity_m_per_s, law.reference_coefficient);
        let friction_pa = |n: usize, phi: f64| {
            let law = RateAndState { direct_effect: a[n], ..law };
            sigma_pa[n] * law.coefficient(velocity_m_per_s, f0 + b[n] * phi)
        };
        let radiated_pa = medium.radiation_pa_s_per_m() * velocity_m_per_s;
        let (states, prestress_pa): (Vec<f64>, Vec<f64>) = if is_uniform {
            let strongest = nodes.clone().fold(0, |most, n| if a[n] > a[most] { n } else { most });
            let rubbing_pa = friction_pa(strongest, libm::log(v0 / velocity_m_per_s));
            let state = |n: usize| {
                let x = rubbing_pa / (a[n] * sigma_pa[n]);
                let ln_sinh = if x > LARGE { x - std::f64::consts::LN_2 } else { libm::log(libm::sinh(x)) };
                (a[n] / b[n]) * (libm::log(2.0 * v0 / velocity_m_per_s) + ln_sinh) - f0 / b[n]
            };
            nodes.map(|n| (state(n), rubbing_pa + radiated_pa)).unzip()
        } else {
            let phi = libm::log(v0 * keys.initial_theta_ratio / velocity);
            nodes.map(|n| (phi, friction_pa(n, phi) + radiated_pa)).unzip()
        };
        medium = Medium {
            direct_effect: a,
            evolution_effect: b,
            critical_slip_m: slip_m,
            normal_stress_pa: sigma_pa,
            prestress_pa,
            ..medium
        };
        Some(FaultLine { medium, velocity_m_per_s, states })
    }
}

/// The value at a depth: of a single one that, otherwise linear between ascending knots and constant beyond.
fn at_depth(knots_m: &[f64], values: &[f64], depth_m: f64) -> f64 {
    match (knots_m.partition_point(|knot_m| *knot_m <= depth_m), values) {
        (_, [value]) | (0, [value, ..]) => *value,
        (behind, _) if behind == knots_m.len() => values[behind - 1],
        (behind, _) => {
            let (from_m, start) = (knots_m[behind - 1], values[behind - 1]);
            start + (values[behind] - start) * ((depth_m - from_m) / (knots_m[behind] - from_m))
        }
    }
}
