//! Runs that begin in the state of another run, or in one from a table.

use std::path::Path;
use std::time::Duration;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{Event, Observer, Record, SlipEvent, StepRecord, Switch};
use asperity_run::{Begin, LogTo, Opened, SolverKind, Task, Threads, Verdict, check, check_again, run};
use asperity_runlog::{RunReader, Topics};
use asperity_testkit::equality::{self, Agreement, Disagreement};

fn resolve(name: &str, sets: &[&str]) -> Result<Scenario, String> {
    let source = asperity_model::source(Path::new(name)).unwrap();
    source.resolve(name, sets, &Opened).map_err(|errors| errors.to_string())
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

/// Compares both solvers, with the steps and blocks of the slip events.
fn verify(plan: &Plan) -> Result<Agreement, Disagreement> {
    let mut records: [Vec<StepRecord>; 2] = [Vec::new(), Vec::new()];
    let each = |plain: &StepRecord, fast: &StepRecord| {
        records[0].push(plain.clone());
        records[1].push(fast.clone());
    };
    let agreement = equality::compare(plan, each, |_| ())?;
    let [plain, fast] = records.map(|records| {
        let events = asperity_run::detectors::of_plan(plan).all_events(&records);
        let slips = events.iter().filter_map(|event| event.get::<SlipEvent>());
        slips
            .map(|slip| (slip.onset_step, slip.end_step, slip.first_block, slip.last_block))
            .collect::<Vec<_>>()
    });
    assert_eq!(plain, fast);
    Ok(agreement)
}

/// Makes a run, with its log at a path if there is one, and as many checkpoints as there may be.
fn made(scenario: &Scenario, solver: SolverKind, log: Option<&Path>) -> Seen {
    let mut seen = Seen::default();
    let mut task = Task { solver, threads: Threads::One, ..Task::new(scenario) };
    if let Some(path) = log {
        let millis = if solver == SolverKind::Plain { 5 } else { 0 };
        task = task.log_to(LogTo { checkpoint_interval: Duration::from_millis(millis), ..LogTo::new(path) });
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
    ["slider.blocks=12", "time.duration_s=0.3", "time.step_s=4e-7", "drive.velocity_m_per_s=2e-3"];
const SLAB: [&str; 4] = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.26"];
const SHEET: [&str; 2] = ["drive.velocity_m_per_s=1e-3", "time.duration_s=0.05"];

/// Scenarios of several laws and bodies, in which something slips.
fn cases() -> Vec<(&'static str, Vec<&'static str>)> {
    let chain = |more: &[&'static str]| ("default", [&CHAIN[..], more].concat());
    vec![
        chain(&[]),
        chain(&["parameter_set=as-coded", "time.duration_s=0.2"]),
        chain(&["friction.law=rigid", "friction.radiation_kg_per_s=30", "slider.relative_damping=0"]),
        chain(&["friction.law=velocity-weakening"]),
        chain(&["friction.law=rigid", "friction.weakening_slip_m=1e-7", "friction.slip_memory_s=2e-3"]),
        chain(&[
            "friction.weakening_slip_m=1e-7",
            "friction.weakening_slip_offsets_m=[0,0,0,0,0,0,5e-7,0,0,0,0,0]",
            "friction.weakening_fractions=[0.25]",
            "friction.weakening_shares=[0.5]",
        ]),
        chain(&["friction.ageing_coefficient=0.02", "friction.ageing_time_s=0.01"]),
        chain(&["normal_load.schedule_s=[0.05,0.2]", "normal_load.schedule_n=[400,300]"]),
        chain(&[
            "drive.until_load_ratio=0.2",
            "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0,0.1]",
            "normal_load.schedule_n=[400,100]",
        ]),
        chain(&[
            "slider.left_end=clamped",
            "slider.right_end=absorbing",
            "friction.detach_by=spring",
            "disorder.stiffness_spread=0.3",
            "drive.kind=top",
            "drive.course_s=[0.1,0.1,0.2]",
            "drive.course_m_per_s=[2e-3,1e-3,4e-3]",
        ]),
        chain(&[
            "time.duration_s=0.1",
            "drive.kind=force",
            "drive.course_s=[0,0.1]",
            "drive.course_n=[0,300]",
            "disorder.load_spread=0.3",
            "prestress.course_s=[0.02,0.08]",
            "prestress.course_ratio=[0,0.2]",
            "normal_load.course_s=[0.02,0.08]",
            "normal_load.course_factor=[1,0.6]",
        ]),
        (
            "chain-junctions",
            vec![
                "time.step_s=1e-7",
                "slider.blocks=10",
                "friction.junction_count=20",
                "time.duration_s=0.1",
                "drive.velocity_m_per_s=2e-3",
            ],
        ),
        ("rate-and-state", vec!["time.duration_s=2"]),
        ("slab", SLAB.to_vec()),
        ("sheet-coarse", SHEET.to_vec()),
        (
            "rate-and-state",
            vec![
                "time.duration_s=2",
                "friction.initial_velocity_m_per_s=2e-4",
                "friction.initial_theta_s=0.02",
                "prestress.course_s=[0.3,0.9,0.9]",
                "prestress.course_ratio=[0,0.02,-0.01]",
                "prestress.swing_ratio=2e-3",
                "prestress.swing_period_s=0.1",
                "prestress.swing_from_s=0.2",
            ],
        ),
    ]
}

/// Branches of runs of the cases with these numbers, each by all solvers that can make it.
fn branches_without_change_are_the_rest_of_the_run(numbers: &[usize]) {
    let folder = tempfile::tempdir().unwrap();
    let (mut compared, mut runs) = ([0; 3], 0);
    let cases = cases().into_iter().enumerate();
    for (number, (name, sets)) in cases.filter(|(number, _)| numbers.contains(number)) {
        let scenario = accepted(name, &sets);
        for solver in SolverKind::of(scenario.friction.law) {
            runs += 1;
            let log = folder.path().join(format!("{number}-{}.mcap", solver.name()));
            let whole = made(&scenario, *solver, Some(&log));
            let plan = Plan::new(&scenario);
            let all = checkpoints(&log);
            let slid = |step: u64| {
                whole.steps.iter().rev().find(|record| record.step <= step).map_or(0, |record| record.sliding)
            };
            // One while nothing slides, one while something does, and one that is no checkpoint.
            let switching = || whole.steps.iter().filter(|record| !record.switches.is_empty());
            let [first, last] = [switching().next(), switching().next_back()]
                .map(|record| record.unwrap_or_else(|| panic!("{name} {sets:?}: nothing slips")).step);
            let before_last = || all.iter().copied().filter(|step| (first..last).contains(step));
            let at_rest = before_last().skip(1).find(|step| slid(*step) == 0);
            let sliding = before_last().skip(1).find(|step| slid(*step) > 0);
            let between = ((first + last) / 2..last).find(|step| !all.contains(step));
            for (step, is_exact) in [(at_rest, true), (sliding, true), (between, false)] {
                let Some(step) = step else { continue };
                compared[if !is_exact { 2 } else { usize::from(slid(step) > 0) }] += 1;
                let at = format!("initial.at_s={}", plan.grid.time_s(step));
                let from = from(&log);
                // A free start is none of a branch.
                let none = ["friction.initial_velocity_m_per_s=0", "friction.initial_theta_s=0"];
                let branch = accepted(name, &[&sets[..], &[&from, &at], &none].concat());
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
                        switches
                            .iter()
                            .flat_map(|(step, _, _, all)| {
                                all.iter().map(move |s| (*step, s.block, s.direction))
                            })
                            .collect()
                    };
                    assert!(of(&found) == of(&expected), "{what}");
                }
            }
        }
    }
    // Which checkpoints there are depends on the time that the runs take.
    let [at_rest, sliding, between] = compared;
    assert!(2 * at_rest > runs && 3 * sliding > runs && between == runs, "{compared:?} of {runs}");
}

#[test]
fn a_branch_without_change_is_the_rest_of_the_run() {
    branches_without_change_are_the_rest_of_the_run(&[1, 10, 11, 12, 13]);
}

/// The cases that are left; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "seconds of many runs: cargo xtask ci"]
    fn branches_of_further_laws_are_the_rest_of_the_run() {
        branches_without_change_are_the_rest_of_the_run(&[0, 2, 3, 4, 5, 6, 7, 8, 9]);
    }
}

/// The default chain at a time when nothing slides, and at one when something does, and its log.
fn parent(folder: &Path) -> (Scenario, std::path::PathBuf, Seen, [u64; 2]) {
    let scenario = accepted("default", &CHAIN);
    let log = folder.join("parent.mcap");
    let seen = made(&scenario, SolverKind::Fast, Some(&log));
    let calm = seen
        .steps
        .windows(2)
        .find(|pair| pair[0].step > 200_000 && pair[0].sliding == 0 && pair[0].switches.is_empty());
    let slip = seen.steps.iter().find(|record| record.step > 200_000 && record.sliding > 2);
    let steps = [calm.unwrap()[0].step, slip.unwrap().step];
    (scenario, log, seen, steps)
}

fn at(scenario: &Scenario, step: u64) -> String {
    format!("initial.at_s={}", Plan::new(scenario).grid.time_s(step))
}

fn blocks(seen: &Seen, after_step: u64) -> Vec<(u64, u32)> {
    let later = seen.steps.iter().filter(|record| record.step > after_step);
    later.flat_map(|record| record.switches.iter().map(|switch| (record.step, switch.block))).collect()
}

#[test]
fn a_branch_of_a_branch_goes_on_and_another_velocity_begins_where_the_point_is() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, log, seen, [calm, slip]) = parent(folder.path());
    let (first, second) = (calm.min(slip), calm.max(slip));
    let branch = accepted("default", &[&CHAIN[..], &[&from(&log), &at(&scenario, first)]].concat());
    let branch_log = folder.path().join("branch.mcap");
    made(&branch, SolverKind::Fast, Some(&branch_log));
    let again = accepted("default", &[&CHAIN[..], &[&from(&branch_log), &at(&scenario, second)]].concat());
    assert_eq!(blocks(&made(&again, SolverKind::Fast, None), second), blocks(&seen, second));

    let faster_sets = [&from(&log), &*at(&scenario, first), "drive.velocity_m_per_s=0.01"];
    let faster = accepted("default", &[&CHAIN[..], &faster_sets].concat());
    let [before, after] = [&scenario, &faster].map(Plan::new);
    let point_m = |plan: &Plan, step| plan.outside(step, u64::MAX).point_m;
    assert!((point_m(&before, first) / point_m(&after, first) - 1.0).abs() < 1e-14);
    let way_m = point_m(&after, first + 1000) - point_m(&after, first);
    assert!((way_m / (0.01 * 1000.0 * 4e-7) - 1.0).abs() < 1e-9, "{way_m}");
    // Its branch has the same point, to the bit.
    let faster_log = folder.path().join("faster.mcap");
    made(&faster, SolverKind::Fast, Some(&faster_log));
    let of_faster = [&from(&faster_log), &*at(&scenario, second), "drive.velocity_m_per_s=0.01"];
    let on = Plan::new(&accepted("default", &[&CHAIN[..], &of_faster].concat()));
    assert_eq!(on.drive.offset_m.to_bits(), after.drive.offset_m.to_bits());
    // A drive that has stopped and moves on does so from where it stopped.
    let held = [&from(&log), &*at(&scenario, second), "drive.hold_from_s=0.01"];
    let held = accepted("default", &[&CHAIN[..], &held].concat());
    assert_eq!(
        Plan::new(&held).outside(second + 9, Plan::new(&held).initial.hold_step).point_m,
        point_m(&before, second)
    );
}

