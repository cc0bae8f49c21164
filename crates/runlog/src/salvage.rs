//! Putting together what is left of a damaged log.
//!
//! A record is kept if something other than itself says that it is what was written: chunks
//! and attachments have checksums, the header is compared with the scenario (by whoever calls,
//! since this crate does not know scenarios), and every message must be one of its topic.
//! Where the file cannot be followed from record to record, it is searched for the next one
//! that proves itself. What falls out is told by the messages' own numbers, each topic's
//! counted from 0 without a gap, so that a chunk that was cut out without a trace is missed
//! as well as one that was overwritten.
//!
//! The result is a log with the status `salvaged`, and a metadata record `salvage` that says
//! where something is missing. Messages keep their numbers, so any reader sees the gaps.
//!
//! Events of detectors that are not known here are kept under the topic and the schema that
//! the log announces. Where the announcement is lost, nothing says what they are: they are
//! left out, and this is remarked.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use asperity_record::{
    EventKind, FieldRecord, RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, SolverReport, WindowRecord,
};
use mcap::records::{Channel, Record, SchemaHeader};
use serde_json::{Map, Value};

use crate::chunk::Chunk;
use crate::findings::{Gap, Salvaged};
use crate::format::{EVENTS, FIELDS, MOST_SCHEMA_BYTES, STEP, SWITCH, WINDOW};
use crate::messages::{StepMessage, SwitchMessage, Topic};
use crate::metadata;
use crate::parse::parse;
use crate::pieces::{Piece, Pieces};
use crate::problem::{LogProblem, WriteError};
use crate::read::{RunReader, Topics};
use crate::versions;
use crate::write::RunWriter;

/// A log that nothing could be made of.
#[derive(Debug, thiserror::Error)]
pub enum SalvageError {
    /// The input cannot be read.
    #[error("{path}: {error}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        error: io::Error,
    },
    /// There is nothing to do.
    #[error("{0} is whole: there is nothing to salvage")]
    Whole(String),
    /// Neither header nor scenario is left, or they are of a version that is not known.
    #[error("{path}: {problem}")]
    Hopeless {
        /// The file.
        path: String,
        /// What is missing.
        problem: String,
    },
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// What the caller makes of header and scenario, either of which may be missing: the header
/// to go on with, and what is to be remarked about it; or why there is none.
pub type Settle<'a> =
    dyn Fn(Option<RunHeader>, Option<&str>) -> Result<(RunHeader, Vec<String>), String> + 'a;

/// Writes what is left of the log `input` to a new log `output`.
///
/// # Errors
/// If `input` is whole, cannot be read or has nothing left that says what run it is of, or
/// `output` exists or cannot be written.
pub fn salvage(
    input: &Path,
    output: &Path,
    events: &[EventKind],
    settle: &Settle<'_>,
) -> Result<Salvaged, SalvageError> {
    let name = input.display().to_string();
    let read_error = |error| SalvageError::Read { path: name.clone(), error };
    if is_whole(input) {
        return Err(SalvageError::Whole(name));
    }
    let mut pieces = Pieces::open(input).map_err(read_error)?;
    // Once to see what there is, once to write it: the gaps are told at the beginning.
    let mut found = Found::default();
    let mut walk = Walk::new(events);
    while let Some(piece) = pieces.next().map_err(read_error)? {
        match piece {
            Piece::Run(map) => found.run(&map),
            Piece::Scenario(text) => found.scenario = found.scenario.or(Some(text)),
            Piece::End(end) => found.end = Some(end),
            Piece::Checkpoint(_) => {}
            Piece::Chunk { at, mut chunk } => match walk.chunk(at, &mut chunk, &mut |_| Ok(())) {
                Ok(()) => {}
                Err(ChunkProblem::Content(what)) => pieces.reject(at, what),
                Err(ChunkProblem::Write(error)) => return Err(error.into()),
            },
        }
    }
    let hopeless = |problem: String| SalvageError::Hopeless { path: name.clone(), problem };
    if let Some(problem) = found.problem {
        return Err(hopeless(problem));
    }
    let has_scenario = found.scenario.is_some();
    let (mut header, mut remarks) = settle(found.header, found.scenario.as_deref()).map_err(hopeless)?;
    // Whatever version the damaged one was in, this one is written in the present one.
    header.record_schema_version = RECORD_SCHEMA_VERSION;
    if !has_scenario {
        remarks.push("the scenario is lost".to_owned());
    }
    let (mut salvaged, foreign) = walk.finish(found.end.as_ref());
    salvaged.damage = std::mem::take(&mut pieces.damage);
    salvaged.damage.sort_by_key(|damage| damage.from_byte);
    salvaged.remarks.splice(0..0, remarks);

    let scenario = found.scenario.unwrap_or_default();
    let topics = events.iter().map(Topic::of).chain(foreign.into_values());
    let mut writer = RunWriter::create_salvaged(output, input, &header, &scenario, topics)?;
    let report = found.end.map_or(SolverReport::default(), |end| end.solver);
    let written = writer
        .salvaged(&salvaged)
        .map_err(SalvageError::from)
        .and_then(|()| write_pieces(input, events, &mut writer))
        .and_then(|()| Ok(writer.finish(RunStatus::Salvaged, report)?));
    // If it fails, nothing is left of it: it can be made again from what is still there.
    written.map(|_end| salvaged)
}

