//! Logs of every version of the format, each made by the program of that time, are read as that program
//! did. `fixtures/logs/vN` contains them with the slip events that it found.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary;
use crate::support::binary::{outcome, succeed, text};
use asperity_record::RECORD_SCHEMA_VERSION;
use asperity_runlog::{RunReader, Topics};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs")
}

/// The logs of a version, in order of their names.
fn logs(version: u32) -> Vec<PathBuf> {
    let folder = fixtures().join(format!("v{version}"));
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut logs: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .collect();
    logs.sort();
    logs
}

#[test]
fn logs_of_every_version_give_the_events_that_they_gave() {
    for version in 1..=RECORD_SCHEMA_VERSION {
        let logs = logs(version);
        assert!(logs.len() >= 4, "version {version} has {} golden logs", logs.len());
        let mut compared = 0;
        for log in logs {
            let name = log.display();
            let reader = RunReader::open(&log, Topics::ALL).expect("a golden log has a header");
            assert_eq!(reader.header().record_schema_version, version, "{name}");
            let (code, said, _) = outcome(&["check", text(&log)]);
            if let Ok(events) = fs::read_to_string(log.with_extension("events.csv")) {
                // By the program of that time.
                assert_eq!(code, 6, "{said}");
                assert!(said.contains(": by other code or detectors: "), "{said}");
                assert_eq!(succeed(&["events", text(&log)]), events, "{name}");
                assert_eq!(succeed(&["replay", "--format", "csv", text(&log)]), events, "{name}");
                compared += 1;
            } else {
                // Not whole when it was made, and for the same reason now.
                assert!(matches!(code, 3..=5), "{said}");
                let reason = fs::read_to_string(log.with_extension("check.txt")).expect("it says why");
                assert!(said.contains(reason.trim()), "{said}");
            }
        }
        assert!(compared >= 3, "version {version} has {compared} whole golden logs");
    }
}

/// Data of a newer program may mean anything: the log is refused by its version, before any other error can
/// be reported.
#[test]
fn a_newer_version_is_refused_by_name() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("newer.mcap");
    let newer = (RECORD_SCHEMA_VERSION + 1).to_string();
    let metadata = mcap::records::Metadata {
        name: "run".to_owned(),
        metadata: [("record_schema_version".to_owned(), newer.clone())].into(),
    };
    let mut writer = mcap::Writer::new(fs::File::create(&log).unwrap()).unwrap();
    writer.write_metadata(&metadata).unwrap();
    writer.finish().unwrap();
    for command in ["events", "summary", "replay", "check"] {
        let (code, out, err) = outcome(&[command, text(&log)]);
        let said = out + &err;
        let expected = format!(
            "version {newer} of the format; this program reads versions 1 to {RECORD_SCHEMA_VERSION}"
        );
        assert!(said.contains(&expected), "{command}: {said}");
        assert_ne!(code, 0);
    }
}

#[test]
fn what_is_written_now_is_of_the_present_version() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    binary::run(&["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=0.01"], &log);
    let reader = RunReader::open(&log, Topics::NONE).expect("the log has a header");
    assert_eq!(reader.header().record_schema_version, RECORD_SCHEMA_VERSION);
}
