//! Events, as detectors emit them.
//!
//! An [`Event`] carries the payload that its detector made, as the type that it has. Stream, log and replay
//! transport it without knowing that type. JSON is made where a log is written, and an event is JSON text
//! only where it comes out of a log whose topic no linked crate knows.

use std::any::Any;
use std::borrow::Cow;
use std::fmt;
use std::sync::{Arc, OnceLock};

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::Parts;
use crate::column::{Cell, Column};

/// A type that can be sent as an [`Event`] and is a row of a table. [`payload!`](crate::payload) defines
/// one.
pub trait EventPayload:
    Serialize + DeserializeOwned + JsonSchema + Clone + fmt::Debug + Send + Sync + 'static
{
    /// The log topic, `/events/...`.
    const TOPIC: &'static str;
    /// Name of a table of such events, which follows the name of its run: `events` in `NAME.events.csv`.
    const TABLE: &'static str;
    /// The columns of its table, in order, with those that only some runs have.
    const COLUMNS: &'static [Column];

    /// Its row: a cell for each column.
    fn cells(&self) -> impl AsRef<[Cell]>;
}

/// A payload whose type is known to whoever made it.
trait Carried: Any + fmt::Debug + Send + Sync {
    fn topic(&self) -> &'static str;
    fn cells(&self) -> Vec<Cell>;
    fn json(&self) -> String;
    fn write_json(&self, out: &mut Vec<u8>);
    fn bytes(&self) -> usize;
}

impl<P: EventPayload> Carried for P {
    fn topic(&self) -> &'static str {
        P::TOPIC
    }

    fn cells(&self) -> Vec<Cell> {
        EventPayload::cells(self).as_ref().to_vec()
    }

    fn json(&self) -> String {
        serde_json::to_string(self).expect(PLAIN)
    }

    fn write_json(&self, out: &mut Vec<u8>) {
        serde_json::to_writer(out, self).expect(PLAIN);
    }

    fn bytes(&self) -> usize {
        size_of::<P>()
    }
}

const PLAIN: &str = "payloads are plain structs of numbers, which JSON can always hold";

/// The description of a detector's events, announced before the first one, from which a log names and
/// describes its topics, and tables are made.
#[derive(Debug, Clone)]
pub struct EventKind {
    /// The log topic.
    pub topic: &'static str,
    /// Name of a table of such events.
    pub table: &'static str,
    /// Name of the payload's schema.
    pub schema_name: String,
    /// What the run has: other columns, cells and properties of the schema are left out.
    parts: Parts,
    /// All columns that such events may have.
    all: &'static [Column],
    /// Computed on first use, since that takes longer than a short run.
    schema: OnceLock<serde_json::Value>,
    make_schema: fn() -> serde_json::Value,
    read: fn(&str) -> Result<Event, serde_json::Error>,
}

impl EventKind {
    /// The kind of events with payload `P`.
    pub fn of<P: EventPayload>() -> EventKind {
        EventKind {
            topic: P::TOPIC,
            table: P::TABLE,
            schema_name: P::schema_name().into_owned(),
            parts: Parts::default(),
            all: P::COLUMNS,
            schema: OnceLock::new(),
            make_schema: || schemars::schema_for!(P).to_value(),
            read: |json| Ok(Event::new(serde_json::from_str::<P>(json)?)),
        }
    }

    /// The kind of these events in a run that has these parts.
    #[must_use]
    pub fn with(self, parts: Parts) -> EventKind {
        EventKind { parts, schema: OnceLock::new(), ..self }
    }

    /// The columns of a table of such events.
    pub fn columns(&self) -> Vec<Column> {
        self.all.iter().filter(|column| is_in(self.parts, column)).cloned().collect()
    }

    /// JSON schema of the payload.
    pub fn schema(&self) -> &serde_json::Value {
        self.schema.get_or_init(|| {
            let mut schema = (self.make_schema)();
            let lacks =
                |name: &str| self.all.iter().any(|column| column.name == name && !is_in(self.parts, column));
            if let Some(properties) = schema["properties"].as_object_mut() {
                properties.retain(|name, _| !lacks(name));
                let over_area = self.all.iter().filter_map(|column| Some((&column.name, column.over_area?)));
                for (name, about) in over_area.filter(|_| self.parts.area) {
                    properties[name.as_ref()]["description"] = about.into();
                }
            }
            schema
        })
    }

    /// Reads an event of this kind from the JSON object of its payload.
    ///
    /// # Errors
    /// If the payload does not match its topic.
    pub fn read(&self, json: &str) -> Result<Event, serde_json::Error> {
        (self.read)(json)
    }

