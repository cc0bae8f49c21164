//! Salvages a damaged log.
//!
//! A record is kept if something independent confirms that it is what was written: chunks and attachments
//! have checksums, the caller compares the header with the scenario, since this crate does not interpret
//! scenarios, and every message must match its topic and follow those before it (`walk`). Where the sequence
//! of records is broken, the file is searched for the next valid piece (`pieces`).
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

use asperity_record::{EventKind, RunEnd, RunHeader, RunStatus, SolverReport};

use crate::digest::Digests;
use crate::findings::{Damage, Salvaged};
use crate::messages::Topic;
use crate::metadata;
use crate::pieces::{Content, Piece, Pieces};
use crate::problem::{LogProblem, WriteError};
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
    /// No message that a checksum confirms is left, or neither header nor scenario, or it is of another version.
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
/// If `input` cannot be read, nothing left in it identifies its run, or none of its messages is left, or
/// `output` exists or cannot be written.
pub fn salvage(
    input: &Path,
    output: &Path,
    events: &[EventKind],
    settle: &Settle<'_>,
) -> Result<Salvaged, SalvageError> {
    let name = input.display().to_string();
    let read_error = |error| SalvageError::Read { path: name.clone(), error };
    let hopeless = |problem: String| SalvageError::Hopeless { path: name.clone(), problem };
    let mut pieces = Pieces::open(input).map_err(read_error)?;
    let Found { header, scenario, end, entries, other_version } = find(&mut pieces).map_err(read_error)?;
    if let (None, Some(version)) = (&header, other_version) {
        return Err(hopeless(LogProblem::Version(version).to_string()));
    }
    let (header, mut remarks) = settle(header, scenario.as_deref()).map_err(hopeless)?;
    if scenario.is_none() {
        remarks.push("the scenario is lost".to_owned());
    }

    let events: Vec<EventKind> = events.iter().map(|kind| kind.clone().with(header.parts())).collect();
    let events = &events[..];
    let gaps = gaps(&entries, &mut pieces, Walk::new(events, &header)).map_err(read_error)?;
    // The first walk finds the gaps, which are written first; the second walk writes.
    let mut walk = Walk::new(events, &header);
    let mut damage = std::mem::take(&mut pieces.damage);
    let mut digests = Digests::default();
    for entry in entries.iter().filter(|entry| entry.is_chunk) {
        let Some(mut chunk) = pieces.chunk(entry.at).map_err(read_error)? else { continue };
        if gaps.contains(&entry.at) {
            walk.begin_gap();
        }
        let mut keep = |message: &Message| {
            digests.add(&message.topic, &message.payload);
            Ok(())
        };
        match walk.chunk(entry.at, &mut chunk, &mut keep) {
            Ok(()) => {}
            Err(ChunkProblem::Content(what)) => {
                damage.push(Damage { from_byte: entry.at, to_byte: entry.end, what });
            }
            Err(ChunkProblem::Write(error)) => return Err(error.into()),
        }
    }
    let (mut salvaged, foreign) = walk.finish(end.as_ref());
    if salvaged.kept.is_empty() {
        return Err(hopeless("no message is left that a checksum confirms".to_owned()));
    }
    if let Some(topic) = end.as_ref().and_then(|end| changed(end, &salvaged, &mut digests)) {
        let problem =
            "has all of its messages with right checksums, but others than metadata `run_end` names";
        return Err(hopeless(format!("{topic} {problem}")));
    }
    damage.sort_by_key(|damage| damage.from_byte);
    salvaged.damage = damage;
    salvaged.remarks.splice(0..0, remarks);

    let own = events.iter().map(Topic::of).filter(|topic| !foreign.contains_key(&topic.topic));
    let topics = own.chain(foreign.values().cloned());
    let scenario = scenario.unwrap_or_default();
    let mut writer = RunWriter::create_salvaged(output, input, &header, &scenario, topics)?;
    let report = end.map_or(SolverReport::default(), |end| end.solver);
    let written = writer
        .salvaged(&salvaged)
        .map_err(SalvageError::from)
        .and_then(|()| write(&entries, &gaps, &mut pieces, Walk::new(events, &header), &mut writer, &name))
        .and_then(|()| Ok(writer.finish(RunStatus::Salvaged, report)?));
    // Leaves nothing behind on failure: it can be repeated from the input.
    written.map(|_end| salvaged)
}

