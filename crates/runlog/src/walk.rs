//! Walks through the messages of a damaged log in order, and decides which of them can be kept.
//! Missing messages are detected by the message numbers, which count from 0 within each topic.

use std::collections::BTreeMap;

use asperity_record::{EventKind, FieldRecord, RunEnd, RunHeader, WindowRecord, counted};
use mcap::records::{Channel, MessageHeader, Record, SchemaHeader};
use serde_json::{Map, Value};

use crate::agree;
use crate::chunk::Chunk;
use crate::findings::{Gap, Salvaged};
use crate::format::{EVENTS, FIELDS, MOST_SCHEMA_BYTES, STEP, SWITCH, WINDOW};
use crate::messages::{StepMessage, SwitchMessage, Topic};
use crate::parse::parse;
use crate::problem::{LogProblem, WriteError};

/// A message of a chunk.
pub(crate) struct Message {
    pub(crate) topic: String,
    pub(crate) sequence: u32,
    pub(crate) time_ns: u64,
    pub(crate) payload: Vec<u8>,
    kind: Kind,
}

/// The parts of a message that decide whether it can be kept.
#[derive(Clone, Copy)]
enum Kind {
    Step { step: u64, switches: u32 },
    Switch { step: u64 },
    State { step: u64 },
    Event,
}

/// An announced schema.
struct Schema {
    name: String,
    text: String,
}

/// The schema of messages about which nothing else is known.
const ANY_OBJECT: &str = r#"{"type":"object"}"#;

/// Why a chunk's messages were not kept.
pub(crate) enum ChunkProblem {
    /// It contains what no run writes.
    Content(String),
    /// Writing failed.
    Write(WriteError),
}

pub(crate) type Keep<'a> = dyn FnMut(&Message) -> Result<(), WriteError> + 'a;

/// Follows messages by topic and number, and keeps those that are complete: a step with all of its
/// switches, and any other message by itself.
pub(crate) struct Walk<'a> {
    events: &'a [EventKind],
    header: &'a RunHeader,
    topics: BTreeMap<u16, String>,
    /// JSON schemas by their number in the file, up to the bound on their size.
    schemas: BTreeMap<u16, Schema>,
    schema_bytes: usize,
    /// Announced topics of events that are not among `events`, or have other fields there, as other code wrote them.
    foreign: BTreeMap<String, Topic>,
    foreign_bytes: usize,
    /// Number of unidentified events: their announcement is lost or exceeded the bound.
    nameless: u64,
    /// The next number of each topic, and the number of gaps before its last message: missing
    /// messages of the topic lie after that.
    expected: BTreeMap<String, (u32, usize)>,
    /// A step whose switches are not complete, with those read so far.
    unit: Vec<Message>,
    missing_switches: u32,
    last_step: Option<u64>,
    last_step_record: Option<u64>,
    /// The time of the last message kept.
    last_ns: u64,
    /// Whether something is missing since the last message kept.
    in_gap: bool,
    repeated: u64,
    /// Number of messages whose step is before that of an earlier message.
    contrary: u64,
    salvaged: Salvaged,
}

/// Far above the longest state of that many blocks: a dozen numbers per block, of two dozen bytes each.
fn longest_state(blocks: u32) -> usize {
    4096 + 512 * blocks as usize
}

