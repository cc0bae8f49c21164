//! Misplaced chunks and halves: of another run, moved, doubled, dropped, and logs cut at every border of
//! records. Raw, as after a fault of the file system, and with a corrected checksum of the data. None counts as
//! complete. Of this run alone, salvage keeps all that is there, once and in order; of chunks out of order, a part.

use std::fs;
use std::ops::Range;

use mcap::records::op;

use crate::case::{Case, try_all};
use crate::file::{self, Message};
use crate::forge::closed;
use crate::ground::{DENSE, Error, Genuine, Ground, OTHER};
use crate::random::Random;
use crate::verdict::Verdict;

/// A log and its chunks, each with its indexes.
struct Run {
    log: Genuine,
    blocks: Vec<Range<usize>>,
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let ours = Run::new(ground.genuine("dense", &DENSE)?);
    let other = Run::new(ground.genuine("dense-tilted", &[&DENSE[..], &OTHER].concat())?);
    if ours.log.chunks.len() < 4 || other.log.chunks.len() < 4 {
        return Err("the logs to be mixed have too few chunks".into());
    }
    let cases = ground.size.mixes;
    try_all(ground, "mixes", "chunks", cases, |case| mixed(case, &ours, &other))?;
    let records = file::records(&ours.log.bytes);
    let borders = ground.some_of(records.len(), 40);
    let borders: Vec<usize> = borders.into_iter().map(|number| records[number].at.start).collect();
    try_all(ground, "mixes", "cuts", borders.len(), |case| cut(case, &ours, borders[case.number]))
}

impl Run {
    fn new(log: Genuine) -> Run {
        let records = file::records(&log.bytes);
        let mut blocks: Vec<Range<usize>> = Vec::new();
        for record in records {
            match record.opcode {
                op::CHUNK => blocks.push(record.at.clone()),
                op::MESSAGE_INDEX => blocks.last_mut().expect("it follows a chunk").end = record.at.end,
                _ => {}
            }
        }
        Run { log, blocks }
    }

    fn block(&self, number: usize) -> &[u8] {
        &self.log.bytes[self.blocks[number].clone()]
    }
}

/// A file composed of pieces of logs, and the part of our run that must be kept.
struct Mix {
    what: String,
    bytes: Vec<u8>,
    left: Left,
}

/// What salvage must keep of our run.
enum Left {
    /// Another run is in it, and nothing tells the chunks of two runs apart.
    OfTwo,
    /// A part, in order.
    Part,
    /// All but these chunks.
    AllBut(Vec<usize>),
}

fn mix(random: &mut Random, ours: &Run, other: &Run) -> (&'static str, Mix) {
    let (a, b) = (&ours.log.bytes, &other.log.bytes);
    let count = ours.blocks.len();
    let i = random.below(count as u64) as usize;
    let j = random.below(other.blocks.len() as u64) as usize;
    let block = ours.blocks[i].clone();
    match random.below(6) {
        0 => {
            let bytes = [&a[..block.start], other.block(j), &a[block.end..]].concat();
            let what = format!("chunk {i} is chunk {j} of another run");
            ("a chunk of another run", Mix { what, bytes, left: Left::OfTwo })
        }
        1 => {
            // The chunk alone: the indexes of the replaced one stay.
            let foreign = &other.log.chunks[j].at;
            let own = &ours.log.chunks[i].at;
            let bytes = [&a[..own.start], &b[foreign.clone()], &a[own.end..]].concat();
            let what = format!("chunk {i} is chunk {j} of another run, without its indexes");
            ("a chunk of another run without what belongs to it", Mix { what, bytes, left: Left::OfTwo })
        }
        2 => {
            let bytes = [&a[..block.start], &b[other.blocks[j].start..]].concat();
            let what = format!("from chunk {i} on it is another run from chunk {j} on");
            ("halves of two runs", Mix { what, bytes, left: Left::OfTwo })
        }
        3 => {
            // To another place, over at least one chunk.
            let to = (0..=count)
                .filter(|to| *to != i && *to != i + 1)
                .nth(random.below(count as u64 - 1) as usize);
            let to = to.unwrap_or(0);
            let mut order: Vec<usize> = (0..count).filter(|number| *number != i).collect();
            order.insert(if to > i { to - 1 } else { to }, i);
            let middle: Vec<u8> = order.iter().flat_map(|number| ours.block(*number).to_vec()).collect();
            // Records between chunks, such as checkpoints, stay before the last chunks.
            let between: Vec<u8> =
                ours.blocks.windows(2).flat_map(|w| a[w[0].end..w[1].start].to_vec()).collect();
            let last = ours.blocks.last().map_or(0, |block| block.end);
            let bytes = [&a[..ours.blocks[0].start], &between, &middle, &a[last..]].concat();
            let what = format!("chunk {i} moved before what was chunk {to}");
            ("a chunk moved", Mix { what, bytes, left: Left::Part })
        }
        4 => {
            let to = random.below(count as u64) as usize;
            let place = ours.blocks[to].end;
            let bytes = [&a[..place], ours.block(i), &a[place..]].concat();
            let what = format!("chunk {i} stands again behind chunk {to}");
            // Where it stands first, salvage takes it: those between are lost.
            let left = if to < i { Left::Part } else { Left::AllBut(Vec::new()) };
            ("a chunk doubled", Mix { what, bytes, left })
        }
        _ => {
            let bytes = [&a[..block.start], &a[block.end..]].concat();
            let what = format!("chunk {i} is gone");
            ("a chunk dropped", Mix { what, bytes, left: Left::AllBut(vec![i]) })
        }
    }
}

