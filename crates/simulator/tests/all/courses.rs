//! Courses in time: drives by force, and forces and loads of single contacts, against closed forms.

use asperity_model::Plan;
use asperity_record::StepRecord;
use asperity_simulator::SolverKind;

use crate::fast_and_plain::{agree, assert_balanced, entries, fields, run, steps};

/// One rigid block of 1 kg under 400 N, in steps of a microsecond.
const BLOCK: [&str; 8] = [
    "slider.blocks=1",
    "slider.mass_kg=1",
    "friction.law=rigid",
    "time.step_s=1e-6",
    "time.duration_s=3",
    "recording.sample_s=0.01",
    "recording.fields_s=0",
    "recording.event_fields=false",
];

fn plan(sets: &[&str]) -> Plan {
    asperity_testkit::plan("default", &[&BLOCK[..], sets].concat())
}

/// All step records by both solvers, which must be the same, and whose energies balance.
fn records(plan: &Plan) -> Vec<StepRecord> {
    let [fast, plain] = [SolverKind::Fast, SolverKind::Plain].map(|kind| run(plan, kind).0);
    assert_eq!(entries(&fast), entries(&plain));
    let of_both = steps(&fast).into_iter().zip(steps(&plain));
    of_both.for_each(|(a, b)| assert_eq!(a.driving_force_n, b.driving_force_n));
    assert_balanced(&fast, 1e-9, "a block");
    steps(&fast).into_iter().cloned().collect()
}

fn onset_s(records: &[StepRecord]) -> f64 {
    records.iter().find(|record| !record.switches.is_empty()).expect("it slips").time_s
}

#[test]
fn a_block_under_a_force_slips_and_accelerates_as_newton_says() {
    // mu_s p = 280 N, mu_d p = 180 N. From 0 to 400 N over 2 s, then constant.
    let plan = plan(&["drive.kind=force", "drive.course_s=[0,2]", "drive.course_n=[0,400]"]);
    let records = records(&plan);
    let found_s = onset_s(&records);
    assert!((found_s - 1.4).abs() < 1.5e-6, "{found_s}");
    // m u'' = 200 t - 180 from t = 1.4 on, and 220 from t = 2 on.
    let speed =
        |t: f64| if t < 2.0 { 100.0 * (t * t - 1.96) - 180.0 * (t - 1.4) } else { 96.0 + 220.0 * (t - 2.0) };
    for record in records.iter().filter(|record| record.time_s > 1.41) {
        let kinetic_j = 0.5 * speed(record.time_s).powi(2);
        let found_j = record.energy.kinetic_j;
        assert!((found_j / kinetic_j - 1.0).abs() < 1e-3, "{}: {found_j}, not {kinetic_j}", record.time_s);
    }
    // F_T is the force.
    let last = records.last().unwrap();
    assert_eq!((last.driving_force_n, last.normal_load_n), (400.0, 400.0));
}

#[test]
fn a_dead_weight_stops_where_a_load_is_reached() {
    let force = ["drive.kind=force", "drive.course_s=[0,2]", "drive.course_n=[0,400]"];
    let records = records(&plan(&[&force[..], &["drive.until_load_ratio=0.25"]].concat()));
    // 100 N from 0.5 s on.
    let late = records.iter().filter(|record| record.time_s > 0.51);
    assert!(late.clone().count() > 100);
    late.for_each(|record| assert!((record.driving_force_n - 100.0).abs() < 1e-3));
}

#[test]
fn a_block_slips_where_its_load_has_fallen_to_what_its_force_needs() {
    // 140 N, and mu_s p = 280 N times a factor that falls from 1 to 0.2 between 1 and 2 s.
    let force = ["drive.kind=force", "drive.course_s=[0,0.5]", "drive.course_n=[0,140]"];
    let load = ["normal_load.course_s=[1,2]", "normal_load.course_factor=[1,0.2]"];
    let records = records(&plan(&[&force[..], &load].concat()));
    let found_s = onset_s(&records);
    assert!((found_s - 1.625).abs() < 1.5e-6, "{found_s}");
    let last = records.last().unwrap();
    assert!((last.normal_load_n - 80.0).abs() < 1e-12);
}

