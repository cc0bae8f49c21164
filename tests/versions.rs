//! A log of another version of the format is refused by its version; one of this version by other code is read as its
//! program did. `fixtures/logs` has such logs, and the slip events that their program found.

use std::fs;
use std::path::Path;

use asperity_record::RECORD_SCHEMA_VERSION;

use crate::support::binary::{outcome, succeed, text};
use crate::support::clients::file;
use crate::support::{pairs, small};

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

/// A log without messages that says that it is of a version of the format.
fn write_of_version(version: u32, log: &Path) {
    let metadata = mcap::records::Metadata {
        name: "run".to_owned(),
        metadata: [("record_schema_version".to_owned(), version.to_string())].into(),
    };
    let mut writer = mcap::Writer::new(fs::File::create(log).unwrap()).unwrap();
    writer.write_metadata(&metadata).unwrap();
    writer.finish().unwrap();
}

/// Data of another version may mean anything: the log is refused by its version, before any other error can
/// be reported.
#[test]
fn another_version_is_refused_by_name() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("other.mcap");
    for version in [RECORD_SCHEMA_VERSION - 1, RECORD_SCHEMA_VERSION + 1] {
        write_of_version(version, &log);
        let out = folder.path().join("salvaged.mcap");
        for command in
            [&["events"][..], &["summary"], &["replay"], &["check"], &["salvage", "--out", text(&out)]]
        {
            let (code, said, err) = outcome(&[command, &[text(&log)]].concat());
            let said = said + &err;
            let expected = format!(
                "written with version {version} of the format; this program reads version {RECORD_SCHEMA_VERSION}"
            );
            assert!(
                code == 2 && said.contains(&expected) && !said.contains("damaged"),
                "{command:?}: {said}"
            );
        }
    }
}

/// `cargo xtask diff-events` with a revision that writes another version of the format.
#[test]
fn runs_of_which_one_cannot_be_read_are_compared_by_their_tables_of_events() {
    let folder = asperity_testkit::folder();
    let [old, new] = ["old", "new"].map(|name| folder.path().join(name));
    for out in [&old, &new] {
        ["runs", "tables", pairs::TABLES].iter().for_each(|name| fs::create_dir_all(out.join(name)).unwrap());
    }
    let compared = || pairs::compare(Path::new(env!("CARGO_BIN_EXE_asperity")), [&old, &new], &[]).unwrap();
    let log = new.join("runs/a.mcap");
    small::run(&log);
    let events = succeed(&["events", text(&log)]);
    let [old_table, new_table] = [&old, &new].map(|out| out.join(pairs::TABLES).join("a.csv"));
    fs::write(&new_table, &events).unwrap();
    fs::write(&old_table, &events).unwrap();
    write_of_version(RECORD_SCHEMA_VERSION - 1, &old.join("runs/a.mcap"));
    assert_eq!(compared(), Some(0));
    let (but_last, _) = events.trim_end().rsplit_once('\n').expect("it has events");
    fs::write(&old_table, format!("{but_last}\n")).unwrap();
    assert_eq!(compared(), Some(1));
    // Logs of this version say more than their tables.
    fs::copy(&log, old.join("runs/a.mcap")).unwrap();
    assert_eq!(compared(), Some(0));
}
