//! Verifies the message indexes after each chunk, and the summary. Programs that read by index see
//! only what these list, so they must be complete and correct.
//!
//! Stores eight bytes per chunk, attachment and metadata record until the summary is read, and
//! sixteen bytes per message of the current chunk.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use mcap::records::{
    AttachmentIndex, ChunkHeader, ChunkIndex, Footer, MessageHeader, MessageIndex, Record, Statistics, op,
};

use crate::format::RECORD_HEAD_BYTES;
use crate::problem::LogProblem;

/// The position of a record in the file, including its head.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) at: u64,
    pub(crate) length: u64,
}

/// Verifies the index against the records of a file, including those in chunks.
#[derive(Debug, Default)]
pub(crate) struct Index {
    statistics: Statistics,
    has_messages: bool,
    /// A hash of each schema and channel.
    schemas: BTreeMap<u16, u64>,
    channels: BTreeMap<u16, u64>,
    /// Hashes of the summary's entries for chunks, attachments and metadata records, in order.
    chunks: Vec<u64>,
    attachments: Vec<u64>,
    metadata: Vec<u64>,
    chunk: Option<OpenChunk>,
    summary: Option<Summary>,
}

/// A chunk whose messages or message indexes are being read.
#[derive(Debug)]
struct OpenChunk {
    place: Place,
    header: ChunkHeader,
    bounds: Option<(u64, u64)>,
    /// Time and offset of each message, by channel.
    messages: BTreeMap<u16, Vec<(u64, u64)>>,
    indexes: BTreeMap<u16, u64>,
    index_bytes: u64,
}

/// The progress of reading the summary.
#[derive(Debug)]
struct Summary {
    start: u64,
    /// The expected schemas and channels, in order of their numbers.
    schemas: Vec<u64>,
    channels: Vec<u64>,
    /// Opcode, offset and length of each group of records of one kind.
    groups: Vec<(u8, u64, u64)>,
    offsets: Vec<(u8, u64, u64)>,
    crc: crc32fast::Hasher,
    /// Number of records of each kind.
    counts: BTreeMap<u8, usize>,
}

impl Index {
    /// Adds a schema, channel or message of the open chunk, with its offset there.
    pub(crate) fn in_chunk(&mut self, record: &Record<'_>, offset: u64) -> Result<(), LogProblem> {
        let at = self.chunk.as_ref().map_or(0, |chunk| chunk.place.at);
        match record {
            Record::Schema { header, data } => {
                let what = hash(&(header.id, &header.name, &header.encoding, data));
                announce(&mut self.schemas, header.id, what, || wrong(at, "a schema that changes"))
            }
            Record::Channel(channel) => {
                let what = hash(&channel_fields(channel));
                announce(&mut self.channels, channel.id, what, || wrong(at, "a channel that changes"))
            }
            Record::Message { header, .. } => {
                self.message(header, offset);
                Ok(())
            }
            _ => Err(wrong(at, "the chunk holds something other than schemas, channels and messages")),
        }
    }

    fn message(&mut self, header: &MessageHeader, offset: u64) {
        let time = header.log_time;
        let statistics = &mut self.statistics;
        statistics.message_count += 1;
        *statistics.channel_message_counts.entry(header.channel_id).or_insert(0) += 1;
        if !std::mem::replace(&mut self.has_messages, true) {
            (statistics.message_start_time, statistics.message_end_time) = (time, time);
        }
        statistics.message_start_time = statistics.message_start_time.min(time);
        statistics.message_end_time = statistics.message_end_time.max(time);
        if let Some(chunk) = &mut self.chunk {
            let (start, end) = chunk.bounds.unwrap_or((time, time));
            chunk.bounds = Some((start.min(time), end.max(time)));
            chunk.messages.entry(header.channel_id).or_default().push((time, offset));
        }
    }

