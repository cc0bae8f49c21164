//! Run logs as plain MCAP files, read independently of the attacked code, as far as the bytes allow.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use mcap::records::op;

use super::parts::Part;

/// Opcode and length, before every record.
pub const HEAD: usize = 9;

/// No chunk of a genuine log unpacks to more.
const LONGEST_CHUNK: usize = 1 << 26;

/// A record in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    pub opcode: u8,
    /// Its bytes in the file, including its head.
    pub at: Range<usize>,
}

impl Record {
    /// Its content after the head.
    pub fn body<'a>(&self, bytes: &'a [u8]) -> &'a [u8] {
        &bytes[self.at.start + HEAD..self.at.end]
    }

    /// The record by itself.
    pub fn part(&self, bytes: &[u8]) -> Part {
        Part::new(self.opcode, self.body(bytes))
    }
}

/// The records of a file, to where the bytes end or make none.
pub fn records(bytes: &[u8]) -> Vec<Record> {
    let mut found = Vec::new();
    let mut at = mcap::MAGIC.len();
    while let Some(head) = bytes.get(at..at + HEAD) {
        let length = head[1..].first_chunk().map_or(0, |length| u64::from_le_bytes(*length));
        let end = usize::try_from(length).ok().and_then(|length| (at + HEAD).checked_add(length));
        let Some(end) = end.filter(|end| *end <= bytes.len()) else { break };
        found.push(Record { opcode: head[0], at: at..end });
        at = end;
        if head[0] == op::FOOTER {
            break;
        }
    }
    found
}

/// Those that are chunks.
pub fn chunks(bytes: &[u8]) -> Vec<Record> {
    records(bytes).into_iter().filter(|record| record.opcode == op::CHUNK).collect()
}

/// A chunk's own fields.
#[derive(Debug, Clone)]
pub struct Chunk<'a> {
    pub crc: u32,
    pub compression: &'a str,
    pub size: u64,
    pub records: &'a [u8],
}

/// Reads a chunk's fields.
pub fn chunk(body: &[u8]) -> Option<Chunk<'_>> {
    let size = u64::from_le_bytes(*body.get(16..)?.first_chunk()?);
    let crc = u32::from_le_bytes(*body.get(24..)?.first_chunk()?);
    let length = u32::from_le_bytes(*body.get(28..)?.first_chunk()?) as usize;
    let compression = std::str::from_utf8(body.get(32..32 + length)?).ok()?;
    Some(Chunk { crc, compression, size, records: body.get(32 + length + 8..)? })
}

/// The records in a chunk, its checksum compared.
pub fn opened(body: &[u8]) -> Result<Vec<Part>, String> {
    let chunk = chunk(body).ok_or("a chunk too short for its own fields")?;
    let size = usize::try_from(chunk.size).unwrap_or(usize::MAX).min(LONGEST_CHUNK);
    let unpacked = match chunk.compression {
        "" => chunk.records.to_vec(),
        "zstd" => zstd::bulk::decompress(chunk.records, size).map_err(|error| format!("a chunk: {error}"))?,
        other => return Err(format!("a chunk compressed as {other:?}")),
    };
    if crc32fast::hash(&unpacked) != chunk.crc {
        return Err("a chunk whose checksum is wrong".to_owned());
    }
    let mut parts = Vec::new();
    let mut rest = unpacked.as_slice();
    while let Some((head, behind)) = rest.split_first_chunk::<HEAD>() {
        let length = head[1..].first_chunk().map_or(0, |length| u64::from_le_bytes(*length));
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let body = behind.get(..length).ok_or("a record longer than its chunk")?;
        parts.push(Part::new(head[0], body));
        rest = &behind[length..];
    }
    Ok(parts)
}

/// A message, as every reader sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    pub topic: Arc<str>,
    pub sequence: u32,
    pub time_ns: u64,
    pub payload: Vec<u8>,
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let payload: String = String::from_utf8_lossy(&self.payload).chars().take(120).collect();
        write!(f, "{} {} at {} ns: {payload}", self.topic, self.sequence, self.time_ns)
    }
}

/// The messages of a file in their order, each with the number of its chunk.
pub fn messages(bytes: &[u8]) -> Result<Vec<(usize, Message)>, String> {
    let mut topics: BTreeMap<u16, Arc<str>> = BTreeMap::new();
    let mut found = Vec::new();
    let mut number = 0;
    for record in records(bytes) {
        let parts = match record.opcode {
            op::CHUNK => opened(record.body(bytes))?,
            op::CHANNEL | op::MESSAGE => vec![record.part(bytes)],
            _ => continue,
        };
        for part in parts {
            match (part.opcode, part.channel_id()) {
                (op::CHANNEL, Some(id)) => {
                    topics.insert(id, part.name().unwrap_or_default().into());
                }
                (op::MESSAGE, Some(id)) => {
                    let topic = topics.get(&id).ok_or("a message of a channel that nothing announced")?;
                    let message = message(&part, topic).ok_or("a message too short for its own fields")?;
                    found.push((number, message));
                }
                _ => {}
            }
        }
        number += usize::from(record.opcode == op::CHUNK);
    }
    Ok(found)
}

fn message(part: &Part, topic: &Arc<str>) -> Option<Message> {
    Some(Message {
        topic: Arc::clone(topic),
        sequence: u32::from_le_bytes(*part.body.get(2..)?.first_chunk()?),
        time_ns: u64::from_le_bytes(*part.body.get(6..)?.first_chunk()?),
        payload: part.payload()?.to_vec(),
    })
}

/// The difference of two sequences of messages, in words; `None` if they agree.
pub fn difference(expected: &[&Message], found: &[&Message]) -> Option<String> {
    let same = expected.iter().zip(found).take_while(|(a, b)| a == b).count();
    if same == expected.len() && same == found.len() {
        return None;
    }
    let show = |message: Option<&&Message>| message.map_or("nothing".to_owned(), ToString::to_string);
    Some(format!(
        "{} messages, not {}; message {same} is {}, not {}",
        found.len(),
        expected.len(),
        show(found.get(same)),
        show(expected.get(same))
    ))
}
