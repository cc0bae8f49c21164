//! Observes the bytes written to a file, for the records `chunk`: their number, their checksum, and
//! the checksum of the last piece. The MCAP library does not expose these.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crc32fast::Hasher;
use mcap::McapResult;
use mcap::Writer;
use mcap::records::{Metadata, op};

use super::record::Seal;
use crate::format::{CHUNK, MAGIC, RECORD_HEAD_BYTES};

/// A file that records what is written to it.
pub(crate) struct Tee<W> {
    file: W,
    seen: Arc<Mutex<Seen>>,
}

impl<W> Tee<W> {
    pub(crate) fn new(file: W) -> Tee<W> {
        Tee { file, seen: Arc::default() }
    }

    pub(crate) fn into_inner(self) -> W {
        self.file
    }
}

impl<W: Write> Write for Tee<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        lock(&self.seen).take(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Only to report the position: the library is configured not to seek.
impl<W: Seek> Seek for Tee<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

fn lock(seen: &Mutex<Seen>) -> MutexGuard<'_, Seen> {
    // No code panics while it has the lock.
    seen.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes the records `chunk` of a log.
pub(crate) struct Sealer {
    seen: Arc<Mutex<Seen>>,
    run_id: String,
    next: u64,
    before_crc: u32,
}

impl Sealer {
    pub(crate) fn new<W>(file: &Tee<W>, run_id: &str) -> Sealer {
        Sealer { seen: Arc::clone(&file.seen), run_id: run_id.to_owned(), next: 0, before_crc: 0 }
    }

    /// Ends the piece written last, writes its record `chunk`, and flushes both.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(crate) fn close<W: Write + Seek>(&mut self, writer: &mut Writer<Tee<W>>) -> McapResult<()> {
        writer.flush()?;
        let seal = {
            let seen = lock(&self.seen);
            Seal {
                run_id: self.run_id.clone(),
                number: self.next,
                crc: seen.piece_crc,
                before_crc: self.before_crc,
                bytes: seen.bytes,
                bytes_crc: seen.crc.clone().finalize(),
            }
        };
        writer.write_metadata(&Metadata { name: CHUNK.to_owned(), metadata: seal.to_map() })?;
        writer.flush()?;
        (self.next, self.before_crc) = (seal.number + 1, seal.crc);
        Ok(())
    }
}

/// Offset of the checksum in a chunk: after two times and the size.
const CHUNK_CRC_AT: u64 = 8 + 8 + 8;

/// Parses the records of a file as they are written.
struct Seen {
    bytes: u64,
    crc: Hasher,
    /// The checksum of the last chunk, attachment or metadata record.
    piece_crc: u32,
    /// The head of the current record, as far as it has been written.
    head: [u8; RECORD_HEAD_BYTES],
    head_bytes: usize,
    /// Bytes of its body written so far, and in total.
    body_bytes: u64,
    length: u64,
    /// The checksum inside the record, and one over its body.
    inner_crc: [u8; 4],
    body_crc: Hasher,
}

impl Default for Seen {
    fn default() -> Seen {
        Seen {
            bytes: 0,
            crc: Hasher::new(),
            piece_crc: 0,
            head: [0; RECORD_HEAD_BYTES],
            head_bytes: 0,
            body_bytes: 0,
            length: 0,
            inner_crc: [0; 4],
            body_crc: Hasher::new(),
        }
    }
}

impl Seen {
    fn take(&mut self, mut bytes: &[u8]) {
        self.crc.update(bytes);
        let magic = (MAGIC.len() as u64).saturating_sub(self.bytes).min(bytes.len() as u64);
        self.bytes += bytes.len() as u64;
        bytes = &bytes[magic as usize..];
        while !bytes.is_empty() {
            if self.head_bytes < RECORD_HEAD_BYTES {
                let (now, later) = bytes.split_at((RECORD_HEAD_BYTES - self.head_bytes).min(bytes.len()));
                self.head[self.head_bytes..][..now.len()].copy_from_slice(now);
                self.head_bytes += now.len();
                bytes = later;
                if self.head_bytes < RECORD_HEAD_BYTES {
                    return;
                }
                self.length = u64::from_le_bytes(self.head[1..].try_into().expect("eight bytes"));
                (self.body_bytes, self.body_crc) = (0, Hasher::new());
            } else {
                let now = (self.length - self.body_bytes).min(bytes.len() as u64) as usize;
                self.body(&bytes[..now]);
                bytes = &bytes[now..];
            }
            if self.body_bytes == self.length {
                match self.head[0] {
                    op::CHUNK | op::ATTACHMENT => self.piece_crc = u32::from_le_bytes(self.inner_crc),
                    op::METADATA => self.piece_crc = self.body_crc.clone().finalize(),
                    _ => {}
                }
                self.head_bytes = 0;
            }
        }
    }

    fn body(&mut self, bytes: &[u8]) {
        let crc_at = match self.head[0] {
            op::CHUNK => CHUNK_CRC_AT,
            // The checksum is last.
            op::ATTACHMENT => self.length.saturating_sub(4),
            op::METADATA => {
                self.body_crc.update(bytes);
                u64::MAX
            }
            _ => u64::MAX,
        };
        for (number, byte) in self.inner_crc.iter_mut().enumerate() {
            let place = crc_at.saturating_add(number as u64).checked_sub(self.body_bytes);
            if let Some(found) = place.and_then(|place| bytes.get(usize::try_from(place).ok()?)) {
                *byte = *found;
            }
        }
        self.body_bytes += bytes.len() as u64;
    }
}

#[cfg(test)]
mod tests {
    use mcap::records::op;

    use super::Seen;
    use crate::format::MAGIC;

    #[test]
    fn checksums_are_found_however_the_bytes_come() {
        let record =
            |opcode: u8, body: &[u8]| [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat();
        let chunk = [&[0; 24][..], &7u32.to_le_bytes(), &[9; 50]].concat();
        let attachment = [&[1; 30][..], &8u32.to_le_bytes()].concat();
        let records = [
            (record(op::HEADER, b"anything"), 0),
            (record(op::CHUNK, &chunk), 7),
            (record(op::MESSAGE_INDEX, b""), 7),
            (record(op::ATTACHMENT, &attachment), 8),
            (record(op::METADATA, b"some words"), crc32fast::hash(b"some words")),
        ];
        for step in [1, 2, 3, 7, 100] {
            let mut seen = Seen::default();
            seen.take(MAGIC);
            let mut all = MAGIC.to_vec();
            for (bytes, crc) in &records {
                bytes.chunks(step).for_each(|bytes| seen.take(bytes));
                all.extend(bytes);
                assert_eq!(seen.piece_crc, *crc, "{step} bytes at a time");
            }
            assert_eq!((seen.bytes, seen.crc.finalize()), (all.len() as u64, crc32fast::hash(&all)));
        }
    }
}
