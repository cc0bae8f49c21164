//! Runs whose time step is too long are stopped.

use asperity_model::Plan;
use asperity_record::{Energy, Record, RunStatus, StepRecord};
use asperity_simulator::{MOST_SCHEME_SHARE, Plain, SimulationError, Solver, SolverKind};

/// A built-in scenario, with a time step of about that share of the longest stable one.
fn plan(name: &str, share: f64, sets: &[&str]) -> Plan {
    let sets: Vec<String> =
        ["parameter_set=as-stated"].iter().chain(sets).map(|set| (*set).to_owned()).collect();
    let longest_s = asperity_testkit::plan(name, &sets).longest_stable_step_s;
    // All times of the scenarios are whole milliseconds.
    let step_s = 1e-3 / (1e-3 / (share * longest_s)).ceil();
    asperity_testkit::plan(name, &[&sets[..], &[format!("time.step_s={step_s:e}")]].concat())
}

/// How a run ended, the number of its slip events, and its last step record.
struct Ended {
    error: Option<SimulationError>,
    events: usize,
    last: Option<StepRecord>,
}

impl Ended {
    fn energy(&self) -> Energy {
        self.last.as_ref().and_then(|last| last.energy).expect("there is a step record with energies")
    }
}

fn run(mut solver: impl Solver) -> Ended {
    let (mut events, mut last): (usize, Option<StepRecord>) = (0, None);
    loop {
        match solver.next_record() {
            Ok(Some(Record::Step(step))) => {
                let slid = last.as_ref().is_some_and(|last| last.sliding > 0);
                events += usize::from(step.sliding > 0 && !slid);
                last = Some(step);
            }
            Ok(Some(_)) => {}
            ended => {
                return Ended { error: ended.err(), events, last };
            }
        }
    }
}

#[test]
fn near_the_longest_step_runs_are_stopped_or_count_as_with_a_short_one() {
    let mut stopped = Vec::new();
    for name in [
        "default",
        "top-driven",
        "rigid-contacts",
        "ageing-contacts",
        "load-on-far-end",
        "scattered-friction",
    ] {
        // The top drive slips once, after 7 s.
        let duration = if name == "top-driven" { "time.duration_s=8" } else { "time.duration_s=2" };
        let short = run(SolverKind::Fast.start(plan(name, 0.1, &[duration])));
        assert_eq!(short.error, None, "{name}");
        assert!(short.events > 0, "{name}");
        for share in [0.8, 0.9, 0.95, 0.99] {
            let plan = plan(name, share, &[duration]);
            assert!(
                (share * 0.99..=share).contains(&(plan.grid.step_s() / plan.longest_stable_step_s)),
                "{}",
                (plan.grid.step_s() / plan.longest_stable_step_s)
            );
            let Ended { error, events, .. } = run(SolverKind::Fast.start(plan));
            match error {
                Some(SimulationError::Energy { .. }) => stopped.push((name, share)),
                Some(other) => panic!("{name} at {share}: {other}"),
                None => assert!(
                    events <= 2 * short.events && short.events <= 2 * events,
                    "{name} at {share}: {events} events, {} with a short step",
                    short.events
                ),
            }
        }
    }
    // All but the top drive, whose blocks switch once each.
    let blown_up = |name| [0.9, 0.95, 0.99].map(|share| (name, share));
    let others = ["ageing-contacts", "load-on-far-end", "scattered-friction"].map(blown_up).concat();
    assert_eq!(
        stopped,
        [blown_up("default"), blown_up("rigid-contacts")]
            .concat()
            .into_iter()
            .chain(others)
            .collect::<Vec<_>>()
    );
}

