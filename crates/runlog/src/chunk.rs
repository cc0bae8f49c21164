//! Decompresses chunks. The MCAP library would trust the length of a record that exceeds its
//! uncompressed chunk, and does not report where in the file an invalid chunk is.

use std::io::Read;

use mcap::McapError;
use mcap::records::ChunkHeader;

use crate::format::{LONGEST_RECORD_BYTES, RECORD_HEAD_BYTES};
use crate::problem::LogProblem;

/// The records of one chunk whose checksum, if it has one, is right.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    records: Vec<u8>,
    read: usize,
}

impl Chunk {
    /// Decompresses a chunk and checks its checksum.
    ///
    /// # Errors
    /// If it does not match its header, or is larger than any chunk that was ever written.
    pub(crate) fn open(header: &ChunkHeader, data: &[u8]) -> Result<Chunk, LogProblem> {
        if header.uncompressed_size > LONGEST_RECORD_BYTES as u64 {
            return Err(McapError::ChunkTooLarge(header.uncompressed_size).into());
        }
        let size = header.uncompressed_size as usize;
        let records = match header.compression.as_str() {
            "" => data.to_owned(),
            // Allocates the stated size only; larger contents are refused.
            "zstd" => zstd::bulk::decompress(data, size)
                .map_err(|error| McapError::DecompressionError(error.to_string()))?,
            // One byte more than stated shows that there is more.
            "lz4" => {
                let mut records = Vec::new();
                let unpacked = lz4::Decoder::new(data)
                    .and_then(|packed| packed.take(size as u64 + 1).read_to_end(&mut records));
                unpacked.map_err(|error| McapError::DecompressionError(error.to_string()))?;
                records
            }
            other => return Err(McapError::UnsupportedCompression(other.to_owned()).into()),
        };
        if records.len() != size {
            let (header, available) = (header.uncompressed_size, records.len() as u64);
            return Err(McapError::BadChunkLength { header, available }.into());
        }
        let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&records));
        // 0 means that there is no checksum; `Layout` decides whether it may be missing.
        if saved != calculated && saved != 0 {
            return Err(McapError::BadChunkCrc { saved, calculated }.into());
        }
        Ok(Chunk { records, read: 0 })
    }

    /// Returns the next record: opcode and body.
    ///
    /// # Errors
    /// If its length exceeds the rest of the chunk.
    pub(crate) fn next_record(&mut self) -> Result<Option<(u8, &[u8])>, LogProblem> {
        let rest = &self.records[self.read..];
        if rest.is_empty() {
            return Ok(None);
        }
        let head = rest.get(..RECORD_HEAD_BYTES).ok_or(McapError::UnexpectedEoc)?;
        let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        let end = usize::try_from(length).ok().and_then(|length| RECORD_HEAD_BYTES.checked_add(length));
        let body = end.and_then(|end| rest.get(RECORD_HEAD_BYTES..end)).ok_or(McapError::UnexpectedEoc)?;
        self.read += RECORD_HEAD_BYTES + body.len();
        Ok(Some((head[0], body)))
    }
}
