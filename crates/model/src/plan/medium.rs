//! A fault line in a medium as a scenario describes it, and how it starts.

use crate::body::medium::Medium;
use crate::law::rate_and_state::RateAndState;
use crate::scenario::Scenario;
use crate::scenario::choices::Start;
use crate::scenario::keys::List;

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
        let lists = keys.lists().map(|(_, list)| list);
        if !slider.is_in_medium() || !lists.iter().all(|list| keys.has_values(list)) {
            return None;
        }
        let (dz_m, nodes) = (slider.spacing_m(), 0..slider.blocks as usize);
        let depth_m = |n: usize| (n as f64 + keys.first_node.cells()) * dz_m;
        let by_node =
            |list: &List| nodes.clone().map(|n| at_depth(&keys.profile_m, list, depth_m(n))).collect();
        let [a, b, critical_slip_m, sigma_pa]: [Vec<f64>; 4] = lists.map(by_node);
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
        let (states, friction_pa): (Vec<f64>, Vec<f64>) = if is_uniform {
            let strongest = nodes.clone().fold(0, |most, n| if a[n] > a[most] { n } else { most });
            let even_pa = friction_pa(strongest, libm::log(v0 / velocity_m_per_s));
            let state = |n: usize| {
                let x = even_pa / (a[n] * sigma_pa[n]);
                let ln_sinh = if x > LARGE { x - std::f64::consts::LN_2 } else { libm::log(libm::sinh(x)) };
                (a[n] / b[n]) * (libm::log(2.0 * v0 / velocity_m_per_s) + ln_sinh) - f0 / b[n]
            };
            nodes.map(|n| (state(n), even_pa)).unzip()
        } else {
            let phi = libm::log(v0 * keys.initial_theta_ratio / velocity);
            nodes.map(|n| (phi, friction_pa(n, phi))).unzip()
        };
        let mut medium = Medium {
            kind: slider.medium,
            width_m: keys.width_m,
            first_node: keys.first_node,
            shear_modulus_pa: keys.shear_modulus_pa,
            density_kg_per_m3: keys.density_kg_per_m3,
            spacing_m: dz_m,
            prestress_pa: friction_pa,
            direct_effect: a,
            evolution_effect: b,
            critical_slip_m,
            normal_stress_pa: sigma_pa,
        };
        let radiated_pa = medium.radiation_pa_s_per_m() * velocity_m_per_s;
        medium.prestress_pa.iter_mut().for_each(|pa| *pa += radiated_pa);
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::at_depth;
    use crate::{FirstNode, Plan, Scenario, ScenarioSource, resolve};

    fn plan(name: &str, sets: &[&str]) -> Plan {
        Plan::new(&resolve(name, sets).unwrap_or_else(|errors| panic!("{errors}")))
    }

    /// The largest relative imbalance of friction, radiation and stress, over the nodes.
    fn imbalance(plan: &Plan) -> f64 {
        let (medium, law) = (plan.medium.as_ref().unwrap(), plan.friction.law.rate_and_state().unwrap());
        let of = |n: usize| {
            let (a, v) = (medium.direct_effect[n], plan.initial.velocity_m_per_s[n]);
            let psi = law.reference_coefficient + medium.evolution_effect[n] * plan.initial.friction_state[n];
            let sinh = v / (2.0 * law.reference_velocity_m_per_s) * (psi / a).exp();
            let rubbing_pa = medium.normal_stress_pa[n] * a * sinh.asinh();
            (rubbing_pa + medium.radiation_pa_s_per_m() * v) / medium.prestress_pa[n] - 1.0
        };
        (0..medium.nodes()).map(|n| of(n).abs()).fold(0.0, f64::max)
    }

    /// Numbers of the benchmark's description, and of its parameters.
    #[test]
    fn bp1_begins_as_its_description_says() {
        let plan = plan("seas-bp1-qd", &[]);
        let medium = plan.medium.as_ref().unwrap();
        assert!(medium.prestress_pa.iter().all(|tau_pa| (tau_pa / 26.546122365e6 - 1.0).abs() < 1e-10));
        assert!((medium.shear_speed_m_per_s() - 3464.0).abs() < 1e-9);
        assert!((medium.radiation_pa_s_per_m() - 4.62444e6).abs() < 1.0);
        assert!(imbalance(&plan) < 1e-12, "{}", imbalance(&plan));
        assert!(plan.initial.velocity_m_per_s.iter().all(|v| *v == 1e-9));
        let a = [0, 600, 660, 720, 1599].map(|n| medium.direct_effect[n]);
        assert!(a.iter().zip([0.01, 0.01, 0.0175, 0.025, 0.025]).all(|(a, right)| (a - right).abs() < 1e-15));
        assert_eq!((plan.normal_load_n[0], plan.normal_load_n[1]), (50e6 * 12.5, 50e6 * 25.0));
        assert!((plan.total_normal_load_n / (50e6 * 25.0 * 1599.5) - 1.0).abs() < 1e-13);
        let shear_pa = plan.initial.tangential_force_n[1] / 25.0;
        assert!((shear_pa / (26.546122365e6 - 4.62444e-3) - 1.0).abs() < 1e-10);
        // Waves pass a cell in dz / c_s, ruptures link within 30 s, and moments are per metre of strike.
        assert!((plan.scales.wave_speed_m_per_s() / 3464.0 - 1.0).abs() < 1e-12);
        assert!((plan.scales.link_time_ratio * plan.scales.block_time_s / 30.0 - 1.0).abs() < 1e-12);
        assert_eq!(plan.scales.modulus_n_per_m, 32_038_120_320.0);
        assert_eq!(plan.friction.law.rate_and_state().unwrap().event_speed_m_per_s, 1e-3);
        assert_eq!(
            plan.recording.series_blocks,
            [0, 100, 200, 300, 400, 500, 600, 700, 800, 1000, 1200, 1400]
        );
        let preview = resolve::<&str>("seas-bp1-qd", &[]).unwrap().preview().fault.unwrap();
        let lengths_m =
            [preview.cohesive_zone_cells, preview.nucleation_cells].map(|cells| 25.0 * cells.unwrap());
        assert_eq!(lengths_m.map(f64::round), [302.0, 1958.0]);
        // Its 36 events take some 400,000 steps.
        assert!((2e5..8e5).contains(&preview.steps), "{preview:?}");
    }

    #[test]
    fn a_steady_start_is_in_balance_at_the_perturbed_velocity() {
        let sets = [
            "time.start=steady",
            "medium.initial_theta_ratio=0.99",
            "friction.initial_kick=-2",
            "medium.evolution_effect=[0, 0.015]",
            "medium.first_node=half-cell",
        ];
        let plan = plan("seas-bp1-qd-coarse", &sets);
        let medium = plan.medium.as_ref().unwrap();
        assert!(imbalance(&plan) < 1e-12, "{}", imbalance(&plan));
        assert!(
            plan.initial.velocity_m_per_s.iter().all(|v| (v / (1e-9 * (-2f64).exp()) - 1.0).abs() < 1e-14)
        );
        let phi = (1e-6 * 0.99 / 1e-9f64).ln();
        assert!(plan.initial.friction_state.iter().all(|state| (state - phi).abs() < 1e-12));
        assert_eq!(
            (medium.first_node, medium.depth_m(0), medium.weight(0)),
            (FirstNode::HalfCell, 100.0, 1.0)
        );
        // The stations at 0 and 2.5 km.
        assert_eq!(plan.recording.series_blocks[..2], [0, 12]);
    }

    #[test]
    fn profiles_are_linear_between_knots_and_constant_beyond() {
        let at = |depth_m| at_depth(&[10.0, 20.0], &[1.0, 3.0], depth_m);
        assert_eq!([0.0, 10.0, 15.0, 20.0, 99.0].map(at), [1.0, 1.0, 2.0, 3.0, 3.0]);
        assert_eq!(at_depth(&[], &[7.0], 5.0), 7.0);
    }

    #[test]
    fn profiles_come_from_a_file_and_its_log_holds_them() {
        let path = std::env::temp_dir().join(format!("asperity-depths-{}.csv", std::process::id()));
        let head = "depth_m,normal_stress_pa,direct_effect,evolution_effect,critical_slip_m\n";
        let read = |rows: &str| {
            fs::write(&path, format!("{head}{rows}")).unwrap();
            let of = |list| format!("medium.{list}=[]");
            let lists =
                ["profile_m", "direct_effect", "evolution_effect", "critical_slip_m", "normal_stress_pa"];
            let set = format!("medium.profile_csv={}", path.display());
            let sets: Vec<String> = lists.into_iter().map(of).chain([set]).collect();
            resolve("seas-bp1-qd-coarse", &sets).map_err(|errors| errors.to_string())
        };
        let scenario = read("15000,5e7,0.01,0.015,0.008\n18000,5e7,0.025,0.015,0.008\n").unwrap();
        let built_in = plan("seas-bp1-qd-coarse", &[]);
        assert_eq!(Plan::new(&scenario).medium, built_in.medium);
        let logged = ScenarioSource::logged("run.mcap", scenario.to_commented_toml());
        assert_eq!(Scenario::resolve(&logged).unwrap(), scenario);
        for (rows, problem) in [
            ("1,1,1,1,1\n1,1,1,1,1\n", "csv:3: depth_m is 1"),
            ("1,1,1,1,1\n2,1,1,1,0\n", "csv:3: critical_slip_m is 0"),
            ("-1,1,1,1,1\n", "csv:2: depth_m is -1"),
            ("1,1,x,1,1\n", "csv:2: direct_effect of \"1,1,x,1,1\" is not a finite number"),
        ] {
            let error = read(rows).unwrap_err();
            assert!(error.contains(problem) && error.contains("medium.profile_csv: "), "{rows}: {error}");
        }
        fs::remove_file(&path).unwrap();
    }
}
