//! Physical laws for any parameters, tested with the plain stepper on small chains and short times.

use asperity_model::Plan;
use asperity_model::theory::analytic;
use asperity_record::{Direction, Record, WindowRecord};
use asperity_simulator::{Plain, Solver, SolverKind};
use asperity_testkit::plan;

use crate::fast_and_plain::{fields, records, run, steps, windows};

/// Energies of a chain: kinetic, in the springs between blocks, in the driving
/// spring, and in the friction springs of stuck blocks.
fn energy_j(plan: &Plan, solver: &Plain) -> f64 {
    let state = solver.state();
    let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    let drive_m = plan.drive.velocity_m_per_s * plan.grid.time_s(state.step) - u[0];
    let kinetic: f64 = v.iter().map(|v| 0.5 * plan.block_mass_kg * v * v).sum();
    let between: f64 =
        u.windows(2).map(|u| 0.5 * plan.elastic.stiffness_n_per_m * (u[1] - u[0]).powi(2)).sum();
    let friction: f64 = (0..u.len())
        .map(|n| (1.0 - state.slip[n]) * 0.5 * kt * (u[n] - state.stick_position_m[n]).powi(2))
        .sum();
    kinetic + between + friction + 0.5 * plan.drive.stiffest_n_per_m() * drive_m * drive_m
}

/// Runs a scenario step by step and returns the drive's work and the residual of the energy balance:
/// energy gained minus drive work plus losses, including the energy that friction springs lose at
/// detachment and gain at re-attachment.
fn energy_balance_j(plan: &Plan) -> (f64, f64) {
    let mut solver = Plain::new(plan.clone());
    let dt = plan.grid.step_s();
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    let initial_j = energy_j(plan, &solver);
    let (mut work_j, mut losses_j, mut switched_j) = (0.0, 0.0, 0.0);
    let mut switches = 0;
    for _ in 0..plan.steps {
        let slides: Vec<f64> = solver.state().slip.clone();
        let stick: Vec<f64> = solver.state().stick_position_m.clone();
        work_j += solver.take_step().total_n * plan.drive.velocity_m_per_s * dt;
        let state = solver.state();
        let v = &state.velocity_m_per_s;
        for n in 0..v.len() {
            losses_j += slides[n] * plan.friction.dynamic_friction_n[n] * v[n].abs() * dt;
        }
        losses_j +=
            v.windows(2).map(|v| plan.elastic.damping_kg_per_s * (v[1] - v[0]).powi(2) * dt).sum::<f64>();
        for &n in solver.switched() {
            switches += 1;
            let spring_j = |stick: f64| 0.5 * kt * (state.displacement_m[n] - stick).powi(2);
            if state.slip[n] == 1.0 {
                switched_j -= spring_j(stick[n]);
            } else {
                switched_j += spring_j(state.stick_position_m[n]);
            }
        }
    }
    assert!(switches > 4, "a run without slip would test little");
    (work_j, energy_j(plan, &solver) - initial_j - work_j + losses_j - switched_j)
}

#[test]
fn energy_is_accounted_for_to_first_order_in_dt() {
    for set in ["as-coded", "as-stated"] {
        let balance = |dt: &str| {
            energy_balance_j(&plan(
                "ten-blocks",
                &[
                    &format!("parameter_set={set}"),
                    "time.duration_s=0.5",
                    "drive.velocity_m_per_s=8e-4",
                    &format!("time.step_s={dt}"),
                ],
            ))
        };
        let ((work_j, coarse_j), (_, fine_j)) = (balance("4e-7"), balance("1e-7"));
        assert!(coarse_j.abs() < 2e-3 * work_j, "{set}: {coarse_j} J of {work_j} J are lost");
        // A quarter of the step: a first-order error falls to a quarter.
        assert!(fine_j.abs() < 0.35 * coarse_j.abs(), "{set}: {coarse_j} J and {fine_j} J");
    }
}