/// Writes what the first walk found to be good.
fn write_pieces(input: &Path, events: &[EventKind], writer: &mut RunWriter) -> Result<(), SalvageError> {
    let read_error = |error| SalvageError::Read { path: input.display().to_string(), error };
    let mut walk = Walk::new(events);
    let mut pieces = Pieces::open(input).map_err(read_error)?;
    while let Some(piece) = pieces.next().map_err(read_error)? {
        match piece {
            Piece::Chunk { at, mut chunk } => {
                let written = walk.chunk(at, &mut chunk, &mut |message| {
                    writer.salvaged_message(
                        &message.topic,
                        message.sequence,
                        message.time_ns,
                        message.step(),
                        &message.payload,
                    )
                });
                // What is refused was so the first time, and is told of.
                if let Err(ChunkProblem::Write(error)) = written {
                    return Err(error.into());
                }
            }
            Piece::Checkpoint(state) => writer.salvaged_checkpoint(&state)?,
            _ => {}
        }
    }
    Ok(())
}

fn is_whole(path: &Path) -> bool {
    RunReader::open(path, Topics::ALL).and_then(|mut reader| reader.verify()).is_ok()
}

/// What stands beside the messages.
#[derive(Default)]
struct Found {
    header: Option<RunHeader>,
    scenario: Option<String>,
    end: Option<RunEnd>,
    /// Why nothing can be made of the log at all.
    problem: Option<String>,
}

impl Found {
    fn run(&mut self, map: &BTreeMap<String, String>) {
        match versions::check(map) {
            Err(problem @ LogProblem::Version(_)) => self.problem = Some(problem.to_string()),
            _ => self.header = self.header.take().or_else(|| metadata::header_from_map(map).ok()),
        }
    }
}

/// A message of a chunk.
struct Message {
    topic: String,
    sequence: u32,
    time_ns: u64,
    payload: Vec<u8>,
    kind: Kind,
}

/// What of a message decides whether it can be kept.
#[derive(Clone, Copy)]
enum Kind {
    Step { step: u64, switches: u32 },
    Switch { step: u64 },
    State { step: u64 },
    Event,
}

/// What a log announces messages with.
struct Schema {
    name: String,
    text: String,
}

/// The schema of messages of which nothing else is known.
const ANY_OBJECT: &str = r#"{"type":"object"}"#;

/// Why a chunk's messages were not taken.
enum ChunkProblem {
    /// It holds what no run writes.
    Content(String),
    /// They could not be written.
    Write(WriteError),
}

type Keep<'a> = dyn FnMut(&Message) -> Result<(), WriteError> + 'a;

