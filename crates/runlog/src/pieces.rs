//! Finds the pieces of a damaged file whose checksums are right, and the damage between them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;

use asperity_record::RunEnd;
use mcap::records::{Record, op};

use crate::chunk::Chunk;
use crate::findings::Damage;
use crate::format::{CHECKPOINT, LONGEST_RECORD_BYTES, MAGIC, RECORD_HEAD_BYTES, RUN, RUN_END, SCENARIO};
use crate::metadata;
use crate::parse::parse;

/// A part of the file whose checksum is right, or that its reader compares with others.
pub(crate) enum Content {
    Run(BTreeMap<String, String>),
    Scenario(String),
    Checkpoint(String),
    End(Box<RunEnd>),
    Chunk(Chunk),
}

/// Such a part, and its position.
pub(crate) struct Piece {
    pub(crate) at: u64,
    /// The first byte after it.
    pub(crate) end: u64,
    pub(crate) content: Content,
}

/// Walks through a file from piece to piece, skipping what is between them.
pub(crate) struct Pieces {
    file: BufReader<File>,
    length: u64,
    at: u64,
    /// The end of the last valid piece: nothing before it needs to be searched.
    proved: u64,
    /// Bytes that may still be read for candidates that turn out to be invalid.
    effort: u64,
    pub(crate) damage: Vec<Damage>,
}

impl Pieces {
    pub(crate) fn open(path: &Path) -> io::Result<Pieces> {
        let file = asperity_files::open(path)?;
        let length = file.metadata()?.len();
        let file = BufReader::with_capacity(1 << 16, file);
        let effort = MOST_EFFORT_BYTES.saturating_add(length.saturating_mul(4));
        let mut pieces = Pieces { file, length, at: 0, proved: 0, effort, damage: Vec::new() };
        if pieces.bytes(0, MAGIC.len() as u64)?.as_deref() == Some(MAGIC) {
            (pieces.at, pieces.proved) = (MAGIC.len() as u64, MAGIC.len() as u64);
        }
        Ok(pieces)
    }

    /// Reads a piece found before.
    pub(crate) fn again(&mut self, at: u64) -> io::Result<Option<Content>> {
        Ok(self.record(at)?.ok().and_then(|(piece, _)| piece).map(|piece| piece.content))
    }

