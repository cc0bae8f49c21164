//! Salvages damaged logs: everything undamaged is kept, nothing else is, and what is missing is
//! reported.

use std::fs;
use std::ops::{Deref, Range};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use crate::export::TOPICS;
use crate::laws::file::{self, Message};
use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::take_apart;
use crate::support::binary::{ends, outcome, succeed, text, with_sets};
use crate::support::{binary, small};
use asperity_run::Verdict;
use asperity_runlog::{LogItem, LogProblem, RunReader, Topics};
use asperity_testkit::{first_stray, read_until_problem};
use mcap::records::op;

/// A log of many chunks, in memory, and a folder for damaged copies.
struct Log {
    folder: tempfile::TempDir,
    contents: Arc<Contents>,
}

struct Contents {
    bytes: Vec<u8>,
    items: Vec<LogItem>,
    /// Where its chunks are.
    chunks: Vec<Range<usize>>,
    /// Each with the number of its chunk.
    messages: Vec<(usize, Message)>,
}

impl Deref for Log {
    type Target = Contents;

    fn deref(&self) -> &Contents {
        &self.contents
    }
}

impl Log {
    /// It consists mostly of states of all blocks, so it has many chunks.
    fn make() -> Log {
        static USUAL: OnceLock<Arc<Contents>> = OnceLock::new();
        let scenario = ["default", "--set", "recording.fields_s=0.0004", "--set", "time.duration_s=0.6"];
        let contents = USUAL.get_or_init(|| Log::with(&scenario).contents).clone();
        Log { folder: asperity_testkit::folder(), contents }
    }

    fn with(scenario: &[&str]) -> Log {
        let folder = asperity_testkit::folder();
        let path = folder.path().join("whole.mcap");
        binary::run(scenario, &path);
        let bytes = fs::read(&path).expect("the log can be read");
        let items = read_until_problem(&path).0;
        let chunks: Vec<_> = file::chunks(&bytes).into_iter().map(|chunk| chunk.at).collect();
        assert!(chunks.len() >= 5, "{} chunks", chunks.len());
        let messages = file::messages(&bytes).expect("the log is whole");
        Log { folder, contents: Arc::new(Contents { bytes, items, chunks, messages }) }
    }

    /// The messages of all chunks that were not hit; none depends on the indices behind a chunk.
    fn outside(&self, hit: &Range<usize>) -> Vec<&Message> {
        let untouched = |chunk: &Range<usize>| chunk.end <= hit.start || hit.end <= chunk.start;
        let kept = self.messages.iter().filter(|(chunk, _)| untouched(&self.chunks[*chunk]));
        kept.map(|(_, message)| message).collect()
    }

    /// Salvages some bytes; returns the output of the command, and its log.
    fn salvage(&self, bytes: &[u8]) -> (String, PathBuf) {
        let (damaged, out) =
            (self.folder.path().join("damaged.mcap"), self.folder.path().join("salvaged.mcap"));
        fs::write(&damaged, bytes).expect("the folder can be written");
        if out.exists() {
            fs::remove_file(&out).expect("it can be removed");
        }
        (succeed(&["salvage", text(&damaged), "--out", text(&out)]), out)
    }

    /// Salvages a damaged copy, and compares the result with the expected one: the messages of these chunks
    /// are kept, in order, and the log is incomplete.
    #[track_caller]
    fn must_keep(&self, what: &str, bytes: &[u8], hit: &Range<usize>) -> String {
        let (said, out) = self.salvage(bytes);
        let (items, problem) = read_until_problem(&out);
        let problem = problem.map(|error| error.problem);
        assert!(matches!(problem, Some(LogProblem::Salvaged)), "{what}: {problem:?}\n{said}");
        assert_eq!(
            first_stray(&items, &self.items),
            None,
            "{what}: an item that the log did not have, or not in this place\n{said}"
        );
        let kept = file::messages(&fs::read(&out).expect("it was just written")).expect("it can be read");
        let kept: Vec<&Message> = kept.iter().map(|(_, message)| message).collect();
        assert_eq!(file::difference(&self.outside(hit), &kept), None, "{what}: {said}");
        let checked = asperity_run::check(&out);
        assert_eq!(checked.verdict, Verdict::Salvaged, "{what}: {checked}");
        said
    }
}

#[test]
fn what_is_not_hit_is_kept() {
    hit(11);
}

#[test]
#[ignore = "most of a minute of salvaging: cargo xtask nightly"]
fn what_is_not_hit_anywhere_is_kept() {
    hit(1);
}

