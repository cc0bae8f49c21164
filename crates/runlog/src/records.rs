//! Iterates over the MCAP records of a log, including those in chunks: checks every checksum, and that every message
//! is on an announced channel, in memory bounded by a chunk.
//!
//! `run_end` confirms all messages, whoever wrote the file. Without it, as in a log that is being written, only
//! messages as the program itself writes them are taken for sound: in chunks with checksums, numbered from 0.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::ahead::Ahead;
use crate::chunk::Chunk;
use crate::format::{
    LONGEST_READ_BYTES, LONGEST_RECORD_BYTES, LONGEST_TOPIC_BYTES, MAGIC, MOST_CHANNELS, PROFILE,
    RECORD_HEAD_BYTES,
};
use crate::parse::parse;
use crate::problem::{LogProblem, NoRunLog, most};

/// Reads the records of one file.
pub(crate) struct Records {
    source: BufReader<File>,
    reader: LinearReader,
    /// The offsets of the next record and of the current one.
    next_at: u64,
    at: u64,
    /// The rest of the current chunk.
    chunk: Chunk,
    channels: BTreeMap<u16, Channel>,
    /// Whether the data have ended, which the summary follows.
    has_ended: bool,
    has_run: bool,
    has_scenario: bool,
    /// Whether the file has `run_end`.
    has_end: bool,
    is_salvaged: bool,
    /// Whether nothing but `run_end` confirms what has been read.
    is_doubtful: bool,
    /// Why the file is no run log, by its first bytes.
    foreign: Option<NoRunLog>,
    has_other_profile: bool,
}

/// Length of an index of so many messages: a channel, a length, and a time and a place for each.
fn index_bytes(messages: usize) -> u64 {
    (RECORD_HEAD_BYTES + 6 + 16 * messages) as u64
}

struct Channel {
    topic: String,
    messages: u32,
}

impl Records {
    /// Opens a file with this header, scenario and end.
    ///
    /// # Errors
    /// If it does not exist or the system refuses.
    pub(crate) fn open(path: &Path, ahead: &Ahead) -> io::Result<Records> {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(LONGEST_RECORD_BYTES);
        let mut source = BufReader::with_capacity(1 << 16, asperity_files::open(path)?);
        asperity_files::fill(&mut source)?;
        Ok(Records {
            foreign: foreign(source.buffer()),
            source,
            reader: LinearReader::new_with_options(options),
            next_at: MAGIC.len() as u64,
            at: 0,
            chunk: Chunk::default(),
            channels: BTreeMap::new(),
            has_ended: false,
            has_run: ahead.run.is_some(),
            has_scenario: ahead.scenario.is_some(),
            has_end: ahead.end.is_some(),
            is_salvaged: ahead.salvage.is_some(),
            is_doubtful: false,
            has_other_profile: false,
        })
    }

    /// The topic of a channel that was announced.
    pub(crate) fn topic(&self, channel: u16) -> Option<&str> {
        self.channels.get(&channel).map(|channel| channel.topic.as_str())
    }

    /// Whether a channel has been announced.
    pub(crate) fn has_channels(&self) -> bool {
        !self.channels.is_empty()
    }