impl<'a> Walk<'a> {
    pub(crate) fn new(events: &'a [EventKind], header: &'a RunHeader) -> Walk<'a> {
        Walk {
            events,
            header,
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
            last_step_record: None,
            last_ns: 0,
            in_gap: false,
            repeated: 0,
            contrary: 0,
            salvaged: Salvaged::default(),
        }
    }

    /// Records that messages are missing before the next chunk.
    pub(crate) fn begin_gap(&mut self) {
        self.lose_unit();
        self.in_gap = true;
    }

    /// Adds the messages of a chunk, or none of them if one is invalid.
    pub(crate) fn chunk(
        &mut self,
        at: u64,
        chunk: &mut Chunk,
        keep: &mut Keep<'_>,
    ) -> Result<(), ChunkProblem> {
        let messages = self.messages(at, chunk).map_err(ChunkProblem::Content)?;
        messages.into_iter().try_for_each(|message| self.take(message, keep)).map_err(ChunkProblem::Write)
    }

    /// Returns the messages of a chunk, without those of which a chunk before it has the numbers; an error
    /// if one does not match its topic, or is of another number of blocks or time step.
    pub(crate) fn messages(&mut self, at: u64, chunk: &mut Chunk) -> Result<Vec<Message>, String> {
        let mut messages = Vec::new();
        let (mut nameless, mut repeated) = (0, 0);
        while let Some((opcode, body)) = chunk.next_record().map_err(|error| error.to_string())? {
            match parse(opcode, body, at).map_err(|error| error.to_string())? {
                Record::Schema { header, data } => self.schema(header, &data),
                Record::Channel(channel) => self.channel(channel),
                Record::Message { header, .. } if self.is_repeated(&header) => repeated += 1,
                Record::Message { header, data } => {
                    let payload = data.into_owned();
                    let (sequence, time_ns) = (header.sequence, header.log_time);
                    match self.identify(header.channel_id, &payload)? {
                        Some((topic, kind)) => {
                            if let Some(step) = kind.step() {
                                agree::time(self.header, &topic, step, &header)
                                    .map_err(|problem| problem.to_string())?;
                            }
                            messages.push(Message { topic, sequence, time_ns, payload, kind });
                        }
                        None => nameless += 1,
                    }
                }
                _ => {}
            }
        }
        self.nameless += nameless;
        self.repeated += repeated;
        Ok(messages)
    }

    /// Whether a message of this topic with this number was noted.
    fn is_repeated(&self, header: &MessageHeader) -> bool {
        let next = self.topics.get(&header.channel_id).and_then(|topic| self.expected.get(topic));
        next.is_some_and(|&(next, _)| header.sequence < next)
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
        let has_other_fields = |kind: &EventKind| {
            let announced =
                self.schemas.get(&schema_id).map(|schema| serde_json::from_str::<Value>(&schema.text));
            announced.is_some_and(|schema| schema.is_ok_and(|schema| schema != *kind.schema()))
        };
        let own = self.events.iter().find(|kind| kind.topic == topic);
        let is_foreign = own.map_or(!self.is_known(&topic), has_other_fields);
        if topic.starts_with(EVENTS) && is_foreign && !self.foreign.contains_key(&topic) {
            let (schema_name, schema) = match self.schemas.get(&schema_id) {
                Some(Schema { name, text }) => (name.as_str(), text.as_str()),
                None => (topic.as_str(), ANY_OBJECT),
            };
            let bytes = topic.len() + schema_name.len() + schema.len();
            // Several topics may refer to one long schema.
            if self.foreign_bytes + bytes <= MOST_SCHEMA_BYTES {
                self.foreign_bytes += bytes;
                let (schema_name, schema) = (schema_name.to_owned(), schema.to_owned());
                self.foreign.insert(topic.clone(), Topic { topic: topic.clone(), schema_name, schema });
            }
        }
        self.topics.insert(id, topic);
    }

    /// Identifies the topic and kind of a message; None for an event of an unknown kind.
    fn identify(&self, channel: u16, payload: &[u8]) -> Result<Option<(String, Kind)>, String> {
        match self.topics.get(&channel) {
            Some(topic) if topic.starts_with(EVENTS) && !self.is_known(topic) => Ok(None),
            Some(topic) => Ok(Some((topic.clone(), self.kind(topic, payload)?))),
            // The chunk that announced the channels is lost.
            None => self.recognise(payload),
        }
    }

    /// The kind of a message, which must match its topic and the slider.
    fn kind(&self, topic: &str, payload: &[u8]) -> Result<Kind, String> {
        let refused = |error: serde_json::Error| format!("a message of {topic} that cannot be read: {error}");
        let words = |problem: LogProblem| problem.to_string();
        let blocks = self.header.blocks;
        Ok(match topic {
            STEP => {
                let message: StepMessage = serde_json::from_slice(payload).map_err(refused)?;
                agree::step(self.header, &message, None).map_err(words)?;
                let StepMessage { step, switches, sliding, .. } = message;
                if switches > blocks || sliding > blocks {
                    return Err(format!(
                        "step {step}: more blocks switch or slide than the {blocks} there are"
                    ));
                }
                Kind::Step { step, switches }
            }
            SWITCH => {
                let message: SwitchMessage = serde_json::from_slice(payload).map_err(refused)?;
                agree::parts_of_switch(self.header, &message).map_err(words)?;
                let SwitchMessage { step, block, .. } = message;
                if !(1..=blocks).contains(&block) {
                    let all = agree::all_of(self.header);
                    return Err(format!("step {step}: a switch of block {block} of {all}"));
                }
                Kind::Switch { step }
            }
            // In memory these take several times as much as here.
            FIELDS | WINDOW if payload.len() > longest_state(blocks) => {
                return Err(format!("a message of {topic} of {} bytes, for {blocks} blocks", payload.len()));
            }
            FIELDS => {
                let record: FieldRecord = serde_json::from_slice(payload).map_err(refused)?;
                agree::fields(self.header, &record, None).map_err(words)?;
                Kind::State { step: record.step }
            }
            WINDOW => {
                let record: WindowRecord = serde_json::from_slice(payload).map_err(refused)?;
                agree::window(self.header, &record).map_err(words)?;
                Kind::State { step: record.step }
            }
            _ if self.foreign.contains_key(topic) => {
                serde_json::from_slice::<Map<String, Value>>(payload).map_err(refused)?;
                Kind::Event
            }
            _ => {
                let kind = self.events.iter().find(|kind| kind.topic == topic);
                let kind = kind.ok_or_else(|| format!("a message of {topic}, which no run writes"))?;
                let object = serde_json::from_slice(payload).map_err(refused)?;
                if !has_the_fields_of(kind.schema(), &object) {
                    return Err(format!("a message of {topic} with other fields"));
                }
                agree::event(topic, &String::from_utf8_lossy(payload), self.header).map_err(refused)?;
                Kind::Event
            }
        })
    }

    /// Recognises the topic of a message by its fields, which no two topics share; other objects
    /// are events of unknown detectors.
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
        if self.goes_back(&message) {
            self.contrary += 1;
            return Ok(());
        }
        if message.sequence > expected {
            // Switches missing before the first one of a step belong to other steps.
            if !self.is_first_switch(&message) {
                self.lose_unit();
            }
            self.lose_after(gaps, &message.topic, u64::from(message.sequence - expected));
        }
        self.note(&message);
        match message.kind {
            Kind::Step { switches, .. } => {
                self.lose_unit();
                self.missing_switches = switches;
                self.unit.push(message);
            }
            Kind::Switch { step } => {
                if self.unit.first().and_then(Message::step) != Some(step) {
                    self.lose_unit();
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

    /// Whether a message is the first switch of the step before it.
    fn is_first_switch(&self, message: &Message) -> bool {
        let [step] = &self.unit[..] else { return false };
        matches!(message.kind, Kind::Switch { .. }) && step.step() == message.step()
    }

    /// Whether a message is of an earlier step than one before it.
    fn goes_back(&self, message: &Message) -> bool {
        let before = self.unit.first().and_then(Message::step).or(self.last_step);
        match message.kind {
            Kind::Step { step, .. } => {
                let last = self.unit.first().and_then(Message::step).max(self.last_step_record);
                before.is_some_and(|before| step < before) || last.is_some_and(|last| step <= last)
            }
            Kind::Switch { step } | Kind::State { step } => before.is_some_and(|before| step < before),
            Kind::Event => message.time_ns < self.last_ns,
        }
    }

    fn keep(&mut self, message: &Message, keep: &mut Keep<'_>) -> Result<(), WriteError> {
        if let Some(step) = message.step() {
            if std::mem::take(&mut self.in_gap) {
                self.salvaged.gaps.push(Gap { after_step: self.last_step, before_step: Some(step) });
            }
            self.last_step = Some(step);
            if matches!(message.kind, Kind::Step { .. }) {
                self.last_step_record = Some(step);
            }
        }
        self.last_ns = message.time_ns;
        // Again, because the number of gaps may have grown.
        self.note(message);
        *self.salvaged.kept.entry(message.topic.clone()).or_default() += 1;
        keep(message)
    }

    /// Notes the number of a message.
    pub(crate) fn note(&mut self, message: &Message) {
        // An event does not end a gap, but messages missing before it lie in the gap.
        let gaps = self.salvaged.gaps.len() + usize::from(self.in_gap);
        let next = (message.sequence.saturating_add(1), gaps);
        self.expected.insert(message.topic.clone(), next);
    }

    /// Records that messages of a topic are missing after that many gaps: they may have been lost
    /// in a later one, together with messages of another topic.
    fn lose_after(&mut self, gaps: usize, topic: &str, messages: u64) {
        let in_known_gap = !self.in_gap && self.salvaged.gaps.len() > gaps;
        self.lose(topic, messages);
        self.in_gap &= !in_known_gap;
    }

    fn lose(&mut self, topic: &str, messages: u64) {
        *self.salvaged.lost.entry(topic.to_owned()).or_default() += messages;
        self.in_gap = true;
    }

    /// Drops a step without all of its switches.
    fn lose_unit(&mut self) {
        for message in std::mem::take(&mut self.unit) {
            *self.salvaged.lost.entry(message.topic).or_default() += 1;
            self.in_gap = true;
        }
        self.missing_switches = 0;
    }

    /// The summary of kept and lost messages, and the topics of unknown events.
    pub(crate) fn finish(mut self, end: Option<&RunEnd>) -> (Salvaged, BTreeMap<String, Topic>) {
        self.lose_unit();
        for (topic, &count) in end.iter().flat_map(|end| &end.message_counts) {
            if count > 0 && !self.is_known(topic) {
                // Their positions are unknown, so they make no gap.
                self.salvaged.lost.insert(topic.clone(), count);
                let events = counted(count, "event");
                self.salvaged
                    .remarks
                    .push(format!("{topic} is left out: the announcement of its {events} is lost"));
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
            self.salvaged.remarks.push(format!("{} stood there twice", counted(self.repeated, "message")));
        }
        if self.contrary > 0 {
            let messages = counted(self.contrary, "message");
            self.salvaged
                .remarks
                .push(format!("{messages} left out, which go back behind those before them"));
        }
        if self.nameless > 0 {
            let events = counted(self.nameless, "event");
            self.salvaged
                .remarks
                .push(format!("{events} left out: nothing is left that announces their topic"));
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
    pub(crate) fn step(&self) -> Option<u64> {
        self.kind.step()
    }
}

impl Kind {
    fn step(self) -> Option<u64> {
        match self {
            Kind::Step { step, .. } | Kind::Switch { step } | Kind::State { step } => Some(step),
            Kind::Event => None,
        }
    }
}

/// Whether an object has exactly the fields of its schema: all that are required, and no others.
fn has_the_fields_of(schema: &Value, payload: &Value) -> bool {
    let Some(fields) = payload.as_object() else { return false };
    let named = schema["properties"].as_object();
    let required = schema["required"].as_array();
    fields.keys().all(|field| named.is_some_and(|named| named.contains_key(field)))
        && required
            .is_some_and(|all| all.iter().filter_map(Value::as_str).all(|one| fields.contains_key(one)))
}
