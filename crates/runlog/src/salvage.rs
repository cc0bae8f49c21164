//! Salvages a damaged log.
//!
//! Chunks are taken in the order of the file. Of each whose checksum is right, all messages are kept, if each of them
//! is of its topic and of this run; behind damage the file is searched for the next such chunk ([`pieces`]). A step
//! needs all of its switches. Messages that stand behind later ones, as in a chunk that was moved, are left out.
//!
//! The result is a log with the status `salvaged` and a metadata record `salvage` that states the gaps. Messages keep
//! their numbers, which count from 0 within each topic and so tell where some are missing.
//!
//! [`pieces`]: crate::pieces

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use asperity_record::{EventKind, Parts, RowKind, RunEnd, RunHeader, RunStatus, SolverReport, counted};
use mcap::records::{MessageHeader, Record, op};

use crate::chunk::Chunk;
use crate::digest::Digests;
use crate::findings::{Damage, Gap, Salvaged};
use crate::format::{
    CHECKPOINT, DESCRIPTIONS, FIELDS, MOST_CHANNELS, MOST_SCHEMA_BYTES, RUN, RUN_END, SIGNAL, STEP, SWITCH,
    TRACES, WINDOW,
};
use crate::messages::{Message, Topic};
use crate::metadata;
use crate::parse::parse;
use crate::pieces::{Piece, Pieces};
use crate::problem::{LogProblem, WriteError};
use crate::unfinished::Place;
use crate::write::{Content, RunWriter};

