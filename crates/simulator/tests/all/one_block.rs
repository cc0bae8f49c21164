//! One block on its driving spring: every law is compared with a line of algebra, and the fast solver with the
//! plain one.
//!
//! A stuck block is loaded by `S V` per second, where `S` is `K` in series with the friction spring, if there is
//! one. It slips at `mu_s p`. As `m u'' = K (V t - u) - mu_d p` with a fast slip, it overshoots its new place
//! `A = (mu_s - mu_d) p / K` away by as much, or, with a damping `E`, by `exp(-pi z / sqrt(1 - z^2))` of it, where
//! `z = E / (2 sqrt(K m))`.

use asperity_model::Plan;
use asperity_model::law::laws::FrictionLaw;
use asperity_record::{Direction, StepRecord};
use asperity_simulator::SolverKind;

use crate::fast_and_plain::{agree, run, switching};

const DRIVE_N_PER_M: f64 = 8e5;
const VELOCITY_M_PER_S: f64 = 2e-3;
const MASS_KG: f64 = 0.012;
/// `mu_s p`, `mu_d p` and their difference.
const STATIC_N: f64 = 280.0;
const SLIDING_N: f64 = 180.0;
const DROP_N: f64 = 100.0;
const RADIATION_KG_PER_S: f64 = 20.0;

fn plan(law: FrictionLaw, sets: &[&str]) -> Plan {
    let law = format!("friction.law={}", law.word());
    let block = [
        "parameter_set=as-stated",
        "slider.blocks=1",
        "time.step_s=2e-6",
        "time.duration_s=0.8",
        "drive.velocity_m_per_s=2e-3",
    ];
    asperity_testkit::plan("default", &[&block[..], &[&law[..]], sets].concat())
}

/// The keys of a law, `S`, and the overshoot over `A`.
fn expected(law: FrictionLaw) -> (&'static [&'static str], f64, f64) {
    // E L_y L_z / L, the `k` of a single block.
    let friction_n_per_m = 2.5e6;
    let in_series_n_per_m = DRIVE_N_PER_M * friction_n_per_m / (DRIVE_N_PER_M + friction_n_per_m);
    match law.word() {
        "interfacial-springs" => (&[], in_series_n_per_m, 1.0),
        "rigid" => (&[], DRIVE_N_PER_M, 1.0),
        "velocity-weakening" => {
            let damping = RADIATION_KG_PER_S / (2.0 * (DRIVE_N_PER_M * MASS_KG).sqrt());
            let overshoot = (-std::f64::consts::PI * damping / (1.0 - damping * damping).sqrt()).exp();
            (
                &["friction.weakening_velocity_m_per_s=1e9", "friction.radiation_kg_per_s=20"],
                DRIVE_N_PER_M,
                overshoot,
            )
        }
        other => panic!("{other} needs its algebra here"),
    }
}

#[test]
fn every_law_sticks_and_slips_as_algebra_says() {
    // Junctions have closed forms of their own (`src/junctions/tests.rs`).
    let is_one_contact = |law: &&FrictionLaw| law.sticks() && **law != FrictionLaw::Junctions;
    for &law in FrictionLaw::ALL.iter().filter(is_one_contact) {
        let (sets, loading_n_per_m, overshoot) = expected(law);
        let plan = plan(law, sets);
        let (records, ..) = run(&plan, SolverKind::Plain);
        let found = switching(&records);
        let is = |found: f64, expected: f64, what: &str| {
            assert!((found / expected - 1.0).abs() < 5e-3, "{law:?}, {what}: {found}, not {expected}");
        };
        let slip_m = (1.0 + overshoot) * DROP_N / DRIVE_N_PER_M;
        let after_n = SLIDING_N - overshoot * DROP_N;
        let rate_n_per_s = loading_n_per_m * VELOCITY_M_PER_S;
        is(found[0].time_s, STATIC_N / rate_n_per_s, "the first slip");
        let slips: Vec<[&StepRecord; 2]> = found.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        assert!(slips.len() >= 3, "{law:?}: {} slips", slips.len());
        for (number, [detached, attached]) in slips.iter().enumerate() {
            let [before, after] = [&detached.switches[0], &attached.switches[0]];
            assert_eq!(
                (before.direction, after.direction),
                (Direction::Detach, Direction::Attach),
                "{law:?}"
            );
            is(detached.driving_force_n, STATIC_N, "the load at a detachment");
            is(attached.driving_force_n, after_n, "the load behind a slip");
            is(after.displacement_m - before.displacement_m, slip_m, "a slip");
            if let Some([next, _]) = slips.get(number + 1) {
                is(next.time_s - attached.time_s, (STATIC_N - after_n) / rate_n_per_s, "a rest");
            }
            // Nothing but the contact takes energy.
            let energy = attached.energy;
            assert_eq!(energy.viscous_loss_j, 0.0, "{law:?}");
        }
    }
}

#[test]
fn the_fast_solver_does_what_the_plain_one_does() {
    let cases: [&[&str]; 7] = [
        &[],
        &["drive.kind=top", "prestress.ratio=0.3"],
        &["drive.hold_from_s=0.3", "normal_load.schedule_s=[0.3,0.6]", "normal_load.schedule_n=[400,100]"],
        &["drive.until_load_ratio=0.5", "prestress.profile=[0.3]"],
        &["friction.static_spread=0.1", "slider.relative_damping=30"],
        &["slider.mass_kg=1e-4", "time.step_s=2e-7", "time.duration_s=0.25"],
        &["drive.stiffness_n_per_m=0", "prestress.ratio=0.9", "time.duration_s=1e-4"],
    ];
    let springs: [&[&str]; 4] = [
        &["friction.reattach=two-way"],
        &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3"],
        // At 400 N the force equals the threshold in step 115,500, and rounding decides.
        &["time.start=loaded", "normal_load.total_n=399"],
        &["initial_velocity.amplitude_m_per_s=0.1", "initial_velocity.mode=0"],
    ];
    for &law in FrictionLaw::ALL.iter().filter(|law| law.sticks()) {
        let of_springs = springs.iter().filter(|_| law == FrictionLaw::InterfacialSprings);
        for sets in cases.iter().chain(of_springs) {
            let plan = plan(law, sets);
            let what = format!("{law:?}, {sets:?}");
            assert!(agree(&plan, &what).switches > 0, "{what}");
            let mut fast = SolverKind::Fast.start(plan.clone());
            while fast.next_record().unwrap().is_some() {}
            assert!(fast.snapshot().fits(&plan) && fast.counters().fit(plan.steps - plan.initial.step));
        }
    }
}