#[test]
fn single_modes_ring_and_decay_as_5_28_says() {
    for (mode, damping) in [("1", "0"), ("7", "0.3"), ("19", "0"), ("19", "0.2"), ("19", "1"), ("19", "3")] {
        let error = |dt: &str| {
            let plan = plan(
                "ring-down",
                &[
                    "slider.blocks=20",
                    &format!("initial_velocity.mode={mode}"),
                    &format!("slider.relative_damping={damping}"),
                    &format!("time.step_s={dt}"),
                    "time.duration_s=1e-3",
                    "recording.sample_s=0",
                    "recording.window=[]",
                ],
            );
            let shape = analytic::mode_shape(mode.parse().unwrap(), 20);
            let rate = (plan.elastic.stiffness_n_per_m / plan.block_mass_kg).sqrt();
            let initial = plan.initial.velocity_m_per_s[0];
            let mut solver = Plain::new(plan.clone());
            let mut worst: f64 = 0.0;
            for step in 1..=plan.steps {
                solver.take_step();
                let phase = plan.grid.time_s(step) * rate;
                let theory = analytic::mode_velocity(shape, damping.parse().unwrap(), phase);
                worst = worst.max((solver.state().velocity_m_per_s[0] / initial - theory).abs());
            }
            worst
        };
        let (coarse, fine) = (error("4e-7"), error("1e-7"));
        assert!(fine < 0.01, "mode {mode}, damping {damping}: off by {fine}");
        assert!((2.5..6.0).contains(&(coarse / fine)), "mode {mode}, damping {damping}: {coarse} and {fine}");
    }
}

#[test]
fn force_in_a_stuck_chain_decays_by_the_discrete_factor() {
    for ratio in [0.1, 1.0, 10.0] {
        let plan = plan(
            "first-precursor",
            &[
                &format!("friction.interfacial_stiffness_ratio={ratio}"),
                "time.step_s=1e-7",
                "time.duration_s=0.03",
            ],
        );
        let mut solver = Plain::new(plan.clone());
        for _ in 0..plan.steps {
            solver.take_step();
        }
        let state = solver.state();
        assert_eq!(state.detached, 0);
        let decay = analytic::discrete_decay_per_block(ratio);
        for n in 0..4 {
            let found = state.tangential_force_n[n + 1] / state.tangential_force_n[n];
            assert!((found / decay - 1.0).abs() < 0.02, "k_t/k {ratio}, block {}: {found} {decay}", n + 1);
        }
        // The friction springs balance the drive, except for the vibration from its start.
        let held: f64 = (0..plan.blocks)
            .map(|n| {
                plan.friction.interfacial_stiffness_n_per_m
                    * (state.displacement_m[n] - state.stick_position_m[n])
            })
            .sum();
        let drive = plan.drive.total_force_n(plan.drive_point_m(plan.steps, u64::MAX), &state.displacement_m);
        assert!((held / drive - 1.0).abs() < 5e-3, "{held} N of {drive} N");
    }
}

#[test]
fn blocks_detach_at_their_threshold_and_attach_at_rest() {
    let plan = plan(
        "ten-blocks",
        &["normal_load.tilt=0.3", "time.step_s=1e-7", "time.duration_s=0.5", "drive.velocity_m_per_s=1.6e-3"],
    );
    let mut solver = Plain::new(plan.clone());
    let (mut detached, mut attached) = (0, 0);
    let mut before = solver.state().clone();
    for _ in 0..plan.steps {
        solver.take_step();
        let now = solver.state();
        for n in 0..plan.blocks {
            let tau = now.tangential_force_n[n];
            let overloaded = tau.abs() >= plan.friction.static_threshold_n[n];
            let at_rest = now.velocity_m_per_s[n] <= 0.0;
            let switches = if before.slip[n] == 1.0 { at_rest } else { overloaded };
            assert_eq!(switches, now.slip[n] != before.slip[n], "block {} at step {}", n + 1, now.step);
            if switches && now.slip[n] == 1.0 {
                detached += 1;
                assert_eq!(now.stick_position_m[n], before.stick_position_m[n]);
            } else if switches {
                attached += 1;
                let kt = plan.friction.interfacial_stiffness_n_per_m;
                assert_eq!(now.stick_position_m[n], now.displacement_m[n] - tau / kt);
            }
        }
        before.clone_from(now);
    }
    assert!(detached > 10 && attached > 10, "{detached} and {attached}");
}

#[test]
fn displacements_before_slip_converge_to_first_order_in_dt() {
    let end = |dt: &str| {
        let plan = plan(
            "ten-blocks",
            &["parameter_set=as-stated", &format!("time.step_s={dt}"), "time.duration_s=2e-3"],
        );
        let mut solver = Plain::new(plan.clone());
        for _ in 0..plan.steps {
            solver.take_step();
        }
        solver.state().displacement_m[0]
    };
    let (coarse, middle, fine) = (end("8e-8"), end("4e-8"), end("2e-8"));
    let ratio = (coarse - middle) / (middle - fine);
    assert!((1.7..2.3).contains(&ratio), "ratio {ratio}");
}

