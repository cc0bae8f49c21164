//! Runs that begin in the state of another run, or in one from a table.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use asperity_model::{Plan, Scenario};
use asperity_record::{Event, Observer, Record, StepRecord, Switch};
use asperity_run::{Begin, LogTo, SolverKind, Task, Verdict, check, check_again, run, with_logged_states};
use asperity_runlog::{LogItem, RunReader, Topics, partial_path};

fn resolve(name: &str, sets: &[&str]) -> Result<Scenario, String> {
    let source = with_logged_states(asperity_model::source(Path::new(name)).unwrap());
    source.resolve(name, sets).map_err(|errors| errors.to_string())
}

fn accepted(name: &str, sets: &[&str]) -> Scenario {
    resolve(name, sets).unwrap_or_else(|errors| panic!("{sets:?}: {errors}"))
}

/// The step records and events of a run.
#[derive(Default)]
struct Seen {
    steps: Vec<StepRecord>,
    events: Vec<Event>,
}

impl Observer for Seen {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.steps.push(record.clone());
        }
    }

    fn event(&mut self, event: &Event) {
        self.events.push(event.clone());
    }
}

/// Makes a run, with its log at a path if there is one, and as many checkpoints as there may be.
fn made(scenario: &Scenario, solver: SolverKind, log: Option<&Path>) -> Seen {
    let mut seen = Seen::default();
    let mut task = Task::new(scenario).solved_by(Some(solver)).on_one_thread();
    if let Some(path) = log {
        task = task.log_to(LogTo { checkpoint_interval: Duration::ZERO, ..LogTo::new(path) });
    }
    run(task, Begin::Anew, &|| false, &mut seen).unwrap_or_else(|error| panic!("{error}"));
    seen
}

/// The switches after a step, with the numbers of the step that are no energies.
fn switches(seen: &Seen, after_step: u64) -> Vec<(u64, f64, u32, &[Switch])> {
    let later = seen.steps.iter().filter(|record| record.step > after_step && !record.switches.is_empty());
    later.map(|record| (record.step, record.driving_force_n, record.sliding, &*record.switches)).collect()
}

/// The steps of the checkpoints of a log.
fn checkpoints(log: &Path) -> Vec<u64> {
    let mut reader = RunReader::open(log, Topics::NONE).unwrap();
    let mut steps = Vec::new();
    while let Some(text) = reader.next_checkpoint().unwrap() {
        let saved: serde_json::Value = serde_json::from_str(text).unwrap();
        steps.push(saved["solver"]["slider"]["step"].as_u64().unwrap());
    }
    steps
}

fn from(log: &Path) -> String {
    format!("initial.from={}", log.display())
}

const CHAIN: [&str; 4] =
    ["slider.blocks=12", "time.duration_s=0.9", "time.step_s=2e-7", "drive.velocity_m_per_s=1e-3"];
const SLAB: [&str; 4] =
    ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.26"];
const SHEET: [&str; 2] = ["drive.velocity_m_per_s=1e-3", "time.duration_s=0.05"];

/// Scenarios of several laws and bodies, in which something slips.
fn cases() -> Vec<(&'static str, Vec<&'static str>)> {
    let chain = |more: &[&'static str]| ("default", [&CHAIN[..], more].concat());
    vec![
        chain(&[]),
        chain(&["parameter_set=as-coded", "time.duration_s=0.6"]),
        chain(&["friction.law=rigid", "friction.radiation_kg_per_s=30", "slider.relative_damping=0"]),
        chain(&["friction.law=velocity-weakening"]),
        chain(&["friction.ageing_coefficient=0.02", "friction.ageing_time_s=0.01"]),
        chain(&["normal_load.schedule_s=[0.2,0.7]", "normal_load.schedule_n=[400,300]"]),
        chain(&["drive.until_load_ratio=0.2", "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0,0.3]", "normal_load.schedule_n=[400,100]"]),
        ("chain-junctions", vec!["slider.blocks=8", "friction.junction_count=20", "time.duration_s=0.1"]),
        ("rate-and-state", vec!["time.duration_s=0.4"]),
        ("slab", SLAB.to_vec()),
        ("sheet-coarse", SHEET.to_vec()),
    ]
}

#[test]
fn a_branch_without_change_is_the_rest_of_the_run() {
    let folder = tempfile::tempdir().unwrap();
    for (number, (name, sets)) in cases().into_iter().enumerate() {
        let scenario = accepted(name, &sets);
        for solver in SolverKind::of(scenario.friction.law) {
            let log = folder.path().join(format!("{number}-{}.mcap", solver.name()));
            let whole = made(&scenario, *solver, Some(&log));
            let plan = Plan::new(&scenario);
            let all = checkpoints(&log);
            let slid = |step: u64| whole.steps.iter().rev().find(|record| record.step <= step).map_or(0, |record| record.sliding);
            // One while nothing slides, one while something does, and one that is no checkpoint.
            let middle = all.iter().filter(|step| **step > plan.steps / 4);
            let at_rest = middle.clone().find(|step| slid(**step) == 0);
            let sliding = middle.clone().find(|step| slid(**step) > 0);
            let between = Some(plan.steps * 3 / 8 + 1).filter(|step| !all.contains(step));
            for (step, is_exact) in
                [(at_rest.copied(), true), (sliding.copied(), true), (between, false)]
            {
                let Some(step) = step else { continue };
                let at = format!("initial.at_s={}", plan.grid.time_s(step));
                let from = from(&log);
                let branch = accepted(name, &[&sets[..], &[&from, &at]].concat());
                let branched = Plan::new(&branch);
                assert_eq!(branched.initial.step, step);
                assert_eq!(branched.drive.offset_m.to_bits(), 0.0_f64.to_bits());
                let found = made(&branch, *solver, None);
                let (expected, found) = (switches(&whole, step), switches(&found, step));
                let what = format!("{name} {sets:?} {} at step {step} of {}", solver.name(), plan.steps);
                assert!(!expected.is_empty(), "{what}: nothing switches");
                if is_exact {
                    assert!(found == expected, "{what}: {} and {} switches", found.len(), expected.len());
                } else {
                    let of = |switches: &[(u64, f64, u32, &[Switch])]| -> Vec<_> {
                        switches.iter().flat_map(|(step, _, _, all)| all.iter().map(move |s| (*step, s.block, s.direction))).collect()
                    };
                    assert!(of(&found) == of(&expected), "{what}");
                }
            }
        }
    }
}
