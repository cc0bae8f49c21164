//! Changes single bits and bytes in every kind of place of complete and unfinished logs: no such log counts
//! as complete, and the events of an unfinished one are those before, or the first of them.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::thread;
use std::time::Duration;

use crate::calls::Call;
use crate::case::{Case, try_all};
use crate::file;
use crate::ground::{AREA, DENSE, Error, Genuine, Ground, RUN, SMALL, STATE};
use crate::parts::Part;
use mcap::records::op;

/// A log and the places in it, by kind, so that small kinds are tried too.
struct Target {
    what: String,
    bytes: Vec<u8>,
    regions: Vec<(String, Vec<Range<usize>>)>,
    /// For an unfinished log: the events of it untouched.
    unfinished: Option<String>,
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let mut whole = Vec::new();
    for (name, run) in [("small", &SMALL[..]), ("dense", &DENSE)] {
        whole.push(Target::whole(&ground.genuine(name, run)?));
    }
    whole.push(Target::whole(&ground.genuine_of("area", &AREA)?));
    whole.push(Target::whole(&ground.genuine_of("state", &STATE)?));
    for path in ground.genuine_logs()? {
        whole.push(Target::whole(&Genuine::read(&path)?));
    }
    try_all(ground, "flips", "whole logs", ground.size.flips, |case| {
        let target = &whole[case.number % whole.len()];
        flip(case, target)
    })?;

    let mut unfinished = Vec::new();
    for (signal, bytes) in [("KILL", 700_000), ("INT", 1_200_000), ("KILL", 2_500_000), ("TERM", 1)] {
        unfinished.extend(stopped(ground, signal, bytes)?);
    }
    if unfinished.is_empty() {
        let reason = "no run could be stopped before its end".to_owned();
        ground.tally.lock().expect("no case panics with it").skip("flips", reason);
        return Ok(());
    }
    try_all(ground, "flips", "unfinished logs", ground.size.flips, |case| {
        let target = &unfinished[case.number % unfinished.len()];
        flip(case, target)
    })
}

fn flip(case: &mut Case<'_>, target: &Target) -> Result<(), Error> {
    let (region, ranges) = &target.regions[case.random.below(target.regions.len() as u64) as usize];
    let range = ranges[case.random.below(ranges.len() as u64) as usize].clone();
    let place = range.start + case.random.below(range.len() as u64) as usize;
    let mut bytes = target.bytes.clone();
    let old = bytes[place];
    bytes[place] = if case.random.below(3) == 0 {
        old.wrapping_add(1 + case.random.below(255) as u8)
    } else {
        old ^ 1 << case.random.below(8)
    };
    let new = bytes[place];
    let file = if target.unfinished.is_some() { "flipped.mcap.partial" } else { "flipped.mcap" };
    case.write(file, &bytes)?;
    let judged = case.check(file)?;
    let what = format!("{}: byte {place} from {old:#04x} to {new:#04x}", target.what);
    let told = format!("{what}: {}", judged.said());
    if judged.is_whole() {
        case.broke(format!("check calls whole what has a flip in {region}"), told);
    } else if let Some(before) = &target.unfinished {
        let events = case.call(&["events", file])?;
        case.hold(
            before.starts_with(&events.out),
            &format!("an unfinished log with a flip in {region} gives other events"),
            || told,
        );
    }
    Ok(())
}

impl Target {
    fn whole(log: &Genuine) -> Target {
        let what = format!("the log {}", log.name);
        Target { what, regions: regions(&log.bytes), bytes: log.bytes.clone(), unfinished: None }
    }
}