#[test]
fn a_branch_has_another_load_from_its_first_step_on_and_counts_energies_from_there() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, log, _, [calm, slip]) = parent(folder.path());
    for (step, solver) in [(calm, SolverKind::Fast), (slip, SolverKind::Fast), (slip, SolverKind::Plain)] {
        let sets = [&from(&log), &*at(&scenario, step), "normal_load.total_n=350", "recording.sample_s=1e-3"];
        let branch = accepted("default", &[&CHAIN[..], &sets].concat());
        let seen = made(&branch, solver, None);
        assert!(seen.steps.iter().all(|record| record.normal_load_n == 350.0));
        let first = seen.steps.first().unwrap();
        assert_eq!(first.step == step, step == slip, "contacts that slide are recorded at the start");
        let [start, end] = [first, seen.steps.last().unwrap()].map(|record| record.energy);
        if step == slip {
            assert_eq!((first.sliding, first.switches.len() > 2), (0, true));
            let totals =
                [start.drive_work_j, start.friction_heat_j, start.anchor_change_j, start.scheme_work_j];
            assert_eq!(totals.map(f64::abs), [0.0; 4]);
        }
        assert!((end.balance_j() - start.balance_j()).abs() < 1e-8 * end.drive_work_j, "{start:?} {end:?}");
        assert!(verify(&Plan::new(&branch)).unwrap().switches > 20);
    }
}

