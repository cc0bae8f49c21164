//! Reading a run log, from its first byte to its last, with every checksum
//! checked and memory bounded by a chunk.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use asperity_record::{
    Direction, Event, FieldRecord, RECORD_SCHEMA_VERSION, Record, RunEnd, RunHeader, RunStatus, StepRecord,
    WindowRecord,
};
use mcap::records::{MessageHeader, Record as Raw};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::de::DeserializeOwned;

use crate::agree;
use crate::chunk::{Chunk, RECORD_HEAD_BYTES};
use crate::layout::Layout;
use crate::lengths;
use crate::messages::{EVENTS, FIELDS, STEP, SWITCH, StepMessage, SwitchMessage, WINDOW};
use crate::metadata::{self, MetadataError, RUN, RUN_END, SALVAGE};
use crate::versions;
use crate::write::{CHECKPOINT, SCENARIO, digest_message};

/// No record of ours comes near this: the state of the longest chain is ten million bytes. A
/// length beyond it is damage, and must not be allocated.
pub(crate) const LONGEST_RECORD_BYTES: usize = 1 << 26;

/// Most that is made room for at once: a length is only believed as far as there are bytes.
const LONGEST_READ_BYTES: usize = 1 << 20;

/// Most that is kept of the schemas of a log's topics, in bytes; ours are some thousand.
const MOST_SCHEMA_BYTES: usize = 1 << 20;

/// A run log that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct LogError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: LogProblem,
}

/// What is wrong with a run log.
#[derive(Debug, thiserror::Error)]
pub enum LogProblem {
    /// The system refused.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not an MCAP file, or a damaged one.
    #[error("not a whole MCAP file: {0}")]
    Mcap(#[from] mcap::McapError),
    /// A record that cannot be read.
    #[error("the record at byte {at} cannot be read: {error}")]
    Record {
        /// Where in the file it begins, or the chunk that it is in.
        at: u64,
        /// Why.
        error: mcap::McapError,
    },
    /// A record that has no room for what it says it holds.
    #[error("the record at byte {at}, of the kind 0x{opcode:02x}, holds a length that reaches over its end")]
    InnerLength {
        /// Where in the file it begins, or the chunk that it is in.
        at: u64,
        /// Its kind.
        opcode: u8,
    },
    /// A record that reaches over the end of a file that was not cut off.
    #[error("the record at byte {0} claims to be longer than the rest of the file, which has its end")]
    Overlong(u64),
    /// A message on a channel that nothing announced.
    #[error("a message of channel {0}, which nothing announced")]
    UnknownChannel(u16),
    /// A channel that is announced for two topics.
    #[error("channel {id} is that of {topic} and of {other}")]
    ChannelReused {
        /// The channel.
        id: u16,
        /// What it was announced for first.
        topic: String,
        /// What it is announced for then.
        other: String,
    },
    /// A topic on two channels.
    #[error("{0} has two channels")]
    TopicTwice(String),
    /// A message that is missing, or there twice.
    #[error("message {found} of {topic} stands where number {expected} must")]
    Number {
        /// The topic.
        topic: String,
        /// The number that it must have.
        expected: u32,
        /// The number that it has.
        found: u32,
    },
    /// A text that is none.
    #[error("attachment `{0}` is not UTF-8")]
    NotText(&'static str),
    /// A time in the file that is not that of the message's step.
    #[error(
        "{topic}: the message of step {step} stands at {found_ns} ns, not at {}",
        expected_ns.map_or("any time that a file can give".to_owned(), |ns| format!("{ns} ns"))
    )]
    LogTime {
        /// The topic.
        topic: String,
        /// The step.
        step: u64,
        /// The time that the message has in the file.
        found_ns: u64,
        /// The time of its step.
        expected_ns: Option<u64>,
    },
    /// A message that says two things which cannot both be.
    #[error("step {step}: {what}")]
    Contradiction {
        /// The step.
        step: u64,
        /// What it says.
        what: String,
    },
    /// An array that has not one value per block.
    #[error("step {step}: {key} has {found} values, not {expected}")]
    ArrayLength {
        /// The step.
        step: u64,
        /// The array.
        key: &'static str,
        /// How many values it has.
        found: usize,
        /// How many it must have.
        expected: usize,
    },
    /// Header or end do not say what they must.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
    /// Not a run log of ours.
    #[error("no metadata `{RUN}` before the first message: not a run log of asperity")]
    NoHeader,
    /// Written by a later version, or by none.
    #[error(
        "written with version {0} of the format; this program reads versions 1 to {RECORD_SCHEMA_VERSION}: a newer one is needed"
    )]
    Version(u32),
    /// A message that is not what its topic promises.
    #[error("message {sequence} of {topic} cannot be read: {error}")]
    Message {
        /// The topic.
        topic: String,
        /// The message's number in it.
        sequence: u32,
        /// What is wrong with it.
        error: serde_json::Error,
    },
    /// Switches that do not belong to the step before them.
    #[error("step {step} promises {promised} switches and has {found}")]
    Switches {
        /// The step.
        step: u64,
        /// How many its message promises.
        promised: u32,
        /// How many follow.
        found: u32,
    },
    /// A switch of a block that the chain does not have, or to where it already is.
    #[error("block {block} cannot {direction:?} at step {step}")]
    ImpossibleSwitch {
        /// The step.
        step: u64,
        /// The block.
        block: u32,
        /// What it is said to do.
        direction: Direction,
    },
    /// A step with another number of sliding blocks than its switches give.
    #[error("step {step} says that {promised} blocks slide; the switches before it leave {found}")]
    Sliding {
        /// The step.
        step: u64,
        /// How many its message says.
        promised: u32,
        /// How many are detached.
        found: u32,
    },
    /// Two headers, or something behind the end.
    #[error("{0}")]
    Misplaced(&'static str),
    /// The file ends before the run does.
    #[error("no metadata `{RUN_END}`: the run did not finish, or the file was cut off")]
    NoEnd,
    /// A signal stopped the run.
    #[error("the run was interrupted after step {0}")]
    Interrupted(u64),
    /// The log is what was left of a damaged one.
    #[error("it was salvaged from a damaged log; metadata `{SALVAGE}` says what is missing")]
    Salvaged,
    /// The content is not what `run_end` says.
    #[error("metadata `{RUN_END}` says {what} {promised}, the file has {found}")]
    EndMismatch {
        /// What differs.
        what: String,
        /// What `run_end` says.
        promised: String,
        /// What the file has.
        found: String,
    },
}

