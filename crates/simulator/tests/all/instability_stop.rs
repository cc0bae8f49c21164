//! Runs whose time step is too long are stopped.

use asperity_model::Plan;
use asperity_record::{Energy, RunStatus, StepRecord};
use asperity_simulator::{MOST_SCHEME_SHARE, SimulationError, SolverKind};

use crate::fast_and_plain::{run, steps};

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
        self.last.as_ref().expect("there is a step record").energy
    }
}

fn ended(plan: &Plan, kind: SolverKind) -> Ended {
    let (records, _, error) = run(plan, kind);
    let steps = steps(&records);
    let events = steps.windows(2).filter(|pair| pair[0].sliding == 0 && pair[1].sliding > 0).count();
    let begins = usize::from(steps.first().is_some_and(|step| step.sliding > 0));
    Ended { error, events: events + begins, last: steps.last().map(|step| (*step).clone()) }
}

#[test]
fn near_the_longest_step_runs_are_stopped_or_count_as_with_a_short_one() {
    near_the_longest_step(["default", "top-driven", "rigid-contacts"]);
}

/// The others; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "seconds of many slips: cargo xtask ci"]
    fn near_the_longest_step_other_runs_are_stopped_or_count_as_with_a_short_one() {
        near_the_longest_step(["ageing-contacts", "load-on-far-end", "scattered-friction"]);
    }
}

fn near_the_longest_step(names: [&'static str; 3]) {
    let mut stopped = Vec::new();
    for name in names {
        // The top drive slips once, after 7 s.
        let duration = if name == "top-driven" { "time.duration_s=8" } else { "time.duration_s=2" };
        let short = ended(&plan(name, 0.1, &[duration]), SolverKind::Fast);
        assert_eq!(short.error, None, "{name}");
        assert!(short.events > 0, "{name}");
        for share in [0.8, 0.9, 0.95, 0.99] {
            let plan = plan(name, share, &[duration]);
            assert!(
                (share * 0.99..=share).contains(&(plan.grid.step_s() / plan.longest_stable_step_s)),
                "{}",
                (plan.grid.step_s() / plan.longest_stable_step_s)
            );
            let Ended { error, events, .. } = ended(&plan, SolverKind::Fast);
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
    let blown_up = names.into_iter().filter(|name| *name != "top-driven");
    let blown_up = blown_up.flat_map(|name| [0.9, 0.95, 0.99].map(|share| (name, share)));
    assert_eq!(stopped, blown_up.collect::<Vec<_>>());
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
            let ended = ended(&plan, SolverKind::Fast);
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
            Some(ref error @ SimulationError::Energy { step, scheme_work_j, put_in_j, .. }) => {
                assert_eq!(error.status(), RunStatus::StoppedEnergy);
                let last = ended.last.as_ref().expect("there is a step record");
                assert!(last.step == step && !last.switches.is_empty(), "{last:?}");
                let energy = ended.energy();
                assert_eq!((scheme_work_j, put_in_j), (energy.scheme_work_j, energy.drive_work_j));
                assert!(scheme_work_j.abs() > MOST_SCHEME_SHARE * put_in_j);
                step
            }
            ref other => panic!("{name}: {other:?}"),
        };
        let fast = step(&ended(&plan(&[]), SolverKind::Fast));
        assert_eq!(fast, step(&ended(&plan(&often), SolverKind::Fast)), "{name}");
        assert_eq!(fast, step(&ended(&plan(&[]), SolverKind::Plain)), "{name}");
        assert_eq!(fast, step(&ended(&plan(&often), SolverKind::Plain)), "{name}");
    }
}

/// Displacements in the first step, or energies long before them.
#[test]
fn what_is_not_finite_is_named_and_never_recorded() {
    // Scenarios with such numbers are refused, so the plan is changed directly.
    let mut plan = asperity_testkit::plan("default", &["time.duration_s=1", "recording.sample_s=1e-6"]);
    for (velocity_m_per_s, friction_n, at) in [(1e308, 1.0, "in step 1 "), (1e156, 1e158, "in step ")] {
        plan.drive.velocity_m_per_s = velocity_m_per_s;
        plan.friction.static_threshold_n.fill(friction_n);
        plan.friction.dynamic_friction_n.fill(friction_n);
        for ended in [SolverKind::Fast, SolverKind::Plain].map(|kind| ended(&plan, kind)) {
            let error = ended.error.expect("an overflow must not pass unseen");
            assert_eq!(error.status(), RunStatus::StoppedNotFinite);
            let message = error.to_string();
            let names = " is no longer finite: block 1 is at u = ";
            assert!(message.starts_with(at) && message.contains(names), "{message}");
            let recorded = ended.last.map(|last| last.energy).unwrap_or_default();
            assert!(recorded.parts().all(|(_, value_j)| value_j.is_finite()));
        }
    }
}