    /// Whether nothing but `run_end` confirms what has been read.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.is_doubtful
    }

    /// Why the file does not begin as run logs do, if so: it is empty, torn, or of another program. The MCAP header
    /// is read for its library.
    pub(crate) fn foreign(&mut self) -> Result<Option<NoRunLog>, LogProblem> {
        match self.foreign {
            Some(NoRunLog::OtherProgram { .. }) => match self.read() {
                Err(problem @ LogProblem::Io(_)) => Err(problem),
                // Other errors in it do not matter.
                _ => Ok(self.foreign.clone()),
            },
            _ => Ok(self.foreign.clone()),
        }
    }

    /// The error for a missing header: the file is damaged, or of another program.
    pub(crate) fn no_header(&self) -> LogProblem {
        let foreign = self.foreign.clone().filter(|_| self.has_other_profile);
        foreign.map_or(LogProblem::NoHeader, LogProblem::from)
    }

    /// Returns the next record; None after the last one.
    ///
    /// # Errors
    /// If it cannot be read, or is not allowed there.
    pub(crate) fn next(&mut self) -> Result<Option<Record<'static>>, LogProblem> {
        match self.read() {
            Err(problem @ LogProblem::Io(_)) => Err(problem),
            // A file of another program is not a run log, whatever its errors, nor if it has none.
            Err(_) | Ok(None) if self.has_other_profile && !self.has_run => Err(self.no_header()),
            read => read,
        }
    }

    fn read(&mut self) -> Result<Option<Record<'static>>, LogProblem> {
        loop {
            if let Some((opcode, body)) = self.chunk.next_record().map_err(|problem| problem.at(self.at))? {
                let record = parse(opcode, body, self.at)?.into_owned();
                self.inner(&record)?;
                return Ok(Some(record));
            }
            let record = match self.reader.next_event() {
                None if read_some(&mut self.source, &mut [0])? > 0 => {
                    return Err(LogProblem::misplaced("there is something after the end of the MCAP file"));
                }
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let buffer = self.reader.insert(wanted.min(LONGEST_READ_BYTES));
                    let read = read_some(&mut self.source, buffer)?;
                    self.reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.at = self.next_at;
                    self.next_at += (RECORD_HEAD_BYTES + data.len()) as u64;
                    let record = parse(opcode, data, self.at)?.into_owned();
                    self.outer(&record)?;
                    record
                }
                Some(Err(McapError::UnexpectedEof)) => return Err(self.early_end()),
                Some(Err(McapError::BadMagic)) if self.at == 0 => {
                    return Err(self.foreign.clone().unwrap_or(NoRunLog::NotMcap).into());
                }
                Some(Err(error)) => return Err(LogProblem::from(error).at(self.next_at)),
            };
            match record {
                Record::Chunk { header, data } => {
                    self.chunk = Chunk::open(&header, &data).map_err(|problem| problem.at(self.at))?;
                }
                Record::Header(header) => {
                    self.has_other_profile = header.profile != PROFILE;
                    if let Some(NoRunLog::OtherProgram { library }) = &mut self.foreign {
                        library.clone_from(&header.library);
                    }
                    return Ok(Some(Record::Header(header)));
                }
                record => return Ok(Some(record)),
            }
        }
    }

    /// Checks a record outside chunks.
    ///
    /// # Errors
    /// If it is not allowed there.
    fn outer(&mut self, record: &Record<'_>) -> Result<(), LogProblem> {
        match record {
            Record::Header(_) if self.at == MAGIC.len() as u64 => {}
            Record::Footer(_) if !self.has_ended => {
                return Err(LogProblem::misplaced("there is a footer before the end of the data"));
            }
            Record::DataEnd(_) => self.has_ended = true,
            Record::Chunk { header, .. } if header.uncompressed_crc == 0 => {
                self.doubt("a chunk without checksum")?;
            }
            Record::Attachment { crc: 0, .. } => self.doubt("an attachment without checksum")?,
            Record::Schema { .. } | Record::Channel(_) | Record::Message { .. } => {
                if !self.has_ended {
                    self.doubt("a message, or what announces it, outside chunks")?;
                }
                self.inner(record)?;
            }
            Record::Metadata(_) | Record::Attachment { .. } | Record::Chunk { .. } => {}
            // A wrong bit makes the index of a chunk's messages of a chunk, or what no log has.
            Record::MessageIndex(index) if self.next_at - self.at == index_bytes(index.records.len()) => {}
            _ if !self.has_ended => self.doubt("a record that no run log has")?,
            _ => {}
        }
        Ok(())
    }

    /// Checks a record of a chunk, or one that might be in one.
    ///
    /// # Errors
    /// If it is not allowed there.
    fn inner(&mut self, record: &Record<'_>) -> Result<(), LogProblem> {
        match record {
            Record::Channel(_) | Record::Message { .. } if !self.has_scenario => {
                Err(LogProblem::misplaced("there is no attachment `scenario.toml`"))
            }
            Record::Schema { .. } => Ok(()),
            Record::Channel(channel) => self.channel(channel.id, &channel.topic),
            Record::Message { header, .. } => self.message(header.channel_id, header.sequence),
            _ => Err(LogProblem::misplaced(
                "a chunk holds something other than schemas, channels and messages",
            )),
        }
    }

    /// Notes that the file has something that the program does not write.
    ///
    /// # Errors
    /// If no `run_end` confirms the messages of the file.
    fn doubt(&mut self, what: &'static str) -> Result<(), LogProblem> {
        self.is_doubtful = true;
        if self.has_end { Ok(()) } else { Err(LogProblem::Unsound { at: self.at, what }) }
    }

    /// Channels are announced before their messages and may be repeated.
    fn channel(&mut self, id: u16, topic: &str) -> Result<(), LogProblem> {
        if let Some(known) = self.channels.get(&id) {
            let what = || format!("channel {id} is that of {} and of {topic}", known.topic);
            return if known.topic == topic { Ok(()) } else { Err(LogProblem::misplaced(what())) };
        }
        most("channels", self.channels.len() + 1, MOST_CHANNELS)?;
        most("bytes in the name of a topic", topic.len(), LONGEST_TOPIC_BYTES)?;
        if self.channels.values().any(|known| known.topic == topic) {
            return Err(LogProblem::misplaced(format!("{topic} has two channels")));
        }
        self.channels.insert(id, Channel { topic: topic.to_owned(), messages: 0 });
        Ok(())
    }

    /// Messages of a topic are numbered from 0. Other programs may number them otherwise, and messages of
    /// salvaged logs have their original numbers.
    fn message(&mut self, id: u16, found: u32) -> Result<(), LogProblem> {
        let unknown = || LogProblem::misplaced(format!("a message of channel {id}, which nothing announced"));
        let channel = self.channels.get_mut(&id).ok_or_else(unknown)?;
        let expected = channel.messages;
        channel.messages = expected.wrapping_add(1);
        if found == expected || self.is_salvaged {
            return Ok(());
        }
        if !self.has_end {
            let what = format!("message {found} of {} stands where number {expected} must", channel.topic);
            return Err(LogProblem::misplaced(what));
        }
        self.doubt("a message out of its number")
    }

    /// The error for a file that ends inside a record: it was truncated, or the record's length is
    /// wrong. A truncated file has no proper ending.
    fn early_end(&mut self) -> LogProblem {
        let mut last = [0; MAGIC.len()];
        let back = SeekFrom::End(-(last.len() as i64));
        let read = self.source.seek(back).and_then(|at| self.source.read_exact(&mut last).map(|()| at));
        match read {
            Ok(at) if at > self.next_at && last == *MAGIC => {
                let what = "it claims to be longer than the rest of the file, which was not cut off there";
                LogProblem::Unsound { at: self.next_at, what }
            }
            _ => match self.foreign.clone().filter(|_| self.at == 0) {
                Some(foreign) => foreign.into(),
                None => McapError::UnexpectedEof.into(),
            },
        }
    }
}

