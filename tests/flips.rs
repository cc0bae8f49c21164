//! A single flipped bit is detected anywhere in a complete log. In an unfinished one it is detected, or what
//! follows it is missing, or nothing that is read has changed.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::laws::file;
use crate::support::binary::{self, outcome, text, with_sets};
use crate::support::small;
use asperity_runlog::{LogItem, LogProblem, RunReader, Topics};
use asperity_testkit::{Random, read_until_problem};
use mcap::records::op;

/// How many bits are flipped in a log, each in a copy of its own. `cargo xtask attack flips` flips more.
const FLIPS: u64 = 500;

/// Of so many flips, one record at a log's beginning has every bit of its length flipped.
const PER_LENGTH: u64 = 60;

/// How many of the copies are given to the built command.
const CHECKED: u64 = 40;

/// The contents of a log: its items, and how they end.
fn read(path: &Path) -> Outcome {
    let (items, error) = read_until_problem(path);
    (items, error.map(|error| error.problem))
}

/// A copy of a log of which one byte at a time is another.
struct Altered(PathBuf);

impl Altered {
    fn of(bytes: &[u8], path: PathBuf) -> Altered {
        fs::write(&path, bytes).expect("the folder can be written");
        Altered(path)
    }

    fn put(&self, place: usize, byte: u8) {
        let mut file = OpenOptions::new().write(true).open(&self.0).expect("it was just written");
        file.seek(SeekFrom::Start(place as u64)).expect("it is a file");
        file.write_all(&[byte]).expect("the folder can be written");
    }

    /// Does something with the log while a bit is flipped.
    fn flipped<T>(&self, bytes: &[u8], place: usize, bit: usize, ask: impl FnOnce(&Path) -> T) -> T {
        self.put(place, bytes[place] ^ 1 << bit);
        let answer = ask(&self.0);
        self.put(place, bytes[place]);
        answer
    }
}

/// The kind of top-level record that each byte of a file is in; that of the magics is 0.
fn kinds(bytes: &[u8]) -> Vec<u8> {
    let mut kinds = vec![0; bytes.len()];
    file::records(bytes).into_iter().for_each(|record| kinds[record.at].fill(record.opcode));
    kinds
}

/// A small log of several chunks and checkpoints.
fn sound() -> Vec<u8> {
    static SOUND: OnceLock<Vec<u8>> = OnceLock::new();
    // The plain solver is slow enough for some checkpoints in its second or less.
    let often = ["--solver", "plain", "--checkpoint-s", "0.01", "--set", "time.duration_s=0.61"];
    SOUND.get_or_init(|| sound_of(&[&small::SCENARIO[..5], &often].concat())).clone()
}

/// The bytes of a whole log of a scenario.
fn sound_of(scenario: &[&str]) -> Vec<u8> {
    let folder = asperity_testkit::folder();
    let path = folder.path().join("sound.mcap");
    binary::run(scenario, &path);
    let bytes = fs::read(&path).expect("the log can be read");
    // Events of all kinds but slips of the whole slider.
    let (items, _) = read(&path);
    for topic in ["/events/onset", "/events/slip", "/events/rupture", "/events/arrival"] {
        assert!(
            items.iter().any(|item| matches!(item, LogItem::Event(event) if event.topic() == topic)),
            "no {topic}"
        );
    }
    let kinds = kinds(&bytes);
    for kind in [op::CHUNK, op::ATTACHMENT] {
        assert!(kinds.chunk_by(|a, b| a == b).filter(|record| record[0] == kind).count() > 2);
    }
    bytes
}

/// The contents of a log: its items, and how they end.
type Outcome = (Vec<LogItem>, Option<LogProblem>);