/// The kind of the record, in words; metadata and attachments by their names.
fn kind(part: &Part) -> String {
    let word = match part.opcode {
        op::HEADER => "header",
        op::FOOTER => "footer",
        op::SCHEMA => "schema",
        op::CHANNEL => "channel",
        op::MESSAGE => "message",
        op::CHUNK => "chunk",
        op::MESSAGE_INDEX => "message index",
        op::CHUNK_INDEX => "chunk index",
        op::ATTACHMENT => "attachment",
        op::ATTACHMENT_INDEX => "attachment index",
        op::STATISTICS => "statistics",
        op::METADATA => "metadata",
        op::METADATA_INDEX => "metadata index",
        op::SUMMARY_OFFSET => "summary offset",
        op::DATA_END => "data end",
        _ => "record of no kind",
    };
    match (part.opcode, part.name()) {
        (op::METADATA | op::ATTACHMENT, Some(name)) => format!("{word} {name}"),
        _ => word.to_owned(),
    }
}

/// The places of a file by the kind of record. Heads and what they head are two kinds.
fn regions(bytes: &[u8]) -> Vec<(String, Vec<Range<usize>>)> {
    let mut found: BTreeMap<String, Vec<Range<usize>>> = BTreeMap::new();
    let mut add = |kind: String, range: Range<usize>| {
        if !range.is_empty() {
            found.entry(kind).or_default().push(range);
        }
    };
    let magic = mcap::MAGIC.len();
    add("the first magic".to_owned(), 0..magic.min(bytes.len()));
    let records = file::records(bytes);
    let mut in_summary = false;
    for record in &records {
        let kind = kind(&record.part(bytes));
        let place = if in_summary { " of the summary" } else { "" };
        let body = record.at.start + file::HEAD;
        add(format!("the head of a {kind}{place}"), record.at.start..body);
        match file::chunk(record.body(bytes)).filter(|_| record.opcode == op::CHUNK) {
            Some(chunk) => {
                let records = record.at.end - chunk.records.len();
                add("the fields of a chunk".to_owned(), body..records);
                add("the data of a chunk".to_owned(), records..record.at.end);
            }
            None => add(format!("a {kind}{place}"), body..record.at.end),
        }
        in_summary |= record.opcode == op::DATA_END;
    }
    let end = records.last().map_or(magic, |record| record.at.end);
    let what = if in_summary { "the last magic" } else { "what was being written" };
    add(what.to_owned(), end..bytes.len());
    found.into_iter().collect()
}

/// An unfinished log to be flipped.
fn stopped(ground: &Ground, signal: &str, from_bytes: u64) -> Result<Option<Target>, Error> {
    let Some(bytes) = stopped_log(ground, signal, from_bytes)? else { return Ok(None) };
    // Under the name of the flipped ones, since messages begin with it.
    fs::write(ground.work.join("flipped.mcap.partial"), &bytes)?;
    let events = Call::new(&ground.program, &ground.work, &["events", "flipped.mcap.partial"])?.run()?;
    let what = format!("a log stopped by SIG{signal} at {} bytes", bytes.len());
    let unfinished = Some(events.out);
    Ok(Some(Target { what, regions: regions(&bytes), bytes, unfinished }))
}

/// The log that a run of the default scenario leaves when it is stopped once its log has this many
/// bytes; None if it finished before.
fn stopped_log(ground: &Ground, signal: &str, from_bytes: u64) -> Result<Option<Vec<u8>>, Error> {
    let folder = ground.logs.join(format!("stopped-{signal}-{from_bytes}"));
    let log = folder.join("run.mcap.partial");
    // A few attempts: on a busy machine the run may be done before the signal comes.
    for _ in 0..5 {
        crate::ground::emptied(&folder)?;
        let run = [&RUN[..], &["--checkpoint-s", "0.02"]].concat();
        let mut run = Call::new(&ground.program, &folder, &run)?.start()?;
        while !run.has_ended()? && fs::metadata(&log).map_or(0, |file| file.len()) < from_bytes {
            thread::sleep(Duration::from_millis(1));
        }
        run.signal(signal)?;
        run.wait()?;
        if log.exists() {
            return Ok(Some(fs::read(&log)?));
        }
    }
    Ok(None)
}