/// Damages a log in twelve places in five ways, of which every `each`-th is tried.
fn hit(each: usize) {
    let log = Log::make();
    let (bytes, end) = (&log.bytes, log.bytes.len());
    for number in (0..60).step_by(each) {
        let (number, way) = (number / 5, number % 5);
        let any = 40 + (end - 80) * number / 12 + 77 * number;
        // Header and scenario are in one block of the disk; with both gone, nothing identifies the run.
        let place = any.max(log.chunks[0].start);
        let block = place..(place + 4096).min(end);
        let (what, damaged, hit) = match way {
            0 => {
                let mut flipped = bytes.clone();
                flipped[any] ^= 1 << (number % 8);
                // No message depends on the times in the head of a chunk, whose content has a checksum of its own.
                let times = |chunk: &Range<usize>| (chunk.start + 9..chunk.start + 25).contains(&any);
                let hit = if log.chunks.iter().any(times) { 0..0 } else { any..any + 1 };
                ("a bit turned", flipped, hit)
            }
            1 => {
                let mut zeroed = bytes.clone();
                zeroed[block.clone()].fill(0);
                ("a block of the disk lost", zeroed, block)
            }
            2 => ("bytes cut out", [&bytes[..block.start], &bytes[block.end..]].concat(), block),
            3 => {
                let inserted = [&bytes[..place], &[0x06; 300], &bytes[place..]].concat();
                ("bytes put in", inserted, place..place)
            }
            _ => {
                let place = place.max(log.chunks[0].end);
                ("cut off", bytes[..place].to_vec(), place..end)
            }
        };
        log.must_keep(&format!("{what} at {place}"), &damaged, &hit);
    }
}

/// The chunk that announces the topics is the first one: without it, the summary does.
#[test]
fn without_its_beginning_a_log_is_read_from_its_scenario_and_messages() {
    let log = Log::make();
    let first = log.chunks[0].clone();
    let mut bytes = log.bytes.clone();
    bytes[first.clone()].fill(0xff);
    let said = log.must_keep("the first chunk", &bytes, &first);
    assert!(said.contains("nothing between the beginning and step "), "{said}");
    // Nor is the header needed, as long as there is the scenario, nor the file's first bytes.
    let run = bytes.windows(7).position(|bytes| bytes == b"\x03\0\0\0run").expect("the metadata is there");
    bytes[run + 4] = b'R';
    bytes[..8].fill(0);
    let said = log.must_keep("header and first chunk", &bytes, &(0..first.end));
    assert!(said.contains("metadata `run` is lost, and was rebuilt from the scenario"), "{said}");
    let out = log.folder.path().join("salvaged.mcap");
    let mut reader = RunReader::open(&out, Topics::NONE).expect("it has a header");
    assert!(matches!(reader.verify().map_err(|error| error.problem), Err(LogProblem::Salvaged)));
    let end = reader.end().expect("it was read to its end");
    assert!(
        end.topic_digests.keys().eq(end.message_counts.keys()) && end.topic_digests.len() == TOPICS.len()
    );
    assert_eq!((reader.header().blocks, reader.header().code_version.as_str()), (100, "unknown"));
    assert!(reader.scenario_toml().contains("duration_s = 0.6"));
}

#[test]
fn chunks_that_are_gone_there_twice_or_of_another_slider_are_noticed() {
    let log = Log::make();
    let b = &log.bytes;
    let third = log.chunks[2].clone();
    let gone = [&b[..third.start], &b[third.end..]].concat();
    let said = log.must_keep("a chunk cut out", &gone, &third);
    assert!(said.contains("nothing between step "), "{said}");

    let twice = [&b[..third.end], &b[third.clone()], &b[third.end..]].concat();
    let (said, out) = log.salvage(&twice);
    assert!(said.contains("messages left out, which stood behind later ones, or twice"), "{said}");
    assert!(!said.contains(" lost") && !said.contains("nothing between"), "{said}");
    assert_eq!(read_until_problem(&out).0, log.items);

    // Of a chunk that was moved forward, or those that it has overtaken, some are kept.
    let last = log.chunks[log.chunks.len() - 1].clone();
    let moved = [&b[..third.start], &b[last.clone()], &b[third.start..last.start], &b[last.end..]].concat();
    let (said, out) = log.salvage(&moved);
    assert!(
        said.contains(" left out, which stood behind later ones") && said.contains("nothing between"),
        "{said}"
    );
    assert_eq!(first_stray(&read_until_problem(&out).0, &log.items), None);
    assert_eq!(asperity_run::check(&out).verdict, Verdict::Salvaged);

    let other = ["recording.fields_s=0.0002", "time.duration_s=0.6", "slider.blocks=50"];
    let other = Log::with(&with_sets(&["default"], &other));
    let foreign = &other.bytes[other.chunks[1].clone()];
    let among = [&b[..third.start], foreign, &b[third.start..]].concat();
    let said = log.must_keep("a chunk of another slider", &among, &(third.start..third.start));
    assert!(said.contains("50 values, not 100") || said.contains("has 50 values"), "{said}");
}

/// Eight million bytes that look like the beginnings of chunks: a few are looked into in vain,
/// and the chunks behind them are found all the same.
#[test]
fn false_beginnings_of_chunks_cost_little() {
    let log = Log::make();
    let own = log.chunks[1].start;
    let mut false_chunk = vec![op::CHUNK];
    false_chunk.extend(2_000_000u64.to_le_bytes());
    false_chunk.extend([0; 28]);
    false_chunk.extend(b"\x04\0\0\0zstd");
    let falsehoods = false_chunk.repeat(8_000_000 / false_chunk.len());
    let bytes = [&log.bytes[..own], &[0xff], &falsehoods[..], &log.bytes[own..]].concat();
    log.must_keep("false beginnings", &bytes, &(own..own));
}

