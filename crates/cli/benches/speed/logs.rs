//! How fast logs are written and read, against the bare MCAP reader, and in how much memory.

use std::fs;
use std::io::Read;
use std::path::Path;

use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::{ROUNDS, asperity, median, seconds, watched};

/// Logs of different kinds, and of one kind in different sizes.
const LOGS: [(&str, &[&str]); 4] = [
    ("the default run", &[]),
    ("its states every 0.2 ms", &["recording.fields_s=0.0002"]),
    ("its load every 10 µs, for 1.25 s", &["recording.sample_s=0.00001", "time.duration_s=1.25"]),
    ("the same for 5 s", &["recording.sample_s=0.00001"]),
];

pub(crate) fn logs() {
    println!("## Logs: time over that of the bare MCAP reader\n");
    println!(
        "The bare reader unpacks every chunk, checks its checksum, and looks at no message. MB are those of the file; the\n\
         unpacked messages are about four times as large. Writing is what `asperity run` takes beyond the same run with no\n\
         states and samples.\n"
    );
    println!(
        "| log | MB | bare reader, MB/s | writing | `asperity events` | `... --quick` | `asperity replay` | ... in MB/s | \
         `asperity check` | replay's memory, MB |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for (number, (name, set)) in LOGS.into_iter().enumerate() {
        let log = folder.path().join(format!("{number}.mcap"));
        let path = log.to_str().expect("temporary folders have plain names");
        let run = |set: &[&str]| {
            let start = ["run", "default", "--set", "parameter_set=as-coded", "--out", path];
            let sets = set.iter().flat_map(|value| ["--set", value]);
            let arguments: Vec<&str> = start.into_iter().chain(sets).collect();
            fs::remove_file(&log).ok();
            seconds(|| asperity(&arguments))
        };
        let without =
            [set, &["recording.sample_s=0", "recording.fields_s=0", "recording.event_fields=false"]];
        let writing_s = (0..ROUNDS).map(|_| -run(&without.concat()) + run(set)).collect();
        let mb = fs::metadata(&log).expect("the log is there").len() as f64 / 1e6;
        let mut bare_s = Vec::new();
        let mut of = |command: &[&str]| {
            let ratios = (0..ROUNDS).map(|_| {
                let before_s = seconds(|| bare(&log));
                let elapsed_s = seconds(|| asperity(&[command, &[path]].concat()));
                let bare = (before_s + seconds(|| bare(&log))) / 2.0;
                bare_s.push(bare);
                elapsed_s / bare
            });
            median(ratios.collect())
        };
        let commands: [&[&str]; 4] = [&["events"], &["events", "--quick"], &["replay"], &["check"]];
        let [events, quick, replay, check] = commands.map(&mut of);
        let bare_s = median(bare_s);
        println!(
            "| {name} | {mb:.1} | {:.0} | {:.1} | {events:.1} | {quick:.2} | {replay:.1} | {:.0} | {check:.1} | {:.0} |",
            mb / bare_s,
            median(writing_s) / bare_s,
            mb / bare_s / replay,
            watched(&["replay", path]).2,
        );
        fs::remove_file(&log).expect("the log is there");
    }
    println!();
}

/// Reads a log with the library only.
fn bare(log: &Path) {
    let mut file = fs::File::open(log).expect("the log is there");
    let options = LinearReaderOptions::default().with_prevalidate_chunk_crcs(true);
    let mut reader = LinearReader::new_with_options(options);
    let mut records = 0u64;
    while let Some(event) = reader.next_event() {
        match event.expect("the log is whole") {
            LinearReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted)).expect("the log can be read");
                reader.notify_read(read);
            }
            LinearReadEvent::Record { .. } => records += 1,
        }
    }
    std::hint::black_box(records);
}
