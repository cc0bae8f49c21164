//! Takes a log apart and reassembles it as its writer would: chunks, indexes, statistics, counts,
//! digests and every checksum are recomputed, so that only the changes in between are wrong.

use std::collections::BTreeMap;

use mcap::records::op;

use crate::file::{self, HEAD};
use crate::parts::{Part, correct_end};

/// Compresses about as well as the writer does.
const COMPRESSION_LEVEL: i32 = 3;

/// A record of the data section, or a chunk with what is in it.
#[derive(Debug, Clone)]
pub(crate) enum Item {
    Record {
        part: Part,
        /// Whether its content is forced, and not corrected. Only metadata `chunk` is corrected.
        as_is: bool,
    },
    Chunk {
        compression: String,
        records: Vec<Part>,
    },
}

/// The contents of a log, without indexes.
#[derive(Debug, Clone)]
pub(crate) struct Log {
    pub(crate) items: Vec<Item>,
    /// Whether it was closed: data end, summary, footer.
    closed: bool,
}

/// The records of a file in their order, open to changes before the rest is adjusted.
#[derive(Debug, Clone)]
pub(crate) struct Records {
    /// Each with whether its content is forced.
    pub(crate) parts: Vec<(Part, bool)>,
    closed: bool,
}

impl Log {
    /// Takes a log apart. An unfinished one may end in the middle of a record, which is left out.
    pub(crate) fn read(bytes: &[u8]) -> Result<Log, String> {
        let mut items = Vec::new();
        let mut closed = false;
        for record in file::records(bytes) {
            match record.opcode {
                op::MESSAGE_INDEX => {}
                op::DATA_END => {
                    closed = true;
                    break;
                }
                op::CHUNK => {
                    let body = record.body(bytes);
                    let compression = file::chunk(body).map_or("", |chunk| chunk.compression).to_owned();
                    items.push(Item::Chunk { compression, records: file::opened(body)? });
                }
                _ => items.push(Item::Record { part: record.part(bytes), as_is: false }),
            }
        }
        Ok(Log { items, closed })
    }

    /// Makes `run_end` agree with the messages: counts and digests.
    pub(crate) fn correct_end(&mut self) {
        let mut flat = Vec::new();
        for item in &self.items {
            match item {
                Item::Record { part, .. } => flat.push(part.clone()),
                Item::Chunk { records, .. } => flat.extend(records.iter().cloned()),
            }
        }
        correct_end(&mut flat);
        let corrected = flat.into_iter().rfind(|part| part.name() == Some("run_end"));
        let ours = self.items.iter_mut().rev().find_map(|item| match item {
            Item::Record { part, .. } if part.name() == Some("run_end") => Some(part),
            _ => None,
        });
        if let (Some(ours), Some(corrected)) = (ours, corrected) {
            *ours = corrected;
        }
    }

    /// Positions of all records in their order: the index of the item and, in a chunk, the index there.
    pub(crate) fn places(&self) -> Vec<(usize, Option<usize>)> {
        let mut places = Vec::new();
        for (at, item) in self.items.iter().enumerate() {
            match item {
                Item::Record { .. } => places.push((at, None)),
                Item::Chunk { records, .. } => {
                    places.extend((0..records.len()).map(|inner| (at, Some(inner))));
                }
            }
        }
        places
    }

    /// The record at a place.
    pub(crate) fn at(&self, place: (usize, Option<usize>)) -> Option<&Part> {
        match (self.items.get(place.0)?, place.1) {
            (Item::Record { part, .. }, None) => Some(part),
            (Item::Chunk { records, .. }, Some(inner)) => records.get(inner),
            _ => None,
        }
    }

    /// The record at a place, to be changed.
    pub(crate) fn at_mut(&mut self, place: (usize, Option<usize>)) -> Option<&mut Part> {
        match (self.items.get_mut(place.0)?, place.1) {
            (Item::Record { part, .. }, None) => Some(part),
            (Item::Chunk { records, .. }, Some(inner)) => records.get_mut(inner),
            _ => None,
        }
    }

