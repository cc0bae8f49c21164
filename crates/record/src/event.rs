//! Events, as detectors emit them.
//!
//! An [`Event`] is an envelope of a topic and a payload in JSON. A new detector defines its own payload
//! type, and stream, run log and replay transport it without knowing that type.

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::column::{Cell, Column};

/// A type that can be sent as an [`Event`] and is a row of a table. [`payload!`](crate::payload) defines
/// one.
pub trait EventPayload: Serialize + DeserializeOwned + JsonSchema {
    /// The log topic, `/events/...`.
    const TOPIC: &'static str;
    /// Name of a table of such events, which follows the name of its run: `events` in `NAME.events.csv`.
    const TABLE: &'static str;
    /// The columns of its table, in order.
    const COLUMNS: &'static [Column];

    /// Its row: a cell for each column.
    fn cells(&self) -> impl AsRef<[Cell]>;
}

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
    /// The columns of a table of such events.
    pub columns: &'static [Column],
    /// Computed on first use, since that takes longer than a short run.
    schema: OnceLock<serde_json::Value>,
    make_schema: fn() -> serde_json::Value,
    cells: fn(&str) -> Result<Vec<Cell>, serde_json::Error>,
}

impl EventKind {
    /// The kind of events with payload `P`.
    pub fn of<P: EventPayload>() -> EventKind {
        EventKind {
            topic: P::TOPIC,
            table: P::TABLE,
            schema_name: P::schema_name().into_owned(),
            columns: P::COLUMNS,
            schema: OnceLock::new(),
            make_schema: || schemars::schema_for!(P).to_value(),
            cells: |payload| Ok(serde_json::from_str::<P>(payload)?.cells().as_ref().to_vec()),
        }
    }

    /// JSON schema of the payload.
    pub fn schema(&self) -> &serde_json::Value {
        self.schema.get_or_init(self.make_schema)
    }

    /// The row of an event of this kind, decoded from its payload.
    ///
    /// # Errors
    /// If the payload does not match its topic.
    pub fn cells(&self, payload: &str) -> Result<Vec<Cell>, serde_json::Error> {
        (self.cells)(payload)
    }
}

/// One event on its way from a detector to the log. It belongs to the step of the record that made it
/// certain, and follows that record directly.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// The log topic.
    pub topic: String,
    /// The payload as one JSON object.
    pub payload: String,
}

impl Event {
    /// Encodes a payload as an event.
    pub fn new<P: EventPayload>(payload: &P) -> Event {
        Event {
            topic: P::TOPIC.to_owned(),
            payload: serde_json::to_string(payload)
                .expect("payloads are plain structs of numbers, which JSON can always hold"),
        }
    }

    /// Decodes the payload; `None` if the event has another topic.
    ///
    /// # Errors
    /// If the payload does not match its topic.
    pub fn decode<P: EventPayload>(&self) -> Option<Result<P, serde_json::Error>> {
        (self.topic == P::TOPIC).then(|| serde_json::from_str(&self.payload))
    }
}
