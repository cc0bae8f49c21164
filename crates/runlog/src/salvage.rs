//! Salvages a damaged log.
//!
//! A record is kept if something independent confirms that it is what was written, and of this run:
//! chunks and attachments have checksums, the records `chunk` assign them to a run (`lineage`), the
//! caller compares the header with the scenario, since this crate does not interpret scenarios, and
//! every message must match its topic (`walk`). Where the sequence of records is broken, the file
//! is searched for the next valid piece (`pieces`).
//!
//! The result is a log with the status `salvaged` and a metadata record `salvage` that states the
//! gaps. Messages keep their numbers, so that every reader sees the gaps.
//!
//! Events of unknown detectors are kept under the topic and schema that the log announces. If the
//! announcement is lost they cannot be identified and are dropped, with a remark.
//!
//! The time is linear in the size of the file, whatever it contains.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

use asperity_record::{EventKind, RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, SolverReport};

use crate::findings::{Damage, Salvaged};
use crate::format::CHUNK_SINCE;
use crate::lineage::{Entry, Found, Kept, Outline, keep_old};
use crate::messages::Topic;
use crate::metadata;
use crate::pieces::{Content, Pieces};
use crate::problem::{LogProblem, WriteError};
use crate::versions;
use crate::walk::{ChunkProblem, Message, Walk};
use crate::write::RunWriter;