    /// Adds a record outside chunks; `bytes` are those of the record after its length.
    pub(crate) fn take(&mut self, place: Place, record: &Record<'_>, bytes: &[u8]) -> Result<(), LogProblem> {
        if let Record::MessageIndex(index) = record {
            return self.message_index(place, index);
        }
        self.close_chunk()?;
        if self.summary.is_some() {
            return self.summarised(place, record, bytes);
        }
        match record {
            Record::Chunk { header, .. } => {
                self.statistics.chunk_count += 1;
                self.chunk = Some(OpenChunk {
                    place,
                    header: header.clone(),
                    bounds: None,
                    messages: BTreeMap::new(),
                    indexes: BTreeMap::new(),
                    index_bytes: 0,
                });
            }
            Record::Attachment { header, data, .. } => {
                self.statistics.attachment_count += 1;
                self.attachments.push(hash(&attachment_fields(&AttachmentIndex {
                    offset: place.at,
                    length: place.length,
                    log_time: header.log_time,
                    create_time: header.create_time,
                    data_size: data.len() as u64,
                    name: header.name.clone(),
                    media_type: header.media_type.clone(),
                })));
            }
            Record::Metadata(metadata) => {
                self.statistics.metadata_count += 1;
                self.metadata.push(hash(&(place.at, place.length, &metadata.name)));
            }
            Record::DataEnd(_) => {
                self.statistics.schema_count = self.schemas.len() as u16;
                self.statistics.channel_count = self.channels.len() as u32;
                self.summary = Some(Summary {
                    start: place.at + place.length,
                    schemas: self.schemas.values().copied().collect(),
                    channels: self.channels.values().copied().collect(),
                    groups: Vec::new(),
                    offsets: Vec::new(),
                    crc: crc32fast::Hasher::new(),
                    counts: BTreeMap::new(),
                });
            }
            _ => {}
        }
        Ok(())
    }

    fn message_index(&mut self, place: Place, index: &MessageIndex) -> Result<(), LogProblem> {
        let Some(chunk) = &mut self.chunk else {
            return Err(wrong(place.at, "a message index that follows no chunk"));
        };
        let listed = index.records.iter().map(|entry| (entry.log_time, entry.offset));
        let messages = chunk.messages.get(&index.channel_id);
        if !messages.is_some_and(|messages| messages.iter().copied().eq(listed)) {
            return Err(wrong(place.at, "a message index that does not list the messages of its chunk"));
        }
        if chunk.indexes.insert(index.channel_id, place.at).is_some() {
            return Err(wrong(place.at, "a second message index of the same channel"));
        }
        chunk.index_bytes += place.length;
        Ok(())
    }

    /// Ends the indexes of a chunk.
    fn close_chunk(&mut self) -> Result<(), LogProblem> {
        let Some(chunk) = self.chunk.take() else { return Ok(()) };
        let at = chunk.place.at;
        if chunk.indexes.len() != chunk.messages.len() {
            return Err(wrong(at, "the chunk lacks the message index of a channel"));
        }
        let times = (chunk.header.message_start_time, chunk.header.message_end_time);
        if times != chunk.bounds.unwrap_or((0, 0)) {
            return Err(wrong(at, "the chunk says other times than its messages"));
        }
        self.chunks.push(hash(&chunk_fields(&ChunkIndex {
            message_start_time: times.0,
            message_end_time: times.1,
            chunk_start_offset: at,
            chunk_length: chunk.place.length,
            message_index_offsets: chunk.indexes,
            message_index_length: chunk.index_bytes,
            compression: chunk.header.compression,
            compressed_size: chunk.header.compressed_size,
            uncompressed_size: chunk.header.uncompressed_size,
        })));
        Ok(())
    }