impl LogProblem {
    /// The same, with where in the file it is.
    fn at(self, at: u64) -> LogProblem {
        match self {
            LogProblem::Mcap(error) => LogProblem::Record { at, error },
            other => other,
        }
    }

    /// Whether the file only ends too early: what stands before is as it was written.
    pub fn is_early_end(&self) -> bool {
        matches!(
            self,
            LogProblem::NoEnd
                | LogProblem::Interrupted(_)
                | LogProblem::Salvaged
                | LogProblem::Mcap(mcap::McapError::UnexpectedEof)
        )
    }
}

/// Which messages to decode. All are read and checked in any case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topics {
    /// Step records with their switches.
    pub steps: bool,
    /// States of all blocks.
    pub fields: bool,
    /// Dense windows.
    pub windows: bool,
    /// Events.
    pub events: bool,
}

impl Topics {
    /// Everything.
    pub const ALL: Topics = Topics { steps: true, fields: true, windows: true, events: true };
    /// What detectors see.
    pub const STEPS: Topics = Topics { steps: true, fields: false, windows: false, events: false };
    /// Nothing: only whether the log is sound, and its last checkpoint.
    pub const NONE: Topics = Topics { steps: false, fields: false, windows: false, events: false };
    /// What a solver gave.
    pub const RECORDS: Topics = Topics { steps: true, fields: true, windows: true, events: false };
    /// What detectors emitted.
    pub const EVENTS: Topics = Topics { steps: false, fields: false, windows: false, events: true };
}

/// One thing out of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum LogItem {
    /// A record, as the solver gave it.
    Record(Record),
    /// An event, as a detector emitted it.
    Event(Event),
}

/// How far a salvaged log can be relied on: its messages bear the numbers that they had.
#[derive(Default)]
struct Salvage {
    /// The number of the next message of each topic.
    expected: BTreeMap<String, u32>,
    /// Whether messages are missing before what is read now.
    has_gap: bool,
    /// Whether switches are missing since the state of all blocks was last known.
    is_state_unknown: bool,
}

