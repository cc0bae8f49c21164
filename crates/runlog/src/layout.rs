//! The records of a log: one header, one end, one scenario, every message on an announced channel. `run_end`
//! confirms all messages, whoever wrote the file. Without it, as in a log that is being written, only what the
//! program itself writes is taken for sound, since a damaged record may be one of another kind.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::Record;

use crate::ahead::Ahead;
use crate::format::{LONGEST_TOPIC_BYTES, MOST_CHANNELS, MOST_SCHEMAS, RUN, RUN_END, SALVAGE, SCENARIO};
use crate::parse::fills;
use crate::problem::{LogProblem, most};

/// Checks the records of a file in order.
#[derive(Debug)]
pub(crate) struct Layout {
    section: Section,
    /// Whether there was a record.
    begun: bool,
    has_run: bool,
    has_scenario: bool,
    /// Whether the file has `run_end`.
    has_end: bool,
    is_salvaged: bool,
    /// Metadata and scenarios that were read, of which there is one each.
    once: BTreeSet<&'static str>,
    channels: BTreeMap<u16, Channel>,
    schemas: BTreeSet<u16>,
    /// Whether nothing but `run_end` confirms what has been read.
    is_doubtful: bool,
}

/// The section of the file that is being read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Data,
    /// After the end of the data: the summary, which repeats records for faster access.
    Summary,
    /// After the footer.
    Closed,
}

#[derive(Debug)]
struct Channel {
    topic: String,
    messages: u32,
}

impl Layout {
    pub(crate) fn new(ahead: &Ahead) -> Layout {
        Layout {
            section: Section::Data,
            begun: false,
            has_run: ahead.run.is_some(),
            has_scenario: ahead.scenario.is_some(),
            has_end: ahead.end.is_some(),
            is_salvaged: ahead.salvage.is_some(),
            once: BTreeSet::new(),
            channels: BTreeMap::new(),
            schemas: BTreeSet::new(),
            is_doubtful: false,
        }
    }

    /// Checks a record outside chunks; `at` is its offset, and `body` excludes its length.
    ///
    /// # Errors
    /// If it is not allowed there.
    pub(crate) fn take(&mut self, at: u64, record: &Record<'_>, body: &[u8]) -> Result<(), LogProblem> {
        use Section::{Closed, Data, Summary};
        let misplaced = |what| Err(LogProblem::Misplaced(what));
        let first = !std::mem::replace(&mut self.begun, true);
        match (first, record) {
            (true, Record::Header(_)) => return Ok(()),
            (true, _) => return misplaced("the first record is no MCAP header"),
            (false, Record::Header(_)) => return misplaced("there are two MCAP headers"),
            (false, _) => {}
        }
        if self.section == Data && !fills(record.opcode(), body) {
            self.doubt(at, "a record longer than its fields")?;
        }
        match (record, self.section) {
            (_, Closed) => misplaced("there is something after the footer"),
            (Record::DataEnd(_), Summary) => misplaced("the data ends twice"),
            (Record::DataEnd(_), Data) => {
                self.section = Summary;
                Ok(())
            }
            (Record::Footer(_), Summary) => {
                self.section = Closed;
                Ok(())
            }
            (Record::Footer(_), Data) => misplaced("there is a footer before the end of the data"),
            (
                Record::Message { .. }
                | Record::Metadata(_)
                | Record::Attachment { .. }
                | Record::Chunk { .. },
                Summary,
            ) => misplaced("there are messages, metadata or attachments after the end of the data"),
            (Record::Metadata(metadata), Data) => match metadata.name.as_str() {
                RUN => self.is_first(RUN, "there are two metadata `run`"),
                RUN_END => self.is_first(RUN_END, "there are two metadata `run_end`"),
                SALVAGE => self.is_first(SALVAGE, "there are two metadata `salvage`"),
                _ => Ok(()),
            },
            (Record::Attachment { header, crc, .. }, Data) => {
                if *crc == 0 {
                    self.doubt(at, "an attachment without checksum")?;
                }
                match header.name == SCENARIO {
                    true => self.is_first(SCENARIO, "there are two attachments `scenario.toml`"),
                    false => Ok(()),
                }
            }
            (Record::Chunk { header, .. }, Data) => match header.uncompressed_crc {
                0 => self.doubt(at, "a chunk without checksum"),
                _ => Ok(()),
            },
            (Record::MessageIndex(_), Data) => Ok(()),
            (Record::Schema { .. } | Record::Channel(_) | Record::Message { .. }, Data) => {
                self.doubt(at, "a message, or what announces it, outside chunks")?;
                self.inner(at, record)
            }
            (_, Data) => self.doubt(at, "a record that no run log has"),
            (Record::Schema { .. } | Record::Channel(_), Summary) => self.inner(at, record),
            _ => Ok(()),
        }
    }

