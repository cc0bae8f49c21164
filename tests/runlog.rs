//! The layout of a run log, as a reader that knows MCAP and not asperity sees it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};

use crate::export::TOPICS;
use crate::support::binary::{succeed, text};
use crate::support::{binary, small};
use asperity_record::{
    Arrival, BulkRecord, Event, EventKind, FieldRecord, GlobalSlip, Onset, RunEnd, RunStatus, Rupture,
    SlipEvent, SolverReport,
};
use asperity_runlog::{Content, Existing, LogError, LogItem, RunReader, RunWriter, Topics, partial_path};
use mcap::read::{ChunkFlattener, LinearReader};
use mcap::records::Record;

/// The time step of the small run.
const STEP_NS: u64 = 100;

struct Log {
    folder: tempfile::TempDir,
    path: PathBuf,
    bytes: Vec<u8>,
}

impl Log {
    fn make() -> Log {
        let folder = asperity_testkit::folder();
        let path = folder.path().join("run.mcap");
        small::run(&path);
        let bytes = fs::read(&path).expect("the log can be read");
        Log { folder, path, bytes }
    }

    /// Every record from the first to the end of the data, those in chunks included.
    fn data(&self) -> Vec<Record<'_>> {
        ChunkFlattener::new(&self.bytes)
            .expect("the log is MCAP")
            .map(|record| record.expect("the log is whole"))
            .take_while(|record| !matches!(record, Record::DataEnd(_)))
            .collect()
    }
}

#[test]
fn header_first_and_end_last() {
    let log = Log::make();
    let outer: Vec<Record<'_>> = LinearReader::new(&log.bytes)
        .expect("the log is MCAP")
        .map(|record| record.expect("the log is whole"))
        .take_while(|record| !matches!(record, Record::DataEnd(_)))
        .filter(|record| !matches!(record, Record::MessageIndex(_)))
        .collect();
    let [
        Record::Header(header),
        Record::Metadata(run),
        Record::Attachment { header: scenario, data, .. },
        chunks @ ..,
        Record::Metadata(end),
    ] = &outer[..]
    else {
        panic!("not header, run, scenario.toml, chunks, run_end: {:?}", opcodes(&outer))
    };
    assert!(chunks.iter().all(|record| matches!(record, Record::Chunk { .. })), "{:?}", opcodes(chunks));
    assert_eq!(header.profile, "asperity");
    assert_eq!((run.name.as_str(), end.name.as_str()), ("run", "run_end"));
    assert_eq!(run.metadata["time_step_s"], "0.0000001");
    assert_eq!(run.metadata["log_time"], "step * 100 ns, exact");
    assert_eq!(end.metadata["status"], "complete");
    assert_eq!(end.metadata["last_step"], run.metadata["steps"]);

    // The attachment is the whole of the scenario that `scenario show` shows; values that it leaves to the
    // parameter set are written out here.
    assert_eq!((scenario.name.as_str(), scenario.media_type.as_str()), ("scenario.toml", "application/toml"));
    let shown = succeed(&[&["scenario", "show"], &small::SCENARIO[..]].concat());
    let attached = std::str::from_utf8(data).expect("the attachment is text");
    assert!(attached.contains("\nmass_kg = 12.0\n") && !shown.contains("\nmass_kg"), "{attached}");
    let file = log.folder.path().join("scenario.toml");
    fs::write(&file, data).expect("the folder can be written");
    assert_eq!(succeed(&["scenario", "show", text(&file)]), shown);
}