#[test]
fn logs_of_branches_are_whole_and_can_be_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, log, _, [_, slip]) = parent(folder.path());
    let branch = accepted("default", &[&CHAIN[..], &[&from(&log), &at(&scenario, slip)]].concat());
    let whole = folder.path().join("whole.mcap");
    made(&branch, SolverKind::Fast, Some(&whole));
    for checked in [check(&whole), check_again(&whole)] {
        assert_eq!(checked.verdict, Verdict::Whole, "{checked}");
    }
    // Its scenario holds the state: nothing is read from the other log any more.
    std::fs::rename(&log, folder.path().join("elsewhere.mcap")).unwrap();
    let mut reader = RunReader::open(&whole, Topics::NONE).unwrap();
    let logged = asperity_model::ScenarioSource::logged("log", reader.scenario_toml());
    assert_eq!(Scenario::resolve(&logged).unwrap().hash(), branch.hash());
    let part = folder.path().join("part.mcap");
    let to = LogTo { checkpoint_interval: Duration::ZERO, ..LogTo::new(&part) };
    let polls = std::sync::atomic::AtomicU64::new(0);
    let stop = || polls.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 60;
    let task = || Task { threads: Threads::One, ..Task::new(&branch) }.log_to(to);
    run(task(), Begin::Anew, &stop, &mut ()).unwrap_err();
    let resumed = run(task(), Begin::GoOn, &|| false, &mut ()).unwrap().end.unwrap();
    assert_eq!(resumed.digest, reader.verify().unwrap().digest);
    assert_eq!(resumed.solver.counts.get("resumed"), Some(&1));
}