/// Why nothing was salvaged.
#[derive(Debug, thiserror::Error)]
pub enum SalvageError {
    /// The input cannot be read.
    #[error("{0}")]
    Read(#[from] io::Error),
    /// No message that a checksum confirms is left, or neither header nor scenario, or it is of another version.
    #[error("{0}")]
    Hopeless(String),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Callback that compares header and scenario, where either may be missing. Returns the header to use and
/// remarks about it, or the reason why there is none.
pub type Settle<'a> =
    dyn Fn(Option<RunHeader>, Option<&str>) -> Result<(RunHeader, Vec<String>), String> + 'a;

/// Writes what is left of the log `input` to a new log `output`; all of it for a whole log. `events` are announced if
/// nothing is left of the log's own announcements.
///
/// # Errors
/// If `input` cannot be read, nothing left in it identifies its run, or none of its messages is left, or
/// `output` exists or cannot be written.
pub fn salvage(
    input: &Path,
    output: &Path,
    events: &[EventKind],
    settle: &Settle<'_>,
) -> Result<Salvaged, SalvageError> {
    let Found { header, scenario, end, channels, other_version, .. } = Found::of(input, events)?;
    if let (None, Some(version)) = (&header, other_version) {
        return Err(SalvageError::Hopeless(LogProblem::Version(version).to_string()));
    }
    let (header, remarks) = settle(header, scenario.as_deref()).map_err(SalvageError::Hopeless)?;
    // The first walk finds the gaps, which are written before what the second walk writes.
    let mut digests = Digests::default();
    let salvaged = Walk::new(&header, &channels).through(input, end.as_ref(), &mut |kept| {
        if let Kept::Message { topic, payload, .. } = kept {
            digests.add(topic, &payload);
        }
        Ok(())
    })?;
    if salvaged.kept.is_empty() {
        return Err(SalvageError::Hopeless("no message is left that a checksum confirms".to_owned()));
    }
    if let Some(topic) = end.as_ref().and_then(|end| changed(end, &salvaged, &mut digests)) {
        let problem =
            "has all of its messages with right checksums, but others than metadata `run_end` names";
        return Err(SalvageError::Hopeless(format!("{topic} {problem}")));
    }
    let lost = scenario.is_none().then(|| "the scenario is lost".to_owned());
    let salvaged =
        Salvaged { remarks: [remarks, lost.into_iter().collect(), salvaged.remarks].concat(), ..salvaged };

    let announced = |topic: &str| channels.values().find(|channel| channel.topic == topic).cloned();
    let of_kind = |kind: &EventKind| {
        announced(kind.topic).unwrap_or_else(|| Topic::of(&kind.clone().with(header.parts())))
    };
    let is_foreign = |topic: &&Topic| {
        let name = topic.topic.as_str();
        !RECORDS.contains(&name)
            && RowKind::with(name).is_none()
            && !events.iter().any(|kind| kind.topic == name)
    };
    let topics = events.iter().map(of_kind).chain(channels.values().filter(is_foreign).cloned());
    let scenario = scenario.unwrap_or_default();
    let mut writer =
        RunWriter::start(Place::hidden(output, input)?, &header, &scenario, topics, Content::Text)?;
    writer.salvaged(&salvaged)?;
    Walk::new(&header, &channels).through(input, None, &mut |kept| Ok(writer.keep(kept)?))?;
    writer.finish(RunStatus::Salvaged, end.map_or(SolverReport::default(), |end| end.solver))?;
    Ok(salvaged)
}

/// A topic of which no message is lost, and some are not those of the run.
fn changed(end: &RunEnd, salvaged: &Salvaged, digests: &mut Digests) -> Option<String> {
    let (_, found) = digests.finish(salvaged.kept.keys());
    let is_all = |topic: &String| salvaged.kept.get(topic) == end.message_counts.get(topic);
    let is_other =
        |(topic, digest): &(String, String)| end.topic_digests.get(topic).is_some_and(|said| said != digest);
    found.into_iter().filter(|(topic, _)| is_all(topic)).find(is_other).map(|(topic, _)| topic)
}

/// The topics of records, in the order in which logs announce them; the last two of recordings alone.
const RECORDS: [&str; 6] = [STEP, SWITCH, FIELDS, WINDOW, SIGNAL, TRACES];

/// What a file says of its run, wherever it stands.
#[derive(Default)]
struct Found {
    /// The first header.
    header: Option<RunHeader>,
    /// The version of a header of another version of the format, if there is one.
    other_version: Option<u32>,
    /// The first scenario.
    scenario: Option<String>,
    /// The last end.
    end: Option<RunEnd>,
    /// The announced topics.
    channels: BTreeMap<u16, Topic>,
    /// The announced schemas, with their names.
    schemas: BTreeMap<u16, (String, String)>,
    /// The length of all of these, which is bounded: several topics may refer to one long schema.
    bytes: usize,
}

impl Found {
    /// What the file says. The first chunk, and the summary at the end, announce the topics; any others have the numbers
    /// that this program gives them.
    fn of(input: &Path, events: &[EventKind]) -> io::Result<Found> {
        let mut pieces = Pieces::open(input)?;
        let mut found = Found::default();
        while let Some((at, piece)) = pieces.next()? {
            match piece {
                Piece::Record(record) => found.take(record),
                Piece::Chunk(mut chunk) => {
                    while let Ok(Some((opcode, body))) = chunk.next_record() {
                        if matches!(opcode, op::SCHEMA | op::CHANNEL)
                            && let Ok(record) = parse(opcode, body, at)
                        {
                            found.take(record);
                        }
                    }
                }
            }
        }
        let record = |topic: &str| Topic::of_json(topic, "", String::new());
        let parts = found.header.as_ref().map_or(Parts::default(), RunHeader::parts);
        let own = if parts.recording { &RECORDS[..] } else { &RECORDS[..4] };
        let own = own.iter().copied().chain(RowKind::all_in(parts).map(|row| row.topic)).map(record);
        let own = own.chain(events.iter().map(Topic::of));
        for (id, topic) in (1..).zip(own) {
            if found.channels.values().all(|known| known.topic != topic.topic) {
                found.channels.entry(id).or_insert(topic);
            }
        }
        Ok(found)
    }

    fn take(&mut self, record: Record<'_>) {
        match record {
            Record::Metadata(record) if record.name == RUN => match metadata::check_version(&record.metadata)
            {
                Err(LogProblem::Version(version)) => {
                    self.other_version = self.other_version.or(Some(version))
                }
                _ => self.header = self.header.take().or(metadata::header_from_map(&record.metadata).ok()),
            },
            Record::Metadata(record) if record.name == RUN_END => {
                self.end = metadata::end_from_map(&record.metadata).ok().or(self.end.take());
            }
            Record::Attachment { header, data, .. } if DESCRIPTIONS.contains(&header.name.as_str()) => {
                self.scenario = self.scenario.take().or(String::from_utf8(data.into_owned()).ok());
            }
            Record::Schema { header, data } => {
                let schema = String::from_utf8_lossy(&data).into_owned();
                if header.encoding == "jsonschema" && self.has_room(header.name.len() + schema.len()) {
                    self.schemas.entry(header.id).or_insert((header.name, schema));
                }
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let any = || (channel.topic.clone(), r#"{"type":"object"}"#.to_owned());
                let (schema_name, schema) = self.schemas.get(&channel.schema_id).cloned().unwrap_or_else(any);
                let is_new = self.channels.values().all(|known| known.topic != channel.topic);
                if is_new
                    && self.channels.len() < MOST_CHANNELS
                    && self.has_room(channel.topic.len() + schema_name.len() + schema.len())
                {
                    self.channels.insert(channel.id, Topic::of_json(&channel.topic, &schema_name, schema));
                }
            }
            _ => {}
        }
    }

    fn has_room(&mut self, bytes: usize) -> bool {
        let has_room = self.bytes + bytes <= 2 * MOST_SCHEMA_BYTES;
        self.bytes += if has_room { bytes } else { 0 };
        has_room
    }
}

/// What is kept of a log.
pub(crate) enum Kept<'a> {
    Message {
        topic: &'a str,
        head: MessageHeader,
        /// None of an event.
        step: Option<u64>,
        payload: Vec<u8>,
    },
    Checkpoint(String),
}

type Keep<'a> = dyn FnMut(Kept<'_>) -> Result<(), SalvageError> + 'a;

/// A message that is of its topic and of this run.
struct Sound<'a> {
    topic: &'a str,
    head: MessageHeader,
    payload: Vec<u8>,
    message: Message,
}

