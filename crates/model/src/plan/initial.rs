//! The state of the slider before its first step.

use crate::body::chain::{SteadyLoading, Stiffness};
use crate::body::elastic::gaps;
use crate::body::lattice::Lattice;
use crate::law::rate_and_state::RateAndState;
use crate::plan::derive::evolution_effects;
use crate::plan::state::SliderState;
use crate::plan::{Drive, Plan};
use crate::scenario::Scenario;
use crate::scenario::choices::Start;

/// The state at time 0 of a run that starts at rest.
pub(crate) fn state(
    scenario: &Scenario,
    elastic: &Lattice,
    spacing_m: f64,
    springs_n_per_m: &[f64],
    drive: &Drive,
    normal_load_n: &[f64],
    prestress_n: &[f64],
) -> SliderState {
    let (nodes, freedoms) = (elastic.nodes(), elastic.freedoms());
    // Displacements whose spring forces equal the profile, from u_1 = 0; in other bodies there is none.
    let u = elastic.as_chain().map_or_else(
        || vec![0.0; freedoms],
        |chain| chain.displacements_m(&shear_n(scenario, normal_load_n, spacing_m)),
    );

    // Each friction spring balances the pull of the neighbouring blocks.
    // The drive's springs pull as well: their elongation is measured from the undeformed grid.
    let mut pull = elastic.tangential_force_n(&u);
    for spring in &drive.springs {
        pull[spring.block] += spring.force_n(0.0, u[spring.block]);
    }
    for (pull, prestress) in pull.iter_mut().zip(prestress_n) {
        *pull += prestress;
    }
    // Without a foundation all nodes are contacts, and all their freedoms tangential.
    let anchor = |n: usize| {
        let kt = springs_n_per_m[n % springs_n_per_m.len()];
        if kt > 0.0 { u[n] - pull[n] / kt } else { u[n] }
    };
    let stick_position_m = (0..freedoms).map(anchor).collect();

    let amplitude = scenario.initial_velocity.amplitude_m_per_s;
    let mode = f64::from(scenario.initial_velocity.mode);
    let velocity_m_per_s = (0..freedoms)
        .map(|n| {
            if amplitude == 0.0 {
                return 0.0;
            }
            let phase = std::f64::consts::PI * mode * (n as f64 + 0.5) / nodes as f64;
            amplitude * libm::cos(phase)
        })
        .collect();
    SliderState { displacement_m: u, velocity_m_per_s, stick_position_m, ..SliderState::default() }
}

/// The requested initial shear of every block. The last block takes the negative of the sum of the
/// others, so that the shear adds up to 0.
pub(crate) fn shear_n(scenario: &Scenario, normal_load_n: &[f64], spacing_m: f64) -> Vec<f64> {
    let mut tau0 = shear_profile(beta(scenario), normal_load_n, spacing_m);
    for ((tau, ratio), p) in tau0.iter_mut().zip(&scenario.initial_shear.profile).zip(normal_load_n) {
        *tau += ratio * p;
    }
    tau0
}

/// The constant external force on each block; empty where there is none.
pub(crate) fn prestress_n(scenario: &Scenario, normal_load_n: &[f64]) -> Vec<f64> {
    let prestress = &scenario.prestress;
    let gaps = gaps(normal_load_n.len()) as f64;
    let of = |n: usize| {
        let first = if n == 0 { prestress.first_block_ratio } else { 0.0 };
        let rise = prestress.rise_ratio * (n as f64 / gaps);
        let listed = prestress.profile.get(n).copied().unwrap_or(0.0);
        let steps = prestress.from_blocks.partition_point(|from| *from <= (n + 1) as f64);
        let step = steps.checked_sub(1).map_or(0.0, |last| prestress.from_blocks_ratio[last]);
        (prestress.ratio + first + rise + step + listed) * normal_load_n[n]
    };
    let forces: Vec<f64> = (0..normal_load_n.len()).map(of).collect();
    if forces.iter().all(|force| *force == 0.0) { Vec::new() } else { forces }
}