#[test]
fn a_table_gives_the_state_that_a_log_gives() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, log, seen, steps) = parent(folder.path());
    for step in steps {
        let branch = accepted("default", &[&CHAIN[..], &[&from(&log), &at(&scenario, step)]].concat());
        let initial = Plan::new(&branch).initial;
        let slides = |n: usize| u8::from(initial.slip[n] != 0.0);
        let mut table = "displacement_m,velocity_m_per_s,stick_position_m,slides\n".to_owned();
        for n in 0..12 {
            let [u, v, anchor] =
                [&initial.displacement_m, &initial.velocity_m_per_s, &initial.stick_position_m]
                    .map(|all| all[n]);
            table.push_str(&format!("{u},{v},{anchor},{}\n", slides(n)));
        }
        let path = folder.path().join("state.csv");
        std::fs::write(&path, table).unwrap();
        let set = format!("initial.state_csv={}", path.display());
        let given = accepted("default", &[&CHAIN[..], &[&set, &at(&scenario, step)]].concat());
        assert_eq!(blocks(&made(&given, SolverKind::Fast, None), step), blocks(&seen, step));
        // The table is read once.
        std::fs::write(&path, "").unwrap();
        let source = asperity_model::ScenarioSource::logged("log", given.to_commented_toml());
        assert_eq!(Scenario::resolve(&source).unwrap().hash(), given.hash());
        assert!(
            resolve("default", &[&CHAIN[..], &[&set]].concat())
                .unwrap_err()
                .contains("state.csv:1: the header is \"\"")
        );
    }
}

#[test]
fn a_log_that_is_made_again_gives_the_same_state_and_one_that_changed_another() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("parent.mcap");
    let hash = |sets: &[&str]| {
        let scenario = accepted("default", &[&CHAIN[..], sets].concat());
        if log.exists() {
            std::fs::remove_file(&log).unwrap();
        }
        made(&scenario, SolverKind::Fast, Some(&log));
        accepted("default", &[&CHAIN[..], &[&from(&log), "time.duration_s=0.4"]].concat()).hash()
    };
    let first = hash(&[]);
    assert_eq!(hash(&["recording.sample_s=1e-4"]), first);
    assert_ne!(hash(&["friction.static_coefficient=0.69"]), first);
}

