//! Everything that a log of versions 3 to 6 has besides its records: the records `chunk`, indexes and
//! summary, all of them correct, however wrong the rest is. Written from the description of the format,
//! independently of `crates/runlog`, so that each checks the other.

use std::collections::BTreeMap;

use mcap::records::op;

use super::parts::{MESSAGE_HEAD, Part};

/// Whether these records are of a log with such a version.
pub fn is_sealed(parts: &[Part]) -> bool {
    let version = |run: &Part| run.map()?.get("record_schema_version")?.parse::<u32>().ok();
    parts
        .iter()
        .find(|part| part.name() == Some("run"))
        .and_then(version)
        .is_some_and(|version| matches!(version, 3..=6))
}

/// A group of the summary: its kind, and its records.
type Group = (u8, Vec<u8>);

/// A file of these records, chunks among them, with all that belongs to it.
pub fn seal(parts: &[Part], data_crc: bool) -> Vec<u8> {
    let mut out = mcap::MAGIC.to_vec();
    let run_id = parts
        .iter()
        .find(|part| part.name() == Some("run"))
        .and_then(|run| run.map()?.get("run_id").cloned())
        .unwrap_or_default();
    let mut seal = Seal { run_id, ..Seal::default() };
    for part in parts.iter().filter(|part| !is_link(part)) {
        seal.put(part, &mut out);
    }
    let crc = if data_crc { crc32fast::hash(&out) } else { 0 };
    Part::new(op::DATA_END, crc.to_le_bytes()).put(&mut out);
    seal.summary(&mut out);
    out
}

fn is_link(part: &Part) -> bool {
    part.opcode == op::METADATA && part.name() == Some("chunk")
}

#[derive(Default)]
struct Seal {
    run_id: String,
    links: u64,
    before_crc: u32,
    schemas: BTreeMap<u16, Part>,
    channels: BTreeMap<u16, Part>,
    counts: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
    chunks: Vec<Part>,
    attachments: Vec<Part>,
    metadata: Vec<Part>,
}

impl Seal {
    fn put(&mut self, part: &Part, out: &mut Vec<u8>) {
        let at = out.len();
        let piece = match (part.opcode, part.name()) {
            (op::CHUNK, _) => {
                self.chunk(part, out);
                let crc = part.body.get(24..28).and_then(|crc| crc.try_into().ok());
                crc.map(u32::from_le_bytes)
            }
            (op::ATTACHMENT, name) => {
                part.put(out);
                self.attachment(part, name.unwrap_or_default(), at, out.len() - at);
                let crc = part.body.last_chunk::<4>();
                crc.map(|crc| u32::from_le_bytes(*crc))
            }
            (op::METADATA, name) => {
                part.put(out);
                self.metadata_index(name.unwrap_or_default(), at, out.len() - at);
                (name != Some("run")).then(|| crc32fast::hash(&part.body))
            }
            _ => {
                part.put(out);
                None
            }
        };
        if let Some(crc) = piece {
            self.link(crc, out);
        }
    }

    fn link(&mut self, crc: u32, out: &mut Vec<u8>) {
        let map = [
            ("run_id", self.run_id.clone()),
            ("number", self.links.to_string()),
            ("crc", format!("{crc:08x}")),
            ("before_crc", format!("{:08x}", self.before_crc)),
            ("bytes", out.len().to_string()),
            ("bytes_crc", format!("{:08x}", crc32fast::hash(out))),
        ]
        .map(|(key, value)| (key.to_owned(), value));
        let at = out.len();
        Part::metadata("chunk", &map.into()).put(out);
        self.metadata_index("chunk", at, out.len() - at);
        (self.links, self.before_crc) = (self.links + 1, crc);
    }

    fn metadata_index(&mut self, name: &str, at: usize, length: usize) {
        let mut body = numbers(&[at as u64, length as u64]);
        put_text(&mut body, name);
        self.metadata.push(Part::new(op::METADATA_INDEX, body));
    }

    fn attachment(&mut self, part: &Part, name: &str, at: usize, length: usize) {
        let mut body = numbers(&[at as u64, length as u64]);
        // Both times, the size of the data, name and type as in the attachment.
        body.extend(part.body.get(..16).unwrap_or(&[0; 16]));
        body.extend((part.attached().map_or(0, <[u8]>::len) as u64).to_le_bytes());
        put_text(&mut body, name);
        put_text(&mut body, part.media_type().unwrap_or_default());
        self.attachments.push(Part::new(op::ATTACHMENT_INDEX, body));
    }