    /// Reads a chunk found before.
    pub(crate) fn chunk(&mut self, at: u64) -> io::Result<Option<Chunk>> {
        Ok(match self.again(at)? {
            Some(Content::Chunk(chunk)) => Some(chunk),
            _ => None,
        })
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

    pub(crate) fn next(&mut self) -> io::Result<Option<Piece>> {
        loop {
            if self.at >= self.length || self.is_end_magic()? {
                return Ok(None);
            }
            match self.record(self.at)? {
                Ok((piece, next)) => {
                    self.at = next;
                    if let Some(piece) = piece {
                        self.proved = next;
                        return Ok(Some(piece));
                    }
                }
                Err(what) => {
                    let from_byte = self.at;
                    let (to_byte, gave_up) = self.search(self.proved.max(8))?;
                    let what = if gave_up {
                        format!(
                            "{what}; too many false beginnings of chunks follow, so the rest was not searched"
                        )
                    } else {
                        what
                    };
                    self.damage.push(Damage { from_byte: from_byte.min(to_byte), to_byte, what });
                    (self.at, self.proved) = (to_byte, to_byte);
                }
            }
        }
    }

    fn is_end_magic(&mut self) -> io::Result<bool> {
        let left = self.length - self.at;
        Ok(left == MAGIC.len() as u64 && self.bytes(self.at, left)?.as_deref() == Some(MAGIC))
    }

    /// Reads the record at an offset, and returns it, if it is valid, with the offset of the next
    /// one.
    fn record(&mut self, at: u64) -> io::Result<Result<(Option<Piece>, u64), String>> {
        let Some(head) = self.bytes(at, RECORD_HEAD_BYTES as u64)? else {
            return Ok(Err("the file ends within the head of a record".to_owned()));
        };
        let opcode = head[0];
        let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        if !(op::HEADER..=op::DATA_END).contains(&opcode) {
            return Ok(Err(format!("{opcode:#04x} begins no record")));
        }
        let body_at = at + RECORD_HEAD_BYTES as u64;
        let next = match body_at.checked_add(length) {
            Some(next) if next <= self.length => next,
            _ => return Ok(Err("a record is longer than what is left of the file".to_owned())),
        };
        if !matches!(opcode, op::CHUNK | op::ATTACHMENT | op::METADATA) {
            return Ok(Ok((None, next)));
        }
        if length > LONGEST_RECORD_BYTES as u64 {
            return Ok(Err(format!("a record of {length} bytes, larger than any that was written")));
        }
        let Some(body) = self.bytes(body_at, length)? else {
            return Ok(Err("a record is longer than what is left of the file".to_owned()));
        };
        let piece =
            content(opcode, &body, at).map(|found| found.map(|content| Piece { at, end: next, content }));
        Ok(piece.map(|piece| (piece, next)))
    }

    /// The offset of the next valid piece, or the end of the file; and whether the search gave up
    /// before.
    fn search(&mut self, from: u64) -> io::Result<(u64, bool)> {
        // Enough bytes to decide whether a candidate is worth reading.
        const LOOK_BYTES: u64 = 64;
        let mut start = from;
        while start < self.length {
            let count = (WINDOW_BYTES + LOOK_BYTES).min(self.length - start);
            let window = self.bytes(start, count)?.unwrap_or_default();
            for offset in 0..count.min(WINDOW_BYTES) {
                let at = start + offset;
                let look = &window[offset as usize..];
                if at == self.at || !looks_like_a_piece(look) {
                    continue;
                }
                if let Ok((Some(_), _)) = self.record(at)? {
                    return Ok((at, false));
                }
                let claimed = u64::from_le_bytes(look[1..9].try_into().expect("eight bytes"));
                let cost = claimed.min(LONGEST_RECORD_BYTES as u64).min(self.length - at);
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

/// Bytes searched at a time.
const WINDOW_BYTES: u64 = 1 << 16;

/// Bytes that may be read in vain, in addition to four times the file: bytes that only look like
/// the beginning of chunks could otherwise make the search read the whole file for each of them.
const MOST_EFFORT_BYTES: u64 = 1 << 26;

/// Whether bytes look like the beginning of a chunk, an attachment or a metadata record of a run
/// log.
fn looks_like_a_piece(bytes: &[u8]) -> bool {
    let begins_at = |place: usize, text: &[u8]| bytes.get(place..).is_some_and(|rest| rest.starts_with(text));
    if bytes.len() <= RECORD_HEAD_BYTES {
        return false;
    }
    match bytes.first() {
        // After head, times, size and checksum.
        Some(&op::CHUNK) => [&b"\x04\0\0\0zstd"[..], b"\x03\0\0\0lz4", b"\0\0\0\0"].iter().any(|name| {
            // The length of the records, behind the name of their compression, follows from that of the chunk.
            let place = 9 + 28 + name.len();
            let length = |at: usize| bytes.get(at..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
            let around = (place - 9 + 8) as u64;
            begins_at(9 + 28, name)
                && length(1)
                    .zip(length(place))
                    .is_some_and(|(all, records)| records.checked_add(around) == Some(all))
        }),
        // After head and times.
        Some(&op::ATTACHMENT) => {
            begins_at(9 + 16, b"\x0d\0\0\0scenario.toml") || begins_at(9 + 16, b"\x0a\0\0\0checkpoint")
        }
        Some(&op::METADATA) => begins_at(9, b"\x03\0\0\0run") || begins_at(9, b"\x07\0\0\0run_end"),
        _ => false,
    }
}

/// The contents of a record, or why it is damaged.
fn content(opcode: u8, body: &[u8], at: u64) -> Result<Option<Content>, String> {
    match opcode {
        op::ATTACHMENT => attachment(body),
        op::METADATA => match parse(opcode, body, at) {
            Ok(Record::Metadata(metadata)) if metadata.name == RUN => {
                Ok(Some(Content::Run(metadata.metadata)))
            }
            Ok(Record::Metadata(metadata)) if metadata.name == RUN_END => {
                let end = metadata::end_from_map(&metadata.metadata).map_err(|error| error.to_string())?;
                Ok(Some(Content::End(Box::new(end))))
            }
            Ok(_) => Ok(None),
            Err(error) => Err(error.to_string()),
        },
        _ => match parse(opcode, body, at) {
            Ok(Record::Chunk { header, .. }) if header.uncompressed_crc == 0 => {
                Err("a chunk without checksum, which nothing confirms".to_owned())
            }
            Ok(Record::Chunk { header, data }) => {
                let chunk = Chunk::open(&header, &data).map_err(|error| format!("a chunk: {error}"))?;
                Ok(Some(Content::Chunk(chunk)))
            }
            Ok(_) => Ok(None),
            Err(error) => Err(error.to_string()),
        },
    }
}

/// Reads an attachment of a run log whose checksum is right.
fn attachment(body: &[u8]) -> Result<Option<Content>, String> {
    let wrong = || "an attachment whose checksum is not that of its content".to_owned();
    let (content, crc) = body.split_at_checked(body.len().wrapping_sub(4)).ok_or_else(wrong)?;
    let crc = u32::from_le_bytes(crc.try_into().map_err(|_| wrong())?);
    if crc32fast::hash(content) != crc {
        return Err(wrong());
    }
    // After two times: name and media type, each with its length before it, then the data.
    let mut rest = content.get(16..).ok_or_else(wrong)?;
    let mut text = || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (text, after) = after.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        rest = after;
        std::str::from_utf8(text).ok()
    };
    let (name, _media_type) = text().zip(text()).ok_or_else(wrong)?;
    let (length, data) = rest.split_first_chunk::<8>().ok_or_else(wrong)?;
    if u64::from_le_bytes(*length) != data.len() as u64 {
        return Err(wrong());
    }
    let text = String::from_utf8(data.to_owned()).map_err(|_| wrong())?;
    Ok(match name {
        SCENARIO => Some(Content::Scenario(text)),
        CHECKPOINT => Some(Content::Checkpoint(text)),
        _ => None,
    })
}