/// The amplitude of (5.50): that of the scenario, and the one that prevented lateral expansion causes, `4 nu L_z / L_x`.
///
/// Under the normal load a free slider with Poisson's ratio `nu` would expand along `x` by the
/// strain `nu F_N / (E L_x L_y)`. Friction prevents that, which leaves a compressive force
/// `nu F_N L_z / L_x` through the middle cross-section. The friction on either half balances it,
/// and the profile (5.50) gives `beta F_N / 4` for that friction. The shear is therefore
/// proportional to the load, and the amplitude is independent of it.
pub(crate) fn beta(scenario: &Scenario) -> f64 {
    let (slider, shear) = (&scenario.slider, &scenario.initial_shear);
    shear.beta + 4.0 * shear.poisson_ratio * slider.height_m / slider.length_m
}

/// Share of its static threshold that the first block has reached when a run starts loaded.
const LOADED: f64 = 0.999;

/// Advances the start of a plan to just before the first detachment. The stuck chain follows the
/// drive in steady motion, lag by damping included; this is the part of the stick phase that does
/// not depend on how it began.
pub(crate) fn start_loaded(plan: &mut Plan) {
    // Other bodies begin at rest.
    let Some(chain) = plan.elastic.as_chain() else { return };
    let stiffness = Stiffness::of(plan, &chain);
    let steady = SteadyLoading::of(plan, &stiffness, plan.outside(0, u64::MAX).advance_m());
    let anchors = plan.initial.stick_position_m.clone();
    let mut position_m = vec![0.0; plan.blocks];
    // The first step starts from these positions.
    steady.position_m(plan, &stiffness, &anchors, plan.outside(1, u64::MAX), &mut position_m);
    let mut steps = plan.steps as f64 - 1.0;
    for n in 0..plan.blocks {
        let kt = plan.friction.springs_n_per_m[n];
        let (force, rate) = (kt * (position_m[n] - anchors[n]), kt * steady.advance_m[n]);
        let room = LOADED * plan.friction.static_threshold_n[n];
        if force.abs() >= room {
            return;
        }
        if rate != 0.0 {
            steps = steps.min(if rate > 0.0 { (room - force) / rate } else { (room + force) / -rate });
        }
    }
    let stop = plan.drive.hold_from_step.unwrap_or(u64::MAX);
    let step = (steps as u64).min(stop);
    if step == 0 {
        return;
    }
    let displacement_m = position_m.iter().zip(&steady.advance_m).map(|(a, b)| a + step as f64 * b).collect();
    plan.initial.step = step;
    plan.initial.displacement_m = displacement_m;
    plan.initial.velocity_m_per_s = steady.velocity_m_per_s;
}

/// The states `psi_n` in which contacts begin by rate-and-state: those of a given `theta`, or of steady sliding at `V_l`,
/// the velocity of the drive; where the drive begins at rest, at that of the block, or else at `V_0`.
pub(crate) fn states_at_start(scenario: &Scenario, law: &RateAndState) -> Vec<f64> {
    let friction = &scenario.friction;
    let state = |(n, b): (usize, &f64)| {
        let speeds = [scenario.drive.velocity_m_per_s, friction.velocity_at_start_m_per_s(n)];
        let steady_m_per_s = speeds.into_iter().find(|speed| *speed > 0.0);
        match friction.theta_at_start_s(n) {
            0.0 => law.steady_state(*b, steady_m_per_s.unwrap_or(law.reference_velocity_m_per_s)),
            theta_s => law.state_of_theta(*b, theta_s),
        }
    };
    evolution_effects(scenario).iter().enumerate().map(state).collect()
}

