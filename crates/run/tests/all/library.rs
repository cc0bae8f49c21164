//! A run as a library: observers, custom detectors, stopping and resuming.

use std::sync::atomic::{AtomicBool, Ordering};

use asperity_model::Scenario;
use asperity_model::resolve;
use asperity_record::{Event, EventKind, EventPayload, Record, RunStatus, SlipEvent, StepRecord, payload};
use asperity_run::detectors::Settings;
use asperity_run::study::{Job, Stored};
use asperity_run::{
    Begin, Detector, Field, LogTo, Observer, Quantity, Replay, ReplayError, RunError, SolverKind, Span, Task,
    Threads, Verdict, check, run,
};
use asperity_runlog::partial_path;
use asperity_testkit::{folder, run_end};

payload! {
    topic: "/events/widest",
    table: "widest",
    /// More blocks slide than ever before.
    struct Widest {
        /// Time of the step, s.
        time_s: f64,
        /// How many blocks slide in it.
        sliding: u32,
    }
}

/// Emits a [`Widest`] whenever more blocks slide than ever before.
#[derive(Default)]
struct Widen(u32);

impl Detector for Widen {
    fn emits(&self) -> EventKind {
        EventKind::of::<Widest>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if record.sliding > self.0 {
            self.0 = record.sliding;
            emit(Event::new(Widest { time_s: record.time_s, sliding: record.sliding }));
        }
    }
}

/// Finds nothing, on the given topic.
struct Idle(&'static str);

impl Detector for Idle {
    fn emits(&self) -> EventKind {
        let mut kind = EventKind::of::<SlipEvent>();
        kind.topic = self.0;
        kind
    }
}

/// Collects everything that a caller observes; sets `stop` after this many records.
struct Seen<'a> {
    records: Vec<Record>,
    events: Vec<Event>,
    reached: u64,
    stop: Option<(usize, &'a AtomicBool)>,
}

impl Seen<'_> {
    const ALL: Seen<'static> = Seen { records: Vec::new(), events: Vec::new(), reached: 0, stop: None };

    fn of(&self, topic: &str) -> Vec<&Event> {
        self.events.iter().filter(|event| event.topic() == topic).collect()
    }
}

impl Observer for Seen<'_> {
    fn record(&mut self, record: &Record) {
        self.records.push(record.clone());
        if let Some((after, stop)) = self.stop
            && self.records.len() == after
        {
            stop.store(true, Ordering::Relaxed);
        }
    }

    fn event(&mut self, event: &Event) {
        self.events.push(event.clone());
    }

    fn reached(&mut self, step: u64) {
        self.reached = step;
    }
}

fn scenario() -> Scenario {
    resolve(
        "default",
        &["parameter_set=as-coded", "slider.blocks=10", "time.step_s=1e-6", "time.duration_s=3"],
    )
    .expect("it resolves")
}

const NEVER: &(dyn Fn() -> bool + Sync) = &|| false;

#[test]
fn a_run_shows_the_same_with_a_log_and_without_and_on_one_thread() {
    let folder = folder();
    let (scenario, path) = (scenario(), folder.path().join("run.mcap"));
    let (mut bare, mut with_log) = (Seen::ALL, Seen::ALL);
    let outcome = run(Task::new(&scenario), Begin::Anew, NEVER, &mut bare).expect("it runs");
    assert!(outcome.status == RunStatus::Complete && outcome.end.is_none());
    let task = Task::new(&scenario).log_to(LogTo::new(&path));
    let outcome = run(task, Begin::Anew, NEVER, &mut with_log).expect("it runs");
    assert_eq!(outcome.end, Some(run_end(&path)));
    assert_eq!(bare.records, with_log.records);
    assert_eq!(bare.events, with_log.events);
    assert_eq!(bare.reached, 3_000_000);
    assert!(bare.of(SlipEvent::TOPIC).len() > 20, "there is something to compare");
    let alone = folder.path().join("alone.mcap");
    let mut on_one_thread = Seen::ALL;
    let task = Task { threads: Threads::One, ..Task::new(&scenario) }.log_to(LogTo::new(&alone));
    let alone = run(task, Begin::Anew, NEVER, &mut on_one_thread).expect("it runs");
    assert_eq!(alone.end, outcome.end);
    assert_eq!(on_one_thread.records, with_log.records);
    assert_eq!(on_one_thread.events, with_log.events);
    let refused = Task::new(&scenario).log_to(LogTo::new(&path));
    assert!(matches!(run(refused, Begin::Anew, NEVER, &mut ()), Err(RunError::Write(_))), "the log is kept");
}