fn mixed(case: &mut Case<'_>, ours: &Run, other: &Run) -> Result<(), Error> {
    let (kind, Mix { what, mut bytes, left }) = mix(&mut case.random, ours, other);
    let sealed = case.random.below(2) == 0;
    if sealed {
        let data = file::records(&bytes).into_iter().find(|record| record.opcode == op::DATA_END);
        bytes.truncate(data.map_or(bytes.len(), |end| end.at.start));
        bytes = closed(bytes);
    }
    let how = if sealed { "checksum made right" } else { "raw" };
    let kind = format!("{kind} ({how})");
    case.write("mixed.mcap", &bytes)?;
    let judged = case.check("mixed.mcap")?;
    case.hold(!judged.is_whole(), &format!("check calls whole a log with {kind}"), || {
        format!("{what}: {}", judged.said())
    });
    if matches!(left, Left::OfTwo) {
        return Ok(());
    }
    let Some(kept) = salvaged(case, &kind, &what, "mixed.mcap")? else {
        case.broke(format!("salvage keeps nothing of a log with {kind}"), what);
        return Ok(());
    };
    of_this_run(case, &kind, &what, &kept, ours);
    let Left::AllBut(lost) = left else { return Ok(()) };
    let found: Vec<&Message> = kept.iter().collect();
    if let Some(difference) = file::difference(&ours.log.without(&lost), &found) {
        case.broke(
            format!("salvage keeps other messages than those that are sound of a log with {kind}"),
            format!("{what}: {difference}"),
        );
    }
    Ok(())
}

/// The messages that salvage keeps.
fn salvaged(case: &mut Case<'_>, kind: &str, what: &str, file: &str) -> Result<Option<Vec<Message>>, Error> {
    let salvage = case.call(&["salvage", file, "--out", "salvaged.mcap"])?;
    let made = case.path("salvaged.mcap").exists();
    case.hold(
        made == (salvage.code == Some(0)),
        "salvage exits with 0 and makes nothing, or the other way",
        || format!("{what}: {}: {}", salvage.ending(), salvage.said()),
    );
    if !made {
        return Ok(None);
    }
    let bytes = fs::read(case.path("salvaged.mcap"))?;
    let messages = match file::messages(&bytes) {
        Ok(messages) => messages.into_iter().map(|(_, message)| message).collect(),
        Err(problem) => {
            case.broke("what salvage makes cannot be read", format!("{what}: {problem}"));
            return Ok(None);
        }
    };
    let judged = case.check("salvaged.mcap")?;
    case.hold(
        judged.verdict == Some(Verdict::Gaps),
        &format!("check of what salvage makes of a log with {kind} does not say \"salvaged with gaps\""),
        || format!("{what}: {}", judged.said()),
    );
    Ok(Some(messages))
}

/// Every message must be one of this run, in its order.
fn of_this_run(case: &mut Case<'_>, kind: &str, what: &str, kept: &[Message], run: &Run) {
    let mut genuine = run.log.messages.iter();
    let stray = kept.iter().find(|message| !genuine.any(|(_, known)| known == *message));
    if let Some(stray) = stray {
        let known = run.log.messages.iter().any(|(_, known)| known == stray);
        let word = if known { "out of order or twice" } else { "of another run" };
        case.broke(
            format!("salvage keeps a message {word} of a log with {kind}"),
            format!("{what}: {stray}"),
        );
    }
}

fn cut(case: &mut Case<'_>, ours: &Run, border: usize) -> Result<(), Error> {
    let what = format!("{} cut at byte {border} of {}", ours.log.name, ours.log.bytes.len());
    case.write("cut.mcap", &ours.log.bytes[..border])?;
    let judged = case.check("cut.mcap")?;
    case.hold(!judged.is_whole(), "check calls whole a log that is cut off", || {
        format!("{what}: {}", judged.said())
    });
    let there = ours.log.chunks.iter().filter(|chunk| chunk.at.end <= border).count();
    let Some(kept) = salvaged(case, "its end cut off", &what, "cut.mcap")? else {
        case.hold(there == 0, "salvage keeps nothing of a log with its end cut off", || what.clone());
        return Ok(());
    };
    let found: Vec<&Message> = kept.iter().collect();
    let lost: Vec<usize> = (there..ours.blocks.len()).collect();
    if let Some(difference) = file::difference(&ours.log.without(&lost), &found) {
        case.broke(
            "salvage keeps other messages than those of all chunks before the cut",
            format!("{what}, {there} chunks complete: {difference}"),
        );
    }
    Ok(())
}
