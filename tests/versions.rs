//! A log of another version of the format is refused by its version; one of this version by other code is read as its
//! program did. `fixtures/logs` has such logs, and the slip events that their program found.

use std::fs;

use asperity_record::RECORD_SCHEMA_VERSION;

use crate::support::binary::{outcome, succeed, text};
use crate::support::clients::file;

#[test]
fn a_log_by_other_code_gives_the_events_that_it_gave() {
    let log = file("fixtures/logs/complete.mcap");
    let (code, said, _) = outcome(&["check", text(&log)]);
    assert!(code == 6 && said.contains(": by other code or detectors: "), "{said}");
    assert!(!said.contains("events differ"), "{said}");
    let events = fs::read_to_string(log.with_extension("events.csv")).expect("the table is there");
    assert_eq!(succeed(&["events", text(&log)]), events);
    assert_eq!(succeed(&["replay", "--format", "csv", text(&log)]), events);
}

#[test]
fn logs_by_other_code_that_are_not_whole_say_why() {
    for (name, code, why) in [
        ("interrupted", 3, "the run was interrupted after step 930000"),
        ("salvaged", 5, "it was salvaged from a damaged log"),
    ] {
        let log = file(&format!("fixtures/logs/{name}.mcap"));
        let (found, said, _) = outcome(&["check", text(&log)]);
        assert!(found == code && said.contains(why), "{found}: {said}");
    }
}

/// Data of another version may mean anything: the log is refused by its version, before any other error can
/// be reported.
#[test]
fn another_version_is_refused_by_name() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("other.mcap");
    for version in [RECORD_SCHEMA_VERSION - 1, RECORD_SCHEMA_VERSION + 1] {
        let metadata = mcap::records::Metadata {
            name: "run".to_owned(),
            metadata: [("record_schema_version".to_owned(), version.to_string())].into(),
        };
        let mut writer = mcap::Writer::new(fs::File::create(&log).unwrap()).unwrap();
        writer.write_metadata(&metadata).unwrap();
        writer.finish().unwrap();
        let out = folder.path().join("salvaged.mcap");
        for command in
            [&["events"][..], &["summary"], &["replay"], &["check"], &["salvage", "--out", text(&out)]]
        {
            let (code, said, err) = outcome(&[command, &[text(&log)]].concat());
            let said = said + &err;
            let expected = format!(
                "written with version {version} of the format; this program reads version {RECORD_SCHEMA_VERSION}"
            );
            assert!(code != 0 && said.contains(&expected), "{command:?}: {said}");
        }
    }
}