/// Sets the start of a plan by rate-and-state, with the forces `start_n` from outside besides the drive.
///
/// Loaded, every block moves at its given `V(0)` or at `V = V_l e^x`, and springs and drive balance the friction at that
/// velocity, the damping `E V` and the dashpots: `M u = tau_p + D V - F - E V`, with `M` the stiffness of chain and
/// drive. The perturbation `x` must be in `u`: one of the velocity alone dies within `m V / (a p)` seconds. Otherwise blocks are
/// at rest with relaxed springs.
pub(crate) fn start_in_state(plan: &mut Plan, scenario: &Scenario, law: &RateAndState, start_n: &[f64]) {
    plan.initial.friction_state = states_at_start(scenario, law);
    let is_loaded = scenario.time.start == Start::Loaded;
    let Some(chain) = plan.elastic.as_chain().filter(|_| is_loaded) else { return };
    let perturbed_m_per_s = plan.drive.velocity_m_per_s * libm::exp(law.initial_kick);
    let velocity = |n: usize| match scenario.friction.velocity_at_start_m_per_s(n) {
        0.0 => perturbed_m_per_s,
        given_m_per_s => given_m_per_s,
    };
    let velocity_m_per_s: Vec<f64> = (0..plan.blocks).map(velocity).collect();
    let (outside, still) = (plan.outside(0, u64::MAX), vec![0.0; plan.blocks]);
    let states = outside.loads_n().into_iter().zip(&plan.initial.friction_state).zip(&velocity_m_per_s);
    let resists = |(n, ((p, state), v)): (usize, ((f64, &f64), &f64))| {
        plan.elastic.damping_force_n(&velocity_m_per_s, n)
            - (p * law.coefficient(*v, *state) + law.radiation_kg_per_s * v)
    };
    let mut pull_n: Vec<f64> = states.enumerate().map(resists).collect();
    outside.pull([&still, &still], |block, force_n| pull_n[block] += force_n);
    pull_n.iter_mut().zip(start_n).for_each(|(pull, start)| *pull += start);
    chain.stuck(&still, &plan.drive.stiffness_n_per_m(plan.blocks)).solve(&mut pull_n);
    plan.initial.stick_position_m.clone_from(&pull_n);
    plan.initial.displacement_m = pull_n;
    plan.initial.velocity_m_per_s = velocity_m_per_s;
}

