//! Synthetic logs of a few records: truncated, damaged, unfinished, and with events that only their
//! own program knows.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use asperity_files::FileError;
use asperity_record::{
    Checkpoint, Event, EventKind, EventPayload, GlobalSlip, Record, RunHeader, RunStatus, SolverReport,
    payload,
};
use asperity_runlog::{
    Content, Existing, Gap, LogError, LogItem, LogProblem, RunReader, RunWriter, SalvageError, Salvaged,
    Topics, Unfinished, WriteError, partial_path, salvage,
};
use tempfile::TempDir;

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
    RunHeader { time_step_s: 1.0, steps: STEPS, ..asperity_testkit::run_header() }
}

fn step(step: u64) -> Record {
    Record::Step(asperity_testkit::quiet_step(step, step as f64, 0.5))
}

fn writer(path: &Path, kinds: &[EventKind]) -> RunWriter {
    RunWriter::create(path, Existing::Refuse, &header(), "blocks = 2", kinds, Content::Text).unwrap()
}

/// Writes a log of that many steps; returns its path.
fn log(folder: &Path, steps: u64, status: RunStatus) -> PathBuf {
    let path = folder.join(format!("{steps}-{status:?}.mcap"));
    let mut writer = writer(&path, &[]);
    (1..=steps).for_each(|n| writer.record(&step(n)).unwrap());
    writer.finish(status, SolverReport::default()).unwrap();
    if status == RunStatus::Interrupted { partial_path(&path) } else { path }
}

/// A power cut may leave zeros where the first bytes of an unfinished log were not written yet.
#[test]
fn a_log_that_begins_with_zeros_is_no_file_of_another_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = log(folder.path(), STEPS, RunStatus::Complete);
    let sound = fs::read(&path).unwrap();
    let is_foreign = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let error = RunReader::open(&path, Topics::NONE).err().unwrap();
        error.problem.is_no_run_log() && !error.problem.is_early_end()
    };
    for from in 0..100 {
        let mut torn = sound.clone();
        torn[from..200].fill(0);
        assert!(!is_foreign(&torn), "zeros from byte {from} on");
        assert!(!is_foreign(&torn[..200]), "zeros from byte {from} on, and no more");
    }
    let text = [&[0; 8][..], b"text that begins with zeros, and is another's"].concat();
    assert!(is_foreign(&text));
}

#[test]
fn skimming_reads_the_chunks_alone_that_their_indexes_lead_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut writer = writer(&path, &[EventKind::of::<Mark>()]);
    for n in 1..=STEPS {
        writer.record(&step(n)).unwrap();
        if n < STEPS {
            writer.event(&Event::new(Mark { before: n - 1 })).unwrap();
        }
        // It ends a chunk.
        writer.checkpoint(&Checkpoint { step: n, state: "{}".to_owned() }).unwrap();
    }
    writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
    let skim = |topics: &'static [&'static str]| {
        let mut items = 0;
        let read = RunReader::open(&path, Topics::NONE).unwrap().skim(topics, &mut |_| items += 1);
        (items, read.map_err(|error| error.problem.to_string()))
    };
    const MARKS: &[&str] = &["/events/mark"];
    assert_eq!((skim(MARKS), skim(&["/step"])), ((3, Ok(())), (4, Ok(()))));
    // The last chunk has no mark.
    let sound = fs::read(&path).unwrap();
    let after =
        |at: usize, word: &[u8]| at + sound[at..].windows(word.len()).position(|w| w == word).unwrap();
    let third = (0..3).fold(0, |at, _| after(at, b"checkpoint") + 1);
    let mut bytes = sound.clone();
    bytes[after(third, b"zstd") + 20] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert_eq!(skim(MARKS), (3, Ok(())));
    assert!(matches!(skim(&["/step"]), (3, Err(_))));
    assert!(RunReader::open(&path, Topics::NONE).unwrap().verify().is_err());
    // An index that leads past a mark.
    let mut bytes = sound.clone();
    let end = after(0, b"/events/mark\x01\0\0\x003");
    bytes[end + 16] = b'4';
    fs::write(&path, bytes).unwrap();
    let promised = "metadata `run_end` says messages of /events/mark: 4, the file has 3";
    assert_eq!(skim(MARKS), (3, Err(promised.to_owned())));
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

