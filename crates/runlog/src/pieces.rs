//! Finds the pieces of a damaged file whose checksums are right, in the order of the file, and the damage between
//! them.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;

use mcap::records::{Record, op};

use crate::chunk::Chunk;
use crate::findings::Damage;
use crate::format::{LONGEST_RECORD_BYTES, MAGIC, RECORD_HEAD_BYTES};
use crate::parse::parse;
use crate::problem::LogProblem;

/// A part of the file.
pub(crate) enum Piece {
    /// A chunk whose checksum is right.
    Chunk(Chunk),
    /// An attachment whose checksum is right; or metadata, a schema or a channel, which have none.
    Record(Record<'static>),
}

/// Walks through a file from piece to piece, skipping what is between them.
pub(crate) struct Pieces {
    file: BufReader<File>,
    length: u64,
    /// Where the next record begins.
    pub(crate) at: u64,
    /// The end of the last valid piece: nothing before it needs to be searched.
    proved: u64,
    /// Bytes that may still be read for candidates that turn out to be invalid.
    effort: u64,
    pub(crate) damage: Vec<Damage>,
}

/// Bytes that may be read in vain, in addition to four times the file: bytes that only look like the beginning of
/// chunks could otherwise make the search read the whole file for each of them.
const MOST_EFFORT_BYTES: u64 = 1 << 26;

/// Bytes searched at a time, and enough of them to decide whether a candidate is worth reading.
const WINDOW_BYTES: u64 = 1 << 16;
const LOOK_BYTES: u64 = 64;

impl Pieces {
    pub(crate) fn open(path: &Path) -> io::Result<Pieces> {
        let file = asperity_files::open(path)?;
        let length = file.metadata()?.len();
        let effort = MOST_EFFORT_BYTES.saturating_add(length.saturating_mul(4));
        let file = BufReader::with_capacity(1 << 16, file);
        let mut pieces = Pieces { file, length, at: 0, proved: 0, effort, damage: Vec::new() };
        if pieces.bytes(0, MAGIC.len() as u64)?.as_deref() == Some(MAGIC) {
            (pieces.at, pieces.proved) = (MAGIC.len() as u64, MAGIC.len() as u64);
        }
        Ok(pieces)
    }

    /// Reads `count` bytes; `None` if the file ends before.
    fn bytes(&mut self, at: u64, count: u64) -> io::Result<Option<Vec<u8>>> {
        if at.checked_add(count).is_none_or(|end| end > self.length) {
            return Ok(None);
        }
        let here = self.file.stream_position()?;
        self.file.seek_relative(at as i64 - here as i64)?;
        let mut bytes = vec![0; count as usize];
        self.file.read_exact(&mut bytes)?;
        Ok(Some(bytes))
    }

    /// The next piece, and its position.
    ///
    /// # Errors
    /// If the system refuses.
    pub(crate) fn next(&mut self) -> io::Result<Option<(u64, Piece)>> {
        let end = self.length.saturating_sub(MAGIC.len() as u64);
        while self.at < self.length
            && (self.at != end || self.bytes(end, MAGIC.len() as u64)?.as_deref() != Some(MAGIC))
        {
            let at = self.at;
            match self.record(at) {
                Ok((None, next)) => self.at = next,
                Ok((Some(piece), next)) => {
                    (self.at, self.proved) = (next, next);
                    return Ok(Some((at, piece)));
                }
                Err(LogProblem::Io(error)) => return Err(error),
                Err(problem) => {
                    let mut what = problem.to_string();
                    let (to_byte, gave_up) = self.search()?;
                    if gave_up {
                        what += "; too many false beginnings of chunks follow, so the rest was not searched";
                    }
                    self.damage.push(Damage { from_byte: at.min(to_byte), to_byte, what });
                    (self.at, self.proved) = (to_byte, to_byte);
                }
            }
        }
        Ok(None)
    }