fn opcodes(records: &[Record<'_>]) -> Vec<u8> {
    records.iter().map(Record::opcode).collect()
}

#[test]
fn every_channel_has_a_schema_that_names_its_fields() {
    let log = Log::make();
    let data = log.data();
    let mut schemas: BTreeMap<u16, serde_json::Value> = BTreeMap::new();
    let mut bulk: BTreeMap<&str, String> = BTreeMap::new();
    for record in &data {
        let Record::Schema { header, data } = record else { continue };
        match header.encoding.as_str() {
            "jsonschema" => {
                drop(schemas.insert(header.id, serde_json::from_slice(data).expect("it is JSON")))
            }
            "protobuf" => drop(bulk.insert(&header.name, String::from_utf8_lossy(data).into_owned())),
            other => panic!("a schema in {other}"),
        }
        assert!(!header.name.is_empty());
    }
    // Programs of others decode by it: `in_ci/clients.rs`.
    let of_fields = &bulk["asperity.Fields"];
    assert!(of_fields.contains("displacement_m") && of_fields.contains("from the initial grid, m.\n"));
    assert!(!of_fields.contains("across") && bulk["asperity.Window"].contains("tangential_force_n"));
    let channels: BTreeMap<u16, &mcap::records::Channel> = data
        .iter()
        .filter_map(|record| match record {
            Record::Channel(channel) => Some((channel.id, channel)),
            _ => None,
        })
        .collect();
    let topics: BTreeSet<&str> = channels.values().map(|channel| channel.topic.as_str()).collect();
    assert_eq!(topics, BTreeSet::from(TOPICS));
    for channel in channels.values() {
        assert_ne!(channel.schema_id, 0, "{} has no schema", channel.topic);
        assert_eq!(channel.metadata.contains_key("unit:time_s"), !channel.topic.starts_with("/events"));
        let is_bulk = ["/fields", "/window"].contains(&channel.topic.as_str());
        assert_eq!(channel.message_encoding, if is_bulk { "protobuf" } else { "json" });
        if is_bulk {
            continue;
        }
        let properties = schemas[&channel.schema_id]["properties"].as_object();
        assert!(properties.is_some_and(|fields| !fields.is_empty()), "{} has no fields", channel.topic);
    }
    for record in &data {
        let Record::Message { header, data } = record else { continue };
        let channel = channels[&header.channel_id];
        if channel.message_encoding == "protobuf" {
            continue;
        }
        let message: BTreeMap<String, serde_json::Value> =
            serde_json::from_slice(data).expect("a message is a JSON object");
        let schema = &schemas[&channel.schema_id];
        let named = schema["properties"].as_object().expect("checked above");
        let unnamed = message.keys().find(|field| !named.contains_key(*field));
        assert_eq!(unnamed, None, "{}: not in its schema", channel.topic);
        for field in schema["required"].as_array().expect("most fields are required") {
            assert!(message.contains_key(field.as_str().unwrap()), "{}: without {field}", channel.topic);
        }
    }
}

#[test]
fn log_time_is_simulated_time() {
    let log = Log::make();
    let data = log.data();
    let mut topics = BTreeMap::new();
    let mut sequences: BTreeMap<u16, u32> = BTreeMap::new();
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut last_ns = 0;
    for record in &data {
        match record {
            Record::Channel(channel) => {
                topics.insert(channel.id, channel.topic.as_str());
            }
            Record::Message { header, data } => {
                assert!(header.log_time >= last_ns, "time runs backwards at {}", header.log_time);
                last_ns = header.log_time;
                assert_eq!(header.publish_time, header.log_time);
                let sequence = sequences.entry(header.channel_id).or_insert(0);
                assert_eq!(header.sequence, *sequence, "messages of {}", topics[&header.channel_id]);
                *sequence += 1;
                *counts.entry(topics[&header.channel_id].to_owned()).or_insert(0) += 1;
                let topic = topics[&header.channel_id];
                let (step, time_s) = if topic == "/fields" {
                    let state = FieldRecord::of_message(data).expect("it is a state");
                    (Some(state.step), Some(state.time_s))
                } else {
                    let message: serde_json::Value = serde_json::from_slice(data).expect("a message is JSON");
                    (message["step"].as_u64(), message["time_s"].as_f64())
                };
                if let Some(step) = step {
                    assert_eq!(header.log_time, step * STEP_NS);
                    assert_eq!(time_s, Some(step as f64 / 1e7));
                } else {
                    assert!(topic.starts_with("/events/"));
                    assert_eq!(header.log_time % STEP_NS, 0);
                }
            }
            _ => {}
        }
    }
    assert_eq!(last_ns, 1_200_000_000, "the last record is of the last step");
    let end = read(&log.path).expect("the log is whole");
    for (topic, promised) in &end.message_counts {
        assert_eq!(counts.get(topic).copied().unwrap_or(0), *promised, "messages of {topic}");
    }
    assert_eq!(counts["/switch"], end.switches);
}

fn read(path: &Path) -> Result<RunEnd, LogError> {
    RunReader::open(path, Topics::ALL)?.verify()
}

/// The digests can be computed with MCAP, BLAKE3 and the head of `crates/runlog/src/lib.rs` alone.
#[test]
fn digests_are_those_of_the_messages_as_they_stand_in_the_file() {
    let log = Log::make();
    let mut topics = BTreeMap::new();
    let mut all = blake3::Hasher::new();
    let mut by_topic: BTreeMap<String, blake3::Hasher> = BTreeMap::new();
    for record in log.data() {
        match record {
            Record::Channel(channel) => {
                by_topic.entry(channel.topic.clone()).or_default();
                topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => {
                let topic = &topics[&header.channel_id];
                for digest in [&mut all, by_topic.get_mut(topic).expect("it has a channel")] {
                    digest.update(&(topic.len() as u64).to_le_bytes()).update(topic.as_bytes());
                    digest.update(&(data.len() as u64).to_le_bytes()).update(&data);
                }
            }
            _ => {}
        }
    }
    let end = read(&log.path).expect("the log is whole");
    let text = |digest: &blake3::Hasher| digest.finalize().to_hex().to_string();
    assert_eq!(end.digest, text(&all));
    let expected: BTreeMap<String, String> =
        by_topic.iter().map(|(topic, digest)| (topic.clone(), text(digest))).collect();
    assert_eq!(end.topic_digests, expected);
    assert!(expected.len() >= 9, "{expected:?}");
    // It has no dense window: the hash of an empty input.
    assert_eq!(expected["/window"], blake3::hash(b"").to_hex().as_str());
}

/// Logs of one run with more and with fewer detectors agree in their common topics.
#[test]
fn a_log_with_a_topic_more_is_compared_in_what_both_have() {
    let log = Log::make();
    let kinds = [
        EventKind::of::<Onset>(),
        EventKind::of::<SlipEvent>(),
        EventKind::of::<GlobalSlip>(),
        EventKind::of::<Rupture>(),
        EventKind::of::<Arrival>(),
    ];
    let again = |name: &str, kinds: &[EventKind], change: Option<&str>| {
        let path = log.folder.path().join(name);
        let mut reader = RunReader::open(&log.path, Topics::ALL).expect("the log has a header");
        let (header, scenario) = (reader.header().clone(), reader.scenario_toml().to_owned());
        let mut writer =
            RunWriter::create(&path, Existing::Refuse, &header, &scenario, kinds, Content::Text).unwrap();
        while let Some(item) = reader.next_item().expect("the log is whole") {
            match item {
                LogItem::Record(record) => writer.record(&record).unwrap(),
                LogItem::Event(event) if kinds.iter().any(|kind| kind.topic == event.topic()) => {
                    let changed = event.json().replace("\"event\":7,", "\"event\":8,");
                    let is_changed = change == Some(event.topic());
                    let event = if is_changed { Event::of_json(event.topic(), &changed) } else { event };
                    writer.event(&event).unwrap();
                }
                LogItem::Event(_) => {}
            }
        }
        let end = writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
        assert_eq!(read(&path).expect("the log is whole"), end);
        end
    };
    let whole = read(&log.path).expect("the log is whole");
    let same = again("same.mcap", &kinds, None);
    assert_eq!((&same.digest, &same.topic_digests), (&whole.digest, &whole.topic_digests));

    let fewer = again("fewer.mcap", &kinds[1..], None);
    assert_ne!(fewer.digest, whole.digest);
    let mut common = whole.topic_digests.clone();
    common.remove("/events/onset").expect("it has that topic");
    assert_eq!(fewer.topic_digests, common);

    let other = again("other.mcap", &kinds[..2], Some("/events/slip"));
    let differs =
        |topic: &&String| other.topic_digests.get(*topic).is_some_and(|digest| *digest != common[*topic]);
    assert_eq!(common.keys().filter(differs).collect::<Vec<_>>(), ["/events/slip"]);
}

/// A file that is no log is reported as such, not as damaged. MCAP files of other programs are in `foreign.rs`.
#[test]
fn what_is_no_run_log_is_told_from_what_is_damaged() {
    let folder = asperity_testkit::folder();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("the folder can be written");
        path
    };
    let magic = "it does not begin with the eight bytes that begin every MCAP file";
    let missing = folder.path().join("missing.mcap");
    assert!(
        read(&missing).expect_err("it is none").to_string().ends_with("missing.mcap: there is no such file")
    );
    for (path, says) in [
        (folder.path().to_owned(), "it is a folder"),
        (file("short.csv", b"a,b"), magic),
        (file("table.csv", b"onset_s,end_s\n"), magic),
        (file("zeros.csv", b"\0\0\0\0\0\0\0\0a,b\n"), magic),
    ] {
        let error = read(&path).expect_err("it is none");
        assert_eq!(error.to_string(), format!("{}: not a run log: {says}", path.display()));
        assert!(error.problem.is_no_run_log());
        assert!(!error.problem.is_early_end());
    }
    // A run that is stopped as it begins, or a power cut, may leave these.
    for (path, says) in [
        (file("empty.mcap", b""), "the file is empty"),
        (file("zeros.mcap", &[0; 1000]), "the file begins with zeros, as after a power cut"),
    ] {
        let error = read(&path).expect_err("it is none");
        assert_eq!(error.to_string(), format!("{}: {says}", path.display()));
        assert!(error.problem.is_no_run_log() && error.problem.is_early_end());
    }
}

/// A note changes nothing but itself, stays when keys are added, and leaves no trace when they are removed.
#[test]
fn a_note_is_kept_and_shown_and_changes_nothing_else() {
    let log = Log::make();
    let (path, page) = (text(&log.path), log.folder.path().join("page.html"));
    let end = read(&log.path).expect("the log is whole");
    let outcome = |arguments: &[&str]| {
        let (code, out, _) = binary::outcome(arguments);
        (code, out)
    };
    let author = format!("{path}: note: author = A. \u{dc}. Name\n");
    let comment = format!("{path}: note: comment = a = b <&>\n");
    assert_eq!(outcome(&["note", path, "author=A. \u{dc}. Name"]), (0, author.clone()));
    assert_eq!(outcome(&["note", path, " comment = a = b <&> "]), (0, format!("{author}{comment}")));
    assert_eq!(read(&log.path).expect("the log is whole"), end);
    for command in ["check", "summary"] {
        let (code, said) = outcome(&[command, path]);
        assert!(code == 0 && said.ends_with(&format!("{author}{comment}")), "{said}");
        assert!(!said.contains("another program"), "{said}");
    }
    succeed(&["report", path, "--out", text(&page)]);
    assert!(fs::read_to_string(&page).unwrap().contains("<p>comment: a = b &lt;&amp;&gt;</p>"));
    assert_eq!(outcome(&["note", path, "author=", "comment="]), (0, String::new()));
    assert!(fs::read(&log.path).unwrap() == log.bytes);
    // What is not finished, or no note, is left alone.
    assert_eq!(outcome(&["note", path, "author"]).0, 2);
    let mut damaged = log.bytes.clone();
    damaged[log.bytes.len() / 2] ^= 1;
    for (bytes, code) in [(&log.bytes[..log.bytes.len() / 2], 3), (&damaged, 4)] {
        fs::write(&log.path, bytes).expect("the folder can be written");
        assert_eq!(outcome(&["note", path, "author=A"]).0, code);
        assert!(fs::read(&log.path).unwrap() == bytes);
    }
}

/// One that is damaged is none of both: `flips.rs`.
#[test]
fn check_tells_whole_from_incomplete_wherever_a_log_is_cut() {
    let log = Log::make();
    let said = succeed(&["check", text(&log.path)]);
    let words = [": whole: ", "28 slip events, up to step 12000000 (1.2 s)"];
    assert!(words.iter().all(|words| said.contains(words)), "{said}");
    let other = log.folder.path().join("other.mcap");
    let bytes = &log.bytes;
    for length in (0..bytes.len()).step_by(bytes.len() / 20) {
        fs::write(&other, &bytes[..length]).expect("the folder can be written");
        let (code, said, _) = binary::outcome(&["check", text(&other)]);
        assert!(code == 3 && said.contains(": incomplete: "), "cut to {length}: {said}");
    }
    // Of several the worst counts.
    assert_eq!(binary::outcome(&["check", text(&log.path), text(&other)]).0, 3);
}

#[test]
fn a_quick_look_prints_the_same_and_says_that_nothing_was_verified() {
    let log = Log::make();
    let [cut, damaged] = ["cut.mcap", "damaged.mcap"].map(|name| log.folder.path().join(name));
    let mut bytes = log.bytes.clone();
    fs::write(&cut, &bytes[..bytes.len() / 2]).expect("the folder can be written");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&damaged, &bytes).expect("the folder can be written");
    for command in [&["events"][..], &["catalogue"], &["summary", "--format", "json"]] {
        for (path, code, says) in
            [(&log.path, 0, "not verified: "), (&cut, 3, "incomplete: "), (&damaged, 4, "damaged: ")]
        {
            let outcome = |more: &[&str]| binary::outcome(&[command, more, &[text(path)]].concat());
            let ((expected, whole, _), (found, quick, said)) = (outcome(&[]), outcome(&["--quick"]));
            assert_eq!((found, expected), (code, code), "{command:?}: {said}");
            assert_eq!(quick, whole, "{command:?} {path:?}");
            assert!(said.contains(says), "{said}");
        }
    }
}

