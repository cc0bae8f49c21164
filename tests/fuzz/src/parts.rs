//! Disassembles a log into its MCAP records and reassembles it with correct lengths and checksums, however
//! wrong the rest is: damage that a checksum detects never reaches the layers behind it.

use std::collections::BTreeMap;

use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};

/// How long a message's head is: channel, sequence, two times.
pub const MESSAGE_HEAD: usize = 2 + 4 + 8 + 8;

/// One record: its opcode, and its content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its kind.
    pub opcode: u8,
    /// Its content.
    pub body: Vec<u8>,
}

impl Part {
    /// Any record.
    pub fn new(opcode: u8, body: impl Into<Vec<u8>>) -> Part {
        Part { opcode, body: body.into() }
    }

    /// A metadata record; a header without its checksum, as in earlier logs, so that it is judged by what it says.
    pub fn metadata(name: &str, map: &BTreeMap<String, String>) -> Part {
        let mut body = Vec::new();
        put_text(&mut body, name);
        let mut pairs = Vec::new();
        for (key, value) in map.iter().filter(|(key, _)| *key != "crc32") {
            put_text(&mut pairs, key);
            put_text(&mut pairs, value);
        }
        body.extend((pairs.len() as u32).to_le_bytes());
        body.extend(pairs);
        Part::new(op::METADATA, body)
    }

    /// An attachment, its checksum right.
    pub fn attachment(name: &str, data: &[u8]) -> Part {
        let mut body = vec![0; 16];
        put_text(&mut body, name);
        put_text(&mut body, "");
        body.extend((data.len() as u64).to_le_bytes());
        body.extend(data);
        let crc = crc32fast::hash(&body);
        body.extend(crc.to_le_bytes());
        Part::new(op::ATTACHMENT, body)
    }

    /// A channel of JSON messages.
    pub fn channel(id: u16, schema: u16, topic: &str) -> Part {
        let mut body = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        put_text(&mut body, topic);
        put_text(&mut body, "json");
        body.extend(0u32.to_le_bytes());
        Part::new(op::CHANNEL, body)
    }

    /// A message.
    pub fn message(channel: u16, sequence: u32, time_ns: u64, payload: &[u8]) -> Part {
        let mut body = channel.to_le_bytes().to_vec();
        body.extend(sequence.to_le_bytes());
        body.extend(time_ns.to_le_bytes());
        body.extend(time_ns.to_le_bytes());
        body.extend(payload);
        Part::new(op::MESSAGE, body)
    }

    /// A chunk of these records without compression, with the correct checksum.
    pub fn chunk(parts: &[Part]) -> Part {
        let mut records = Vec::new();
        parts.iter().for_each(|part| part.put(&mut records));
        let crc = crc32fast::hash(&records);
        Part::chunk_of(records.len() as u64, crc, "", records.len() as u64, &records)
    }

    /// A chunk with the given header.
    pub fn chunk_of(uncompressed: u64, crc: u32, compression: &str, compressed: u64, records: &[u8]) -> Part {
        let mut body = vec![0; 16];
        body.extend(uncompressed.to_le_bytes());
        body.extend(crc.to_le_bytes());
        put_text(&mut body, compression);
        body.extend(compressed.to_le_bytes());
        body.extend(records);
        Part::new(op::CHUNK, body)
    }

    /// The name of a metadata record, the topic of a channel.
    pub fn name(&self) -> Option<&str> {
        let at = match self.opcode {
            op::METADATA => 0,
            op::CHANNEL => 4,
            op::ATTACHMENT => 16,
            _ => return None,
        };
        text_at(&self.body, at).map(|(text, _)| text)
    }

    /// The map of a metadata record.
    pub fn map(&self) -> Option<BTreeMap<String, String>> {
        let (_, end) = text_at(&self.body, 0).filter(|_| self.opcode == op::METADATA)?;
        let mut at = end + 4;
        let mut map = BTreeMap::new();
        while at < self.body.len() {
            let (key, behind_key) = text_at(&self.body, at)?;
            let (value, behind_value) = text_at(&self.body, behind_key)?;
            map.insert(key.to_owned(), value.to_owned());
            at = behind_value;
        }
        Some(map)
    }

    /// The channel of a message or of the record that announces one.
    pub fn channel_id(&self) -> Option<u16> {
        let known = self.opcode == op::MESSAGE || self.opcode == op::CHANNEL;
        Some(u16::from_le_bytes(self.body.get(..2).filter(|_| known)?.try_into().ok()?))
    }

    /// The content of an attachment.
    pub fn attached(&self) -> Option<&[u8]> {
        let (_, name_end) = text_at(&self.body, 16).filter(|_| self.opcode == op::ATTACHMENT)?;
        let (_, type_end) = text_at(&self.body, name_end)?;
        self.body.get(type_end + 8..self.body.len().checked_sub(4)?)
    }

    /// The content of a message.
    pub fn payload(&self) -> Option<&[u8]> {
        self.body.get(MESSAGE_HEAD..).filter(|_| self.opcode == op::MESSAGE)
    }

    /// The record with another payload.
    #[must_use]
    pub fn with_payload(&self, payload: &[u8]) -> Part {
        Part::new(self.opcode, [&self.body[..MESSAGE_HEAD], payload].concat())
    }

