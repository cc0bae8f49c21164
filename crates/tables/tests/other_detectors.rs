//! Logs with events of detectors that the exporting program does not have, and the other way
//! round.

use std::path::{Path, PathBuf};

use asperity_files::{Existing, Inputs};
use asperity_record::{
    Direction, Event, EventKind, Observer, Onset, Record, RunHeader, RunStatus, SolverReport, StepRecord,
    payload,
};
use asperity_run::OpenLog;
use asperity_runlog::{Content, RunWriter};
use asperity_tables::format::{DAMAGED, Format};
use asperity_tables::run_tables::Chosen;
use asperity_tables::{Export, ExportError, Report, Request};
use asperity_testkit::{quiet_step, run_header};

payload! {
    topic: "/events/longest",
    table: "longest",
    /// A slip event that lasted longer than all before it.
    pub struct Longest {
        /// When it began, s.
        pub onset_s: f64,
        /// How much longer it lasted; null for the first.
        pub growth: Option<f64> [unit = "1"],
        /// How many blocks slid.
        pub blocks: u32,
        /// Whether it was the last.
        pub last: bool,
    }
}

payload! {
    topic: "/events/turn",
    table: "turns",
    /// A change of direction.
    pub struct Turn {
        /// Which way it goes on.
        pub direction: Direction,
    }
}

payload! {
    topic: "/events/count",
    table: "counts",
    /// Something that is counted and has no time of its own.
    pub struct Count {
        /// How many there were.
        pub count: u64,
    }
}

/// A log of four records, at 1 s to 4 s, with an event of each kind behind each.
fn log(folder: &Path) -> PathBuf {
    let path = folder.join("run.mcap");
    let header = RunHeader { time_step_s: 1.0, steps: 4, ..run_header() };
    let kinds = [EventKind::of::<Longest>(), EventKind::of::<Turn>(), EventKind::of::<Count>()];
    let mut writer = RunWriter::create(&path, Existing::Refuse, &header, "", &kinds, Content::Text).unwrap();
    for step in 1..=4 {
        writer.record(&Record::Step(quiet_step(step, step as f64, 0.5))).unwrap();
        let growth = (step > 1).then_some(1.5);
        // Reported a second later than it began.
        let longest = Longest { onset_s: step as f64 - 1.0, growth, blocks: 2, last: step == 4 };
        writer.event(&Event::new(longest.clone())).unwrap();
        writer.event(&Event::new(Turn { direction: Direction::Attach })).unwrap();
        writer.event(&Event::new(Count { count: step })).unwrap();
    }
    writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
    path
}

fn request(out: &Path, topics: &[&str]) -> Request {
    Request {
        chosen: Chosen {
            topics: topics.iter().map(|topic| (*topic).to_owned()).collect(),
            ..Chosen::default()
        },
        out: out.to_owned(),
        name: "run".to_owned(),
        existing: Existing::Replace,
        inputs: Inputs::default(),
    }
}

fn begin(log: &OpenLog, request: Request, kinds: &[EventKind]) -> Result<Export, ExportError> {
    Export::begin(log.header(), log.scenario_toml(), &log.event_schemas(), request, kinds, Format::Csv)
}

fn export(log: &Path, request: Request, kinds: &[EventKind]) -> Report {
    let log = OpenLog::open(log).unwrap();
    let mut export = begin(&log, request, kinds).unwrap();
    assert!(log.check(&mut export).verdict.holds_all());
    export.finish("whole", None).unwrap()
}

fn table(folder: &Path, topic: &str) -> String {
    std::fs::read_to_string(folder.join(format!("run.events.{topic}.csv"))).unwrap()
}

