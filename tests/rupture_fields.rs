//! `recording.rupture_fields_from_blocks`: large ruptures are recorded without knowing their times in
//! advance, and the rest of the log is unchanged.

use std::fs;
use std::path::Path;

use asperity_record::Record;
use asperity_runlog::LogItem;
use asperity_testkit::read_log;
use serde_json::Value;

use crate::support::binary::{goes_on, run, succeed, text};

/// Thirty blocks, whose ruptures are of up to eleven.
const SCENARIO: [&str; 7] =
    ["default", "--set", "slider.blocks=30", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1"];
const RUPTURES: [&str; 4] =
    ["--set", "recording.rupture_fields_from_blocks=5", "--set", "recording.rupture_fields_s=3e-5"];

fn logged(path: &Path, more: &[&str]) -> (Vec<LogItem>, asperity_record::RunEnd) {
    run(&[&SCENARIO[..], more].concat(), path);
    read_log(path).expect("the log is whole")
}

#[test]
fn large_ruptures_are_recorded_and_nothing_else_changes() {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let (without, bare) = logged(&path("bare.mcap"), &[]);
    let (with, dense) = logged(&path("dense.mcap"), &RUPTURES);

    // Every topic but the one has the same messages.
    for (topic, digest) in &bare.topic_digests {
        let found = &dense.topic_digests[topic];
        assert!(topic == "/window" || found == digest, "{topic} differs");
    }
    assert_ne!(bare.topic_digests.get("/window"), dense.topic_digests.get("/window"));
    let is_window = |item: &LogItem| matches!(item, LogItem::Record(Record::Window(_)));
    let others: Vec<&LogItem> = with.iter().filter(|item| !is_window(item)).collect();
    assert!(others.iter().copied().eq(without.iter()), "the other items");

    // All multiples of 300 steps in which five blocks slid, and only these, each with all blocks.
    let mut sliding_after = 0;
    let mut last_step = 0;
    let mut expected: Vec<u64> = Vec::new();
    for item in &without {
        let LogItem::Record(Record::Step(record)) = item else { continue };
        let between = (last_step / 300 + 1..).map(|n| 300 * n).take_while(|step| *step < record.step);
        expected.extend(between.filter(|_| sliding_after >= 5));
        expected.extend((record.step.is_multiple_of(300) && record.sliding >= 5).then_some(record.step));
        let detach = record
            .switches
            .iter()
            .filter(|switch| switch.direction == asperity_record::Direction::Detach)
            .count();
        sliding_after = record.sliding as usize + 2 * detach - record.switches.len();
        last_step = record.step;
    }
    let found: Vec<u64> = with
        .iter()
        .filter_map(|item| match item {
            LogItem::Record(Record::Window(record)) => {
                assert_eq!((record.window, record.first_block, record.velocity_m_per_s.len()), (0, 1, 30));
                assert!(record.velocity_m_per_s.iter().any(|velocity| *velocity > 0.0));
                Some(record.step)
            }
            _ => None,
        })
        .collect();
    assert!(expected.len() > 100, "{} states", expected.len());
    assert_eq!(found, expected);

    // It is whole, and a replay finds the same events.
    assert!(succeed(&["check", text(&path("dense.mcap"))]).contains("whole"));
    succeed(&["replay", text(&path("dense.mcap")), "-o", text(&path("events"))]);

    // As tables they are as many rows as blocks times states.
    succeed(&["export", text(&path("dense.mcap")), "--to", "csv", "-o", text(&path("tables"))]);
    let table =
        fs::read_dir(path("tables")).expect("there is a folder").map(|entry| entry.expect("an entry").path());
    let window =
        table.into_iter().find(|path| text(path).ends_with(".window.csv")).expect("the table of windows");
    let rows =
        fs::read_to_string(window).expect("a table").lines().filter(|line| !line.starts_with('#')).count()
            - 1;
    assert_eq!(rows, 30 * expected.len());
}

/// However much of its log a run that was killed leaves behind, it ends with the same messages.
#[test]
fn a_run_that_is_gone_on_with_gives_the_same_states() {
    goes_on(&[&["run"], &SCENARIO[..], &RUPTURES].concat(), &[1, 3, 5, 7]);
}

#[test]
fn what_is_said_before_the_run_holds_of_it() {
    let folder = asperity_testkit::folder();
    let path = folder.path().join("dense.mcap");
    let (items, _) = logged(&path, &RUPTURES);
    let validate = [&["scenario", "validate", "--format", "json"], &SCENARIO[..], &RUPTURES].concat();
    let said: Value = serde_json::from_str(&succeed(&validate)).expect("it is JSON");
    // Of ten million steps.
    assert_eq!(said["log"]["window_records"].as_u64(), Some(33_333));
    let found = items.iter().filter(|item| matches!(item, LogItem::Record(Record::Window(_)))).count() as u64;
    assert!(found < 33_333, "{found}");
}