impl Salvage {
    fn take(&mut self, topic: &str, sequence: u32) {
        let expected = self.expected.entry(topic.to_owned()).or_insert(0);
        if sequence != *expected {
            self.has_gap = true;
            self.is_state_unknown = true;
        }
        *expected = sequence.saturating_add(1);
    }
}

/// Reads one run log.
pub struct RunReader {
    path: PathBuf,
    source: BufReader<File>,
    reader: LinearReader,
    /// Where the next record begins, and that which is being read.
    next_at: u64,
    at: u64,
    /// What is left of the chunk that is being read.
    chunk: Chunk,
    layout: Layout,
    topics: Topics,
    header: Option<RunHeader>,
    scenario_toml: String,
    checkpoint: Option<String>,
    /// For a salvaged log, what may be missing from it.
    salvage: Option<Salvage>,
    end: Option<RunEnd>,
    /// A step record whose switches are still being read, and how many it promises.
    open_step: Option<(StepRecord, u32)>,
    detached: Vec<bool>,
    detached_count: u32,
    last_step: u64,
    /// The step of the last record of any kind.
    record_step: u64,
    ready: VecDeque<LogItem>,
    counts: BTreeMap<String, u64>,
    /// JSON schemas by their number in the file, as far as there is room.
    schemas: BTreeMap<u16, String>,
    schema_bytes: usize,
    /// Topics of events, and the number of the schema of each.
    event_topics: BTreeMap<String, u16>,
    switches: u64,
    digest: blake3::Hasher,
    finished: bool,
}

impl RunReader {
    /// Opens a log and reads its header and scenario.
    ///
    /// # Errors
    /// If the file cannot be read or is no run log of a version this program reads.
    pub fn open(path: &Path, topics: Topics) -> Result<RunReader, LogError> {
        let at = |problem: LogProblem| LogError { path: path.to_owned(), problem };
        let file = File::open(path).map_err(|error| at(error.into()))?;
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(LONGEST_RECORD_BYTES);
        let mut reader = RunReader {
            path: path.to_owned(),
            source: BufReader::with_capacity(1 << 16, file),
            reader: LinearReader::new_with_options(options),
            next_at: mcap::MAGIC.len() as u64,
            at: 0,
            chunk: Chunk::default(),
            layout: Layout::default(),
            topics,
            header: None,
            scenario_toml: String::new(),
            checkpoint: None,
            salvage: None,
            end: None,
            open_step: None,
            detached: Vec::new(),
            detached_count: 0,
            last_step: 0,
            record_step: 0,
            ready: VecDeque::new(),
            counts: BTreeMap::new(),
            schemas: BTreeMap::new(),
            schema_bytes: 0,
            event_topics: BTreeMap::new(),
            switches: 0,
            digest: blake3::Hasher::new(),
            finished: false,
        };
        // Header and scenario stand before the first channel.
        while !reader.layout.has_channels() && !reader.finished {
            reader.advance().map_err(at)?;
        }
        match &reader.header {
            Some(_) => Ok(reader),
            None => Err(at(LogProblem::NoHeader)),
        }
    }

    /// What the run is.
    pub fn header(&self) -> &RunHeader {
        self.header.as_ref().expect("a reader is only handed out with its header read")
    }

    /// The resolved scenario, as TOML.
    pub fn scenario_toml(&self) -> &str {
        &self.scenario_toml
    }

    /// The topics of events that have been announced, all of them before the first item, and
    /// the JSON schema of each; empty where there is none.
    pub fn event_schemas(&self) -> BTreeMap<&str, &str> {
        let schema = |id: &u16| self.schemas.get(id).map_or("", String::as_str);
        self.event_topics.iter().map(|(topic, id)| (topic.as_str(), schema(id))).collect()
    }

    /// The state of the last checkpoint in what has been read, as JSON; whatever it needs of
    /// the log stands before it.
    pub fn checkpoint(&self) -> Option<&str> {
        self.checkpoint.as_deref()
    }

    /// Whether records or events are missing between the last item and those before it, as
    /// may be in a log that was salvaged. Detectors cannot see past that.
    pub fn has_gap(&self) -> bool {
        self.salvage.as_ref().is_some_and(|salvage| salvage.has_gap)
    }