/// A topic of which no message is lost, and some are not those of the run.
fn changed(end: &RunEnd, salvaged: &Salvaged, digests: &mut Digests) -> Option<String> {
    let (_, found) = digests.finish(salvaged.kept.keys());
    let is_all = |topic: &String| salvaged.kept.get(topic) == end.message_counts.get(topic);
    let is_other =
        |(topic, digest): &(String, String)| end.topic_digests.get(topic).is_some_and(|said| said != digest);
    found.into_iter().filter(|(topic, _)| is_all(topic)).find(is_other).map(|(topic, _)| topic)
}

/// What is left of a file.
#[derive(Default)]
struct Found {
    /// The first header.
    header: Option<RunHeader>,
    /// The version of a header of another version of the format, if there is one.
    other_version: Option<u32>,
    /// The first scenario.
    scenario: Option<String>,
    /// The last end.
    end: Option<RunEnd>,
    /// In the order of their times.
    entries: Vec<Entry>,
}

/// A chunk or checkpoint whose checksum is right.
struct Entry {
    at: u64,
    end: u64,
    /// The time of its first message.
    time_ns: u64,
    is_chunk: bool,
    /// Whether there is damage right before it.
    is_after_damage: bool,
}

/// Finds everything with a right checksum in a file.
fn find(pieces: &mut Pieces) -> io::Result<Found> {
    let mut found = Found::default();
    let mut damages = 0;
    while let Some(piece) = pieces.next()? {
        match piece.content {
            Content::Run(map) => match metadata::check_version(&map) {
                Err(LogProblem::Version(version)) => {
                    found.other_version = found.other_version.or(Some(version))
                }
                _ => found.header = found.header.or(metadata::header_from_map(&map).ok()),
            },
            Content::Scenario(text) => found.scenario = found.scenario.or(Some(text)),
            Content::End(end) => found.end = Some(*end),
            content @ (Content::Chunk(_) | Content::Checkpoint(_)) => {
                let is_after_damage =
                    pieces.damage.len() > std::mem::replace(&mut damages, pieces.damage.len());
                let (is_chunk, first_ns) = match content {
                    Content::Chunk(mut chunk) => (true, chunk.first_ns()),
                    _ => (false, None),
                };
                // A checkpoint belongs behind what stands before it.
                let before_ns = found.entries.last().map(|entry| entry.time_ns);
                let time_ns = first_ns.or(before_ns).unwrap_or_default();
                let Piece { at, end, .. } = piece;
                found.entries.push(Entry { at, end, time_ns, is_chunk, is_after_damage });
            }
        }
    }
    // Chunks that were moved, or stand there twice.
    found.entries.sort_by_key(|entry| entry.time_ns);
    Ok(found)
}

/// The offsets of chunks before which messages are missing. That they are is revealed by the numbers of a
/// topic, possibly only some chunks after damage.
fn gaps(entries: &[Entry], pieces: &mut Pieces, mut walk: Walk<'_>) -> io::Result<BTreeSet<u64>> {
    let mut gaps = BTreeSet::new();
    // The chunks before which something may be missing, by index.
    let mut doubtful: Vec<(usize, u64)> = Vec::new();
    // The next number of each topic, and the index of the chunk after its last message.
    let mut next: BTreeMap<String, (u32, usize)> = BTreeMap::new();
    let (mut place, mut is_after_damage) = (0, false);
    for entry in entries {
        is_after_damage |= entry.is_after_damage;
        if !entry.is_chunk {
            continue;
        }
        if std::mem::take(&mut is_after_damage) {
            doubtful.push((place, entry.at));
        }
        if let Some(mut chunk) = pieces.chunk(entry.at)? {
            // The first walk reports what cannot be read.
            for message in walk.messages(entry.at, &mut chunk).unwrap_or_default() {
                walk.note(&message);
                let (expected, since) = next.get(&message.topic).copied().unwrap_or_default();
                if message.sequence > expected && since <= place {
                    let from = doubtful.partition_point(|(place, _)| *place < since);
                    if from == doubtful.len() {
                        // A chunk that was cut out leaves no damage.
                        doubtful.push((place, entry.at));
                    }
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