/// `tau0_n = beta p_n (2 x_n / L - 1)` (5.50) at `x_n = (n - 1) a`.
pub fn shear_profile(beta: f64, normal_load_n: &[f64], spacing_m: f64) -> Vec<f64> {
    let length_m = spacing_m * gaps(normal_load_n.len()) as f64;
    normal_load_n
        .iter()
        .enumerate()
        .map(|(n, p)| beta * p * (2.0 * (n as f64 * spacing_m) / length_m - 1.0))
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::{Plan, Scenario, ScenarioSource};

    fn plan(sets: &[&str]) -> Plan {
        let source =
            sets.iter().fold(ScenarioSource::new("test", ""), |source, set| source.with_override(set));
        Plan::new(&Scenario::resolve_with(&source, &crate::Texts).unwrap_or_else(|errors| panic!("{errors}")))
    }

    #[test]
    fn expansion_pushes_through_the_middle_as_much_as_friction_holds() {
        let plan =
            plan(&["initial_shear.poisson_ratio=0.35", "normal_load.total_n=800", "slider.blocks=1000"]);
        let u = &plan.initial.displacement_m;
        let middle_n = plan.elastic.stiffness_n_per_m * (u[500] - u[499]);
        let expected_n = 0.35 * 800.0 * 0.02 / 0.1;
        assert!((middle_n / -expected_n - 1.0).abs() < 2e-3, "{middle_n} against {expected_n}");
    }

    #[test]
    fn a_prestress_steps_at_blocks_and_stuck_blocks_bear_anything() {
        let plan = plan(&[
            "slider.blocks=5",
            "prestress.ratio=0.1",
            "prestress.from_blocks=[2,4]",
            "prestress.from_blocks_ratio=[0.3,-0.2]",
            "friction.stuck_blocks=[1,5]",
        ]);
        let ratio =
            |of: &[f64]| -> Vec<f64> { of.iter().map(|force| (force / 80.0 * 1e6).round() / 1e6).collect() };
        assert_eq!(ratio(&plan.prestress_n), [0.1, 0.4, 0.4, -0.1, -0.1]);
        let mu_s = plan.friction.static_coefficient;
        assert_eq!(ratio(&plan.friction.static_threshold_n), [1e6, mu_s, mu_s, mu_s, 1e6]);
    }

    #[test]
    fn a_profile_from_a_file_is_held_by_the_springs() {
        let folder = std::env::temp_dir().join(format!("asperity-profile-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("profile.csv");
        std::fs::write(&path, "x_over_l,tau_over_p\n0,0.2\n0.5,-0.1\n1,0.3\n").unwrap();
        let set = format!("initial_shear.profile_csv={}", path.display());
        let plan = plan(&[&set, "slider.blocks=9"]);
        std::fs::remove_dir_all(&folder).unwrap();
        for (n, ratio) in [(0, 0.2), (1, 0.125), (4, -0.1), (6, 0.1), (8, 0.3)] {
            // The last block balances the others.
            let anchor = plan.initial.stick_position_m[n];
            let held =
                plan.friction.interfacial_stiffness_n_per_m * (plan.initial.displacement_m[n] - anchor);
            let expected = ratio * 400.0 / 9.0;
            assert!(n == 8 || (held - expected).abs() < 1e-6, "block {n}: {held} against {expected}");
        }
    }

    #[test]
    fn springs_hold_the_profile_of_5_50() {
        let source = ScenarioSource::new("test", "initial_shear.beta = 0.45\nslider.blocks = 11");
        let plan = Plan::new(&Scenario::resolve(&source).unwrap());
        let p = 400.0 / 11.0;
        for n in 0..11 {
            let tau = plan.elastic.spring_force_n(&plan.initial.displacement_m, n);
            let expected = 0.45 * p * (2.0 * n as f64 / 10.0 - 1.0);
            assert!((tau - expected).abs() < 1e-9, "block {}: {tau} against {expected}", n + 1);
            let spring = plan.friction.interfacial_stiffness_n_per_m
                * (plan.initial.displacement_m[n] - plan.initial.stick_position_m[n]);
            assert!((spring - expected).abs() < 1e-6, "block {}: {spring} against {expected}", n + 1);
        }
        assert_eq!(plan.initial.displacement_m[0], 0.0);
    }

    #[test]
    fn a_start_in_steady_sliding_is_in_balance_with_its_friction() {
        let cases: [&[&str]; 5] = [
            &[],
            &["drive.kind=top", "drive.tilt=0.5", "prestress.ratio=0.2"],
            &[
                "normal_load.tilt=-1",
                "friction.radiation_kg_per_s=1e4",
                "friction.initial_kick=-3",
                "friction.evolution=prz",
            ],
            &[
                "slider.blocks=1",
                "friction.inertia=false",
                "friction.radiation_kg_per_s=50",
                "slider.relative_damping=0",
            ],
            &["slider.blocks=3", "friction.evolution_offsets=[0.01,-0.002,0]", "friction.evolution=slip"],
        ];
        for sets in cases {
            let plan = plan(&[&["friction.law=rate-and-state"], sets].concat());
            let (law, initial) = (plan.friction.law.rate_and_state().unwrap(), &plan.initial);
            let (u, v) = (&initial.displacement_m, 1e-4 * law.initial_kick.exp());
            let mut pull_n: Vec<f64> = (0..plan.blocks).map(|n| plan.elastic.spring_force_n(u, n)).collect();
            plan.drive
                .springs
                .iter()
                .for_each(|spring| pull_n[spring.block] += spring.force_n(0.0, u[spring.block]));
            for (n, pull_n) in pull_n.iter().enumerate() {
                let (b, p) = (plan.friction.evolution_effects[n], plan.normal_load_n[n]);
                // f_0 + a ln(V / V_0) + b ln(V_0 / V_l).
                let friction = 0.6 + 0.01 * (v / 1e-6).ln() - b * 100.0_f64.ln();
                let expected_n = p * friction + law.radiation_kg_per_s * v;
                let prestress_n = plan.prestress_n.get(n).copied().unwrap_or(0.0);
                assert!(
                    (pull_n + prestress_n - expected_n).abs() < 1e-8 * 400.0,
                    "{sets:?}, block {n}: {pull_n}"
                );
                assert!((initial.velocity_m_per_s[n] / v - 1.0).abs() < 1e-14);
                assert!((initial.friction_state[n] - (0.6 - b * 100.0_f64.ln())).abs() < 1e-14);
                assert_eq!(plan.friction.static_threshold_n[n], 0.6 * p);
            }
            let state = initial.friction_state.clone();
            let rest =
                self::plan(&[&["friction.law=rate-and-state", "time.start=at-rest"], sets].concat()).initial;
            assert_eq!((rest.friction_state, rest.step), (state, 0));
            assert!(rest.displacement_m.iter().chain(&rest.velocity_m_per_s).all(|number| *number == 0.0));
        }
        assert!(
            plan(&[]).initial.friction_state.is_empty() && plan(&[]).friction.evolution_effects.is_empty()
        );
    }

    #[test]
    fn a_free_start_is_in_balance_with_its_friction_and_dashpots() {
        let sets = [
            "friction.law=rate-and-state",
            "slider.blocks=3",
            "drive.kind=top",
            "friction.initial_velocities_m_per_s=[1e-5,3e-4,1e-4]",
            "friction.initial_theta_s=0.02",
            "friction.radiation_kg_per_s=30",
            "prestress.ratio=0.1",
            // What jumps at once does so behind the start.
            "prestress.course_s=[0,0]",
            "prestress.course_ratio=[0.05,0.4]",
        ];
        let plan = plan(&sets);
        let (initial, p) = (&plan.initial, 400.0 / 3.0);
        let v = [1e-5, 3e-4, 1e-4];
        assert_eq!(initial.velocity_m_per_s, v);
        for n in 0..3 {
            let spring = &plan.drive.springs[n];
            let pull_n = plan.elastic.spring_force_n(&initial.displacement_m, n)
                + plan.elastic.damping_force_n(&v, n)
                + spring.force_n(0.0, initial.displacement_m[n])
                + 0.15 * p;
            assert!((initial.friction_state[n] - (0.6 + 0.015 * 0.02f64.ln())).abs() < 1e-14);
            let friction = 0.6 + 0.01 * (v[n] / 1e-6).ln() + 0.015 * 0.02f64.ln();
            let expected_n = p * friction + 30.0 * v[n];
            assert!((pull_n - expected_n).abs() < 1e-8 * p, "block {n}: {pull_n} for {expected_n}");
        }
        let prz = self::plan(&[&sets[..], &["friction.evolution=prz"]].concat());
        let [ageing, prz] = [&plan, &prz].map(|plan| plan.initial.friction_state[0]);
        assert!((ageing - prz - 0.015 * 2f64.ln()).abs() < 1e-14, "prz has 2 D_c");
    }

    #[test]
    fn prestress_is_balanced_by_the_friction_springs() {
        let profile = format!(
            "prestress.profile={:?}",
            [0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2]
        );
        let plan = plan(&["slider.blocks=11", "normal_load.tilt=0.3", "prestress.ratio=0.1", &profile]);
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        for (n, (force, p)) in plan.prestress_n.iter().zip(&plan.normal_load_n).enumerate() {
            assert!((force / p - (0.1 + 0.02 * n as f64)).abs() < 1e-12, "block {n}: {force}");
            let held = kt * (plan.initial.displacement_m[n] - plan.initial.stick_position_m[n]);
            assert!((held - force).abs() < 1e-9 * p, "block {n}: {held}");
        }
    }

    #[test]
    fn block_1_may_be_pushed_alone() {
        let plan = plan(&["slider.blocks=11", "prestress.ratio=0.5", "prestress.first_block_ratio=0.2"]);
        let ratios: Vec<f64> =
            plan.prestress_n.iter().zip(&plan.normal_load_n).map(|(force, p)| force / p).collect();
        assert!((ratios[0] - 0.7).abs() < 1e-12, "{ratios:?}");
        assert!(ratios[1..].iter().all(|ratio| (ratio - 0.5).abs() < 1e-12), "{ratios:?}");
    }

    #[test]
    fn a_prestress_may_rise_or_fall_along_the_slider() {
        let plan = plan(&["slider.blocks=11", "prestress.ratio=0.5", "prestress.rise_ratio=-0.2"]);
        for (n, (force, p)) in plan.prestress_n.iter().zip(&plan.normal_load_n).enumerate() {
            assert!((force / p - (0.5 - 0.02 * n as f64)).abs() < 1e-12, "block {n}: {force}");
        }
    }

    #[test]
    fn a_prestress_may_come_from_a_file_as_well() {
        let folder = std::env::temp_dir().join(format!("asperity-prestress-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("prestress.csv");
        std::fs::write(&path, "x_over_l,tau_over_p\n0,0\n1,0.2\n").unwrap();
        let with = plan(&["slider.blocks=11", &format!("prestress.profile_csv={}", path.display())]);
        std::fs::remove_dir_all(&folder).unwrap();
        assert!((with.prestress_n[5] - 0.1 * with.normal_load_n[5]).abs() < 1e-12);
        assert!(plan(&[]).prestress_n.is_empty(), "none, and none is added");
    }
}