    /// How the run ended; known once [`RunReader::next_item`] has given `None`.
    pub fn end(&self) -> Option<&RunEnd> {
        self.end.as_ref()
    }

    /// The next record or event; `None` behind the last one of a whole log.
    ///
    /// # Errors
    /// If the file is damaged, incomplete, or not what its own end says.
    pub fn next_item(&mut self) -> Result<Option<LogItem>, LogError> {
        loop {
            if let Some(item) = self.ready.pop_front() {
                return Ok(Some(item));
            }
            if self.finished {
                return Ok(None);
            }
            self.advance().map_err(|problem| LogError { path: self.path.clone(), problem })?;
        }
    }

    /// Reads one MCAP record.
    fn advance(&mut self) -> Result<(), LogProblem> {
        loop {
            if let Some((opcode, body)) = self.chunk.next_record().map_err(|problem| problem.at(self.at))? {
                let raw = parse(opcode, body, self.at)?;
                if matches!(raw, Raw::Chunk { .. }) {
                    return Err(LogProblem::Misplaced("there is a chunk in a chunk"));
                }
                return self.take(raw);
            }
            let raw = match self.reader.next_event() {
                None => {
                    self.finished = true;
                    if self.source.read(&mut [0])? > 0 {
                        return Err(LogProblem::Misplaced(
                            "there is something behind the end of the MCAP file",
                        ));
                    }
                    return self.check_end();
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let buffer = self.reader.insert(wanted.min(LONGEST_READ_BYTES));
                    let read = loop {
                        match self.source.read(buffer) {
                            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                            other => break other?,
                        }
                    };
                    self.reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.at = self.next_at;
                    self.next_at += (RECORD_HEAD_BYTES + data.len()) as u64;
                    parse(opcode, data, self.at)?
                }
                Some(Err(mcap::McapError::UnexpectedEof)) => return Err(self.early_end()),
                Some(Err(error)) => return Err(LogProblem::from(error).at(self.next_at)),
            };
            if let Raw::Chunk { header, data } = &raw {
                self.layout.take(&raw)?;
                self.chunk = Chunk::open(header, data).map_err(|problem| problem.at(self.at))?;
                continue;
            }
            return self.take(raw);
        }
    }

    /// What it means that the file ends inside a record: it was cut off, or the record lies
    /// about its length. A file that was cut off does not end as a whole one.
    fn early_end(&mut self) -> LogProblem {
        let mut last = [0; mcap::MAGIC.len()];
        let back = SeekFrom::End(-(last.len() as i64));
        let read = self.source.seek(back).and_then(|at| self.source.read_exact(&mut last).map(|()| at));
        match read {
            Ok(at) if at > self.next_at && last == mcap::MAGIC => LogProblem::Overlong(self.next_at),
            _ => mcap::McapError::UnexpectedEof.into(),
        }
    }