#[test]
fn a_prestress_with_a_course_moves_what_it_overcomes() {
    // Ten times a second around 0: 0.8 p, above mu_s p, at 0.05 s.
    let sets = [
        "drive.stiffness_n_per_m=0",
        "prestress.ratio=0.1",
        "prestress.course_s=[0,0.05,0.1]",
        "prestress.course_ratio=[0,0.7,-0.1]",
    ];
    let records = records(&plan(&sets));
    let found_s = onset_s(&records);
    assert!((found_s - 0.05 * 0.6 / 0.7).abs() < 1.5e-6, "{found_s}");
    // It comes to rest, and no force of the drive was recorded.
    assert!(
        records.last().unwrap().sliding == 0 && records.iter().all(|record| record.driving_force_n == 0.0)
    );
}

#[test]
fn loads_and_forces_of_single_blocks_are_theirs() {
    // The middle of three blocks loses most of its load, and slips alone: it is pulled by its prestress.
    let sets = [
        "slider.blocks=3",
        "friction.law=interfacial-springs",
        "drive.stiffness_n_per_m=0",
        "slider.youngs_modulus_pa=1e5",
        "time.duration_s=1",
        "prestress.ratio=0.3",
        "normal_load.course_s=[0.1,0.9]",
        "normal_load.course_factor=[1,1,1,1.2,0.2,1]",
        "recording.fields_s=0.01",
    ];
    let plan = plan(&sets);
    let records = records(&plan);
    let first = records.iter().find(|record| !record.switches.is_empty()).unwrap();
    assert_eq!(first.switches[0].block, 2);
    // 0.3 p reaches 0.7 p times the factor where it is 3/7.
    let expected_s = 0.1 + 0.8 * (1.0 - 3.0 / 7.0) / 0.8;
    assert!((first.time_s - expected_s).abs() < 2e-6, "{}", first.time_s);
    // Its load is recorded, and the total.
    let (all, ..) = run(&plan, SolverKind::Plain);
    let loads_n = &fields(&all).last().expect("fields are recorded").normal_load_n;
    let of = |factor: f64| factor * 400.0 / 3.0;
    for (found, expected) in loads_n.iter().zip([of(1.2), of(0.2), of(1.0)]) {
        assert!((found - expected).abs() < 1e-10, "{loads_n:?}");
    }
    assert!((records.last().unwrap().normal_load_n - of(2.4)).abs() < 1e-10);
    agree(&plan, "three blocks");
}

/// Blocks of a given state without anchors stay where they are, whatever pulls at them.
#[test]
fn springs_balance_all_forces_on_blocks_at_given_places() {
    for set in [
        "disorder.stiffness_offsets=[0.5,0,-0.5]",
        "prestress.course_ratio=[0.1,0.2,0.1,0.3,0.1,0.1]",
        "slider.right_end=clamped",
        "drive.kind=force",
    ] {
        let sets = [
            "slider.blocks=3",
            "friction.law=interfacial-springs",
            "friction.static_coefficient=1e3",
            "initial.displacement_m=[0,1e-6,3e-6]",
            "initial.at_s=0.5",
            "time.step_s=1e-7",
            "time.duration_s=0.5001",
            "recording.sample_s=0",
            set,
        ];
        let more: &[&str] = match set {
            "drive.kind=force" => &["drive.course_s=[0,1]", "drive.course_n=[100,100]"],
            set if set.starts_with("prestress") => &["prestress.course_s=[0,2]", "drive.stiffness_n_per_m=0"],
            _ => &["drive.velocity_m_per_s=0"],
        };
        let plan = plan(&[&sets[..], more].concat());
        let mut solver = SolverKind::Plain.start(plan.clone());
        while solver.step() < plan.initial.step + 20 && solver.next_record().unwrap().is_some() {}
        let state = solver.snapshot().slider;
        let moved = state.displacement_m.iter().zip(&plan.initial.displacement_m);
        let most_m = moved.fold(0.0, |most: f64, (u, start)| most.max((u - start).abs()));
        // Forces that are not balanced would move a block by micrometres.
        assert!(state.step > plan.initial.step && most_m < 1e-11, "{set}: {most_m}");
    }
}