#[test]
fn what_cannot_be_branched_from_is_refused_with_place_and_reason() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, log, ..) = parent(folder.path());
    let bytes = std::fs::read(&log).unwrap();
    let flipped = folder.path().join("flipped.mcap");
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 1;
    std::fs::write(&flipped, damaged).unwrap();
    let partial = folder.path().join("part.mcap.partial");
    std::fs::write(&partial, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let of_run = from(&log);
    let longer = "time.duration_s=9";
    let path = log.display().to_string();
    for (sets, expected) in [
        (
            vec![from(&folder.path().join("none.mcap"))],
            "none.mcap: there is no such file (accepted: the log of".to_owned(),
        ),
        (
            vec![from(folder.path())],
            "(accepted: the log of a run by this program: complete, incomplete or salvaged)".to_owned(),
        ),
        (vec![from(&flipped)], "flipped.mcap: the log is damaged: ".to_owned()),
        (vec![from(&flipped)], "; salvage it first (accepted: ".to_owned()),
        (
            vec![from(&partial), "initial.at_s=0.29".to_owned()],
            format!(
                "initial.at_s: 0.29 s is not in the run of {} (accepted: a time above 0",
                partial.display()
            ),
        ),
        (
            vec![of_run.clone()],
            "time.duration_s: the run begins at 0.3 s on its clock (accepted: a number above 0.3".to_owned(),
        ),
        (
            vec![of_run.clone(), "initial.at_s=8".to_owned(), longer.to_owned()],
            format!(
                "--set initial.at_s=8: initial.at_s: 8 s is not in the run of {path} (accepted: a time above 0, up to 0.3 s, or \
                 0 for its end)"
            ),
        ),
        (
            vec![of_run.clone(), "slider.blocks=13".to_owned()],
            format!(
                "initial.from: {path}: its run has slider.blocks = 12, not 13 (accepted: a run of the same slider,"
            ),
        ),
        (
            vec![of_run.clone(), "slider.length_m=0.2".to_owned()],
            "its run has slider.length_m = 0.1, not 0.2".to_owned(),
        ),
        (
            vec![of_run.clone(), "friction.law=rigid".to_owned()],
            "its run has friction.law = \"interfacial-springs\", not \"rigid\"".to_owned(),
        ),
        (
            vec![of_run.clone(), "time.step_s=2e-7".to_owned()],
            "its run has time.step_s = 4e-7, not 2e-7".to_owned(),
        ),
        (
            vec![of_run.clone(), "initial.displacement_m=[0]".to_owned()],
            "the state is that of a log already".to_owned(),
        ),
    ] {
        let sets: Vec<&str> = CHAIN.into_iter().chain(sets.iter().map(String::as_str)).collect();
        let error = resolve("default", &sets).unwrap_err();
        assert!(error.contains(&expected) && error.contains("accepted: "), "{expected}\nnot in {error}");
    }
    assert_eq!(Plan::new(&scenario).given, None);
}

/// The scenario of a log as a later run takes it, with other values.
fn of_kept(kept: &Scenario, sets: &[&str]) -> Result<Scenario, String> {
    let source = ScenarioSource::logged("log", kept.to_commented_toml());
    let source = sets.iter().fold(source, |source, set| source.with_override(set));
    Scenario::resolve_with(&source, &Opened).map_err(|errors| errors.to_string())
}

