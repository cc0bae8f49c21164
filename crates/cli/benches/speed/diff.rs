//! Diffs of large event tables: seconds and memory.
//!
//! The two tables differ by rounding in every row; in each thousand events one has split and one is
//! missing. Runs have *bunches* of events, with pauses between them that are longer than the time window.
//! The worst case is endless *chatter*, in which every event is within the time window of another.

use std::path::{Path, PathBuf};

use asperity_record::SlipEvent;
use asperity_testkit::slip_event;

use crate::watched;

const SIZES: [u64; 3] = [10_000, 100_000, 1_000_000];

/// The time before an event, by its number, in steps of 1e-8 s.
type Pause = fn(u64) -> u64;

/// The contents of the tables.
const KINDS: [(&str, Pause); 2] =
    [("bunches", |n| if n % 8 == 0 { 30_000 } else { 300 }), ("chatter", |_| 4)];

pub(crate) fn tables() {
    println!("## Diffs of event tables\n");
    println!(
        "| tables | events on each side | `asperity diff` of CSV, s | its memory, MB |\n|---|---|---|---|"
    );
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for (kind, pause) in KINDS {
        for count in SIZES {
            let files = [false, true].map(|is_new| {
                let path = folder.path().join(format!("{is_new}.csv"));
                write(&path, table(count, pause, is_new));
                path
            });
            let (command_s, command_mb) = command(&files);
            println!("| {kind} | {count} | {command_s:.2} | {command_mb:.0} |");
        }
    }
    println!();
}

/// A table of events, generated one by one, and equal for equal arguments.
fn table(count: u64, pause: Pause, is_new: bool) -> impl Iterator<Item = SlipEvent> {
    let mut step = 0;
    (0..count).flat_map(move |n| {
        step += pause(n);
        let (onset, end) = (step, step + if n % 1000 == 300 { 9 } else { 1 + n % 3 });
        step = end;
        let (first, last) = (1 + (n % 5) as u32, 6 + (n % 37) as u32);
        match (is_new, n % 1000) {
            (true, 300) => vec![
                event(n, onset, onset + 4, first, last, 1e-12),
                event(n, onset + 5, end, first, last, 1e-12),
            ],
            (true, 700) => Vec::new(),
            (true, _) => vec![event(n, onset, end, first, last, 1e-12)],
            (false, _) => vec![event(n, onset, end, first, last, 0.0)],
        }
    })
}

fn event(event: u64, onset: u64, end: u64, first_block: u32, last_block: u32, off_s: f64) -> SlipEvent {
    let load = |step: u64| step as f64 * 2e-9;
    SlipEvent {
        onset_s: onset as f64 / 1e8 + off_s,
        end_s: Some(end as f64 / 1e8 + off_s),
        ft_fn_onset: load(onset),
        ft_fn_end: Some(load(end)),
        event,
        ..slip_event(onset, end, first_block..=last_block)
    }
}

fn write(path: &Path, events: impl Iterator<Item = SlipEvent>) {
    let mut table = csv::Writer::from_path(path).expect("the table can be written");
    events.for_each(|event| table.serialize(event).expect("the table can be written"));
    table.flush().expect("the table can be written");
}

/// Seconds and peak memory of `asperity diff`.
fn command(files: &[PathBuf; 2]) -> (f64, f64) {
    let [old, new] = files.each_ref().map(|file| file.to_str().expect("temporary folders have plain names"));
    let (status, elapsed_s, memory_mb) = watched(&["diff", old, new]);
    // They do differ.
    assert_eq!(status.code(), Some(1), "{status}");
    (elapsed_s, memory_mb)
}