    fn summarised(&mut self, place: Place, record: &Record<'_>, bytes: &[u8]) -> Result<(), LogProblem> {
        let Some(summary) = &mut self.summary else { return Ok(()) };
        let Place { at, length } = place;
        let head = [&[record.opcode()][..], &(bytes.len() as u64).to_le_bytes()].concat();
        summary.crc.update(&head);
        if let Record::Footer(footer) = record {
            summary.crc.update(&bytes[..bytes.len() - 4]);
            return self.footer(at, footer);
        }
        summary.crc.update(bytes);
        let opcode = record.opcode();
        match summary.groups.last_mut() {
            Some((last, _, bytes)) if *last == opcode => *bytes += length,
            _ => summary.groups.push((opcode, at, length)),
        }
        let count = summary.counts.entry(opcode).or_insert(0);
        let number = *count;
        *count += 1;
        let (said, is) = match record {
            Record::Schema { header, data } => (
                Some(hash(&(header.id, &header.name, &header.encoding, data))),
                summary.schemas.get(number).copied(),
            ),
            Record::Channel(channel) => {
                (Some(hash(&channel_fields(channel))), summary.channels.get(number).copied())
            }
            Record::ChunkIndex(index) => (Some(hash(&chunk_fields(index))), self.chunks.get(number).copied()),
            Record::AttachmentIndex(index) => {
                (Some(hash(&attachment_fields(index))), self.attachments.get(number).copied())
            }
            Record::MetadataIndex(index) => {
                (Some(hash(&(index.offset, index.length, &index.name))), self.metadata.get(number).copied())
            }
            Record::Statistics(statistics) => {
                (Some(u64::from(*statistics == self.statistics)), (number == 0).then_some(1))
            }
            Record::SummaryOffset(offset) => {
                summary.offsets.push((offset.group_opcode, offset.group_start, offset.group_length));
                return Ok(());
            }
            _ => (None, None),
        };
        match (said, is) {
            (None, _) => Err(wrong(at, "a record that no summary holds")),
            (Some(_), None) => Err(wrong(at, "the summary names something that the log does not hold")),
            (said, is) if said == is => Ok(()),
            _ => Err(wrong(at, "the summary says something else than the log")),
        }
    }

    fn footer(&self, at: u64, footer: &Footer) -> Result<(), LogProblem> {
        let Some(summary) = &self.summary else { return Ok(()) };
        let expected = [
            (op::SCHEMA, self.schemas.len()),
            (op::CHANNEL, self.channels.len()),
            (op::STATISTICS, 1),
            (op::CHUNK_INDEX, self.chunks.len()),
            (op::ATTACHMENT_INDEX, self.attachments.len()),
            (op::METADATA_INDEX, self.metadata.len()),
        ];
        if expected.iter().any(|(kind, count)| summary.counts.get(kind).copied().unwrap_or(0) != *count) {
            return Err(wrong(at, "the summary does not name all that the log holds"));
        }
        let mut groups = summary.groups.clone();
        let offsets_at = match groups.pop() {
            Some((op::SUMMARY_OFFSET, start, _)) => start,
            _ => return Err(wrong(at, "the summary does not end with the places of its parts")),
        };
        if groups != summary.offsets {
            return Err(wrong(at, "the summary does not say where its parts are"));
        }
        let said = (footer.summary_start, footer.summary_offset_start, footer.summary_crc);
        if said != (summary.start, offsets_at, summary.crc.clone().finalize()) {
            return Err(wrong(at, "the footer says something else than the summary"));
        }
        Ok(())
    }
}

/// Records what an identifier refers to; a repeated one must not change.
fn announce(
    known: &mut BTreeMap<u16, u64>,
    id: u16,
    what: u64,
    changed: impl FnOnce() -> LogProblem,
) -> Result<(), LogProblem> {
    if *known.entry(id).or_insert(what) == what { Ok(()) } else { Err(changed()) }
}

fn wrong(at: u64, what: &'static str) -> LogProblem {
    LogProblem::Unsound { at, what }
}

fn hash(what: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    what.hash(&mut hasher);
    hasher.finish()
}

fn channel_fields(channel: &mcap::records::Channel) -> impl Hash + '_ {
    (channel.id, channel.schema_id, &channel.topic, &channel.message_encoding, &channel.metadata)
}

fn chunk_fields(index: &ChunkIndex) -> impl Hash + '_ {
    (
        [index.message_start_time, index.message_end_time, index.chunk_start_offset, index.chunk_length],
        &index.message_index_offsets,
        [index.message_index_length, index.compressed_size, index.uncompressed_size],
        &index.compression,
    )
}

fn attachment_fields(index: &AttachmentIndex) -> impl Hash + '_ {
    (
        [index.offset, index.length, index.log_time, index.create_time, index.data_size],
        &index.name,
        &index.media_type,
    )
}

/// The length of a record including its head.
pub(crate) fn with_head(body: usize) -> u64 {
    (RECORD_HEAD_BYTES + body) as u64
}