/// Why a file with these first bytes is no run log; None if it begins as one, however short it is.
fn foreign(start: &[u8]) -> Option<NoRunLog> {
    /// Where the length of the MCAP header stands, which depends on its library, and where the profile ends.
    const LENGTH_AT: usize = MAGIC.len() + 1;
    const PROFILE_AT: usize = LENGTH_AT + 8 + 4;
    // That length fits in its first byte, and includes profile and library with their lengths.
    const SHORTEST: u8 = 4 + PROFILE.len() as u8 + 4;
    let profile_bytes = (PROFILE.len() as u32).to_le_bytes();
    let ours = [MAGIC, &[op::HEADER], &[0; 8], &profile_bytes, PROFILE.as_bytes()].concat();
    let is_ours = |(at, byte): (usize, &u8)| match at {
        LENGTH_AT => *byte >= SHORTEST,
        _ => *byte == ours[at],
    };
    let start = &start[..start.len().min(ours.len())];
    let differs = match start.iter().enumerate().position(|at| !is_ours(at)) {
        None if start.is_empty() => return Some(NoRunLog::Empty),
        None => return None,
        Some(differs) => differs,
    };
    // The header of another program may have an empty profile, and end there.
    let may_be_another = differs > LENGTH_AT && start.len() <= PROFILE_AT;
    Some(if start[differs..].iter().all(|byte| *byte == 0) && !may_be_another {
        NoRunLog::Torn
    } else if start.starts_with(MAGIC) {
        NoRunLog::OtherProgram { library: String::new() }
    } else {
        NoRunLog::NotMcap
    })
}

/// Reads some bytes, again if a signal interrupts it.
fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