    /// Reads the record at an offset; returns it, if it is a piece, with the offset of the next one.
    fn record(&mut self, at: u64) -> Result<(Option<Piece>, u64), LogProblem> {
        let unsound = |what| LogProblem::Unsound { at, what };
        let head =
            self.bytes(at, RECORD_HEAD_BYTES as u64)?.ok_or(unsound("the file ends within its head"))?;
        let opcode = head[0];
        let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        if !(op::HEADER..=op::DATA_END).contains(&opcode) {
            return Err(unsound("its first byte begins no record"));
        }
        let body_at = at + RECORD_HEAD_BYTES as u64;
        let next = body_at.checked_add(length).filter(|next| *next <= self.length);
        let next = next.ok_or(unsound("it is longer than what is left of the file"))?;
        if !matches!(opcode, op::CHUNK | op::ATTACHMENT | op::METADATA | op::SCHEMA | op::CHANNEL) {
            return Ok((None, next));
        }
        if length > LONGEST_RECORD_BYTES as u64 {
            return Err(unsound("it is longer than any that was written"));
        }
        let body = self.bytes(body_at, length)?.unwrap_or_default();
        let piece = match parse(opcode, &body, at)? {
            Record::Chunk { header, .. } if header.uncompressed_crc == 0 => {
                return Err(unsound("a chunk without checksum, which nothing confirms"));
            }
            Record::Chunk { header, data } => {
                Piece::Chunk(Chunk::open(&header, &data).map_err(|problem| problem.at(at))?)
            }
            Record::Attachment { crc: 0, .. } => return Err(unsound("an attachment without checksum")),
            record => Piece::Record(record.into_owned()),
        };
        Ok((Some(piece), next))
    }

    /// The offset of the next chunk, attachment or metadata record behind what is proved, or the end of the file; and
    /// whether the search gave up before.
    fn search(&mut self) -> io::Result<(u64, bool)> {
        let mut start = self.proved.max(MAGIC.len() as u64);
        while start < self.length {
            let count = (WINDOW_BYTES + LOOK_BYTES).min(self.length - start);
            let window = self.bytes(start, count)?.unwrap_or_default();
            for offset in 0..count.min(WINDOW_BYTES) {
                let at = start + offset;
                let Some(length) = length_of_a_piece(&window[offset as usize..]) else { continue };
                if at == self.at {
                    continue;
                }
                match self.record(at) {
                    Ok((Some(_), _)) => return Ok((at, false)),
                    Err(LogProblem::Io(error)) => return Err(error),
                    _ => {}
                }
                let cost = length.min(LONGEST_RECORD_BYTES as u64).min(self.length - at);
                match self.effort.checked_sub(cost) {
                    Some(left) => self.effort = left,
                    None => return Ok((self.length, true)),
                }
            }
            start += WINDOW_BYTES;
        }
        Ok((self.length, false))
    }
}

/// The length that bytes state, if they look like the beginning of a chunk, or of an attachment or metadata of a run
/// log.
fn length_of_a_piece(bytes: &[u8]) -> Option<u64> {
    let number = |at: usize| bytes.get(at..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
    let begins = |at: usize, names: &[&[u8]]| {
        names
            .iter()
            .find(|name| bytes.get(at..).is_some_and(|rest| rest.starts_with(name)))
            .map(|name| name.len())
    };
    let length = number(1)?;
    let is_piece = match *bytes.first()? {
        // Behind head, times, size, checksum and compression is the length of the records, which follows from that
        // of the chunk.
        op::CHUNK => {
            begins(9 + 28, &[b"\x04\0\0\0zstd", b"\x03\0\0\0lz4", b"\0\0\0\0"]).is_some_and(|name| {
                let around = (28 + name + 8) as u64;
                number(9 + 28 + name).and_then(|records| records.checked_add(around)) == Some(length)
            })
        }
        // Behind head and times.
        op::ATTACHMENT => begins(9 + 16, &[b"\x0d\0\0\0scenario.toml", b"\x0a\0\0\0checkpoint"]).is_some(),
        op::METADATA => begins(9, &[b"\x03\0\0\0run", b"\x07\0\0\0run_end"]).is_some(),
        _ => false,
    };
    is_piece.then_some(length)
}