#[test]
fn a_sliding_block_at_zero_velocity_feels_no_friction_and_stays_finite() {
    let plan = plan("ten-blocks", &["drive.velocity_m_per_s=0"]);
    let mut solver = Plain::new(plan);
    let mut state = solver.snapshot();
    state.slider.slip[4] = 1.0;
    state.slider.detached = 1;
    solver.restore(&state);
    solver.take_step();
    assert_eq!(solver.state().displacement_m, vec![0.0; 10]);
    assert_eq!(solver.state().velocity_m_per_s, vec![0.0; 10]);
    assert_eq!(solver.switched(), [4], "a velocity of zero is at rest");
}

#[test]
fn the_two_rules_differ_for_a_block_that_slides_backwards() {
    let after_one_step = |rule: &str| {
        let mut solver = Plain::new(plan("ten-blocks", &[&format!("friction.reattach={rule}")]));
        let mut state = solver.snapshot();
        state.slider.slip[4] = 1.0;
        state.slider.detached = 1;
        state.slider.velocity_m_per_s[4] = -1e-3;
        solver.restore(&state);
        solver.take_step();
        solver.state().slip[4]
    };
    assert_eq!(after_one_step("one-way"), 0.0);
    assert_eq!(after_one_step("two-way"), 1.0);
}

#[test]
fn records_hold_every_onset_and_end_and_the_cadences() {
    let plan = plan(
        "ten-blocks",
        &[
            "time.step_s=1e-7",
            "time.duration_s=0.9",
            "recording.sample_s=1e-3",
            "recording.fields_s=0.1",
            "recording.window=[{from_s=0.2, to_s=0.2001, every_s=1e-5, first_block=3, last_block=4}]",
        ],
    );
    let records = records(SolverKind::Plain.start(plan));
    let steps = steps(&records);
    let samples = steps.iter().filter(|record| record.step % 10_000 == 0).count();
    assert_eq!(samples, 900);
    assert_eq!(steps.last().unwrap().step, 9_000_000);
    assert!(steps.windows(2).all(|pair| pair[0].step < pair[1].step));
    // Every detachment from rest is followed by a record of the next step.
    for pair in steps.windows(2) {
        let detaches = pair[0].switches.iter().any(|switch| switch.direction == Direction::Detach);
        if pair[0].sliding == 0 && detaches {
            assert_eq!(pair[1].step, pair[0].step + 1);
            assert!(pair[1].sliding > 0);
        }
    }
    let fields: Vec<u64> = fields(&records).iter().map(|state| state.step).collect();
    assert_eq!(fields.iter().filter(|step| *step % 1_000_000 == 0).count(), 10, "0, 0.1, ... 0.9 s");
    assert!(fields.len() > 10, "and the edges of events");
    assert_eq!(windows(&records).len(), 11);
}

/// The states of ruptures are those of an always open window, restricted to steps in which enough blocks
/// slide; nothing else changes in the records of either solver.
#[test]
fn ruptures_are_recorded_while_they_are_large() {
    let plan = |sets: &[&str]| {
        let short = ["slider.blocks=12", "time.step_s=1e-7", "time.duration_s=0.1"];
        plan("default", &[&short[..], &["drive.velocity_m_per_s=2e-3"], sets].concat())
    };
    // While three blocks slide at once.
    let ruptures = ["recording.rupture_fields_from_blocks=3", "recording.rupture_fields_s=2e-5"];
    let open = "recording.window=[{from_s=0,to_s=0.1,every_s=2e-5,first_block=1,last_block=12}]";
    let all = records(SolverKind::Plain.start(plan(&[open])));
    let expected: Vec<&WindowRecord> =
        windows(&all).into_iter().filter(|record| record.sliding >= 3).collect();
    assert!(expected.len() > 30, "{} records", expected.len());
    let bare = plan(&[]);
    let with = plan(&ruptures);
    for kind in [SolverKind::Plain, SolverKind::Fast] {
        let [(bare, ..), (dense, ..)] = [&bare, &with].map(|plan| run(plan, kind));
        assert_eq!(windows(&dense).len(), expected.len());
        for (found, expected) in windows(&dense).iter().zip(&expected) {
            assert_eq!((found.step, found.sliding), (expected.step, expected.sliding));
            // The fast solver rounds differently.
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs().max(1e-6);
            let pairs = found.displacement_m.iter().zip(&expected.displacement_m);
            assert!(pairs.clone().all(|(a, b)| close(*a, *b)), "step {}", found.step);
        }
        let others: Vec<Record> =
            dense.into_iter().filter(|record| !matches!(record, Record::Window(_))).collect();
        assert!(others == bare, "the other records are the same to the bit");
    }
}