/// Flips bits all over a log, in records of all kinds. `wrong` returns the error in an outcome, if any.
fn flip(what: &str, bytes: &[u8], flips: u64, mut wrong: impl FnMut(&Path, Outcome) -> Option<String>) {
    let folder = asperity_testkit::folder();
    let kinds = kinds(bytes);
    // By size nearly all of a log are chunks; half of the flips go into the others.
    let outside: Vec<usize> = (0..bytes.len()).filter(|&place| kinds[place] != op::CHUNK).collect();
    assert!(outside.len() > 1000 && outside.len() < bytes.len());
    let mut random = Random::new(2026);
    let mut flipped: BTreeMap<u8, usize> = BTreeMap::new();
    let mut unseen = Vec::new();
    let mut arguments = vec!["check".to_owned()];
    let copy = Altered::of(bytes, folder.path().join("copy.mcap"));
    for number in 0..flips {
        let place = match number % 2 {
            0 => random.below(bytes.len() as u64) as usize,
            _ => outside[random.below(outside.len() as u64) as usize],
        };
        let bit = random.below(8) as usize;
        *flipped.entry(kinds[place]).or_insert(0) += 1;
        let said = copy.flipped(bytes, place, bit, |path| {
            if number < CHECKED {
                let kept = folder.path().join(format!("flipped-{number}.mcap"));
                fs::copy(path, &kept).expect("the folder can be written");
                arguments.push(text(&kept).to_owned());
            }
            wrong(path, read(path))
        });
        if let Some(wrong) = said {
            unseen.push(format!("bit {bit} of byte {place}, kind 0x{:02x}: {wrong}", kinds[place]));
        }
    }
    // Whatever a record says of its kind and its length, even that it reaches beyond the end of the file.
    let first_records = kinds.iter().enumerate().skip(8).filter(|&(at, &kind)| kinds[at - 1] != kind);
    for at in first_records.map(|(at, _)| at).take((flips / PER_LENGTH) as usize) {
        for bit in 0..72 {
            let said = copy.flipped(bytes, at + bit / 8, bit % 8, |path| wrong(path, read(path)));
            if let Some(wrong) = said {
                unseen.push(format!("bit {bit} of kind and length at byte {at}: {wrong}"));
            }
        }
    }
    writeln!(std::io::stdout(), "{what}: {flips} bits of {}, by kind of record: {flipped:x?}", bytes.len())
        .expect("it is open");
    assert!(unseen.is_empty(), "{what}: {} unseen:\n{}", unseen.len(), unseen.join("\n"));
    // The command detects what the library detects.
    let (_, said, _) = outcome(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(said.lines().count() as u64, CHECKED, "{said}");
    assert!(said.lines().all(|line| !line.contains(": whole: ")), "{said}");
}

#[test]
fn every_flipped_bit_of_a_whole_log_is_seen() {
    flip_whole("whole", &sound(), FLIPS);
}

fn flip_whole(what: &str, bytes: &[u8], flips: u64) {
    flip(what, bytes, flips, |_, (_, problem)| match problem {
        None => Some("called whole".to_owned()),
        Some(problem) => problem.is_early_end().then(|| format!("called incomplete: {problem}")),
    });
}

/// Checkpoints of a slab contain data that no record has, and states have an extra column. The attack flips bits of a
/// sheet's log.
#[test]
fn every_flipped_bit_of_a_slabs_log_is_seen() {
    let sets = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.25"];
    let slab = with_sets(&["slab", "--checkpoint-s", "0.005"], &sets);
    flip_whole("slab", &sound_of(&slab), FLIPS / 8);
}

/// This reader compares no header with a scenario, as is so for logs by other code.
#[test]
fn no_flipped_bit_of_the_header_of_an_unfinished_log_changes_it() {
    let folder = asperity_testkit::folder();
    let mut bytes = sound();
    let kinds = kinds(&bytes);
    let first =
        |from: usize, is: &dyn Fn(u8) -> bool| (from..).find(|&at| is(kinds[at])).expect("it has one");
    let header = first(0, &|kind| kind == op::METADATA);
    let behind = first(header, &|kind| kind != op::METADATA);
    let chunk = first(behind, &|kind| kind == op::CHUNK);
    bytes.truncate(first(chunk, &|kind| kind != op::CHUNK));
    let copy = Altered::of(&bytes, folder.path().join("begun.mcap"));
    let read = |path: &Path| RunReader::open(path, Topics::ALL).map(|reader| reader.header().clone());
    let genuine = read(&copy.0).expect("it has a header");
    for place in header..behind {
        let found = copy.flipped(&bytes, place, place % 8, read);
        assert!(found.map_or(true, |found| found == genuine), "bit {} of byte {place}", place % 8);
    }
}

/// A truncated log counts as one that is being written. Of a checkpoint, all that precedes it is read.
#[test]
fn no_flipped_bit_of_an_unfinished_log_changes_what_is_read() {
    let folder = asperity_testkit::folder();
    let bytes = sound();
    let kinds = kinds(&bytes);
    let last = |kind: u8| {
        (1..bytes.len()).rfind(|&at| kinds[at] == kind && kinds[at - 1] != kind).expect("it has one")
    };
    let (chunk, checkpoint) = (last(op::CHUNK), last(op::ATTACHMENT));
    let behind = (checkpoint..).find(|&at| kinds[at] != op::ATTACHMENT).expect("more follows");
    for (what, end) in [("cut in a chunk", chunk + 200), ("cut behind a checkpoint", behind)] {
        let cut = &bytes[..end];
        let path = folder.path().join("cut.mcap");
        fs::write(&path, cut).expect("the folder can be written");
        let (sound, problem) = read(&path);
        assert!(problem.as_ref().is_some_and(LogProblem::is_early_end), "{problem:?}");
        let sound_checkpoints = checkpoints(&path);
        assert!(sound_checkpoints.len() > 2);
        let mut costs = 0;
        flip(what, cut, FLIPS / 4, |path, (items, problem)| {
            let found = checkpoints(path);
            costs += usize::from(items.len() < sound.len());
            match problem {
                None => Some("called whole".to_owned()),
                _ if !sound.starts_with(&items) => Some("read otherwise".to_owned()),
                _ if !sound_checkpoints.starts_with(&found) => {
                    Some("another checkpoint, or before other records".to_owned())
                }
                _ => None,
            }
        });
        assert!(costs > FLIPS as usize / 16, "{costs} of {} cost records", FLIPS / 4);
    }
}

/// The checkpoints of a log, each with the number of items before it.
fn checkpoints(path: &Path) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let Ok(mut reader) = RunReader::open(path, Topics::ALL) else { return found };
    let mut items = 0;
    loop {
        let is_last = !matches!(reader.next_item(), Ok(Some(_)));
        if let Some(text) =
            reader.checkpoint().filter(|text| found.last().is_none_or(|(_, last)| last != text))
        {
            found.push((items, text.to_owned()));
        }
        if is_last {
            return found;
        }
        items += 1;
    }
}