/// As left by a run that is stopped after its last byte and before the rename.
#[test]
fn a_whole_log_without_its_name_replaces_another_only_if_it_may() {
    let folder = tempfile::tempdir().unwrap();
    let path = log(folder.path(), STEPS, RunStatus::Complete);
    let bytes = fs::read(&path).unwrap();
    fs::rename(&path, partial_path(&path)).unwrap();
    fs::write(&path, "mine").unwrap();
    let unfinished = || Unfinished::of(&path).unwrap().unwrap();
    let refused = unfinished().publish(Existing::Refuse).unwrap_err();
    assert!(matches!(&refused, WriteError::File(FileError::Exists(there)) if *there == path), "{refused}");
    assert_eq!(fs::read(&path).unwrap(), b"mine");
    assert_eq!(fs::read(partial_path(&path)).unwrap(), bytes);
    unfinished().publish(Existing::Replace).unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes);
    assert!(!partial_path(&path).exists());
    // Without a file there is nothing to refuse.
    fs::rename(&path, partial_path(&path)).unwrap();
    unfinished().publish(Existing::Refuse).unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes);
}

/// After a log in progress is removed, another may have its name; the first writer must not mistake it for
/// its own.
#[test]
fn a_log_whose_name_another_has_got_is_not_published() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let begin = || RunWriter::create(&path, Existing::Refuse, &header(), "", &[], Content::Text).unwrap();
    let first = begin();
    fs::remove_file(partial_path(&path)).unwrap();
    let mut second = begin();
    let lost = first.finish(RunStatus::Complete, SolverReport::default()).unwrap_err();
    assert!(lost.to_string().ends_with("was removed or replaced while it was being written"), "{lost}");
    assert!(!path.exists() && partial_path(&path).exists());
    (1..=STEPS).for_each(|n| second.record(&step(n)).unwrap());
    let end = second.finish(RunStatus::Complete, SolverReport::default()).unwrap();
    assert_eq!(RunReader::open(&path, Topics::ALL).unwrap().verify().unwrap(), end);
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
        let mut writer = RunWriter::create(
            &path,
            Existing::Replace,
            &header(),
            "",
            &[EventKind::of::<Mark>()],
            Content::Text,
        )
        .unwrap();
        (1..=STEPS).for_each(|n| writer.record(&step(n)).unwrap());
        let event = Event::of_json(Mark::TOPIC, payload);
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

/// A log of several chunks, with a mark at every thousandth step.
struct Marked {
    folder: TempDir,
    bytes: Vec<u8>,
    /// The ranges of its chunks.
    chunks: Vec<Range<usize>>,
}

impl Marked {
    const STEPS: u64 = 20_000;
    const MARKS: u64 = 20;

    fn make() -> Marked {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("whole.mcap");
        let header = RunHeader { steps: Marked::STEPS, ..header() };
        let kinds = [EventKind::of::<Mark>()];
        let mut writer =
            RunWriter::create(&path, Existing::Refuse, &header, "", &kinds, Content::Text).unwrap();
        for n in 1..=Marked::STEPS {
            writer.record(&step(n)).unwrap();
            if n % 1000 == 0 {
                writer.event(&Event::new(Mark { before: n / 1000 - 1 })).unwrap();
            }
        }
        writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
        let bytes = fs::read(path).unwrap();
        let mut chunks = Vec::new();
        let mut at = 8;
        while at + 9 < bytes.len() {
            let next = at + 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
            if bytes[at] == mcap::records::op::CHUNK {
                chunks.push(at..next);
            }
            at = next;
        }
        assert!(chunks.len() >= 3);
        Marked { folder, bytes, chunks }
    }

    /// Salvages these bytes with a program that has no detector of marks.
    fn salvage(&self, bytes: &[u8]) -> Result<(Salvaged, RunReader), SalvageError> {
        let (damaged, out) = (self.folder.path().join("damaged.mcap"), self.folder.path().join("out.mcap"));
        fs::write(&damaged, bytes).unwrap();
        let settle = |logged: Option<RunHeader>, _: Option<&str>| Ok((logged.unwrap(), Vec::new()));
        let salvaged = salvage(&damaged, &out, &[EventKind::of::<GlobalSlip>()], &settle)?;
        Ok((salvaged, RunReader::open(&out, Topics::ALL).unwrap()))
    }
}