/// The MCAP library finishes a file as its writer is dropped, in a panic as well: the resulting file must
/// not count as a complete log.
#[test]
fn a_writer_that_is_dropped_in_a_panic_leaves_no_whole_log() {
    let log = Log::make();
    let mut reader = RunReader::open(&log.path, Topics::RECORDS).expect("the log has a header");
    let (header, scenario) = (reader.header().clone(), reader.scenario_toml().to_owned());
    let mut records = Vec::new();
    while let Some(item) = reader.next_item().expect("the log is whole") {
        if let LogItem::Record(record) = item {
            records.push(record);
        }
    }
    let path = log.folder.path().join("other.mcap");
    // At the first record, in the midst of them, and behind the last.
    for survived in [0, records.len() / 2, records.len()] {
        let outcome = std::panic::catch_unwind(AssertUnwindSafe(|| {
            let mut writer =
                RunWriter::create(&path, Existing::Refuse, &header, &scenario, &[], Content::Text).unwrap();
            records[..survived].iter().for_each(|record| writer.record(record).unwrap());
            panic!("meant to happen");
        }));
        assert!(outcome.is_err() && !path.exists());
        let left = read(&partial_path(&path)).expect_err("nobody said that the run was over");
        assert!(left.problem.is_early_end(), "{left}");
    }
}