/// Follows messages by topic and number, and keeps those that make sense: a step with all of
/// its switches, and all else by itself.
struct Walk<'a> {
    events: &'a [EventKind],
    topics: BTreeMap<u16, String>,
    /// JSON schemas by their number in the file, as far as there is room.
    schemas: BTreeMap<u16, Schema>,
    schema_bytes: usize,
    /// Topics of events that the log announces and that are not among `events`.
    foreign: BTreeMap<String, Topic>,
    foreign_bytes: usize,
    /// Events that are none of these, since their announcement is lost or there was no room for it.
    nameless: u64,
    /// The number of the next message of each topic, and how many gaps there were before the
    /// last one: what is missing of the topic lies after that.
    expected: BTreeMap<String, (u32, usize)>,
    /// A step whose switches are not all there yet, with those that are.
    unit: Vec<Message>,
    missing_switches: u32,
    last_step: Option<u64>,
    /// Whether something is missing since the last message that was kept.
    in_gap: bool,
    repeated: u64,
    salvaged: Salvaged,
}

impl<'a> Walk<'a> {
    fn new(events: &'a [EventKind]) -> Walk<'a> {
        Walk {
            events,
            topics: BTreeMap::new(),
            schemas: BTreeMap::new(),
            schema_bytes: 0,
            foreign: BTreeMap::new(),
            foreign_bytes: 0,
            nameless: 0,
            expected: BTreeMap::new(),
            unit: Vec::new(),
            missing_switches: 0,
            last_step: None,
            in_gap: false,
            repeated: 0,
            salvaged: Salvaged::default(),
        }
    }

    /// Takes the messages of a chunk, all of them or, if one is not what it should be, none.
    fn chunk(&mut self, at: u64, chunk: &mut Chunk, keep: &mut Keep<'_>) -> Result<(), ChunkProblem> {
        let messages = self.messages(at, chunk).map_err(ChunkProblem::Content)?;
        messages.into_iter().try_for_each(|message| self.take(message, keep)).map_err(ChunkProblem::Write)
    }

    fn messages(&mut self, at: u64, chunk: &mut Chunk) -> Result<Vec<Message>, String> {
        let mut messages = Vec::new();
        let mut nameless = 0;
        while let Some((opcode, body)) = chunk.next_record().map_err(|error| error.to_string())? {
            match parse(opcode, body, at).map_err(|error| error.to_string())? {
                Record::Schema { header, data } => self.schema(header, &data),
                Record::Channel(channel) => self.channel(channel),
                Record::Message { header, data } => {
                    let payload = data.into_owned();
                    let (sequence, time_ns) = (header.sequence, header.log_time);
                    match self.identify(header.channel_id, &payload)? {
                        Some((topic, kind)) => {
                            messages.push(Message { topic, sequence, time_ns, payload, kind });
                        }
                        None => nameless += 1,
                    }
                }
                _ => {}
            }
        }
        self.nameless += nameless;
        Ok(messages)
    }

    fn schema(&mut self, header: SchemaHeader, text: &[u8]) {
        let is_new = !self.schemas.contains_key(&header.id);
        if is_new
            && header.encoding == "jsonschema"
            && self.schema_bytes + header.name.len() + text.len() <= MOST_SCHEMA_BYTES
            && let Ok(text) = std::str::from_utf8(text)
        {
            self.schema_bytes += header.name.len() + text.len();
            self.schemas.insert(header.id, Schema { name: header.name, text: text.to_owned() });
        }
    }

    fn channel(&mut self, channel: Channel) {
        let Channel { id, topic, schema_id, .. } = channel;
        if topic.starts_with(EVENTS) && !self.is_known(&topic) {
            let (schema_name, schema) = match self.schemas.get(&schema_id) {
                Some(Schema { name, text }) => (name.as_str(), text.as_str()),
                None => (topic.as_str(), ANY_OBJECT),
            };
            let bytes = topic.len() + schema_name.len() + schema.len();
            // Several topics may name one long schema.
            if self.foreign_bytes + bytes <= MOST_SCHEMA_BYTES {
                self.foreign_bytes += bytes;
                let (schema_name, schema) = (schema_name.to_owned(), schema.to_owned());
                self.foreign.insert(topic.clone(), Topic { topic: topic.clone(), schema_name, schema });
            }
        }
        self.topics.insert(id, topic);
    }

    /// Of what topic a message is, and what it is; none if it is an event that is not known.
    fn identify(&self, channel: u16, payload: &[u8]) -> Result<Option<(String, Kind)>, String> {
        match self.topics.get(&channel) {
            Some(topic) if topic.starts_with(EVENTS) && !self.is_known(topic) => Ok(None),
            Some(topic) => Ok(Some((topic.clone(), self.kind(topic, payload)?))),
            // The chunk that announced the channels is lost.
            None => self.recognise(payload),
        }
    }

    /// What a message of a topic is, which must be what the topic promises.
    fn kind(&self, topic: &str, payload: &[u8]) -> Result<Kind, String> {
        let refused = |error: serde_json::Error| format!("a message of {topic} that cannot be read: {error}");
        Ok(match topic {
            STEP => {
                let message: StepMessage = serde_json::from_slice(payload).map_err(refused)?;
                Kind::Step { step: message.step, switches: message.switches }
            }
            SWITCH => {
                Kind::Switch { step: serde_json::from_slice::<SwitchMessage>(payload).map_err(refused)?.step }
            }
            FIELDS => {
                Kind::State { step: serde_json::from_slice::<FieldRecord>(payload).map_err(refused)?.step }
            }
            WINDOW => {
                Kind::State { step: serde_json::from_slice::<WindowRecord>(payload).map_err(refused)?.step }
            }
            _ if self.foreign.contains_key(topic) => {
                serde_json::from_slice::<Map<String, Value>>(payload).map_err(refused)?;
                Kind::Event
            }
            _ => {
                let kind = self.events.iter().find(|kind| kind.topic == topic);
                let kind = kind.ok_or_else(|| format!("a message of {topic}, which no run writes"))?;
                let payload = serde_json::from_slice(payload).map_err(refused)?;
                if !has_the_fields_of(&kind.schema, &payload) {
                    return Err(format!("a message of {topic} with other fields"));
                }
                Kind::Event
            }
        })
    }

    /// Of what topic a message must be. Each has fields that no other has; an object with yet
    /// others is of a detector that is not known here.
    fn recognise(&self, payload: &[u8]) -> Result<Option<(String, Kind)>, String> {
        let topics =
            [STEP, SWITCH, FIELDS, WINDOW].into_iter().chain(self.events.iter().map(|kind| kind.topic));
        let recognised =
            topics.filter_map(|topic| Some((topic.to_owned(), self.kind(topic, payload).ok()?))).next();
        match recognised {
            None if serde_json::from_slice::<Map<String, Value>>(payload).is_err() => {
                Err("a message of no topic that is known".to_owned())
            }
            recognised => Ok(recognised),
        }
    }

    fn take(&mut self, message: Message, keep: &mut Keep<'_>) -> Result<(), WriteError> {
        let (expected, gaps) = self.expected.get(&message.topic).copied().unwrap_or_default();
        if message.sequence < expected {
            self.repeated += 1;
            return Ok(());
        }
        if message.sequence > expected {
            self.lose_after(gaps, &message.topic.clone(), u64::from(message.sequence - expected));
        }
        self.note(&message);
        match message.kind {
            Kind::Step { switches, .. } => {
                self.lose_unit();
                self.missing_switches = switches;
                self.unit.push(message);
            }
            Kind::Switch { step } => {
                let fits = self
                    .unit
                    .first()
                    .is_some_and(|unit| matches!(unit.kind, Kind::Step { step: of, .. } if of == step));
                if !fits {
                    self.lose(SWITCH, 1);
                    return Ok(());
                }
                self.missing_switches -= 1;
                self.unit.push(message);
            }
            Kind::State { .. } | Kind::Event => {
                self.lose_unit();
                return self.keep(&message, keep);
            }
        }
        if self.missing_switches == 0 {
            for message in std::mem::take(&mut self.unit) {
                self.keep(&message, keep)?;
            }
        }
        Ok(())
    }

    fn keep(&mut self, message: &Message, keep: &mut Keep<'_>) -> Result<(), WriteError> {
        if let Some(step) = message.step() {
            if std::mem::take(&mut self.in_gap) {
                self.salvaged.gaps.push(Gap { after_step: self.last_step, before_step: Some(step) });
            }
            self.last_step = Some(step);
        }
        // Again: there may be a gap more now.
        self.note(message);
        *self.salvaged.kept.entry(message.topic.clone()).or_default() += 1;
        keep(message)
    }

    fn note(&mut self, message: &Message) {
        let next = (message.sequence.saturating_add(1), self.salvaged.gaps.len());
        self.expected.insert(message.topic.clone(), next);
    }

    /// Takes note that messages of a topic are missing after that many gaps: they may have
    /// gone with what was missing of another topic in a later one.
    fn lose_after(&mut self, gaps: usize, topic: &str, messages: u64) {
        let in_known_gap = !self.in_gap && self.salvaged.gaps.len() > gaps;
        self.lose(topic, messages);
        self.in_gap &= !in_known_gap;
    }

    fn lose(&mut self, topic: &str, messages: u64) {
        // What a step still waits for is among what is lost.
        self.lose_unit();
        *self.salvaged.lost.entry(topic.to_owned()).or_default() += messages;
        self.in_gap = true;
    }

    /// A step is of no use without all of its switches.
    fn lose_unit(&mut self) {
        for message in std::mem::take(&mut self.unit) {
            *self.salvaged.lost.entry(message.topic).or_default() += 1;
            self.in_gap = true;
        }
        self.missing_switches = 0;
    }

    /// What was kept and what was lost, and the topics of events that are not known here.
    fn finish(mut self, end: Option<&RunEnd>) -> (Salvaged, BTreeMap<String, Topic>) {
        self.lose_unit();
        for (topic, &count) in end.iter().flat_map(|end| &end.message_counts) {
            if count > 0 && !self.is_known(topic) {
                // They may stand anywhere, so this makes no gap.
                self.salvaged.lost.insert(topic.clone(), count);
                self.salvaged
                    .remarks
                    .push(format!("{topic} is left out: the announcement of its {count} events is lost"));
                self.nameless = self.nameless.saturating_sub(count);
                continue;
            }
            let (expected, gaps) = self.expected.get(topic).copied().unwrap_or_default();
            let missing = count.saturating_sub(u64::from(expected));
            if missing > 0 {
                self.lose_after(gaps, topic, missing);
            }
        }
        self.salvaged.end_is_known = end.is_some();
        if self.in_gap || end.is_none() {
            self.salvaged.gaps.push(Gap { after_step: self.last_step, before_step: None });
        }
        if self.repeated > 0 {
            self.salvaged.remarks.push(format!("{} messages stood there twice", self.repeated));
        }
        if self.nameless > 0 {
            let remark =
                format!("{} events are left out: nothing is left that announces their topic", self.nameless);
            self.salvaged.remarks.push(remark);
        }
        (self.salvaged, self.foreign)
    }

    fn is_known(&self, topic: &str) -> bool {
        [STEP, SWITCH, FIELDS, WINDOW].contains(&topic)
            || self.events.iter().any(|kind| kind.topic == topic)
            || self.foreign.contains_key(topic)
    }
}

impl Message {
    fn step(&self) -> Option<u64> {
        match self.kind {
            Kind::Step { step, .. } | Kind::Switch { step } | Kind::State { step } => Some(step),
            Kind::Event => None,
        }
    }
}

/// Whether an object has all the fields that its schema requires, and none that it does not
/// name.
fn has_the_fields_of(schema: &Value, payload: &Value) -> bool {
    let Some(fields) = payload.as_object() else { return false };
    let named = schema["properties"].as_object();
    let required = schema["required"].as_array();
    fields.keys().all(|field| named.is_some_and(|named| named.contains_key(field)))
        && required
            .is_some_and(|all| all.iter().filter_map(Value::as_str).all(|one| fields.contains_key(one)))
}
