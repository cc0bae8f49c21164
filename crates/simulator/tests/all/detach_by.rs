//! Contacts that detach by the force of their friction springs: speeds of fronts, and the step of each detachment.

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_simulator::{Plain, SolverKind};
use asperity_testkit::plan;

use crate::front_speed::front_speed;

/// The speed over `c` of a front between the middle and eleven twelfths of a chain at `tau = 0.6`, by the definition of
/// docs/model.md.
fn speed(blocks: u32, ratio: &str, detach_by: &str, kind: SolverKind) -> f64 {
    let tau = 0.6;
    let n = f64::from(blocks);
    let step_s = 1e-3 * (0.012 / n / (2.5e6 * (n - 1.0))).sqrt();
    let sets = [
        format!("slider.blocks={blocks}"),
        "slider.relative_damping=0".to_owned(),
        "friction.law=interfacial-springs".to_owned(),
        format!("friction.interfacial_stiffness_ratio={ratio}"),
        format!("friction.detach_by={detach_by}"),
        format!("prestress.ratio={}", 0.45 + 0.25 * tau),
        format!("prestress.first_block_ratio={}", 0.25 * (1.0 - tau) + 1e-3),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", (1.3 * n / 1e-3).round() * step_s),
    ];
    let plan = Plan::new(&resolve("front", &sets).unwrap_or_else(|errors| panic!("{errors}")));
    front_speed(&plan, kind).expect("the front comes so far")
}

/// The speeds that a short program found which differs only in the test of detachment (docs/model.md): softer springs
/// make fronts slower by their own force, faster by that of all else.
#[test]
fn fronts_are_slower_where_springs_detach_contacts() {
    // The softer the springs, the longer a front takes to become steady.
    for (blocks, ratio, by_force, by_spring) in
        [(120, "10", 1.287, 1.160), (120, "1", 1.315, 1.060), (500, "0.1", 1.322, 1.020)]
    {
        for (detach_by, expected) in [("force", by_force), ("spring", by_spring)] {
            let [plain, fast] =
                [SolverKind::Plain, SolverKind::Fast].map(|kind| speed(blocks, ratio, detach_by, kind));
            assert_eq!(plain, fast, "{ratio} {detach_by}");
            assert!((fast - expected).abs() < 1.5e-3, "{ratio} {detach_by}: {fast} {expected}");
        }
    }
}

/// Every detachment is in the first step in which the spring's force reaches the threshold, whatever the tangential
/// force; both forces are equal at rest, so the first block detaches at about the same time.
#[test]
fn a_contact_detaches_where_its_spring_reaches_the_threshold() {
    let sets = ["drive.velocity_m_per_s=0.05", "time.step_s=1e-7", "time.duration_s=0.02"];
    let onset = |detach_by: &str| {
        let plan = plan("ten-blocks", &[&sets[..], &[detach_by]].concat());
        let by_spring = plan.friction.law.detaches_by_spring();
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let mut plain = Plain::new(plan.clone());
        let (mut first, mut apart) = (None, 0);
        while plain.state().step < plan.steps {
            let before = plain.state().clone();
            plain.take_step();
            let after = plain.state();
            for n in (0..plan.blocks).filter(|n| before.slip[*n] == 0.0) {
                let spring_n = kt * (before.displacement_m[n] - before.stick_position_m[n]).abs();
                let reaches = |force_n: f64| force_n >= plan.friction.static_threshold_n[n];
                let tau_n = after.tangential_force_n[n].abs();
                assert_eq!(after.slip[n] != 0.0, reaches(if by_spring { spring_n } else { tau_n }), "{n}");
                apart += u32::from(reaches(spring_n) != reaches(tau_n));
                first = first.or((after.slip[n] != 0.0).then_some(after.step));
            }
        }
        (first.expect("a block slips") as f64, apart)
    };
    let [(by_force, _), (by_spring, apart)] =
        [onset("friction.detach_by=force"), onset("friction.detach_by=spring")];
    assert!((by_spring / by_force - 1.0).abs() < 0.03, "{by_force} {by_spring}");
    assert!(apart > 100, "{apart}");
}