    /// Appends it in the format of a file.
    pub fn put(&self, out: &mut Vec<u8>) {
        out.push(self.opcode);
        out.extend((self.body.len() as u64).to_le_bytes());
        out.extend(&self.body);
    }
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

/// A text and where it ends.
fn text_at(body: &[u8], at: usize) -> Option<(&str, usize)> {
    let length = u32::from_le_bytes(body.get(at..at.checked_add(4)?)?.try_into().ok()?) as usize;
    let end = (at + 4).checked_add(length)?;
    Some((std::str::from_utf8(body.get(at + 4..end)?).ok()?, end))
}

/// The records of a whole log up to the end of its data, those in chunks one by one.
///
/// # Panics
/// If it is no whole log.
pub fn take_apart(bytes: &[u8]) -> Vec<Part> {
    let mut reader = LinearReader::new();
    let mut rest = bytes;
    let mut parts = Vec::new();
    loop {
        match reader.next_event().expect("a whole log has an end of its data").expect("the log is whole") {
            LinearReadEvent::ReadRequest(wanted) => {
                let (now, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { opcode: op::DATA_END, .. } => return parts,
            LinearReadEvent::Record { opcode: op::MESSAGE_INDEX, .. } => {}
            LinearReadEvent::Record { opcode, data } => parts.push(Part::new(opcode, data)),
        }
    }
}

/// Corrects the counts, switches and digests of messages in `run_end`.
pub fn correct_end(parts: &mut [Part]) {
    let mut topics: BTreeMap<u16, String> = BTreeMap::new();
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut digest = blake3::Hasher::new();
    let mut digests: BTreeMap<String, blake3::Hasher> = BTreeMap::new();
    for part in parts.iter() {
        match (part.opcode, part.channel_id()) {
            (op::CHANNEL, Some(id)) => {
                let topic = part.name().unwrap_or_default().to_owned();
                counts.entry(topic.clone()).or_insert(0);
                digests.entry(topic.clone()).or_default();
                topics.insert(id, topic);
            }
            (op::MESSAGE, Some(id)) => {
                let topic = topics.get(&id).cloned().unwrap_or_default();
                let payload = part.payload().unwrap_or_default();
                for digest in [&mut digest, digests.entry(topic.clone()).or_default()] {
                    for bytes in [topic.as_bytes(), payload] {
                        digest.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
                    }
                }
                *counts.entry(topic).or_insert(0) += 1;
            }
            _ => {}
        }
    }
    for part in parts {
        let Some(mut map) = part.map().filter(|_| part.name() == Some("run_end")) else { continue };
        map.retain(|key, _| !key.starts_with("messages:") && !key.starts_with("digest:"));
        map.insert("switches".to_owned(), counts.get("/switch").unwrap_or(&0).to_string());
        map.insert("digest".to_owned(), digest.finalize().to_hex().to_string());
        map.extend(counts.iter().map(|(topic, count)| (format!("messages:{topic}"), count.to_string())));
        map.extend(
            digests
                .iter()
                .map(|(topic, digest)| (format!("digest:{topic}"), digest.finalize().to_hex().to_string())),
        );
        *part = Part::metadata("run_end", &map);
    }
}

/// The beginning of a log as a whole log: up to the first step after that many messages from which
/// all blocks stick. None if it has no such step.
pub fn beginning(parts: &[Part], messages: usize) -> Option<Vec<Part>> {
    let topics: BTreeMap<u16, &str> = parts
        .iter()
        .filter(|part| part.opcode == op::CHANNEL)
        .filter_map(|part| Some((part.channel_id()?, part.name()?)))
        .collect();
    let number = |part: &Part, key: &str| -> Option<u64> {
        serde_json::from_slice::<serde_json::Value>(part.payload()?).ok()?[key].as_u64()
    };
    let topic = |part: &Part| part.channel_id().and_then(|id| topics.get(&id).copied()).unwrap_or_default();
    let first = parts.iter().position(|part| part.opcode == op::MESSAGE)?;
    // A step without sliding or switches that is followed by a step.
    let end = (first + messages..parts.len()).find(|&at| {
        topic(&parts[at]) == "/step"
            && number(&parts[at], "sliding") == Some(0)
            && number(&parts[at], "switches") == Some(0)
            && parts.get(at + 1).is_some_and(|next| topic(next) == "/step")
    })?;
    let last: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(parts[end].payload()?).ok()?;
    let last_step = last["step"].to_string();
    let mut own = parts[..=end].to_vec();
    own.extend(parts.iter().filter(|part| part.name() == Some("run_end")).cloned());
    for part in &mut own {
        for (record, key) in [("run", "steps"), ("run_end", "last_step")] {
            if let Some(mut map) = part.map().filter(|_| part.name() == Some(record)) {
                map.insert(key.to_owned(), last_step.clone());
                for (key, value) in &mut map {
                    if let Some(energy) = key.strip_prefix("energy:").and_then(|name| last.get(name)) {
                        *value = energy.to_string();
                    }
                }
                *part = Part::metadata(record, &map);
            }
        }
    }
    own.retain(|part| part.name() != Some("checkpoint"));
    correct_end(&mut own);
    Some(own)
}