    /// Checks a record of a chunk that begins at that offset, or one that might be in one.
    ///
    /// # Errors
    /// If it is not allowed there.
    pub(crate) fn inner(&mut self, at: u64, record: &Record<'_>) -> Result<(), LogProblem> {
        match record {
            Record::Message { .. } | Record::Channel(_) if !self.has_run => Err(LogProblem::NoHeader),
            Record::Message { .. } | Record::Channel(_) if !self.has_scenario => {
                Err(LogProblem::Misplaced("there is no attachment `scenario.toml`"))
            }
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id);
                most("schemas", self.schemas.len(), MOST_SCHEMAS)
            }
            Record::Channel(channel) => self.channel(channel.id, &channel.topic),
            Record::Message { header, .. } => self.message(at, header.channel_id, header.sequence),
            Record::Chunk { .. } => Err(LogProblem::Misplaced("there is a chunk in a chunk")),
            _ => Err(LogProblem::Misplaced(
                "a chunk holds something other than schemas, channels and messages",
            )),
        }
    }

    /// Notes that the file has something that the program does not write.
    ///
    /// # Errors
    /// If no `run_end` confirms the messages of the file.
    fn doubt(&mut self, at: u64, what: &'static str) -> Result<(), LogProblem> {
        self.is_doubtful = true;
        if self.has_end { Ok(()) } else { Err(LogProblem::Unsound { at, what }) }
    }

    fn is_first(&mut self, name: &'static str, twice: &'static str) -> Result<(), LogProblem> {
        if self.once.insert(name) { Ok(()) } else { Err(LogProblem::Misplaced(twice)) }
    }

    /// The topic of a channel that was announced.
    pub(crate) fn topic(&self, channel: u16) -> Option<&str> {
        self.channels.get(&channel).map(|channel| channel.topic.as_str())
    }

    /// Whether there was any record.
    pub(crate) fn has_begun(&self) -> bool {
        self.begun
    }

    /// Whether there is metadata `run`.
    pub(crate) fn has_run(&self) -> bool {
        self.has_run
    }

    /// Whether a channel has been announced.
    pub(crate) fn has_channels(&self) -> bool {
        !self.channels.is_empty()
    }

    /// Whether nothing but `run_end` confirms what has been read.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.is_doubtful
    }

    /// Channels are announced before their messages and may be repeated.
    fn channel(&mut self, id: u16, topic: &str) -> Result<(), LogProblem> {
        match self.channels.get(&id) {
            Some(known) if known.topic == topic => return Ok(()),
            Some(known) => {
                return Err(LogProblem::ChannelReused {
                    id,
                    topic: known.topic.clone(),
                    other: topic.to_owned(),
                });
            }
            None => {}
        }
        most("channels", self.channels.len() + 1, MOST_CHANNELS)?;
        most("bytes in the name of a topic", topic.len(), LONGEST_TOPIC_BYTES)?;
        if self.channels.values().any(|known| known.topic == topic) {
            return Err(LogProblem::TopicTwice(topic.to_owned()));
        }
        self.channels.insert(id, Channel { topic: topic.to_owned(), messages: 0 });
        Ok(())
    }

    /// Messages of a topic are numbered from 0. Other programs may number them otherwise, and messages of
    /// salvaged logs have their original numbers.
    fn message(&mut self, at: u64, id: u16, sequence: u32) -> Result<(), LogProblem> {
        let channel = self.channels.get_mut(&id).ok_or(LogProblem::UnknownChannel(id))?;
        let expected = channel.messages;
        channel.messages = expected.wrapping_add(1);
        if sequence == expected || self.is_salvaged {
            return Ok(());
        }
        if !self.has_end {
            let topic = channel.topic.clone();
            return Err(LogProblem::Number { topic, expected, found: sequence });
        }
        self.doubt(at, "a message out of its number")
    }
}
