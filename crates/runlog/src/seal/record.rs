//! The metadata record `chunk`.
//!
//! One follows each *piece* of a log: the scenario, each chunk with its message indexes, each
//! checkpoint, `salvage` and `run_end`. It states the run of the piece and its number in the run,
//! and a checksum over every byte of the file before it. It also repeats the checksum of the piece
//! before, so that one damaged record loses nothing.

use std::collections::BTreeMap;

use mcap::records::{Record, op};

use crate::format::{CHUNK, RECORD_HEAD_BYTES};
use crate::metadata::Reader;
use crate::parse::parse;
use crate::problem::MetadataError;

/// A record `chunk`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Seal {
    /// The id of the piece's run, as in the header.
    pub(crate) run_id: String,
    /// Counted from 0, the record after the scenario, which covers everything before the first
    /// chunk.
    pub(crate) number: u64,
    /// The checksum of the piece: repeated for chunks and attachments, which have one; for a
    /// metadata record the CRC-32 of the record after its length.
    pub(crate) crc: u32,
    /// The checksum of the piece before it; 0 in the first.
    pub(crate) before_crc: u32,
    /// Number of bytes in the file before this record.
    pub(crate) bytes: u64,
    /// Their CRC-32.
    pub(crate) bytes_crc: u32,
}

const KEYS: [&str; 6] = ["run_id", "number", "crc", "before_crc", "bytes", "bytes_crc"];

impl Seal {
    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let hex = |crc: u32| format!("{crc:08x}");
        [
            ("run_id", self.run_id.clone()),
            ("number", self.number.to_string()),
            ("crc", hex(self.crc)),
            ("before_crc", hex(self.before_crc)),
            ("bytes", self.bytes.to_string()),
            ("bytes_crc", hex(self.bytes_crc)),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into()
    }

    /// # Errors
    /// If a key is missing or invalid.
    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Seal, MetadataError> {
        let reader = Reader { record: CHUNK, map };
        if let Some(key) = map.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(reader.invalid(key, "a key of this record"));
        }
        let hex = |key: &'static str| {
            let text = reader.text(key)?;
            let crc = u32::from_str_radix(&text, 16).ok();
            // Only one spelling is accepted, so that every change is detected.
            crc.filter(|crc| format!("{crc:08x}") == text)
                .ok_or_else(|| reader.invalid(key, "eight hexadecimal digits"))
        };
        let number = |key: &'static str| {
            let number: u64 = reader.parse(key, "a whole number")?;
            let is_plain = reader.text(key)? == number.to_string();
            is_plain.then_some(number).ok_or_else(|| reader.invalid(key, "a whole number"))
        };
        Ok(Seal {
            run_id: reader.text("run_id")?,
            number: number("number")?,
            crc: hex("crc")?,
            before_crc: hex("before_crc")?,
            bytes: number("bytes")?,
            bytes_crc: hex("bytes_crc")?,
        })
    }
}

/// Finds the first whole record `chunk` of this run, or of any run if it is unknown.
pub(crate) fn find_seal(bytes: &[u8], run_id: Option<&str>) -> Option<usize> {
    let is_of_run = |seal: &Seal| run_id.is_none_or(|run_id| seal.run_id == run_id);
    (0..bytes.len())
        .filter(|&at| bytes[at] == op::METADATA)
        .find(|&at| seal_at(&bytes[at..]).is_some_and(|(seal, _)| is_of_run(&seal)))
}

/// The longest `chunk` record with its head: six keys, a run id and five numbers.
pub(crate) const LONGEST_SEAL_BYTES: usize = 512;

/// Parses the record `chunk` at the beginning of some bytes; also returns its length. Ignores the
/// length in its head, which may be damaged, since the contents determine it.
pub(crate) fn seal_at(bytes: &[u8]) -> Option<(Seal, usize)> {
    let body = bytes.get(RECORD_HEAD_BYTES..)?;
    if bytes[0] != op::METADATA || !body.starts_with(b"\x05\0\0\0chunk") {
        return None;
    }
    let pairs = u32::from_le_bytes(body.get(9..13)?.try_into().ok()?) as usize;
    let length = 13 + pairs;
    if RECORD_HEAD_BYTES + length > LONGEST_SEAL_BYTES {
        return None;
    }
    match parse(op::METADATA, body.get(..length)?, 0) {
        Ok(Record::Metadata(metadata)) if metadata.metadata.len() == 6 => {
            Some((Seal::from_map(&metadata.metadata).ok()?, RECORD_HEAD_BYTES + length))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::Seal;

    #[test]
    fn a_link_says_what_it_said_or_nothing() {
        let seal = Seal {
            run_id: "ab".to_owned(),
            number: 7,
            crc: 0xa0,
            before_crc: 0,
            bytes: 1 << 40,
            bytes_crc: u32::MAX,
        };
        assert_eq!(Seal::from_map(&seal.to_map()).as_ref(), Ok(&seal));
        for (key, value) in
            [("number", "+7"), ("number", "07"), ("crc", "a0"), ("crc", "000000A0"), ("bytes", "")]
        {
            let mut map = seal.to_map();
            map.insert(key.to_owned(), value.to_owned());
            let error = Seal::from_map(&map).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains("which is not"), "{error}");
        }
        for key in seal.to_map().keys() {
            let mut map = seal.to_map();
            map.remove(key);
            assert!(Seal::from_map(&map).unwrap_err().to_string().contains(key));
        }
    }
}