/// Where messages may be missing.
struct Border {
    gap: Gap,
    /// Whether some are.
    is_gap: bool,
}

/// Walks through the chunks of a file.
struct Walk<'a> {
    header: &'a RunHeader,
    channels: &'a BTreeMap<u16, Topic>,
    /// The next number of each topic, and how many borders were before its last message.
    next: BTreeMap<&'a str, (u32, usize)>,
    borders: Vec<Border>,
    /// A step whose switches are not complete, with those read so far.
    unit: Vec<Sound<'a>>,
    last_step: Option<u64>,
    last_ns: u64,
    left_out: u64,
    salvaged: Salvaged,
}

impl<'a> Walk<'a> {
    fn new(header: &'a RunHeader, channels: &'a BTreeMap<u16, Topic>) -> Walk<'a> {
        Walk {
            header,
            channels,
            next: BTreeMap::new(),
            borders: Vec::new(),
            unit: Vec::new(),
            last_step: None,
            last_ns: 0,
            left_out: 0,
            salvaged: Salvaged::default(),
        }
    }

    /// Passes on what can be kept of a log with that end.
    fn through(
        mut self,
        input: &Path,
        end: Option<&'a RunEnd>,
        keep: &mut Keep<'_>,
    ) -> Result<Salvaged, SalvageError> {
        let mut pieces = Pieces::open(input)?;
        let mut damages = 0;
        while let Some((at, piece)) = pieces.next()? {
            match piece {
                Piece::Chunk(chunk) => {
                    if std::mem::replace(&mut damages, pieces.damage.len()) < pieces.damage.len() {
                        self.border();
                    }
                    match self.messages(at, chunk) {
                        Ok(messages) => messages.into_iter().try_for_each(|sound| self.take(sound, keep))?,
                        Err(problem) => {
                            let what = format!("a chunk: {problem}");
                            pieces.damage.push(Damage { from_byte: at, to_byte: pieces.at, what });
                        }
                    }
                }
                Piece::Record(Record::Attachment { header, data, .. }) if header.name == CHECKPOINT => {
                    if let Ok(state) = String::from_utf8(data.into_owned()) {
                        keep(Kept::Checkpoint(state))?;
                    }
                }
                Piece::Record(_) => {}
            }
        }
        self.lose_unit();
        for (topic, &count) in end.iter().flat_map(|end| &end.message_counts) {
            let next = self.next.get(topic.as_str()).copied().unwrap_or_default();
            let missing = count.saturating_sub(u64::from(next.0));
            if missing > 0 {
                self.lose(topic, missing, next.1);
            }
        }
        if end.is_none() {
            self.border().is_gap = true;
        }
        let mut salvaged = self.salvaged;
        salvaged.end_is_known = end.is_some();
        salvaged.gaps = self.borders.iter().filter(|border| border.is_gap).map(|border| border.gap).collect();
        salvaged.damage = pieces.damage;
        if self.left_out > 0 {
            let messages = counted(self.left_out, "message");
            salvaged.remarks.push(format!("{messages} left out, which stood behind later ones, or twice"));
        }
        Ok(salvaged)
    }

    /// The messages of a chunk on topics that are announced. All must be sound; those behind later ones are left out.
    fn messages(&mut self, at: u64, mut chunk: Chunk) -> Result<Vec<Sound<'a>>, LogProblem> {
        let (mut messages, mut left_out) = (Vec::new(), 0);
        while let Some((opcode, body)) = chunk.next_record()? {
            if let Record::Message { header: head, data } = parse(opcode, body, at)?
                && let Some(Topic { topic, .. }) = self.channels.get(&head.channel_id)
            {
                let message = Message::read(self.header, topic, &head, &data)?;
                match self.is_behind(topic, &head) {
                    true => left_out += 1,
                    false => messages.push(Sound { topic, head, payload: data.into_owned(), message }),
                }
            }
        }
        self.left_out += left_out;
        Ok(messages)
    }

    /// Whether a message stands behind a later one.
    fn is_behind(&self, topic: &str, head: &MessageHeader) -> bool {
        head.log_time < self.last_ns || self.next.get(topic).is_some_and(|(next, _)| head.sequence < *next)
    }

    fn take(&mut self, sound: Sound<'a>, keep: &mut Keep<'_>) -> Result<(), SalvageError> {
        if self.is_behind(sound.topic, &sound.head) {
            self.left_out += 1;
            return Ok(());
        }
        let MessageHeader { sequence, log_time, .. } = sound.head;
        let (next, borders) = self.next.get(sound.topic).copied().unwrap_or_default();
        if sequence > next {
            self.lose(sound.topic, u64::from(sequence - next), borders);
        }
        self.last_ns = log_time;
        match (&sound.message, self.unit.first().map(|step| &step.message)) {
            (Message::Switch(switch), Some(Message::Step(step))) if switch.step == step.step => {}
            (Message::Switch(_), _) => {
                self.lose_unit();
                self.lose(SWITCH, 1, borders);
                self.passed(&sound);
                return Ok(());
            }
            _ => self.lose_unit(),
        }
        self.passed(&sound);
        self.unit.push(sound);
        match &self.unit[0].message {
            Message::Step(step) if self.unit.len() <= step.switches as usize => Ok(()),
            _ => std::mem::take(&mut self.unit).into_iter().try_for_each(|sound| self.keep(sound, keep)),
        }
    }

    /// Notes the number of a message.
    fn passed(&mut self, sound: &Sound<'a>) {
        self.next.insert(sound.topic, (sound.head.sequence.saturating_add(1), self.borders.len()));
    }

    fn keep(
        &mut self,
        Sound { topic, head, payload, message }: Sound<'a>,
        keep: &mut Keep<'_>,
    ) -> Result<(), SalvageError> {
        let step = message.step();
        if step.is_some() {
            self.last_step = step;
            if let Some(Border { gap, .. }) = self.borders.last_mut() {
                gap.before_step = gap.before_step.or(step);
            }
        }
        *self.salvaged.kept.entry(topic.to_owned()).or_default() += 1;
        keep(Kept::Message { topic, head, step, payload })
    }

    /// The border behind the last message kept.
    fn border(&mut self) -> &mut Border {
        if self.borders.last().is_none_or(|last| last.gap.before_step.is_some()) {
            let gap = Gap { after_step: self.last_step, before_step: None };
            self.borders.push(Border { gap, is_gap: false });
        }
        self.borders.last_mut().expect("it was just made")
    }

    /// Notes that messages of a topic are missing behind that many borders: they may have been lost at each that
    /// follows, together with messages of other topics.
    fn lose(&mut self, topic: &str, messages: u64, borders: usize) {
        *self.salvaged.lost.entry(topic.to_owned()).or_default() += messages;
        if borders >= self.borders.len() {
            self.border();
        }
        let from = borders.min(self.borders.len() - 1);
        self.borders[from..].iter_mut().for_each(|border| border.is_gap = true);
    }

    /// Drops a step without all of its switches.
    fn lose_unit(&mut self) {
        for sound in std::mem::take(&mut self.unit) {
            let borders = self.borders.len();
            self.lose(sound.topic, 1, borders);
        }
    }
}
