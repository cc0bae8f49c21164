//! Logs of a few records made up: cut off, damaged, unfinished, and with events that no program
//! but their own knows.

use std::fs;
use std::path::{Path, PathBuf};

use asperity_record::{
    Event, EventKind, EventPayload, Record, RunHeader, RunStatus, SolverReport, StepRecord, payload,
};
use asperity_runlog::{Existing, RunReader, RunWriter, Topics, Unfinished, WriteError, partial_path};

const STEPS: u64 = 4;

payload! {
    topic: "/events/mark",
    table: "marks",
    /// Something that a detector saw which only its own program has.
    struct Mark {
        /// How many there were before.
        before: u64,
    }
}

fn header() -> RunHeader {
    RunHeader {
        record_schema_version: asperity_record::RECORD_SCHEMA_VERSION,
        scenario: "made up".to_owned(),
        scenario_hash: String::new(),
        run_id: String::new(),
        code_version: String::new(),
        parameter_set: "as-coded".to_owned(),
        solver: "by hand".to_owned(),
        blocks: 2,
        time_step_s: 1.0,
        steps: STEPS,
    }
}

fn step(step: u64) -> Record {
    Record::Step(StepRecord {
        step,
        time_s: step as f64,
        driving_force_n: 1.0,
        normal_load_n: 2.0,
        end_forces_n: None,
        sliding: 0,
        switches: Vec::new(),
    })
}

fn writer(path: &Path, kinds: &[EventKind]) -> RunWriter {
    RunWriter::create(path, Existing::Refuse, &header(), "blocks = 2", kinds).unwrap()
}

/// Writes a log of so many steps, and where it stands then.
fn log(folder: &Path, steps: u64, status: RunStatus) -> PathBuf {
    let path = folder.join(format!("{steps}-{status:?}.mcap"));
    let mut writer = writer(&path, &[]);
    (1..=steps).for_each(|n| writer.record(&step(n)).unwrap());
    writer.finish(status, SolverReport::default()).unwrap();
    if status == RunStatus::Interrupted { partial_path(&path) } else { path }
}

#[test]
fn who_asks_on_after_an_error_gets_it_again() {
    let folder = tempfile::tempdir().unwrap();
    let cut = log(folder.path(), STEPS, RunStatus::Complete);
    let bytes = fs::read(&cut).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let mut damaged = bytes.clone();
    let end = bytes.windows(9).rposition(|there| there == b"last_step").unwrap();
    damaged[end] ^= 1;
    let bit = folder.path().join("bit.mcap");
    fs::write(&bit, damaged).unwrap();
    for (what, path, is_early_end) in [
        ("cut off", cut, true),
        ("interrupted", log(folder.path(), 2, RunStatus::Interrupted), true),
        ("too short for its header", log(folder.path(), 3, RunStatus::Complete), false),
        ("with a bit turned", bit, false),
    ] {
        let mut reader = RunReader::open(&path, Topics::ALL).unwrap();
        let first = reader.verify().expect_err(what);
        assert_eq!(first.problem.is_early_end(), is_early_end, "{what}: {first}");
        for _ in 0..2 {
            let again = reader.next_item().expect_err(what);
            assert_eq!(again.to_string(), first.to_string(), "{what}");
            assert_eq!(again.problem.is_early_end(), is_early_end, "{what}");
            assert_eq!(reader.verify().expect_err(what).to_string(), first.to_string(), "{what}");
        }
    }
}

/// As a run leaves it that is stopped after its last byte and before the name.
#[test]
fn a_whole_log_without_its_name_replaces_another_only_if_it_may() {
    let folder = tempfile::tempdir().unwrap();
    let path = log(folder.path(), STEPS, RunStatus::Complete);
    let bytes = fs::read(&path).unwrap();
    fs::rename(&path, partial_path(&path)).unwrap();
    fs::write(&path, "mine").unwrap();
    let unfinished = || Unfinished::of(&path).unwrap().unwrap();
    let refused = unfinished().publish(Existing::Refuse).unwrap_err();
    assert!(matches!(&refused, WriteError::Exists(there) if *there == path), "{refused}");
    assert_eq!(fs::read(&path).unwrap(), b"mine");
    assert_eq!(fs::read(partial_path(&path)).unwrap(), bytes);
    unfinished().publish(Existing::Replace).unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes);
    assert!(!partial_path(&path).exists());
    // Where nothing stands there is nothing to refuse.
    fs::rename(&path, partial_path(&path)).unwrap();
    unfinished().publish(Existing::Refuse).unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes);
}

#[test]
fn events_of_detectors_that_are_not_known_are_json_objects() {
    let folder = tempfile::tempdir().unwrap();
    for (payload, expected) in [
        (r#"{"before":0}"#, Ok(())),
        ("{}", Ok(())),
        ("7", Err("invalid type: integer `7`, expected a map")),
        ("[]", Err("invalid type: sequence, expected a map")),
        ("null", Err("invalid type: null, expected a map")),
        (r#"{"before":1e999}"#, Err("number out of range")),
        ("{", Err("EOF while parsing an object")),
    ] {
        let path = folder.path().join("run.mcap");
        let mut writer =
            RunWriter::create(&path, Existing::Replace, &header(), "", &[EventKind::of::<Mark>()]).unwrap();
        (1..=STEPS).for_each(|n| writer.record(&step(n)).unwrap());
        let event = Event { topic: Mark::TOPIC.to_owned(), payload: payload.to_owned() };
        writer.event(&event).unwrap();
        writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
        let outcome = RunReader::open(&path, Topics::ALL).unwrap().verify();
        match expected {
            Ok(()) => assert!(outcome.is_ok(), "{payload}: {outcome:?}"),
            Err(says) => {
                let error = outcome.expect_err(payload).to_string();
                assert!(error.contains("message 0 of /events/mark") && error.contains(says), "{error}");
            }
        }
    }
}
