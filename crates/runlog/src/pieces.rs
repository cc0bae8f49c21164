//! The pieces of a damaged file that prove themselves, and what lies between them.

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

/// A part of the file that has proved itself, or that its reader has to compare with others.
pub(crate) enum Piece {
    Run(BTreeMap<String, String>),
    Scenario(String),
    Checkpoint(String),
    End(RunEnd),
    /// A chunk's records, and where in the file it is.
    Chunk {
        at: u64,
        chunk: Chunk,
    },
}

/// Walks through a file from piece to piece, past whatever is between them.
pub(crate) struct Pieces {
    file: BufReader<File>,
    length: u64,
    at: u64,
    /// After the last piece that proved itself: nothing before it needs to be searched.
    proved: u64,
    pub(crate) damage: Vec<Damage>,
}

impl Pieces {
    pub(crate) fn open(path: &Path) -> io::Result<Pieces> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        let file = BufReader::with_capacity(1 << 16, file);
        let mut pieces = Pieces { file, length, at: 0, proved: 0, damage: Vec::new() };
        if pieces.bytes(0, MAGIC.len() as u64)?.as_deref() == Some(MAGIC) {
            (pieces.at, pieces.proved) = (MAGIC.len() as u64, MAGIC.len() as u64);
        }
        Ok(pieces)
    }

    /// Takes note that a chunk was not what its topic promises.
    pub(crate) fn reject(&mut self, at: u64, what: String) {
        self.damage.push(Damage { from_byte: at, to_byte: self.at, what });
    }

    /// `count` bytes from there on; `None` if the file has not as many.
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
                    let to_byte = self.search(self.proved.max(8))?;
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

    /// The record there, if it can be one, and where the next one begins.
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
        Ok(piece(opcode, &body, at).map(|piece| (piece, next)))
    }

    /// Where from some byte on the next chunk, attachment or end is that proves itself; the
    /// end of the file if there is none.
    fn search(&mut self, from: u64) -> io::Result<u64> {
        const WINDOW_BYTES: u64 = 1 << 16;
        // Enough after a place to tell whether it is worth a closer look.
        const LOOK_BYTES: u64 = 64;
        let mut start = from;
        while start < self.length {
            let count = (WINDOW_BYTES + LOOK_BYTES).min(self.length - start);
            let window = self.bytes(start, count)?.unwrap_or_default();
            for offset in 0..count.min(WINDOW_BYTES) {
                let at = start + offset;
                let may_begin = looks_like_a_piece(&window[offset as usize..]);
                if may_begin
                    && at != self.at
                    && let Ok((Some(_), _)) = self.record(at)?
                {
                    return Ok(at);
                }
            }
            start += WINDOW_BYTES;
        }
        Ok(self.length)
    }
}

/// A first look at bytes of which a chunk, an attachment or a metadata record of ours may be
/// the beginning.
fn looks_like_a_piece(bytes: &[u8]) -> bool {
    let begins_at = |place: usize, text: &[u8]| bytes.get(place..).is_some_and(|rest| rest.starts_with(text));
    match bytes.first() {
        // After head, times, size and checksum.
        Some(&op::CHUNK) => begins_at(9 + 28, b"\x04\0\0\0zstd"),
        // After head and times.
        Some(&op::ATTACHMENT) => {
            begins_at(9 + 16, b"\x0d\0\0\0scenario.toml") || begins_at(9 + 16, b"\x0a\0\0\0checkpoint")
        }
        Some(&op::METADATA) => begins_at(9, b"\x03\0\0\0run") || begins_at(9, b"\x07\0\0\0run_end"),
        _ => false,
    }
}

/// What a record is, or why it is not what was written.
fn piece(opcode: u8, body: &[u8], at: u64) -> Result<Option<Piece>, String> {
    match opcode {
        op::ATTACHMENT => attachment(body),
        op::METADATA => match parse(opcode, body, at) {
            Ok(Record::Metadata(metadata)) if metadata.name == RUN => Ok(Some(Piece::Run(metadata.metadata))),
            Ok(Record::Metadata(metadata)) if metadata.name == RUN_END => {
                let end = metadata::end_from_map(&metadata.metadata).map_err(|error| error.to_string())?;
                Ok(Some(Piece::End(end)))
            }
            Ok(_) => Ok(None),
            Err(error) => Err(error.to_string()),
        },
        _ => match parse(opcode, body, at) {
            Ok(Record::Chunk { header, data }) => {
                let chunk = Chunk::open(&header, &data).map_err(|error| format!("a chunk: {error}"))?;
                Ok(Some(Piece::Chunk { at, chunk }))
            }
            Ok(_) => Ok(None),
            Err(error) => Err(error.to_string()),
        },
    }
}

/// An attachment of ours whose checksum holds.
fn attachment(body: &[u8]) -> Result<Option<Piece>, String> {
    let wrong = || "an attachment whose checksum is not that of its content".to_owned();
    let (content, crc) = body.split_at_checked(body.len().wrapping_sub(4)).ok_or_else(wrong)?;
    if crc32fast::hash(content) != u32::from_le_bytes(crc.try_into().map_err(|_| wrong())?) {
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
        SCENARIO => Some(Piece::Scenario(text)),
        CHECKPOINT => Some(Piece::Checkpoint(text)),
        _ => None,
    })
}