#[test]
fn what_is_whole_or_hopeless_is_left_alone() {
    let log = Log::make();
    let (said, out) = log.salvage(&log.bytes);
    assert!(said.contains("whole: there is nothing to salvage") && !out.exists(), "{said}");

    let damaged = log.folder.path().join("damaged.mcap");
    for (bytes, code, told) in [
        (&b""[..], 3, "nothing identifies its run"),
        (b"no log at all, but long enough to be one", 2, "nothing identifies its run"),
        (&log.bytes[..20], 3, "nothing identifies its run"),
        (&log.bytes[..log.chunks[0].start], 3, "no message is left that a checksum confirms"),
    ] {
        fs::write(&damaged, bytes).expect("the folder can be written");
        ends(code, &["salvage", text(&damaged), "--out", text(&out)], &[told, "damaged.mcap"]);
        assert!(!out.exists());
    }
    // An output that exists is kept.
    fs::write(&damaged, &log.bytes[..log.bytes.len() / 2]).expect("the folder can be written");
    fs::write(&out, "mine").expect("the folder can be written");
    ends(2, &["salvage", text(&damaged), "--out", text(&out)], &[]);
    assert_eq!(fs::read_to_string(&out).unwrap(), "mine");
}

/// Detectors stop at a gap, and the other commands print the available part, and fail.
#[test]
fn commands_take_a_salvaged_log_for_what_it_is() {
    let log = Log::make();
    let mut bytes = log.bytes.clone();
    let third = log.chunks[2].clone();
    bytes[third.start + 100] ^= 1;
    let (_, out) = log.salvage(&bytes);
    let (code, printed, _) = outcome(&["events", text(&out)]);
    assert_eq!(code, 5);
    let whole = log.folder.path().join("whole.mcap");
    fs::write(&whole, &log.bytes).expect("the folder can be written");
    let whole = succeed(&["events", text(&whole)]);
    let (code, verdict, _) = outcome(&["check", text(&out)]);
    assert!(code == 5 && verdict.contains(": salvaged with gaps: "), "{verdict}");
    let (printed, whole): (Vec<&str>, Vec<&str>) = (printed.lines().collect(), whole.lines().collect());
    assert!(printed.len() < whole.len() && printed.len() > 2, "{} of {} events", printed.len(), whole.len());
    assert!(printed.iter().all(|row| whole.contains(row)));
    ends(5, &["replay", text(&out)], &["salvaged with gaps"]);
}

#[test]
fn whichever_chunk_is_lost_the_rest_is_salvaged_with_gaps() {
    lose_chunks(4);
}

#[test]
#[ignore = "half a minute of salvaging: cargo xtask nightly"]
fn whichever_of_two_hundred_chunks_is_lost_the_rest_is_salvaged_with_gaps() {
    lose_chunks(70);
}

/// Whatever is lost, the rest is a salvaged log, with messages missing in its gaps only.
fn lose_chunks(of_each_packing: usize) {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let windows = "recording.window=[{from_s=0.3,to_s=0.6,every_s=1e-3,first_block=2,last_block=5}]";
    let dense = ["--set", "recording.fields_s=0.005", "--set", windows];
    binary::run(&[&small::SCENARIO[..], &dense].concat(), &path("whole.mcap"));
    let parts = take_apart(&fs::read(path("whole.mcap")).expect("it was just written"));
    let (damaged, out) = (path("damaged.mcap"), path("salvaged.mcap"));
    let mut wrong = Vec::new();
    let mut lost = 0;
    // Chunks of one message each, too: then only that message is missing.
    for per_chunk in [1, 7, 40] {
        let bytes = put_together(&parts, Packing { per_chunk, ..Packing::USUAL });
        let chunks: Vec<_> = file::chunks(&bytes).into_iter().map(|chunk| chunk.at).collect();
        let stride = chunks.len() / of_each_packing + 1;
        for chunk in chunks.into_iter().step_by(stride) {
            let mut broken = bytes.clone();
            broken[chunk.end - 1] ^= 1;
            fs::write(&damaged, &broken).expect("the folder can be written");
            fs::remove_file(&out).ok();
            asperity_run::salvage(&damaged, &out).expect("most of it is left");
            let checked = asperity_run::check(&out);
            lost += 1;
            if checked.verdict != Verdict::Salvaged {
                wrong.push(format!("{per_chunk} to a chunk, that at byte {}: {checked}", chunk.start));
            }
        }
    }
    let count = wrong.len();
    wrong.truncate(20);
    assert!(wrong.is_empty(), "{count} of {lost}:\n{}", wrong.join("\n"));
    assert!(lost > 3 * of_each_packing / 2, "{lost} chunks");
}
