//! Reads the messages of some topics alone, which the indexes behind the chunks of a log lead to, without verifying it.
//!
//! A chunk is read if an index says that it has messages of these topics or of a channel that is not known yet, or if
//! it has no index. So files need no summary at their end.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek};

use mcap::records::{Record as Raw, op};

use super::{LogItem, RunReader, Topics, ending, mismatch};
use crate::chunk::Chunk;
use crate::format::{LONGEST_RECORD_BYTES, MAGIC, MOST_CHANNELS, RECORD_HEAD_BYTES, STEP};
use crate::parse::parse;
use crate::problem::{LogError, LogProblem, most};

/// Topics by their channels.
type Channels = BTreeMap<u16, String>;

impl RunReader {
    /// Passes on the records and events of these topics, in the order of the file. Of `/switch` there are none without
    /// `/step`. Nothing is verified but the checksums of chunks that are read, each message by itself, and whether there
    /// are as many as `run_end` counts.
    ///
    /// # Errors
    /// If what is read is damaged, or the log is incomplete.
    pub fn skim(
        &mut self,
        topics: &'static [&'static str],
        take: &mut dyn FnMut(LogItem),
    ) -> Result<(), LogError> {
        self.skimmed = topics;
        self.topics = Topics { steps: topics.contains(&STEP), windows: true, ..Topics::EVENTS };
        let read = self.skim_records(take);
        // What precedes an error is sound.
        self.ready.drain(..).for_each(take);
        read.map_err(|problem| LogError { path: self.path.clone(), problem })
    }

    fn skim_records(&mut self, take: &mut dyn FnMut(LogItem)) -> Result<(), LogProblem> {
        let file = asperity_files::open(&self.path)?;
        let length = file.metadata()?.len();
        let mut file = BufReader::with_capacity(1 << 12, file);
        let mut channels = Channels::new();
        // Place and size of the chunk before, and whether its indexes so far lead to wanted messages.
        let mut chunk: Option<(u64, u64, Option<bool>)> = None;
        let mut at = MAGIC.len() as u64;
        loop {
            let body_at = at.saturating_add(RECORD_HEAD_BYTES as u64);
            let head = bytes(&mut file, at, RECORD_HEAD_BYTES as u64)?;
            let record = head.split_first().and_then(|(&opcode, size)| {
                let size = u64::from_le_bytes(size.try_into().ok()?);
                let is_whole = body_at.checked_add(size).is_some_and(|next| next <= length);
                (is_whole && !matches!(opcode, op::DATA_END | op::FOOTER)).then_some((opcode, size))
            });
            if let (Some((op::MESSAGE_INDEX, 2..)), Some((.., leads))) = (record, &mut chunk) {
                let channel = bytes(&mut file, body_at, 2)?;
                let topic = channels.get(&u16::from_le_bytes(std::array::from_fn(|n| channel[n])));
                *leads = Some(*leads == Some(true) || topic.is_none_or(|topic| self.is_skimmed(topic)));
            } else if let Some((at, size, Some(true) | None)) = chunk.take() {
                let body = bytes(&mut file, at + RECORD_HEAD_BYTES as u64, size)?;
                if let Raw::Chunk { header, data } = parse(op::CHUNK, &body, at)? {
                    let mut chunk = Chunk::open(&header, &data).map_err(|problem| problem.at(at))?;
                    while let Some((opcode, body)) = chunk.next_record().map_err(|problem| problem.at(at))? {
                        self.skim_record(parse(opcode, body, at)?, &mut channels)?;
                    }
                }
                self.ready.drain(..).for_each(&mut *take);
            }
            let Some((opcode, size)) = record else { break };
            match opcode {
                op::CHUNK => {
                    most("bytes in a chunk", size as usize, LONGEST_RECORD_BYTES)?;
                    chunk = Some((at, size, None));
                }
                op::METADATA | op::CHANNEL | op::MESSAGE if size <= LONGEST_RECORD_BYTES as u64 => {
                    let body = bytes(&mut file, body_at, size)?;
                    self.skim_record(parse(opcode, &body, at)?, &mut channels)?;
                }
                _ => {}
            }
            at = body_at + size;
        }
        self.close_step()?;
        let end = self.end.as_ref().ok_or(LogProblem::NoEnd)?;
        for topic in self.skimmed {
            let of = |counts: &BTreeMap<String, u64>| counts.get(*topic).copied().unwrap_or(0).to_string();
            mismatch(&format!("messages of {topic}:"), of(&end.message_counts), of(&self.counts))?;
        }
        ending(end)
    }

    fn is_skimmed(&self, topic: &str) -> bool {
        self.skimmed.contains(&topic)
    }

    fn skim_record(&mut self, record: Raw<'_>, channels: &mut Channels) -> Result<(), LogProblem> {
        match record {
            Raw::Message { header, data } => {
                let unknown = || LogProblem::misplaced("a message of a channel that nothing announced");
                let topic = channels.get(&header.channel_id).ok_or_else(unknown)?;
                if self.is_skimmed(topic) { self.message(topic, &header, &data) } else { Ok(()) }
            }
            Raw::Channel(channel) => {
                most("channels", channels.len(), MOST_CHANNELS)?;
                channels.insert(channel.id, channel.topic.clone());
                self.take(Raw::Channel(channel))
            }
            record @ Raw::Metadata(_) => self.take(record.into_owned()),
            _ => Ok(()),
        }
    }
}

/// So many bytes from a place on, or fewer at the end of the file.
fn bytes(file: &mut BufReader<File>, at: u64, count: u64) -> io::Result<Vec<u8>> {
    let here = file.stream_position()?;
    file.seek_relative(at as i64 - here as i64)?;
    let mut bytes = Vec::new();
    file.take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}