/// All items of a salvaged log.
fn items(mut reader: RunReader) -> Vec<LogItem> {
    let mut items = Vec::new();
    loop {
        match reader.next_item() {
            Ok(item) => items.extend(item),
            Err(LogError { problem: LogProblem::Salvaged, .. }) => return items,
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn events_of_detectors_that_are_not_known_are_salvaged_with_their_schema() {
    let log = Marked::make();
    let mut bytes = log.bytes.clone();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    let (salvaged, mut reader) = log.salvage(&bytes).unwrap();
    assert_eq!(salvaged.kept[Mark::TOPIC], Marked::MARKS);
    assert!(salvaged.lost.is_empty() && salvaged.gaps.is_empty() && salvaged.end_is_known, "{salvaged:?}");
    let first = reader.next_item().unwrap();
    let schema = EventKind::of::<Mark>().schema().to_string();
    assert_eq!(reader.event_schemas()[Mark::TOPIC], schema);
    let items: Vec<LogItem> = first.into_iter().chain(items(reader)).collect();
    assert_eq!(items.len() as u64, Marked::STEPS + Marked::MARKS);
    assert_eq!(items[1000], LogItem::Event(Event::new(Mark { before: 0 })));

    // One missing chunk makes one gap, which contains the marks of that chunk.
    let mut bytes = log.bytes.clone();
    bytes[log.chunks[1].end - 1] ^= 1;
    fs::remove_file(log.folder.path().join("out.mcap")).unwrap();
    let (salvaged, _) = log.salvage(&bytes).unwrap();
    assert_eq!(salvaged.kept[Mark::TOPIC] + salvaged.lost[Mark::TOPIC], Marked::MARKS);
    assert!(salvaged.kept[Mark::TOPIC] > 0 && salvaged.gaps.len() == 1, "{salvaged:?}");
}

/// The first chunk announces the topics, and the summary at the end does so again.
#[test]
fn without_the_first_chunk_the_summary_or_the_order_of_this_program_tells_the_topics() {
    let log = Marked::make();
    let mut bytes = log.bytes.clone();
    bytes[log.chunks[0].end - 1] ^= 1;
    let (salvaged, reader) = log.salvage(&bytes).unwrap();
    let [Gap { after_step: None, before_step: Some(before_step) }] = salvaged.gaps[..] else {
        panic!("{:?}", salvaged.gaps)
    };
    assert_eq!(salvaged.kept["/step"], Marked::STEPS - before_step + 1);
    assert_eq!(salvaged.lost["/step"], before_step - 1);
    assert!(before_step < 1 + Marked::STEPS / 2, "the first of {} chunks", log.chunks.len());
    assert_eq!(salvaged.kept[Mark::TOPIC] + salvaged.lost[Mark::TOPIC], Marked::MARKS);
    assert_eq!(salvaged.damage.len(), 1, "{:?}", salvaged.damage);
    let found = items(reader);
    assert_eq!(found.len() as u64, salvaged.kept["/step"] + salvaged.kept[Mark::TOPIC]);

    // Without the end the fifth topic is that of the first detector, which does not write such events.
    let end = bytes.windows(11).position(|there| there == b"\x07\0\0\0run_end").unwrap();
    fs::remove_file(log.folder.path().join("out.mcap")).unwrap();
    let refused = log.salvage(&bytes[..end - 9]).err().unwrap().to_string();
    assert_eq!(refused, "no message is left that a checksum confirms");
}

/// Otherwise the next run would fail to resume from it.
#[test]
fn what_holds_no_step_does_not_stand_in_the_way() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run.mcap");
    let mut empty = writer(&path, &[]);
    empty.discard_if_empty();
    drop(empty);
    assert!(Unfinished::of(&path).unwrap().is_none());
    let mut begun = writer(&path, &[]);
    begun.record(&step(1)).unwrap();
    begun.discard_if_empty();
    drop(begun);
    assert!(Unfinished::of(&path).unwrap().is_some());
}