    /// Adds a chunk with the times of its messages, and their indexes. Nothing is known of a compressed
    /// one.
    fn chunk(&mut self, part: &Part, out: &mut Vec<u8>) {
        let at = out.len() as u64;
        let plain = part.body.get(28..32) == Some(&[0; 4]);
        let records = part.body.get(40..).filter(|_| plain).unwrap_or_default();
        let mut messages: BTreeMap<u16, Vec<u8>> = BTreeMap::new();
        let mut times: Option<(u64, u64)> = None;
        let mut place = 0;
        while let Some(part) = part_at(records, place) {
            let id = part.channel_id().unwrap_or_default();
            match part.opcode {
                op::SCHEMA => {
                    let id = part.body.first_chunk::<2>().map_or(0, |id| u16::from_le_bytes(*id));
                    self.schemas.entry(id).or_insert(part.clone());
                }
                op::CHANNEL => {
                    self.channels.entry(id).or_insert(part.clone());
                }
                op::MESSAGE if part.body.len() >= MESSAGE_HEAD => {
                    let time = u64::from_le_bytes(part.body[6..14].try_into().expect("eight bytes"));
                    messages.entry(id).or_default().extend(numbers(&[time, place as u64]));
                    *self.counts.entry(id).or_insert(0) += 1;
                    for times in [&mut times, &mut self.times] {
                        let (start, end) = times.unwrap_or((time, time));
                        *times = Some((start.min(time), end.max(time)));
                    }
                }
                _ => {}
            }
            place += 9 + part.body.len();
        }
        let (start, end) = times.unwrap_or_default();
        let mut part = part.clone();
        if part.body.len() >= 16 {
            part.body[..16].copy_from_slice(&numbers(&[start, end]));
        }
        part.put(out);
        let length = out.len() as u64 - at;
        let indexes_at = out.len();
        let mut offsets = Vec::new();
        for (channel, entries) in messages {
            offsets.extend(channel.to_le_bytes());
            offsets.extend((out.len() as u64).to_le_bytes());
            let mut body = channel.to_le_bytes().to_vec();
            put_bytes(&mut body, &entries);
            Part::new(op::MESSAGE_INDEX, body).put(out);
        }
        let mut index = numbers(&[start, end, at, length]);
        put_bytes(&mut index, &offsets);
        index.extend(((out.len() - indexes_at) as u64).to_le_bytes());
        put_text(&mut index, if plain { "" } else { "zstd" });
        index.extend(part.body.get(32..40).unwrap_or(&[0; 8]));
        index.extend(part.body.get(16..24).unwrap_or(&[0; 8]));
        self.chunks.push(Part::new(op::CHUNK_INDEX, index));
    }

    fn statistics(&self) -> Part {
        let (start, end) = self.times.unwrap_or_default();
        let mut body = numbers(&[self.counts.values().sum()]);
        body.extend((self.schemas.len() as u16).to_le_bytes());
        for count in [self.channels.len(), self.attachments.len(), self.metadata.len(), self.chunks.len()] {
            body.extend((count as u32).to_le_bytes());
        }
        body.extend(numbers(&[start, end]));
        let mut counts = Vec::new();
        for (channel, count) in &self.counts {
            counts.extend(channel.to_le_bytes());
            counts.extend(count.to_le_bytes());
        }
        put_bytes(&mut body, &counts);
        Part::new(op::STATISTICS, body)
    }

    /// The records after the end of the data, up to the end of the file.
    fn summary(self, out: &mut Vec<u8>) {
        let start = out.len();
        let statistics = self.statistics();
        let records = |parts: &mut dyn Iterator<Item = &Part>| {
            let mut bytes = Vec::new();
            parts.for_each(|part| part.put(&mut bytes));
            bytes
        };
        let groups: Vec<Group> = vec![
            (op::SCHEMA, records(&mut self.schemas.values())),
            (op::CHANNEL, records(&mut self.channels.values())),
            (op::STATISTICS, records(&mut std::iter::once(&statistics))),
            (op::CHUNK_INDEX, records(&mut self.chunks.iter())),
            (op::ATTACHMENT_INDEX, records(&mut self.attachments.iter())),
            (op::METADATA_INDEX, records(&mut self.metadata.iter())),
        ];
        let mut offsets = Vec::new();
        for (kind, bytes) in groups.iter().filter(|(_, bytes)| !bytes.is_empty()) {
            let place = numbers(&[out.len() as u64, bytes.len() as u64]);
            offsets.push(Part::new(op::SUMMARY_OFFSET, [&[*kind][..], &place].concat()));
            out.extend(bytes);
        }
        let offsets_at = out.len();
        offsets.iter().for_each(|offset| offset.put(out));
        let mut footer = numbers(&[start as u64, offsets_at as u64]);
        let head = [&[op::FOOTER][..], &20u64.to_le_bytes()].concat();
        let crc = crc32fast::hash(&[&out[start..], &head, &footer].concat());
        footer.extend(crc.to_le_bytes());
        Part::new(op::FOOTER, footer).put(out);
        out.extend(mcap::MAGIC);
    }
}

/// The record that begins there, if a whole one does.
fn part_at(records: &[u8], at: usize) -> Option<Part> {
    let head = records.get(at..at.checked_add(9)?)?;
    let length = usize::try_from(u64::from_le_bytes(head[1..].try_into().ok()?)).ok()?;
    Some(Part::new(head[0], records.get(at + 9..(at + 9).checked_add(length)?)?))
}

fn numbers(numbers: &[u64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    put_bytes(out, text.as_bytes());
}

fn put_bytes(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend(bytes);
}