#[test]
fn a_state_that_is_kept_is_that_of_its_slider_step_and_time() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, log, _, [calm, _]) = parent(folder.path());
    let sets = [&from(&log), &*at(&scenario, calm), "time.duration_s=0.4"];
    let branch = accepted("default", &[&CHAIN[..], &sets].concat());
    let calm_s = branch.initial.at_s;
    for (set, expected) in [
        (
            "time.step_s=2e-7",
            "time.step_s: 2e-7, and the state in initial.state is of a run with 4e-7 (accepted: 4e-7",
        ),
        (
            "slider.length_m=0.2",
            "slider.length_m: 0.2, and the state in initial.state is of a run with 0.1 (accepted: 0.1",
        ),
        ("slider.mass_kg=0.013", "slider.mass_kg: 0.013, and the state"),
        ("slider.blocks=13", "slider.blocks: 13, and the state in initial.state is of a run with 12"),
        (
            "slider.left_end=clamped",
            "slider.left_end: \"clamped\", and the state in initial.state is of a run with \"free\"",
        ),
        ("slider.right_end=absorbing", "slider.right_end: \"absorbing\", and the state"),
        (
            "friction.law=rigid",
            "friction.law: \"rigid\", and the state in initial.state is of a run with \"interf",
        ),
    ] {
        let error = of_kept(&branch, &[set]).unwrap_err();
        assert!(
            error.contains(expected) && error.contains("or in initial.from the log of"),
            "{set}: {error}"
        );
    }
    let edited = branch.to_commented_toml().replace(&format!("at_s = {calm_s}"), "at_s = 0.25");
    assert_ne!(edited, branch.to_commented_toml());
    let error = Scenario::resolve(&ScenarioSource::new("edited.toml", edited)).unwrap_err().to_string();
    let expected = format!(
        "initial.at_s: 0.25, and the state in initial.state is that at {calm_s} s (accepted: {calm_s}"
    );
    assert!(error.contains(&expected), "{error}");
    // Another time is read from the log, which no log names for those who read it.
    let error = of_kept(&branch, &["initial.at_s=0.25"]).unwrap_err();
    assert!(error.contains("initial.from: ") && error.contains("its values are missing"), "{error}");
    let later = of_kept(&branch, &["initial.at_s=0.25", &from(&log)]).unwrap();
    assert_eq!(Plan::new(&later).initial.step, 625_000);
    assert_eq!(
        of_kept(&branch, &["drive.velocity_m_per_s=1e-3"]).unwrap().initial.state,
        branch.initial.state
    );
}

#[test]
fn another_table_replaces_the_lists_of_the_former_one() {
    let folder = tempfile::tempdir().unwrap();
    let table = |name: &str, u: f64| {
        let path = folder.path().join(name);
        let rows = format!("{u},0,0,0\n0,0,0,0\n");
        std::fs::write(&path, format!("displacement_m,velocity_m_per_s,stick_position_m,slides\n{rows}"))
            .unwrap();
        format!("initial.state_csv={}", path.display())
    };
    let (first, second) = (table("first.csv", 1e-6), table("second.csv", 2e-6));
    let shown = accepted("default", &["slider.blocks=2", &first]);
    let again = of_kept(&shown, &[&second]).unwrap();
    assert_eq!([&shown, &again].map(|of| of.initial.displacement_m[0]), [1e-6, 2e-6]);
    let error = of_kept(&shown, &[&second, "initial.sliding_blocks=[1]"]).unwrap_err();
    assert!(error.contains("initial.sliding_blocks: a list beside a table"), "{error}");
}

#[test]
fn what_a_solver_knows_is_left_behind_by_another_motion() {
    let folder = tempfile::tempdir().unwrap();
    let ageing = [
        &CHAIN[..],
        &[
            "friction.ageing_coefficient=0.02",
            "friction.ageing_time_s=0.01",
            "friction.static_coefficient=0.7",
        ],
    ]
    .concat();
    for (name, sets, at_s, changes) in [
        ("sheet-coarse", SHEET.to_vec(), "initial.at_s=0.02", &["disorder.load_spread=0.3"][..]),
        (
            "default",
            ageing,
            "initial.at_s=0.2",
            &[
                "friction.static_coefficient=0.6",
                "friction.ageing_coefficient=0",
                "friction.ageing_time_s=0.02",
            ],
        ),
        ("rate-and-state", vec!["time.duration_s=2"], "initial.at_s=1", &["normal_load.total_n=300"]),
    ] {
        let log = folder.path().join(format!("{name}.mcap"));
        made(&accepted(name, &sets), SolverKind::of(accepted(name, &sets).friction.law)[0], Some(&log));
        let branch = accepted(name, &[&sets[..], &[&from(&log), at_s]].concat());
        let solver = |scenario: &Scenario| Plan::new(scenario).given.unwrap().pace;
        // What is recorded and how long is no motion.
        let longer = of_kept(&branch, &["recording.sample_s=1e-3", "initial_velocity.mode=2"]).unwrap();
        assert!(solver(&branch).is_some() && solver(&longer).is_some(), "{name}");
        for change in changes {
            let changed = of_kept(&branch, &[change]).unwrap();
            assert_eq!(changed.initial.state, branch.initial.state);
            assert_eq!(solver(&changed), None, "{name} {change}");
            if SolverKind::of(changed.friction.law).len() > 1 {
                let verified = verify(&Plan::new(&changed));
                let agreement = verified.unwrap_or_else(|error| panic!("{name} {change}: {error}"));
                assert!(agreement.switches > 20, "{name} {change}");
            }
        }
    }
}