#[test]
fn a_detector_of_ones_own_adds_a_topic_and_changes_no_other() {
    let folder = folder();
    let scenario = scenario();
    let (plain, more) = (folder.path().join("plain.mcap"), folder.path().join("more.mcap"));
    let mut seen = Seen::ALL;
    let task = Task::new(&scenario).log_to(LogTo::new(&plain));
    run(task, Begin::Anew, NEVER, &mut ()).expect("it runs");
    let task = Task::new(&scenario).log_to(LogTo::new(&more)).detect(Widen::default());
    run(task, Begin::Anew, NEVER, &mut seen).expect("it runs");
    let widest = seen.of(Widest::TOPIC);
    assert_eq!(widest[0].decode::<Widest>().expect("it is one").expect("it can be read").sliding, 1);

    let (without, with) = (run_end(&plain), run_end(&more));
    assert_ne!(without.digest, with.digest);
    let mut common = with.topic_digests.clone();
    common.remove(Widest::TOPIC).expect("it has that topic");
    assert_eq!(common, without.topic_digests);

    // Sound for every reader; topics without a detector here are listed.
    let checked = check(&more);
    assert_eq!(checked.verdict, Verdict::OtherCode, "{checked}");
    let said = checked.to_string();
    assert!(said.ends_with(", by other detectors: it also has /events/widest"), "{said}");
    let settings = Settings::default();
    for (log, own, only_logged, only_found) in [
        (&more, false, &[Widest::TOPIC][..], &[][..]),
        (&more, true, &[], &[]),
        (&plain, true, &[], &[Widest::TOPIC]),
    ] {
        let mut replay = Replay::open(log, &settings).expect("it opens");
        if own {
            replay = replay.detect(Widen::default());
        }
        let mut again = Seen::ALL;
        let replayed = replay.run(NEVER, &mut again).expect("the log is whole");
        // A detector of one's own says nothing of the log.
        assert_eq!(replayed.checked.verdict, check(log).verdict);
        let comparison = replayed.comparison.expect("the settings are those of a live run");
        assert_eq!(comparison.difference, None);
        assert_eq!(comparison.other_detectors.only_logged, only_logged);
        assert_eq!(comparison.other_detectors.only_found, only_found);
        assert_eq!(again.of(Widest::TOPIC), if own { widest.clone() } else { Vec::new() });
    }

    for (topic, refused) in [
        (SlipEvent::TOPIC, "two detectors emit /events/slip (accepted: a topic of its own for each)"),
        ("/step", "a detector emits /step (accepted: a topic that begins with /events/)"),
        ("/mine", "a detector emits /mine (accepted: a topic that begins with /events/)"),
    ] {
        let task = Task::new(&scenario).detect(Idle(topic));
        let error = run(task, Begin::Anew, NEVER, &mut ()).expect_err("its topic is none of its own");
        assert!(matches!(&error, RunError::Topic(error) if error == refused), "{error}");
        let replay = Replay::open(&plain, &settings).expect("it opens").detect(Idle(topic));
        let error = replay.run(NEVER, &mut ()).expect_err("its topic is none of its own");
        assert!(matches!(&error, ReplayError::Topic(error) if error == refused), "{error}");
    }
}

#[test]
fn a_run_that_is_stopped_goes_on_and_ends_the_same() {
    let folder = folder();
    let scenario = scenario();
    let (whole, parts) = (folder.path().join("whole.mcap"), folder.path().join("parts.mcap"));
    let mut expected = Seen::ALL;
    let task = Task::new(&scenario).log_to(LogTo::new(&whole)).detect(Widen::default());
    run(task, Begin::Anew, NEVER, &mut expected).expect("it runs");

    let stop = AtomicBool::new(false);
    let mut seen = Seen { stop: Some((expected.records.len() / 3, &stop)), ..Seen::ALL };
    let task = Task::new(&scenario).log_to(LogTo::new(&parts)).detect(Widen::default());
    let stopped = run(task, Begin::Anew, &|| stop.load(Ordering::Relaxed), &mut seen);
    let Err(RunError::Stopped { log: Some(partial) }) = stopped else { panic!("{stopped:?}") };
    assert!(partial.exists() && !parts.exists());
    assert!(seen.records.len() < expected.records.len());

    let task = Task::new(&scenario).log_to(LogTo::new(&parts)).detect(Widen::default());
    assert!(task.is_begun());
    let mut again = Seen::ALL;
    run(task, Begin::GoOn, NEVER, &mut again).expect("it goes on");
    assert_eq!(again.records, expected.records);
    assert_eq!(again.events, expected.events);
    assert_eq!(run_end(&parts).digest, run_end(&whole).digest);
}

