//! The order of records in a log. Checksums and digests prove that nothing changed since the log
//! was written; this checks that it is a log: one header, one end, one scenario, every message on
//! an announced channel, none after the end.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::Record;

use crate::format::{
    CHUNK, LONGEST_TOPIC_BYTES, MOST_CHANNELS, MOST_SCHEMAS, NOTE, RUN, RUN_END, SALVAGE, SCENARIO,
};
use crate::problem::{LogProblem, most};

/// Checks the records of a file in order.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    section: Section,
    /// Whether there was a record.
    begun: bool,
    has_run: bool,
    has_scenario: bool,
    channels: BTreeMap<u16, Channel>,
    schemas: BTreeSet<u16>,
    /// A gap in the message numbers, allowed in salvaged logs only.
    gap: Option<Gap>,
}

/// The section of the file that is being read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Section {
    /// Before `run`.
    #[default]
    Start,
    /// Between `run` and `run_end`.
    Run,
    /// After `run_end`.
    Ended,
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

#[derive(Debug, Clone)]
struct Gap {
    topic: String,
    expected: u32,
    found: u32,
}

impl Layout {
    /// Checks the next record of the file or of a chunk in it.
    ///
    /// # Errors
    /// If it is not allowed there.
    pub(crate) fn take(&mut self, record: &Record<'_>) -> Result<(), LogProblem> {
        use Section::{Closed, Ended, Run, Start, Summary};
        let misplaced = |what| Err(LogProblem::Misplaced(what));
        let first = !std::mem::replace(&mut self.begun, true);
        match (first, record) {
            (true, Record::Header(_)) => return Ok(()),
            (true, _) => return misplaced("the first record is no MCAP header"),
            (false, Record::Header(_)) => return misplaced("there are two MCAP headers"),
            (false, _) => {}
        }
        match (record, self.section) {
            (_, Closed) => misplaced("there is something after the footer"),
            (Record::Metadata(metadata), section) if metadata.name == RUN => match section {
                Start => {
                    (self.section, self.has_run) = (Run, true);
                    Ok(())
                }
                _ => misplaced("there are two metadata `run`"),
            },
            (Record::Metadata(metadata), section) if metadata.name == RUN_END => match section {
                Start => Err(LogProblem::NoHeader),
                Run => {
                    self.section = Ended;
                    Ok(())
                }
                Ended => misplaced("there are two metadata `run_end`"),
                _ => misplaced("metadata `run_end` stands after the end of the data"),
            },
            (Record::Metadata(metadata), Start) if metadata.name == CHUNK => Err(LogProblem::NoHeader),
            // `run_end` is sealed as well.
            (Record::Metadata(metadata), Run | Ended) if metadata.name == CHUNK => Ok(()),
            (Record::Metadata(metadata), Run) if metadata.name == SALVAGE && self.has_messages() => {
                misplaced("metadata `salvage` stands after the first message")
            }
            (Record::Attachment { header, .. }, Start | Run) if header.name == SCENARIO => {
                if self.has_scenario {
                    return misplaced("there are two attachments `scenario.toml`");
                }
                self.has_scenario = true;
                Ok(())
            }
            (Record::Message { .. } | Record::Channel(_), Start) => Err(LogProblem::NoHeader),
            (Record::Metadata(metadata), Ended) if metadata.name == NOTE => Ok(()),
            (Record::Message { .. } | Record::Metadata(_) | Record::Attachment { .. }, Ended) => {
                misplaced("there are messages, metadata or attachments after metadata `run_end`")
            }
            (Record::Message { .. } | Record::Metadata(_) | Record::Attachment { .. }, Summary) => {
                misplaced("there are messages, metadata or attachments after the end of the data")
            }
            (Record::Chunk { .. }, Ended | Summary) => misplaced("there is a chunk after metadata `run_end`"),
            (Record::Message { .. } | Record::Channel(_), Run) if !self.has_scenario => {
                misplaced("there is no attachment `scenario.toml` before the first channel")
            }
            (Record::Schema { header, .. }, _) => {
                self.schemas.insert(header.id);
                most("schemas", self.schemas.len(), MOST_SCHEMAS)
            }
            (Record::Channel(channel), _) => self.channel(channel.id, &channel.topic),
            (Record::Message { header, .. }, Run) => self.message(header.channel_id, header.sequence),
            (Record::DataEnd(_), Summary) => misplaced("the data ends twice"),
            (Record::DataEnd(_), _) => {
                self.section = Summary;
                Ok(())
            }
            (Record::Footer(_), Summary) => {
                self.section = Closed;
                Ok(())
            }
            (Record::Footer(_), _) => misplaced("there is a footer before the end of the data"),
            _ => Ok(()),
        }
    }

    /// The topic of a channel that was announced.
    pub(crate) fn topic(&self, channel: u16) -> Option<&str> {
        self.channels.get(&channel).map(|channel| channel.topic.as_str())
    }

    /// Whether there was any record.
    pub(crate) fn has_begun(&self) -> bool {
        self.begun
    }

    /// Whether there was metadata `run`.
    pub(crate) fn has_run(&self) -> bool {
        self.has_run
    }

    /// Whether a channel has been announced.
    pub(crate) fn has_channels(&self) -> bool {
        !self.channels.is_empty()
    }

    fn has_messages(&self) -> bool {
        self.channels.values().any(|channel| channel.messages > 0)
    }

    /// Checks that no message is missing between others.
    ///
    /// # Errors
    /// If one is.
    pub(crate) fn check_numbers(&self) -> Result<(), LogProblem> {
        match self.gap.clone() {
            None => Ok(()),
            Some(Gap { topic, expected, found }) => Err(LogProblem::Number { topic, expected, found }),
        }
    }

    /// Channels are announced once before the messages and repeated in the summary.
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

    fn message(&mut self, id: u16, sequence: u32) -> Result<(), LogProblem> {
        let channel = self.channels.get_mut(&id).ok_or(LogProblem::UnknownChannel(id))?;
        if sequence != channel.messages && self.gap.is_none() {
            self.gap =
                Some(Gap { topic: channel.topic.clone(), expected: channel.messages, found: sequence });
        }
        channel.messages = channel.messages.wrapping_add(1);
        Ok(())
    }
}