    fn take(&mut self, raw: Raw<'static>) -> Result<(), LogProblem> {
        self.layout.take(&raw)?;
        match raw {
            Raw::Metadata(metadata) if metadata.name == RUN => {
                versions::check(&metadata.metadata)?;
                let header = metadata::header_from_map(&metadata.metadata)?;
                self.detached = vec![false; header.blocks as usize];
                self.header = Some(header);
            }
            Raw::Metadata(metadata) if metadata.name == SALVAGE => self.salvage = Some(Salvage::default()),
            Raw::Metadata(metadata) if metadata.name == RUN_END => {
                self.end = Some(metadata::end_from_map(&metadata.metadata)?);
            }
            Raw::Attachment { header, data, .. } if header.name == SCENARIO => {
                self.scenario_toml = text(SCENARIO, data)?;
            }
            Raw::Attachment { header, data, .. } if header.name == CHECKPOINT => {
                self.close_step()?;
                self.checkpoint = Some(text(CHECKPOINT, data)?);
            }
            Raw::Schema { header, data } => {
                let is_new = !self.schemas.contains_key(&header.id);
                if is_new && self.schema_bytes + data.len() <= MOST_SCHEMA_BYTES {
                    self.schema_bytes += data.len();
                    self.schemas.insert(header.id, String::from_utf8_lossy(&data).into_owned());
                }
            }
            Raw::Channel(channel) => {
                if channel.topic.starts_with(EVENTS) {
                    self.event_topics.insert(channel.topic.clone(), channel.schema_id);
                }
                self.counts.entry(channel.topic).or_insert(0);
            }
            Raw::Message { header, data } => {
                let topic = self.layout.topic(header.channel_id).unwrap_or_default().to_owned();
                digest_message(&mut self.digest, &topic, &data);
                *self.counts.entry(topic.clone()).or_insert(0) += 1;
                self.message(topic, &header, &data)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, topic: String, head: &MessageHeader, data: &[u8]) -> Result<(), LogProblem> {
        let sequence = head.sequence;
        if let Some(salvage) = &mut self.salvage {
            salvage.take(&topic, sequence);
        }
        if topic == SWITCH {
            self.switches += 1;
            return if self.topics.steps {
                self.switch(decode(&topic, sequence, data)?, head)
            } else {
                Ok(())
            };
        }
        self.close_step()?;
        let header = self.header.as_ref().ok_or(LogProblem::NoHeader)?;
        let timed = |step| agree::time(header, &topic, step, head);
        match topic.as_str() {
            STEP if self.topics.steps => {
                let message: StepMessage = decode(&topic, sequence, data)?;
                timed(message.step)?;
                agree::step(&message)?;
                if message.sliding != self.detached_count && !self.is_state_unknown() {
                    let StepMessage { step, sliding: promised, .. } = message;
                    return Err(LogProblem::Sliding { step, promised, found: self.detached_count });
                }
                self.last_step = message.step;
                self.record_step = message.step;
                let promised = message.switches;
                self.open_step = Some((message.into_record(), promised));
                if promised == 0 {
                    self.close_step()?;
                }
            }
            FIELDS if self.topics.fields || (self.topics.steps && self.is_state_unknown()) => {
                let record: FieldRecord = decode(&topic, sequence, data)?;
                timed(record.step)?;
                let blocks = header.blocks;
                self.learn_state(&record);
                agree::fields(&record, blocks, self.topics.steps.then_some(&self.detached[..]))?;
                self.record_step = record.step;
                if self.topics.fields {
                    self.ready.push_back(LogItem::Record(Record::Fields(record)));
                }
            }
            WINDOW if self.topics.windows => {
                let record: WindowRecord = decode(&topic, sequence, data)?;
                timed(record.step)?;
                agree::window(&record, header.blocks)?;
                self.record_step = record.step;
                self.ready.push_back(LogItem::Record(Record::Window(record)));
            }
            _ if self.topics.events && topic.starts_with(EVENTS) => {
                // An event stands at the time of the record before it.
                if self.topics == Topics::ALL {
                    timed(self.record_step)?;
                }
                let invalid = |error| LogProblem::Message { topic: topic.clone(), sequence, error };
                let payload = std::str::from_utf8(data)
                    .map_err(|error| invalid(serde::de::Error::custom(error)))?
                    .to_owned();
                agree::event(&topic, &payload, header.blocks).map_err(invalid)?;
                self.ready.push_back(LogItem::Event(Event { topic, payload }));
            }
            _ => {}
        }
        Ok(())
    }

    fn is_state_unknown(&self) -> bool {
        self.salvage.as_ref().is_some_and(|salvage| salvage.is_state_unknown)
    }

    /// Takes from a record of all blocks what the switches that are missing would have said.
    fn learn_state(&mut self, record: &FieldRecord) {
        if let Some(salvage) = self.salvage.as_mut().filter(|salvage| salvage.is_state_unknown)
            && record.detached.len() == self.detached.len()
        {
            salvage.is_state_unknown = false;
            self.detached = record.detached.iter().map(|&detached| detached != 0).collect();
            self.detached_count = self.detached.iter().filter(|&&detached| detached).count() as u32;
        }
    }

    fn switch(&mut self, message: SwitchMessage, head: &MessageHeader) -> Result<(), LogProblem> {
        let is_state_unknown = self.is_state_unknown();
        let Some((record, promised)) = &mut self.open_step else {
            return Err(LogProblem::Switches { step: message.step, promised: 0, found: 1 });
        };
        agree::switch(record, &message)?;
        if let Some(header) = &self.header {
            agree::time(header, SWITCH, message.step, head)?;
        }
        let (step, block, direction) = (message.step, message.block, message.direction);
        let is_detached = (block as usize).checked_sub(1).and_then(|n| self.detached.get_mut(n));
        match is_detached {
            Some(_) if is_state_unknown => {}
            Some(is_detached) if *is_detached != (direction == Direction::Detach) => {
                *is_detached = !*is_detached;
                match direction {
                    Direction::Detach => self.detached_count += 1,
                    Direction::Attach => self.detached_count -= 1,
                }
            }
            _ => return Err(LogProblem::ImpossibleSwitch { step, block, direction }),
        }
        record.switches.push(message.into_switch());
        if record.switches.len() as u32 == *promised { self.close_step() } else { Ok(()) }
    }

    /// Hands out the step record that was open, if its switches are all there.
    fn close_step(&mut self) -> Result<(), LogProblem> {
        let Some((record, promised)) = self.open_step.take() else { return Ok(()) };
        let found = record.switches.len() as u32;
        if found != promised {
            return Err(LogProblem::Switches { step: record.step, promised, found });
        }
        self.ready.push_back(LogItem::Record(Record::Step(record)));
        Ok(())
    }

    fn check_end(&mut self) -> Result<(), LogProblem> {
        self.close_step()?;
        let Some(end) = &self.end else { return Err(LogProblem::NoEnd) };
        let mismatch = |what: &str, promised: String, found: String| {
            if promised == found {
                Ok(())
            } else {
                Err(LogProblem::EndMismatch { what: what.to_owned(), promised, found })
            }
        };
        // A salvaged log keeps the numbers that its messages had.
        if end.status != RunStatus::Salvaged {
            self.layout.check_numbers()?;
        }
        let topics: BTreeSet<&String> = end.message_counts.keys().chain(self.counts.keys()).collect();
        for topic in topics {
            let count = |counts: &BTreeMap<String, u64>| {
                counts.get(topic).map_or("nothing".to_owned(), ToString::to_string)
            };
            mismatch(&format!("messages of {topic}:"), count(&end.message_counts), count(&self.counts))?;
        }
        let salvaged = end.status == RunStatus::Salvaged;
        if salvaged != self.salvage.is_some() {
            return Err(LogProblem::Misplaced("metadata `salvage` and the status `salvaged` go together"));
        }
        let interrupted = end.status == RunStatus::Interrupted;
        if !interrupted && !salvaged {
            let steps = self.header.as_ref().map_or(0, |header| header.steps);
            mismatch("the last step:", end.last_step.to_string(), steps.to_string())?;
        }
        if self.topics.steps {
            mismatch("the last step:", end.last_step.to_string(), self.last_step.to_string())?;
        }
        mismatch("switches:", end.switches.to_string(), self.switches.to_string())?;
        mismatch("digest:", end.digest.clone(), self.digest.finalize().to_hex().to_string())?;
        match end.status {
            RunStatus::Interrupted => Err(LogProblem::Interrupted(end.last_step)),
            RunStatus::Salvaged => Err(LogProblem::Salvaged),
            RunStatus::Complete | RunStatus::LoadNotReached => Ok(()),
        }
    }
}

fn decode<T: DeserializeOwned>(topic: &str, sequence: u32, data: &[u8]) -> Result<T, LogProblem> {
    serde_json::from_slice(data).map_err(|error| LogProblem::Message {
        topic: topic.to_owned(),
        sequence,
        error,
    })
}

/// A record out of its bytes.
fn parse(opcode: u8, body: &[u8], at: u64) -> Result<Raw<'static>, LogProblem> {
    if !lengths::fit(opcode, body) {
        return Err(LogProblem::InnerLength { at, opcode });
    }
    match mcap::parse_record(opcode, body) {
        Ok(raw) => Ok(raw.into_owned()),
        Err(error) => Err(LogProblem::Record { at, error }),
    }
}

fn text(name: &'static str, data: std::borrow::Cow<'_, [u8]>) -> Result<String, LogProblem> {
    String::from_utf8(data.into_owned()).map_err(|_| LogProblem::NotText(name))
}