    /// Its records in final form, with chunks packed and indexed.
    pub(crate) fn packed(&self) -> Result<Records, String> {
        let mut parts = Vec::new();
        for item in &self.items {
            match item {
                Item::Record { part, as_is } => parts.push((part.clone(), *as_is)),
                Item::Chunk { compression, records } => {
                    let (chunk, indexes) = pack(compression, records)?;
                    parts.push((chunk, false));
                    parts.extend(indexes.into_iter().map(|index| (index, false)));
                }
            }
        }
        Ok(Records { parts, closed: self.closed })
    }

    /// The file as far as its data go, as of a run that was not yet done.
    pub(crate) fn unfinished_bytes(&self) -> Result<Vec<u8>, String> {
        let records = Records { closed: false, ..self.packed()? };
        Ok(records.sealed())
    }

    /// The file.
    pub(crate) fn bytes(&self) -> Result<Vec<u8>, String> {
        Ok(seal(self.packed()?.with_summary()))
    }
}

/// A chunk of these records, and where each channel's messages are in it.
fn pack(compression: &str, records: &[Part]) -> Result<(Part, Vec<Part>), String> {
    let mut unpacked = Vec::new();
    let mut times: Vec<u64> = Vec::new();
    let mut entries: BTreeMap<u16, Vec<u8>> = BTreeMap::new();
    for part in records {
        if let (op::MESSAGE, Some(id)) = (part.opcode, part.channel_id()) {
            let time = part.body.get(6..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default();
            times.push(u64::from_le_bytes(time));
            let entry = entries.entry(id).or_default();
            entry.extend(time);
            entry.extend((unpacked.len() as u64).to_le_bytes());
        }
        part.put(&mut unpacked);
    }
    let packed = match compression {
        "zstd" => zstd::bulk::compress(&unpacked, COMPRESSION_LEVEL).map_err(|error| error.to_string())?,
        _ => unpacked.clone(),
    };
    let crc = crc32fast::hash(&unpacked);
    let mut chunk = Part::chunk_of(unpacked.len() as u64, crc, compression, packed.len() as u64, &packed);
    chunk.body[..8].copy_from_slice(&times.iter().min().copied().unwrap_or(0).to_le_bytes());
    chunk.body[8..16].copy_from_slice(&times.iter().max().copied().unwrap_or(0).to_le_bytes());
    let index = |(id, entries): (u16, Vec<u8>)| {
        let mut body = id.to_le_bytes().to_vec();
        body.extend((entries.len() as u32).to_le_bytes());
        body.extend(entries);
        Part::new(op::MESSAGE_INDEX, body)
    };
    Ok((chunk, entries.into_iter().map(index).collect()))
}

impl Records {
    /// The records of a file up to the end of the data, with chunks unopened.
    pub(crate) fn as_they_are(bytes: &[u8]) -> Records {
        let records = file::records(bytes);
        let end = records.iter().position(|record| record.opcode == op::DATA_END);
        let data = &records[..end.unwrap_or(records.len())];
        // Metadata `chunk` too, which would seal other bytes.
        let parts = data.iter().map(|record| (record.part(bytes), true)).collect();
        Records { parts, closed: end.is_some() }
    }

    /// The file of them, with a right summary.
    pub(crate) fn sealed(self) -> Vec<u8> {
        seal(self.with_summary())
    }

    /// The records with right metadata `chunk`, and, if the log was closed, with data end,
    /// summary and footer.
    pub(crate) fn with_summary(mut self) -> Vec<Part> {
        self.chain();
        let Records { parts, closed, .. } = self;
        let mut parts: Vec<Part> = parts.into_iter().map(|(part, _)| part).collect();
        if closed {
            let summary = summary(&parts);
            parts.push(Part::new(op::DATA_END, [0; 4]));
            parts.extend(summary);
            parts.push(Part::new(op::FOOTER, [0; 20]));
            correct_offsets(&mut parts);
        }
        parts
    }

    /// Corrects every metadata `chunk` to describe the piece of the log before it (a chunk with its
    /// indexes, an attachment or other metadata), and the number of bytes.
    pub(crate) fn chain(&mut self) {
        let mut bytes = mcap::MAGIC.len() as u64;
        let mut all = crc32fast::Hasher::new();
        all.update(mcap::MAGIC);
        let (mut number, mut piece, mut before) = (0u64, 0u32, 0u32);
        for (part, as_is) in &mut self.parts {
            if let Some(mut map) = chunk_map(part) {
                if !*as_is {
                    for (key, value) in [
                        ("number", number.to_string()),
                        ("crc", format!("{piece:08x}")),
                        ("before_crc", format!("{before:08x}")),
                        ("bytes", bytes.to_string()),
                        ("bytes_crc", format!("{:08x}", all.clone().finalize())),
                    ] {
                        // Fields that the format version lacks are not added.
                        if let Some(old) = map.get_mut(key) {
                            *old = value;
                        }
                    }
                    *part = Part::metadata("chunk", &map);
                }
                number += 1;
                before = piece;
            } else {
                piece = match part.opcode {
                    op::CHUNK => file::chunk(&part.body).map_or(0, |chunk| chunk.crc),
                    op::ATTACHMENT => part.body.last_chunk().map_or(0, |crc| u32::from_le_bytes(*crc)),
                    op::METADATA => crc32fast::hash(&part.body),
                    _ => piece,
                };
            }
            let mut put = Vec::new();
            part.put(&mut put);
            bytes += put.len() as u64;
            all.update(&put);
        }
    }
}

fn chunk_map(part: &Part) -> Option<BTreeMap<String, String>> {
    part.map().filter(|_| part.name() == Some("chunk"))
}

/// The summary of the records of the data section, each of which begins after the previous ones.
fn summary(parts: &[Part]) -> Vec<Part> {
    let mut at = mcap::MAGIC.len() as u64;
    let mut announced: BTreeMap<(u8, u16), Part> = BTreeMap::new();
    let mut counts: BTreeMap<u16, u64> = BTreeMap::new();
    let (mut times, mut chunks) = (Vec::new(), Vec::new());
    let (mut attachments, mut metadata) = (Vec::new(), Vec::new());
    let mut take = |part: &Part| match (part.opcode, part.body.first_chunk()) {
        (op::SCHEMA | op::CHANNEL, Some(id)) => {
            announced.insert((part.opcode, u16::from_le_bytes(*id)), part.clone());
        }
        (op::MESSAGE, Some(id)) => {
            *counts.entry(u16::from_le_bytes(*id)).or_insert(0) += 1;
            let time = part.body.get(6..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default();
            times.push(u64::from_le_bytes(time));
        }
        _ => {}
    };
    for (number, part) in parts.iter().enumerate() {
        let length = (part.body.len() + HEAD) as u64;
        match part.opcode {
            op::CHUNK => {
                file::opened(&part.body).unwrap_or_default().iter().for_each(&mut take);
                chunks.push(chunk_index(&parts[number..], at));
            }
            op::ATTACHMENT => attachments.push(attachment_index(part, at, length)),
            op::METADATA => {
                let mut body = [at.to_le_bytes(), length.to_le_bytes()].concat();
                put_text(&mut body, part.name().unwrap_or_default());
                metadata.push(Part::new(op::METADATA_INDEX, body));
            }
            _ => take(part),
        }
        at += length;
    }
    let mut statistics = counts.values().sum::<u64>().to_le_bytes().to_vec();
    let kinds = |opcode: u8| announced.keys().filter(|(kind, _)| *kind == opcode).count() as u32;
    statistics.extend((kinds(op::SCHEMA) as u16).to_le_bytes());
    for count in [kinds(op::CHANNEL), attachments.len() as u32, metadata.len() as u32, chunks.len() as u32] {
        statistics.extend(count.to_le_bytes());
    }
    for time in [times.iter().min(), times.iter().max()] {
        statistics.extend(time.copied().unwrap_or(0).to_le_bytes());
    }
    statistics.extend((counts.len() as u32 * 10).to_le_bytes());
    for (id, count) in counts {
        statistics.extend(id.to_le_bytes());
        statistics.extend(count.to_le_bytes());
    }
    let mut summary: Vec<Part> = announced.into_values().collect();
    summary.sort_by_key(|part| part.opcode);
    summary.push(Part::new(op::STATISTICS, statistics));
    summary.extend(chunks);
    summary.extend(attachments);
    summary.extend(metadata);
    summary
}

/// Corrects the records with the offsets of the groups of the summary.
pub(crate) fn correct_offsets(parts: &mut Vec<Part>) {
    parts.retain(|part| part.opcode != op::SUMMARY_OFFSET);
    let Some(data_end) = parts.iter().position(|part| part.opcode == op::DATA_END) else { return };
    let length = |part: &Part| (part.body.len() + HEAD) as u64;
    let mut at = mcap::MAGIC.len() as u64 + parts[..=data_end].iter().map(length).sum::<u64>();
    let mut offsets = Vec::new();
    for group in parts[data_end + 1..].chunk_by(|a, b| a.opcode == b.opcode) {
        let long = group.iter().map(length).sum::<u64>();
        if group[0].opcode != op::FOOTER {
            let mut body = vec![group[0].opcode];
            body.extend(at.to_le_bytes());
            body.extend(long.to_le_bytes());
            offsets.push(Part::new(op::SUMMARY_OFFSET, body));
        }
        at += long;
    }
    let footer = parts.iter().position(|part| part.opcode == op::FOOTER).unwrap_or(parts.len());
    parts.splice(footer..footer, offsets);
}

/// The index of the first chunk, at that byte, with the indexes of its messages after it.
fn chunk_index(parts: &[Part], at: u64) -> Part {
    let chunk = &parts[0];
    let length = (chunk.body.len() + HEAD) as u64;
    let mut body = chunk.body.get(..16).unwrap_or_default().to_vec();
    body.extend(at.to_le_bytes());
    body.extend(length.to_le_bytes());
    let mut offsets = Vec::new();
    let mut end = at + length;
    for index in parts[1..].iter().take_while(|part| part.opcode == op::MESSAGE_INDEX) {
        offsets.extend(index.body.get(..2).unwrap_or_default());
        offsets.extend(end.to_le_bytes());
        end += (index.body.len() + HEAD) as u64;
    }
    body.extend((offsets.len() as u32).to_le_bytes());
    body.extend(offsets);
    body.extend((end - at - length).to_le_bytes());
    if let Some(fields) = file::chunk(&chunk.body) {
        put_text(&mut body, fields.compression);
        body.extend((fields.records.len() as u64).to_le_bytes());
        body.extend(fields.size.to_le_bytes());
    }
    Part::new(op::CHUNK_INDEX, body)
}

fn attachment_index(part: &Part, at: u64, length: u64) -> Part {
    let mut body = [at.to_le_bytes(), length.to_le_bytes()].concat();
    body.extend(part.body.get(..16).unwrap_or_default());
    body.extend((part.attached().map_or(0, <[u8]>::len) as u64).to_le_bytes());
    let name = part.name().unwrap_or_default();
    put_text(&mut body, name);
    let media_type = part.body.get(16 + 4 + name.len()..).unwrap_or_default();
    let media_type_length = media_type.first_chunk().map_or(0, |length| u32::from_le_bytes(*length)) as usize;
    body.extend(media_type.get(..4 + media_type_length).unwrap_or_default());
    Part::new(op::ATTACHMENT_INDEX, body)
}

/// A text behind its length.
pub(crate) fn put_text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

/// The file of these records: positions and checksums in data end and footer are corrected, whatever else
/// is wrong.
pub(crate) fn seal(parts: Vec<Part>) -> Vec<u8> {
    let mut out = mcap::MAGIC.to_vec();
    let (mut summary_at, mut offsets_at) = (0, 0);
    let mut in_summary = false;
    for mut part in parts {
        match part.opcode {
            op::DATA_END => {
                let crc = crc32fast::hash(&out);
                part.body = crc.to_le_bytes().to_vec();
            }
            op::FOOTER => {
                part.body =
                    [u64::to_le_bytes(summary_at as u64), u64::to_le_bytes(offsets_at as u64)].concat();
                part.body.extend([0; 4]);
                let from = if summary_at == 0 { out.len() } else { summary_at };
                let mut covered = out[from..].to_vec();
                part.put(&mut covered);
                covered.truncate(covered.len() - 4);
                let crc = crc32fast::hash(&covered);
                part.body.truncate(16);
                part.body.extend(crc.to_le_bytes());
                part.put(&mut out);
                out.extend(mcap::MAGIC);
                continue;
            }
            op::SUMMARY_OFFSET if in_summary && offsets_at == 0 => offsets_at = out.len(),
            _ => {}
        }
        part.put(&mut out);
        if part.opcode == op::DATA_END {
            in_summary = true;
            summary_at = out.len();
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{Item, Log};
    use crate::file;

    fn genuine() -> Vec<u8> {
        let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/logs/v2/complete.mcap");
        std::fs::read(&log).unwrap_or_else(|error| panic!("{}: {error}", log.display()))
    }

    /// Reading by index with the MCAP library and reading from front to end give equal results.
    fn assert_indexed(bytes: &[u8]) {
        let all = file::messages(bytes).expect("the log can be read");
        let summary = mcap::Summary::read(bytes).expect("the summary can be read").expect("there is one");
        let statistics = summary.stats.as_ref().expect("it has statistics");
        assert_eq!(statistics.message_count, all.len() as u64);
        assert_eq!(statistics.chunk_count as usize, file::chunks(bytes).len());
        let mut indexed = 0;
        for chunk in &summary.chunk_indexes {
            for (channel, entries) in summary.read_message_indexes(bytes, chunk).expect("indexes can be read")
            {
                for entry in entries {
                    let message = summary.seek_message(bytes, chunk, &entry).expect("there is a message");
                    assert_eq!((message.log_time, message.channel.id), (entry.log_time, channel.id));
                    indexed += 1;
                }
            }
        }
        assert_eq!(indexed, all.len());
        mcap::MessageStream::new(bytes)
            .expect("it is MCAP")
            .for_each(|message| drop(message.expect("it is sound")));
    }

    #[test]
    fn what_is_put_together_again_says_the_same_and_is_indexed() {
        let bytes = genuine();
        assert_indexed(&bytes);
        let again = Log::read(&bytes).expect("the log can be read").bytes().expect("it can be packed");
        assert_indexed(&again);
        assert_eq!(file::messages(&bytes), file::messages(&again));
    }

    #[test]
    fn a_change_is_all_that_is_wrong() {
        let mut log = Log::read(&genuine()).expect("the log can be read");
        let chunk = log.items.iter_mut().find_map(|item| match item {
            Item::Chunk { records, .. } => Some(records),
            Item::Record { .. } => None,
        });
        let records = chunk.expect("it has a chunk");
        let last = records.iter().rposition(|part| part.payload().is_some()).expect("it has messages");
        records.remove(last);
        log.correct_end();
        let bytes = log.bytes().expect("it can be packed");
        assert_indexed(&bytes);
        let end = file::metadata(&bytes, "run_end").expect("it has an end");
        let counted: usize = end
            .iter()
            .filter(|(key, _)| key.starts_with("messages:"))
            .map(|(_, count)| count.parse::<usize>().expect("a count"))
            .sum();
        assert_eq!(counted, file::messages(&bytes).expect("it can be read").len());
    }
}