#[test]
fn a_detector_of_ones_own_has_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let run = log(folder.path());
    let kinds = [EventKind::of::<Longest>(), EventKind::of::<Turn>(), EventKind::of::<Count>()];
    let report = export(&run, request(folder.path(), &[]), &kinds);
    assert!(report.ran.problem.is_none() && report.left_out.is_empty());
    assert_eq!(
        table(folder.path(), "longest"),
        "onset_s,growth,blocks,last\n0,,2,false\n1,1.5,2,false\n2,1.5,2,false\n3,1.5,2,true\n"
    );
    assert_eq!(table(folder.path(), "turn"), "direction\nattach\nattach\nattach\nattach\n");
}

#[test]
fn events_of_other_detectors_have_the_columns_of_their_schema() {
    let folder = tempfile::tempdir().unwrap();
    let run = log(folder.path());
    let report = export(&run, request(folder.path(), &[]), &[EventKind::of::<Onset>()]);
    assert!(report.ran.problem.is_none());
    // In the order of the schema in the log, which is alphabetical.
    assert_eq!(
        table(folder.path(), "longest"),
        "blocks,growth,last,onset_s\n2,,false,0\n2,1.5,false,1\n2,1.5,false,2\n2,1.5,true,3\n"
    );
    assert_eq!(table(folder.path(), "count"), "count\n1\n2\n3\n4\n");
    // Events that are not flat are left out, with a note; an empty table would mean that there were none.
    assert_eq!(report.left_out.into_iter().collect::<Vec<_>>(), [("/events/turn".to_owned(), 4)]);
    assert!(!folder.path().join("run.events.turn.csv").exists());
    assert!(!folder.path().join("run.events.onset.csv").exists());
}

#[test]
fn events_are_chosen_by_their_onset_or_by_when_they_became_certain() {
    let folder = tempfile::tempdir().unwrap();
    let run = log(folder.path());
    let topics = ["/events/longest", "/events/count"];
    let mut request = request(folder.path(), &topics);
    (request.chosen.from_s, request.chosen.to_s) = (Some(1.0), Some(3.0));
    export(&run, request, &[]);
    assert_eq!(table(folder.path(), "longest"), "blocks,growth,last,onset_s\n2,1.5,false,1\n2,1.5,false,2\n");
    assert_eq!(table(folder.path(), "count"), "count\n1\n2\n");
}

#[test]
fn a_topic_that_a_log_has_not_is_refused_with_those_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let log = OpenLog::open(&log(folder.path())).unwrap();
    let kinds = [EventKind::of::<Onset>()];
    let request = |topic| request(folder.path(), &[topic]);
    let Err(error) = begin(&log, request("/events/none"), &kinds) else { panic!("there are none") };
    assert!(
        matches!(&error, ExportError::Choice(said) if said.starts_with("no table is made of the topic")),
        "{error}"
    );
    let Err(error) = begin(&log, request("/events/onset"), &kinds) else { panic!("there are none") };
    assert!(
        matches!(&error, ExportError::Choice(said) if said.starts_with("the log holds no /events/onset, since")),
        "{error}"
    );
    assert!(
        error
            .to_string()
            .ends_with("(accepted: /step, /switch, /fields, /window, /events/count, /events/longest)"),
        "{error}"
    );
}

/// The check accepts a step whose kinds of energies differ from those before it, for which a table has no
/// columns.
#[test]
fn a_step_of_other_columns_ends_the_tables_as_damage() {
    let folder = tempfile::tempdir().unwrap();
    let log = OpenLog::open(&log(folder.path())).unwrap();
    let mut export = begin(&log, request(folder.path(), &["/step"]), &[]).unwrap();
    let step = |step, end_forces_n| {
        let quiet = quiet_step(step, step as f64, 0.5);
        Record::Step(StepRecord { end_forces_n, ..quiet })
    };
    for record in [step(1, None), step(2, Some([0.0; 2])), step(3, None)] {
        export.record(&record);
    }
    let ran = export.finish("whole", None).unwrap().ran;
    assert_eq!((ran.state, ran.last_step), (DAMAGED, 1));
    assert!(ran.problem.unwrap().starts_with("step 2: the forces on the ends differ"));
}
