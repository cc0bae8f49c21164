//! Physical laws for any parameters, tested with the plain stepper on small chains and short times.

use asperity_model::theory::analytic;
use asperity_record::{Direction, Record, WindowRecord};
use asperity_simulator::{Plain, Solver, SolverKind};
use asperity_testkit::{SMALL_SLAB, plan};

use crate::fast_and_plain::{fields, last_energy, records, run, steps, windows};

/// What the scheme does is all that is missing in the balance of other energies, and of first order.
#[test]
fn the_scheme_does_less_work_in_shorter_steps() {
    let chain = ["time.duration_s=0.5", "drive.velocity_m_per_s=8e-4", "parameter_set=as-stated"];
    let slab = [&SMALL_SLAB[..], &["time.duration_s=0.05"]].concat();
    for (scenario, sets, steps_s) in [
        ("ten-blocks", &chain[..2], ["4e-7", "1e-7"]),
        ("ten-blocks", &chain, ["4e-7", "1e-7"]),
        ("slab", &slab, ["1e-5", "2.5e-6"]),
    ] {
        let [long, short] = steps_s.map(|step_s| {
            let plan = plan(scenario, &[sets, &[&format!("time.step_s={step_s}")]].concat());
            let energy = last_energy(&records(SolverKind::Plain.start(plan)));
            assert!(energy.friction_heat_j > 1e-2 * energy.drive_work_j, "{scenario} {sets:?}: {energy:?}");
            (energy.scheme_work_j / energy.drive_work_j).abs()
        });
        assert!(long < 2e-3 && short < 0.35 * long, "{scenario} {sets:?}: {long} {short}");
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
        let drive =
            plan.drive.total_force_n(plan.outside(plan.steps, u64::MAX).point_m, &state.displacement_m);
        assert!((held / drive - 1.0).abs() < 5e-3, "{held} N of {drive} N");
    }
}

/// At rest a block feels no friction, and without friction springs it stays where it would be reversed.
#[test]
fn blocks_that_slide_backwards_or_not_at_all_stick_by_their_rule() {
    for (set, velocity_m_per_s, slides) in [
        ("friction.reattach=one-way", 0.0, 0.0),
        ("friction.reattach=one-way", -1e-3, 0.0),
        ("friction.reattach=two-way", -1e-3, 1.0),
        ("friction.law=rigid", 1e-9, 0.0),
    ] {
        let mut solver = Plain::new(plan("ten-blocks", &["drive.velocity_m_per_s=0", set]));
        let mut state = solver.snapshot();
        state.slider.slip[4] = 1.0;
        state.slider.detached = 1;
        state.slider.velocity_m_per_s[4] = velocity_m_per_s;
        solver.restore(&state);
        solver.take_step();
        let state = solver.state();
        assert_eq!(state.slip[4], slides, "{set} {velocity_m_per_s}");
        if velocity_m_per_s >= 0.0 {
            assert_eq!(
                (&state.displacement_m[..], &state.velocity_m_per_s[..]),
                (&[0.0; 10][..], &[0.0; 10][..])
            );
        }
    }
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
