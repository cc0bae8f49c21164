//! Verifies the records `chunk`: in a log of version 3 or later one follows every piece and must be
//! correct in every field. Nothing else is allowed in such a log, so that a flipped bit that turns
//! a record into one of another kind is detected.

use crc32fast::Hasher;
use mcap::records::Record;

use super::record::Seal;
use crate::format::{
    CHECKPOINT, CHUNK, CHUNK_SINCE, MAGIC, NOTE, RECORD_HEAD_BYTES, RUN, RUN_END, SALVAGE, SCENARIO,
};
use crate::index::{Index, Place};
use crate::metadata;
use crate::parse::fills;
use crate::problem::LogProblem;

/// Verifies the records of a file against its seals.
#[derive(Debug)]
pub(crate) struct Verifier {
    /// The checksum of everything read.
    crc: Hasher,
    /// The version of the format, once known.
    version: Option<u32>,
    run_id: String,
    /// Number of records outside chunks.
    records: u64,
    next: u64,
    before_crc: u32,
    /// The checksum of a piece that is not sealed yet.
    piece: Option<u32>,
    has_end: bool,
    data_ended: bool,
    index: Index,
}

impl Default for Verifier {
    fn default() -> Verifier {
        let mut crc = Hasher::new();
        crc.update(MAGIC);
        Verifier {
            crc,
            version: None,
            run_id: String::new(),
            records: 0,
            next: 0,
            before_crc: 0,
            piece: None,
            has_end: false,
            data_ended: false,
            index: Index::default(),
        }
    }
}

impl Verifier {
    /// Whether the version of the log has seals.
    fn is_strict(&self) -> bool {
        self.version.is_some_and(|version| version >= CHUNK_SINCE)
    }

    /// The run id of the log, if its version has seals.
    pub(crate) fn run_id(&self) -> Option<&str> {
        self.is_strict().then_some(self.run_id.as_str())
    }

    /// Checks a record of a chunk; `offset` is its position there.
    ///
    /// # Errors
    /// If it is not allowed there.
    pub(crate) fn take_inner(&mut self, record: &Record<'_>, offset: u64) -> Result<(), LogProblem> {
        if self.is_strict() { self.index.in_chunk(record, offset) } else { Ok(()) }
    }

    /// Checks a record outside chunks; `body` excludes its length.
    ///
    /// # Errors
    /// If it contradicts the log, or a seal is wrong.
    pub(crate) fn take(&mut self, place: Place, record: &Record<'_>, body: &[u8]) -> Result<(), LogProblem> {
        if let Record::Metadata(run) = record
            && run.name == RUN
        {
            self.version = metadata::version(&run.metadata).ok();
            if self.is_strict() && self.records != 1 {
                let (at, what) = (place.at, "something stands before metadata `run`");
                return Err(LogProblem::Unsound { at, what });
            }
            self.run_id = run.metadata.get("run_id").cloned().unwrap_or_default();
        }
        self.records += 1;
        match (self.version, record) {
            // Bytes before the version are covered by seals as well.
            (None, _) => {
                self.hash(record.opcode(), body);
                return Ok(());
            }
            (Some(..CHUNK_SINCE), Record::Metadata(metadata)) if metadata.name == CHUNK => {
                return Err(LogProblem::Misplaced("metadata `chunk` in a log of a version that has none"));
            }
            (Some(..CHUNK_SINCE), _) => return Ok(()),
            _ => self.check(place, record, body)?,
        }
        self.index.take(place, record, body)?;
        self.hash(record.opcode(), body);
        Ok(())
    }

    fn hash(&mut self, opcode: u8, body: &[u8]) {
        let mut head = [opcode; RECORD_HEAD_BYTES];
        head[1..].copy_from_slice(&(body.len() as u64).to_le_bytes());
        self.crc.update(&head);
        self.crc.update(body);
    }

    fn check(&mut self, place: Place, record: &Record<'_>, body: &[u8]) -> Result<(), LogProblem> {
        let at = place.at;
        if !fills(record.opcode(), body) {
            return Err(LogProblem::InnerLength { at, opcode: record.opcode() });
        }
        let wrong = |what| Err(LogProblem::Unsound { at, what });
        if self.data_ended {
            return Ok(());
        }
        let piece = match record {
            Record::Metadata(metadata) if metadata.name == CHUNK => {
                return self.seal(at, &Seal::from_map(&metadata.metadata)?);
            }
            Record::Metadata(metadata) if [RUN, NOTE].contains(&metadata.name.as_str()) => return Ok(()),
            Record::Metadata(metadata) if [RUN_END, SALVAGE].contains(&metadata.name.as_str()) => {
                self.has_end |= metadata.name == RUN_END;
                crc32fast::hash(body)
            }
            Record::Metadata(_) => return wrong("metadata of a name that no run log has"),
            Record::Attachment { header, crc, .. } => {
                if ![SCENARIO, CHECKPOINT].contains(&header.name.as_str()) {
                    return wrong("an attachment of a name that no run log has");
                }
                // 0 means that there is no checksum; attachments of run logs have one.
                if *crc != crc32fast::hash(&body[..body.len() - 4]) {
                    return wrong("an attachment without its checksum");
                }
                *crc
            }
            Record::Chunk { header, .. } => header.uncompressed_crc,
            Record::MessageIndex(_) => return Ok(()),
            Record::DataEnd(end) => {
                // A writer that is dropped, as in a panic, finishes the file as far as it can.
                if self.piece.is_some() && self.has_end {
                    return wrong("the record before it is not followed by metadata `chunk`");
                }
                self.data_ended = true;
                if end.data_section_crc != self.crc.clone().finalize() {
                    return wrong("the checksum of the data is not that of the data");
                }
                return Ok(());
            }
            _ => return wrong("a record that may stand in chunks alone, or in no run log"),
        };
        match self.piece.replace(piece) {
            None => Ok(()),
            Some(_) => wrong("the record before it is not followed by metadata `chunk`"),
        }
    }

    fn seal(&mut self, at: u64, seal: &Seal) -> Result<(), LogProblem> {
        let wrong = |what| Err(LogProblem::Unsound { at, what });
        if seal.run_id != self.run_id {
            return wrong("metadata `chunk` of another run");
        }
        if self.piece.take() != Some(seal.crc) {
            return wrong("metadata `chunk` that does not follow what it vouches for");
        }
        if (seal.number, seal.before_crc) != (self.next, self.before_crc) {
            return wrong("metadata `chunk` out of order: what stood before it is missing or was moved");
        }
        if (seal.bytes, seal.bytes_crc) != (at, self.crc.clone().finalize()) {
            return wrong("metadata `chunk` vouches for other bytes than stand before it");
        }
        (self.next, self.before_crc) = (seal.number + 1, seal.crc);
        Ok(())
    }
}
