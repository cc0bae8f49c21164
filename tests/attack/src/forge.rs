//! Takes a log apart and puts it together again with counts, digests and checksums recomputed, so that only the
//! changes in between are wrong. Without indexes and summary, which readers of logs do not need.

use mcap::records::op;

use crate::file;
use crate::parts::{Part, correct_end};

/// Compresses about as well as the writer does.
const COMPRESSION_LEVEL: i32 = 3;

/// A record of the data section, or a chunk with what is in it.
#[derive(Debug, Clone)]
pub(crate) enum Item {
    Record(Part),
    Chunk { compression: String, records: Vec<Part> },
}

/// The contents of a log, without indexes.
#[derive(Debug, Clone)]
pub(crate) struct Log {
    pub(crate) items: Vec<Item>,
}

impl Log {
    /// Takes a log apart. An unfinished one may end in the middle of a record, which is left out.
    pub(crate) fn read(bytes: &[u8]) -> Result<Log, String> {
        let mut items = Vec::new();
        for record in file::records(bytes).into_iter().take_while(|record| record.opcode != op::DATA_END) {
            match record.opcode {
                op::MESSAGE_INDEX => {}
                op::CHUNK => {
                    let body = record.body(bytes);
                    let compression = file::chunk(body).map_or("", |chunk| chunk.compression).to_owned();
                    items.push(Item::Chunk { compression, records: file::opened(body)? });
                }
                _ => items.push(Item::Record(record.part(bytes))),
            }
        }
        Ok(Log { items })
    }

    /// Makes `run_end` agree with the messages: counts and digests.
    pub(crate) fn correct_end(&mut self) {
        let mut flat = Vec::new();
        for item in &self.items {
            match item {
                Item::Record(part) => flat.push(part.clone()),
                Item::Chunk { records, .. } => flat.extend(records.iter().cloned()),
            }
        }
        correct_end(&mut flat);
        let corrected = flat.into_iter().rfind(|part| part.name() == Some("run_end"));
        if let (Some(ours), Some(corrected)) = (self.named("run_end"), corrected) {
            *ours = corrected;
        }
    }

    /// The first metadata or attachment of that name.
    pub(crate) fn named(&mut self, name: &str) -> Option<&mut Part> {
        self.items.iter_mut().find_map(|item| match item {
            Item::Record(part) if part.name() == Some(name) => Some(part),
            _ => None,
        })
    }

    /// All records in chunks.
    pub(crate) fn in_chunks(&mut self) -> impl Iterator<Item = &mut Part> {
        self.items
            .iter_mut()
            .filter_map(|item| match item {
                Item::Chunk { records, .. } => Some(records),
                Item::Record(_) => None,
            })
            .flatten()
    }

    /// The file as far as its data go, as of a run that was not yet done.
    pub(crate) fn unfinished_bytes(&self) -> Result<Vec<u8>, String> {
        let mut bytes = mcap::MAGIC.to_vec();
        for item in &self.items {
            match item {
                Item::Record(part) => part.put(&mut bytes),
                Item::Chunk { compression, records } => pack(compression, records)?.put(&mut bytes),
            }
        }
        Ok(bytes)
    }

    /// The file.
    pub(crate) fn bytes(&self) -> Result<Vec<u8>, String> {
        Ok(closed(self.unfinished_bytes()?))
    }
}

/// A file of these data, with their checksum.
pub(crate) fn closed(mut data: Vec<u8>) -> Vec<u8> {
    let crc = crc32fast::hash(&data);
    Part::new(op::DATA_END, crc.to_le_bytes()).put(&mut data);
    Part::new(op::FOOTER, [0; 20]).put(&mut data);
    data.extend(mcap::MAGIC);
    data
}

fn pack(compression: &str, records: &[Part]) -> Result<Part, String> {
    let mut unpacked = Vec::new();
    records.iter().for_each(|part| part.put(&mut unpacked));
    let packed = match compression {
        "zstd" => zstd::bulk::compress(&unpacked, COMPRESSION_LEVEL).map_err(|error| error.to_string())?,
        _ => unpacked.clone(),
    };
    let crc = crc32fast::hash(&unpacked);
    Ok(Part::chunk_of(unpacked.len() as u64, crc, compression, packed.len() as u64, &packed))
}

/// A text behind its length.
pub(crate) fn put_text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}
