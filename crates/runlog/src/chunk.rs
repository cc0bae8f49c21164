//! Opening chunks. The MCAP library would do it as well, but it takes a record in an
//! uncompressed chunk at its word when it claims to be longer than the chunk, and does not
//! say where in the file a chunk is that it cannot open.

use mcap::McapError;
use mcap::records::ChunkHeader;

use crate::format::{LONGEST_RECORD_BYTES, RECORD_HEAD_BYTES};
use crate::problem::LogProblem;

/// The records of one chunk, which have been found to be those that were written.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    records: Vec<u8>,
    read: usize,
}

impl Chunk {
    /// Decompresses a chunk and checks its checksum.
    ///
    /// # Errors
    /// If it is not what its header says, or larger than any that was ever written.
    pub(crate) fn open(header: &ChunkHeader, data: &[u8]) -> Result<Chunk, LogProblem> {
        if header.uncompressed_size > LONGEST_RECORD_BYTES as u64 {
            return Err(McapError::ChunkTooLarge(header.uncompressed_size).into());
        }
        let size = header.uncompressed_size as usize;
        let records = match header.compression.as_str() {
            "" => data.to_owned(),
            // No more room than it claims: what unpacks to more is refused.
            "zstd" => zstd::bulk::decompress(data, size)
                .map_err(|error| McapError::DecompressionError(error.to_string()))?,
            other => return Err(McapError::UnsupportedCompression(other.to_owned()).into()),
        };
        if records.len() != size {
            let (header, available) = (header.uncompressed_size, records.len() as u64);
            return Err(McapError::BadChunkLength { header, available }.into());
        }
        let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&records));
        // 0 stands for a checksum that was not made; logs have all of theirs.
        if saved != calculated {
            return Err(McapError::BadChunkCrc { saved, calculated }.into());
        }
        Ok(Chunk { records, read: 0 })
    }

    /// Where the next record begins.
    pub(crate) fn place(&self) -> u64 {
        self.read as u64
    }

    /// The next record: opcode and body.
    ///
    /// # Errors
    /// If it claims to be longer than what is left of the chunk.
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