#[test]
fn a_run_that_overflows_says_where() {
    // A scenario with such a velocity is refused.
    let mut plan = plan("ten-blocks", &["time.duration_s=1e-3"]);
    plan.drive.velocity_m_per_s = 1e308;
    let (_, _, error) = run(&plan, SolverKind::Plain);
    let error = error.expect("an overflow must not pass unseen").to_string();
    assert!(error.contains("in step 1 ") && error.contains("is no longer finite: block 1 is at"), "{error}");
}

/// Arrival times of a front in a chain of 600 blocks without damping or friction springs, whose blocks
/// all have the same constant force: `(tau_0 - mu_d p) / (mu_s p - mu_d p)` is `tau`. The force on block
/// 1 slightly exceeds its threshold.
fn front_arrivals_s(tau: f64) -> (Plan, Vec<f64>) {
    const BLOCKS: usize = 600;
    let (mu_s, mu_d) = (0.7, 0.45);
    let even = mu_d + tau * (mu_s - mu_d);
    let mut profile = vec![even; BLOCKS];
    profile[0] = mu_s * (1.0 + 1e-12);
    let sets = |dt: f64| {
        [
            format!("slider.blocks={BLOCKS}"),
            "slider.relative_damping=0".to_owned(),
            "friction.law=rigid".to_owned(),
            format!("friction.static_coefficient={mu_s}"),
            format!("friction.dynamic_coefficient={mu_d}"),
            "drive.velocity_m_per_s=0".to_owned(),
            format!("prestress.profile={profile:?}"),
            format!("time.step_s={dt:e}"),
            format!("time.duration_s={:e}", dt * 3_000_000.0),
            "recording.sample_s=0".to_owned(),
            "recording.fields_s=0".to_owned(),
            "recording.event_fields=false".to_owned(),
        ]
    };
    let any = plan("default", &sets(1e-11));
    let dt = 2e-4 * (any.block_mass_kg / any.elastic.stiffness_n_per_m).sqrt();
    // Few digits, so that the duration is a whole number of steps.
    let dt: f64 = format!("{dt:.2e}").parse().unwrap();
    let plan = plan("default", &sets(dt));
    let mut solver = SolverKind::Fast.start(plan.clone());
    let mut arrivals_s = vec![f64::NAN; BLOCKS];
    let mut left = BLOCKS;
    while left > 0 {
        let Some(record) = solver.next_record().unwrap() else { break };
        let Record::Step(record) = record else { continue };
        for switch in record.switches.iter().filter(|switch| switch.direction == Direction::Detach) {
            let arrival_s = &mut arrivals_s[switch.block as usize - 1];
            if arrival_s.is_nan() {
                *arrival_s = record.time_s;
                left -= 1;
            }
        }
    }
    (plan, arrivals_s)
}

/// v / c = 1 / sqrt(1 - tau^2) (Amundsen et al., Phys. Rev. E 92, 032406 (2015)).
#[test]
fn a_front_under_even_prestress_runs_as_fast_as_the_formula_says() {
    for tau in [0.3, 0.6, 0.9] {
        let (plan, arrivals_s) = front_arrivals_s(tau);
        let c = plan.spacing_m * (plan.elastic.stiffness_n_per_m / plan.block_mass_kg).sqrt();
        // A straight line through the arrivals at blocks 300 to 550, by least squares.
        let (from, to) = (300, 550);
        let points: Vec<(f64, f64)> =
            (from..=to).map(|block| (block as f64 * plan.spacing_m, arrivals_s[block - 1])).collect();
        let count = points.len() as f64;
        let (mean_x, mean_t) =
            points.iter().fold((0.0, 0.0), |(x, t), point| (x + point.0 / count, t + point.1 / count));
        let (xx, xt) = points.iter().fold((0.0, 0.0), |(xx, xt), (x, t)| {
            (xx + (x - mean_x) * (x - mean_x), xt + (x - mean_x) * (t - mean_t))
        });
        let speed = xx / xt / c;
        let expected = 1.0 / (1.0 - tau * tau).sqrt();
        assert!((speed / expected - 1.0).abs() < 5e-4, "tau = {tau}: {speed}, not {expected}");
    }
}