/// A log that lacks only its name gets it, unless it also lacks events of a detector.
#[test]
fn a_whole_log_without_its_name_is_whole_if_all_detectors_looked() {
    let folder = folder();
    let scenario = scenario();
    let path = folder.path().join("run.mcap");
    let task = || Task::new(&scenario).log_to(LogTo::new(&path));
    run(task(), Begin::Anew, NEVER, &mut ()).expect("it runs");
    assert!(task().is_whole(&path).expect("it is whole"));
    assert!(!task().detect(Widen::default()).is_whole(&path).expect("it is whole, but for a topic"));

    std::fs::rename(&path, partial_path(&path)).expect("files can be renamed");
    let outcome = run(task().detect(Widen::default()), Begin::GoOn, NEVER, &mut ()).expect("it runs");
    assert!(outcome.has_run);
    assert!(run_end(&path).message_counts[Widest::TOPIC] > 0);

    std::fs::rename(&path, partial_path(&path)).expect("files can be renamed");
    let outcome = run(task().detect(Widen::default()), Begin::GoOn, NEVER, &mut ()).expect("it has its name");
    assert!(!outcome.has_run && outcome.end == Some(run_end(&path)));
}

/// A stop between records takes effect even if it is withdrawn.
#[test]
fn a_wish_to_stop_is_not_forgotten() {
    let scenario = scenario();
    let once = AtomicBool::new(true);
    let stopped = run(Task::new(&scenario), Begin::Anew, &|| once.swap(false, Ordering::Relaxed), &mut ());
    assert!(matches!(stopped, Err(RunError::Stopped { log: None })), "{stopped:?}");
}

/// A replay checks the log that it reads, and goes by the verdict.
#[test]
fn a_replay_of_a_log_that_is_not_whole_fails_with_its_verdict() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    run(Task::new(&scenario()).log_to(LogTo::new(&path)), Begin::Anew, NEVER, &mut ()).expect("it runs");
    let whole = std::fs::read(&path).expect("it was just written");
    let mut flipped = whole.clone();
    flipped[whole.len() * 9 / 10] ^= 4;
    for (bytes, verdict) in [
        (&whole[..whole.len() - 100], Verdict::Incomplete),
        (&flipped, Verdict::Damaged),
        (b"no log", Verdict::NoRunLog),
    ] {
        std::fs::write(&path, bytes).expect("the folder can be written");
        let checked = match Replay::open(&path, &Settings::default()) {
            Err(checked) => checked,
            Ok(replay) => match replay.run(NEVER, &mut ()) {
                Err(ReplayError::Log(checked)) => checked,
                other => panic!("{other:?}"),
            },
        };
        assert_eq!(checked.verdict, verdict, "{checked}");
    }
    std::fs::write(&path, whole).expect("the folder can be written");
    let replay = Replay::open(&path, &Settings::default()).expect("it opens");
    assert!(matches!(replay.run(&|| true, &mut ()), Err(ReplayError::Stopped)));
}

/// Observers of a stored run rely on its blocks: a log of other blocks is not shown.
#[test]
fn a_stored_log_of_another_run_is_shown_to_nobody() {
    let folder = folder();
    let job = Job { name: "run".to_owned(), scenario: scenario() };
    let solver = None;
    let mut seen = Seen::ALL;
    job.make(folder.path(), solver, false, Threads::One, NEVER, &mut ()).expect("it runs");
    assert!(matches!(job.stored(folder.path(), solver, &mut seen), Stored::Whole(_)));
    assert!(!seen.records.is_empty() && !seen.events.is_empty());
    let fewer = resolve(
        "default",
        &["parameter_set=as-coded", "slider.blocks=5", "time.step_s=1e-6", "time.duration_s=3"],
    )
    .expect("it resolves");
    let other = Job { scenario: fewer, ..job };
    let mut seen = Seen::ALL;
    let stored = other.stored(folder.path(), solver, &mut seen);
    assert_eq!(stored, Stored::Unfit("its log is of another scenario".to_owned()));
    assert!(seen.records.is_empty() && seen.events.is_empty());
}

#[test]
fn fields_of_a_fault_line_have_the_depths_of_its_nodes() {
    for (first_node, first_m) in [("surface", 0.0), ("half-cell", 100.0)] {
        let sets = [&format!("medium.first_node={first_node}"), "time.duration_s=1"];
        let scenario = resolve("seas-bp1-qd-coarse", &sets).unwrap();
        let span = Span { from_step: 1, to_step: 1, every_steps: 1 };
        let solver = SolverKind::Adaptive;
        let field = Field::of_scenario(&scenario, solver, Quantity::Velocity, span, &|| false).unwrap();
        assert_eq!(field.position_m[..2], [first_m, first_m + 200.0]);
        assert_eq!((field.position_m.len(), field.values.len()), (200, 200));
    }
}