    /// The row of an event of this kind.
    ///
    /// # Errors
    /// If it was read as text, which does not match its topic.
    pub fn cells(&self, event: &Event) -> Result<Vec<Cell>, serde_json::Error> {
        Ok(self.there(match &event.0 {
            Content::Typed(payload) => payload.cells(),
            Content::Text { json, .. } => self.read(json)?.typed_cells(),
        }))
    }

    /// The row of an event with this payload, which is of this kind.
    pub fn cells_of<P: EventPayload>(&self, payload: &P) -> Vec<Cell> {
        self.there(payload.cells().as_ref().to_vec())
    }

    /// The cells of the columns that the run has.
    fn there(&self, mut cells: Vec<Cell>) -> Vec<Cell> {
        let mut all = self.all.iter();
        cells.retain(|_| all.next().is_none_or(|column| is_in(self.parts, column)));
        cells
    }
}

fn is_in(parts: Parts, column: &Column) -> bool {
    column.only.is_none_or(|part| parts.has(part))
}

/// One event on its way from a detector to the log. It belongs to the step of the record that made it
/// certain, and follows that record directly.
#[derive(Clone)]
pub struct Event(Content);

#[derive(Clone)]
enum Content {
    Typed(Arc<dyn Carried>),
    Text { topic: Arc<str>, json: Arc<str> },
}

impl Event {
    /// The event with this payload.
    pub fn new<P: EventPayload>(payload: P) -> Event {
        Event(Content::Typed(Arc::new(payload)))
    }

    /// An event of a log whose topic no linked crate knows, with its payload as one JSON object.
    pub fn of_json(topic: &str, json: &str) -> Event {
        Event(Content::Text { topic: topic.into(), json: json.into() })
    }

    /// The log topic.
    pub fn topic(&self) -> &str {
        match &self.0 {
            Content::Typed(payload) => payload.topic(),
            Content::Text { topic, .. } => topic,
        }
    }

    /// The payload, if it has this type. Detectors emit it so, and so do logs for the topics of this crate;
    /// [`Event::decode`] also reads what a log holds of other topics.
    pub fn get<P: EventPayload>(&self) -> Option<&P> {
        match &self.0 {
            Content::Typed(payload) => (payload.as_ref() as &dyn Any).downcast_ref(),
            Content::Text { .. } => None,
        }
    }

    /// The payload as this type; `None` if the event has another topic.
    ///
    /// # Errors
    /// If the event was read as text, which does not match its topic.
    pub fn decode<P: EventPayload>(&self) -> Option<Result<P, serde_json::Error>> {
        if self.topic() != P::TOPIC {
            return None;
        }
        Some(
            self.get::<P>().map_or_else(|| serde_json::from_str(&self.json()), |payload| Ok(payload.clone())),
        )
    }

    /// The payload as one JSON object.
    pub fn json(&self) -> Cow<'_, str> {
        match &self.0 {
            Content::Typed(payload) => payload.json().into(),
            Content::Text { json, .. } => Cow::Borrowed(json),
        }
    }

    /// Appends the payload as one JSON object.
    pub fn write_json(&self, out: &mut Vec<u8>) {
        match &self.0 {
            Content::Typed(payload) => payload.write_json(out),
            Content::Text { json, .. } => out.extend_from_slice(json.as_bytes()),
        }
    }

    /// How much memory the event takes.
    pub fn bytes(&self) -> usize {
        size_of::<Event>()
            + match &self.0 {
                Content::Typed(payload) => payload.bytes(),
                Content::Text { topic, json } => topic.len() + json.len(),
            }
    }

    fn typed_cells(&self) -> Vec<Cell> {
        match &self.0 {
            Content::Typed(payload) => payload.cells(),
            Content::Text { .. } => Vec::new(),
        }
    }
}

/// Two events are equal if a log would hold the same values of both: to the last bit, and without
/// distinction between numbers that JSON cannot hold and those that are absent.
impl PartialEq for Event {
    fn eq(&self, other: &Event) -> bool {
        match (&self.0, &other.0) {
            (Content::Typed(one), Content::Typed(other)) => {
                one.topic() == other.topic() && same_cells(&one.cells(), &other.cells())
            }
            _ => self.topic() == other.topic() && self.json() == other.json(),
        }
    }
}

fn same_cells(one: &[Cell], other: &[Cell]) -> bool {
    let logged = |cell: &Cell| match cell {
        Cell::Number(number) if number.is_finite() => Some(Err(number.to_bits())),
        Cell::Number(_) | Cell::Empty => None,
        other => Some(Ok(other.clone())),
    };
    one.len() == other.len() && one.iter().map(logged).eq(other.iter().map(logged))
}

impl fmt::Debug for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.topic(), self.json())
    }
}