/// Fronts and pulses have the largest share: all their slips are single swings.
#[test]
fn steps_that_are_advised_are_not_stopped() {
    for (name, at_least) in [("front", 0.0), ("slip-pulse", 0.03)] {
        for share in [0.1, 0.4] {
            let sets = ["parameter_set=as-stated".to_owned()];
            let known = asperity_testkit::plan(name, &sets);
            let duration_s = known.grid.time_s(known.steps);
            let step_s = duration_s / (duration_s / (share * known.longest_stable_step_s)).ceil();
            let plan =
                asperity_testkit::plan(name, &[&sets[..], &[format!("time.step_s={step_s:e}")]].concat());
            let ended = run(SolverKind::Fast.start(plan));
            assert_eq!(ended.error, None, "{name} at {share}");
            let energy = ended.energy();
            let found = energy.scheme_work_j.abs() / energy.prestress_work_j;
            assert!(found < MOST_SCHEME_SHARE, "{name} at {share}: {found}");
            assert!(share < 0.4 || found > at_least, "{name} at {share}: {found}");
        }
    }
}

/// The step in which a run stops depends neither on sampling nor on the solver, and the error has the
/// numbers of its last record.
#[test]
fn the_step_in_which_a_run_stops_is_its_own() {
    for (name, blocks) in [("default", "slider.blocks=22"), ("rigid-contacts", "slider.blocks=24")] {
        let often = ["recording.sample_s=1e-4", "recording.fields_s=2e-3"];
        let plan = |sets: &[&str]| {
            let sets = [&[blocks, "time.step_s=2.5e-6"], sets].concat();
            asperity_testkit::plan(name, &[&["parameter_set=as-stated"], &sets[..]].concat())
        };
        let step = |ended: &Ended| match ended.error {
            Some(SimulationError::Energy { step, scheme_work_j, put_in_j, .. }) => {
                let last = ended.last.as_ref().expect("there is a step record");
                assert!(last.step == step && !last.switches.is_empty(), "{last:?}");
                let energy = ended.energy();
                assert_eq!((scheme_work_j, put_in_j), (energy.scheme_work_j, energy.drive_work_j));
                assert!(scheme_work_j.abs() > MOST_SCHEME_SHARE * put_in_j);
                step
            }
            ref other => panic!("{name}: {other:?}"),
        };
        let fast = step(&run(SolverKind::Fast.start(plan(&[]))));
        assert_eq!(fast, step(&run(SolverKind::Fast.start(plan(&often)))), "{name}");
        assert_eq!(fast, step(&run(Plain::new(plan(&[])))), "{name}");
        assert_eq!(fast, step(&run(Plain::new(plan(&often)))), "{name}");
    }
}

/// A stopped solver returns its error at every further call, and cannot be saved after the stop.
#[test]
fn no_run_goes_on_behind_its_stop() {
    let sets = ["parameter_set=as-stated", "slider.blocks=24", "time.step_s=2.5e-6"];
    let plan = asperity_testkit::plan("rigid-contacts", &sets);
    let mut solver = SolverKind::Fast.start(plan);
    let error = loop {
        match solver.next_record() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("it is to be stopped"),
            Err(error) => break error,
        }
    };
    assert_eq!(error.status(), RunStatus::StoppedEnergy);
    assert!(!solver.is_between_records());
    assert_eq!(solver.next_record(), Err(error));
}

/// Energies overflow long before displacements do.
#[test]
fn what_is_not_finite_is_named_and_never_recorded() {
    // Scenarios with such numbers are refused, so the plan is changed directly.
    let mut plan = asperity_testkit::plan("default", &["time.duration_s=1", "recording.sample_s=1e-6"]);
    plan.drive.velocity_m_per_s = 1e156;
    plan.friction.static_threshold_n.fill(1e158);
    plan.friction.dynamic_friction_n.fill(1e158);
    for ended in [run(SolverKind::Fast.start(plan.clone())), run(Plain::new(plan))] {
        let Some(error @ SimulationError::NotFinite { .. }) = ended.error else {
            panic!("{:?}", ended.error)
        };
        assert_eq!(error.status(), RunStatus::StoppedNotFinite);
        assert!(error.to_string().contains(" is no longer finite: block 1 is at u = "), "{error}");
        let recorded = ended.last.and_then(|last| last.energy).unwrap_or_default();
        assert!(recorded.parts().all(|(_, value_j)| value_j.is_finite()));
    }
}