/// Why nothing was salvaged.
#[derive(Debug, thiserror::Error)]
pub enum SalvageError {
    /// The input cannot be read.
    #[error("{path}: {error}")]
    Read {
        /// The file.
        path: String,
        /// The reason.
        error: io::Error,
    },
    /// Neither header nor scenario is left, or their version is unknown.
    #[error("{path}: {problem}")]
    Hopeless {
        /// The file.
        path: String,
        /// The missing part.
        problem: String,
    },
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Callback that compares header and scenario, where either may be missing. Returns the header to use and
/// remarks about it, or the reason why there is none.
pub type Settle<'a> =
    dyn Fn(Option<RunHeader>, Option<&str>) -> Result<(RunHeader, Vec<String>), String> + 'a;

/// Writes what is left of the log `input` to a new log `output`; all of it for a whole log.
///
/// # Errors
/// If `input` cannot be read or nothing left in it identifies its run, or `output` exists or cannot
/// be written.
pub fn salvage(
    input: &Path,
    output: &Path,
    events: &[EventKind],
    settle: &Settle<'_>,
) -> Result<Salvaged, SalvageError> {
    let name = input.display().to_string();
    let read_error = |error| SalvageError::Read { path: name.clone(), error };
    let mut pieces = Pieces::open(input).map_err(read_error)?;
    let found = find(&mut pieces).map_err(read_error)?;
    let hopeless = |problem: String| SalvageError::Hopeless { path: name.clone(), problem };
    let Basis { header, scenario, end, mut kept } =
        basis(found, &mut pieces, events, settle).map_err(|problem| match problem {
            Unsettled::Read(error) => read_error(error),
            Unsettled::Hopeless(problem) => hopeless(problem),
        })?;

    let events: Vec<EventKind> = events.iter().map(|kind| kind.clone().with(header.parts())).collect();
    let events = &events[..];
    let gaps = gaps(&kept, &mut pieces, Walk::new(events, &header)).map_err(read_error)?;
    // The first walk finds the gaps, which are written first; the second walk writes.
    let mut walk = Walk::new(events, &header);
    let mut damage = std::mem::take(&mut pieces.damage);
    damage.append(&mut kept.damage);
    for entry in kept.entries.iter().filter(|entry| entry.is_chunk) {
        let Some(mut chunk) = pieces.chunk(entry.at).map_err(read_error)? else { continue };
        if gaps.contains(&entry.at) {
            walk.begin_gap();
        }
        match walk.chunk(entry.at, &mut chunk, &mut |_| Ok(())) {
            Ok(()) => {}
            Err(ChunkProblem::Content(what)) => {
                damage.push(Damage { from_byte: entry.at, to_byte: entry.end, what });
            }
            Err(ChunkProblem::Write(error)) => return Err(error.into()),
        }
    }
    let (mut salvaged, foreign) = walk.finish(end.as_ref());
    damage.sort_by_key(|damage| damage.from_byte);
    salvaged.damage = damage;
    salvaged.remarks.splice(0..0, kept.remarks);

    let topics = events.iter().map(Topic::of).chain(foreign.into_values());
    let mut writer = RunWriter::create_salvaged(output, input, &header, &scenario, topics)?;
    let report = end.map_or(SolverReport::default(), |end| end.solver);
    let written = writer
        .salvaged(&salvaged)
        .map_err(SalvageError::from)
        .and_then(|()| {
            write(&kept.entries, &gaps, &mut pieces, Walk::new(events, &header), &mut writer, &name)
        })
        .and_then(|()| Ok(writer.finish(RunStatus::Salvaged, report)?));
    // Leaves nothing behind on failure: it can be repeated from the input.
    written.map(|_end| salvaged)
}

/// Finds everything with a right checksum in a file, and its records `chunk`.
fn find(pieces: &mut Pieces) -> io::Result<Found> {
    let mut found = Found { seals: pieces.seals()?, ..Found::default() };
    if !found.seals.is_empty() {
        let before = found.seals.iter().filter(|(_, seal)| seal.number > 0).map(|(_, seal)| seal.before_crc);
        let named = found.seals.iter().map(|(_, seal)| seal.crc).chain(before).collect();
        pieces.search_only(named);
    }
    while let Some(piece) = pieces.next()? {
        let mut entry =
            |is_chunk| found.entries.push(Entry { at: piece.at, end: piece.end, crc: piece.crc, is_chunk });
        match piece.content {
            Content::Run(map) => match versions::check(&map) {
                Err(LogProblem::Version(version)) => found.newer = found.newer.or(Some(version)),
                _ => found.headers.extend(metadata::header_from_map(&map).ok()),
            },
            Content::Scenario(text) => {
                // A log has one; a few more are examined in case others were added.
                if found.scenarios.len() < MOST_SCENARIOS {
                    found.scenarios.push((piece.crc, text));
                }
            }
            Content::End(end) => found.ends.push((piece.crc, *end)),
            Content::Chunk(_) => entry(true),
            Content::Checkpoint(_) => entry(false),
            Content::Seal => {}
        }
    }
    Ok(found)
}

/// Most scenarios examined to find that of the run.
const MOST_SCENARIOS: usize = 4;

/// The basis of the new log.
struct Basis {
    header: RunHeader,
    scenario: String,
    end: Option<RunEnd>,
    kept: Kept,
}

enum Unsettled {
    Read(io::Error),
    Hopeless(String),
}

/// Determines the run, and what belongs to it.
fn basis(
    mut found: Found,
    pieces: &mut Pieces,
    events: &[EventKind],
    settle: &Settle<'_>,
) -> Result<Basis, Unsettled> {
    use Unsettled::{Hopeless, Read};
    if let Some(version) = found.newer.filter(|_| found.headers.is_empty()) {
        return Err(Hopeless(LogProblem::Version(version).to_string()));
    }
    let run = found.run();
    let (header, scenario) = match &run {
        Some(run) => {
            let header = found.headers.iter().find(|header| header.run_id == run.id);
            (header.or(found.headers.first()).cloned(), found.scenario_of(run).map(str::to_owned))
        }
        None => (found.headers.first().cloned(), found.scenarios.first().map(|(_, text)| text.clone())),
    };
    let logged_version = header.as_ref().map(|header| header.record_schema_version);
    let (mut header, mut remarks) = settle(header, scenario.as_deref()).map_err(Hopeless)?;
    let blocks_of_seals = logged_version.unwrap_or(header.record_schema_version) >= CHUNK_SINCE;
    let (mut kept, end) = match &run {
        Some(run) => (found.keep(run), found.end_of(run).cloned()),
        None if blocks_of_seals && !found.seals.is_empty() => {
            let what = "its records `chunk` are of another run than metadata `run` and the scenario";
            return Err(Hopeless(what.to_owned()));
        }
        None if blocks_of_seals => (found.keep_none(), None),
        None => {
            let end = found.ends.pop().map(|(_, end)| end);
            (keep_without_seals(&found, pieces, events, &header).map_err(Read)?, end)
        }
    };
    // The new log is of the present version, whatever the damaged one was.
    header.record_schema_version = RECORD_SCHEMA_VERSION;
    if scenario.is_none() {
        remarks.push("the scenario is lost".to_owned());
    }
    kept.remarks.splice(0..0, remarks);
    Ok(Basis { header, scenario: scenario.unwrap_or_default(), end, kept })
}

/// Selects the chunks of a log of a version without records `chunk`. Nothing identifies the run of
/// its checkpoints, and no program resumes from them.
fn keep_without_seals(
    found: &Found,
    pieces: &mut Pieces,
    events: &[EventKind],
    header: &RunHeader,
) -> io::Result<Kept> {
    let mut walk = Walk::new(events, header);
    let mut messages = |entry: &Entry| -> io::Result<Result<Vec<Message>, String>> {
        let chunk = pieces.chunk(entry.at)?;
        Ok(chunk.map_or(Ok(Vec::new()), |mut chunk| walk.messages(entry.at, &mut chunk)))
    };
    let mut outlines = Vec::new();
    let mut damage = Vec::new();
    let named: BTreeSet<u32> = found.seals.iter().map(|(_, seal)| seal.crc).collect();
    for entry in found.entries.iter().filter(|entry| entry.is_chunk) {
        let read = match named.contains(&entry.crc) {
            true => Err("a chunk of a run of a later version".to_owned()),
            false => messages(entry)?,
        };
        match read {
            Ok(messages) => outlines.push(Outline::new(*entry, &messages)),
            Err(what) => damage.push(Damage { from_byte: entry.at, to_byte: entry.end, what }),
        }
    }
    let mut kept = keep_old(outlines, |entry| Ok::<_, io::Error>(messages(entry)?.unwrap_or_default()))?;
    kept.damage.append(&mut damage);
    Ok(kept)
}

/// The offsets of chunks before which messages are missing. The number of a piece reveals that it
/// is missing; that it contained messages is revealed by the numbers of a topic, possibly only some
/// chunks later.
fn gaps(kept: &Kept, pieces: &mut Pieces, mut walk: Walk<'_>) -> io::Result<BTreeSet<u64>> {
    let mut gaps = BTreeSet::new();
    if kept.after_missing.is_empty() {
        return Ok(gaps);
    }
    // The chunks after a missing piece, by index.
    let mut doubtful: Vec<(usize, u64)> = Vec::new();
    // The next number of each topic, and the index of the chunk after its last message.
    let mut next: BTreeMap<String, (u32, usize)> = BTreeMap::new();
    let (mut place, mut is_missing) = (0, false);
    for entry in &kept.entries {
        is_missing |= kept.after_missing.contains(&entry.at);
        if !entry.is_chunk {
            continue;
        }
        if std::mem::take(&mut is_missing) {
            doubtful.push((place, entry.at));
        }
        if let Some(mut chunk) = pieces.chunk(entry.at)? {
            // The first walk reports what cannot be read.
            for message in walk.messages(entry.at, &mut chunk).unwrap_or_default() {
                let (expected, since) = next.get(&message.topic).copied().unwrap_or_default();
                if message.sequence > expected {
                    let from = doubtful.partition_point(|(place, _)| *place < since);
                    gaps.extend(doubtful[from..].iter().map(|(_, at)| *at));
                }
                next.insert(message.topic, (message.sequence.saturating_add(1), place + 1));
            }
        }
        place += 1;
    }
    Ok(gaps)
}

/// Writes what the first walk accepted.
fn write(
    entries: &[Entry],
    gaps: &BTreeSet<u64>,
    pieces: &mut Pieces,
    mut walk: Walk<'_>,
    writer: &mut RunWriter,
    name: &str,
) -> Result<(), SalvageError> {
    let read_error = |error| SalvageError::Read { path: name.to_owned(), error };
    for entry in entries {
        match pieces.again(entry.at).map_err(read_error)? {
            Some(Content::Chunk(mut chunk)) => {
                if gaps.contains(&entry.at) {
                    walk.begin_gap();
                }
                let written = walk.chunk(entry.at, &mut chunk, &mut |message| {
                    writer.salvaged_message(
                        &message.topic,
                        message.sequence,
                        message.time_ns,
                        message.step(),
                        &message.payload,
                    )
                });
                // The first walk refused and reported it as well.
                if let Err(ChunkProblem::Write(error)) = written {
                    return Err(error.into());
                }
            }
            Some(Content::Checkpoint(state)) => writer.salvaged_checkpoint(&state)?,
            _ => {}
        }
    }
    Ok(())
}
