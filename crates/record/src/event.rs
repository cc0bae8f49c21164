//! What detectors emit.
//!
//! An [`Event`] is an envelope: the topic and the payload as JSON. So
//! a new detector brings its own payload type with it, and the stream, the run
//! log and replay carry it without knowing it. The payloads that tables are
//! made of are defined here, because the analysis does not link detectors.

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::column::{Cell, Column};
use crate::payload;

/// A type that can travel as an [`Event`] and is a row of a table. [`payload!`] makes one.
pub trait EventPayload: Serialize + DeserializeOwned + JsonSchema {
    /// The log topic, `/events/...`.
    const TOPIC: &'static str;
    /// What a table of such events is called, after the name of its run: `events` in
    /// `NAME.events.csv`.
    const TABLE: &'static str;
    /// The columns of its table, in order.
    const COLUMNS: &'static [Column];

    /// Its row: a cell for each column.
    fn cells(&self) -> impl AsRef<[Cell]>;
}

/// What a detector emits, announced before the first event so that a log can name and describe
/// its topics. Tables of the events follow from it alone.
#[derive(Debug, Clone)]
pub struct EventKind {
    /// The log topic.
    pub topic: &'static str,
    /// What a table of such events is called.
    pub table: &'static str,
    /// Name of the payload's schema.
    pub schema_name: String,
    /// JSON schema of the payload.
    pub schema: serde_json::Value,
    /// The columns of a table of such events.
    pub columns: &'static [Column],
    cells: fn(&str) -> Result<Vec<Cell>, serde_json::Error>,
}

impl EventKind {
    /// The kind of events with payload `P`.
    pub fn of<P: EventPayload>() -> EventKind {
        EventKind {
            topic: P::TOPIC,
            table: P::TABLE,
            schema_name: P::schema_name().into_owned(),
            schema: schemars::schema_for!(P).to_value(),
            columns: P::COLUMNS,
            cells: |payload| Ok(serde_json::from_str::<P>(payload)?.cells().as_ref().to_vec()),
        }
    }

    /// The row of an event of this kind, read off its payload.
    ///
    /// # Errors
    /// If the payload is not what its topic promises.
    pub fn cells(&self, payload: &str) -> Result<Vec<Cell>, serde_json::Error> {
        (self.cells)(payload)
    }
}

/// One event on its way from a detector to the log. It belongs to the step of
/// the record that made it certain, which it follows directly.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// The log topic.
    pub topic: String,
    /// The payload as one JSON object.
    pub payload: String,
}

impl Event {
    /// Puts a payload in its envelope.
    pub fn new<P: EventPayload>(payload: &P) -> Event {
        Event {
            topic: P::TOPIC.to_owned(),
            payload: serde_json::to_string(payload)
                .expect("payloads are plain structs of numbers, which JSON can always hold"),
        }
    }

    /// Takes the payload out, or `None` if the event is of another topic.
    ///
    /// # Errors
    /// If the payload is not what its topic promises.
    pub fn decode<P: EventPayload>(&self) -> Option<Result<P, serde_json::Error>> {
        (self.topic == P::TOPIC).then(|| serde_json::from_str(&self.payload))
    }
}

payload! {
    topic: "/events/onset",
    table: "onsets",
    /// The start of a slip event: which block went first, when, at what load.
    pub struct Onset {
        /// Number of the slip event in its run, counted from 0.
        pub event: u64,
        /// First step in which a block slides.
        pub onset_step: u64,
        /// Time of that step, s.
        pub onset_s: f64,
        /// Lowest-numbered block that slides in that step.
        pub nucleation_block: u32,
        /// How many blocks slide in that step.
        pub nucleation_blocks: u32,
        /// Tangential force on the nucleation block when it detached, N.
        pub tangential_force_n: f64,
        /// Static friction threshold of the nucleation block when it detached, N.
        pub threshold_n: f64,
        /// `F_T / F_N` used in the onset step.
        pub ft_fn_onset: f64,
    }
}

payload! {
    topic: "/events/slip",
    table: "events",
    /// A maximal run of consecutive steps in which at least one block slides.
    ///
    /// The first seven fields are the columns of the raw event table, in its order.
    pub struct SlipEvent {
        /// Time of the first step in which a block slides, s.
        pub onset_s: f64,
        /// Time of the first step after it in which none does, s; null if the run
        /// ended before.
        pub end_s: Option<f64>,
        /// Lowest-numbered block that slid.
        pub first_block: u32,
        /// Highest-numbered block that slid.
        pub last_block: u32,
        /// Most blocks sliding in one step.
        pub max_sliding: u32,
        /// `F_T / F_N` used in the onset step.
        pub ft_fn_onset: f64,
        /// `F_T / F_N` used in the end step; null if the run ended before.
        pub ft_fn_end: Option<f64>,
        /// Number of the event in its run, counted from 0.
        pub event: u64,
        /// First step in which a block slides.
        pub onset_step: u64,
        /// First step after it in which none does; null if the run ended before.
        pub end_step: Option<u64>,
        /// Number of distinct blocks that slid.
        pub blocks_slipped: u32,
        /// Lowest-numbered block of the onset step.
        pub nucleation_block: u32,
        /// Smallest `F_T / F_N` over the event's switch records.
        pub ft_fn_min: f64,
        /// Largest `F_T / F_N` over the event's switch records.
        pub ft_fn_max: f64,
        /// Whether the run ended before the event did.
        pub open: bool,
    }
}

impl SlipEvent {
    /// Precursor length over slider length, `n_p / N` (5.17), for an event that
    /// starts from the driven end; `None` for one that does not include block 1.
    pub fn length_ratio(&self, blocks: u32) -> Option<f64> {
        (self.first_block == 1).then(|| f64::from(self.last_block) / f64::from(blocks))
    }

    /// Whether every block of the chain slid.
    pub fn is_global(&self, blocks: u32) -> bool {
        self.blocks_slipped == blocks
    }
}

payload! {
    topic: "/events/global",
    table: "global-slips",
    /// A slip event in which every block of the chain slid.
    pub struct GlobalSlip {
        /// Number of the global slip in its run, counted from 0.
        pub global: u64,
        /// Number of the slip event it is.
        pub event: u64,
        /// Time of its onset, s.
        pub onset_s: f64,
        /// Time of its end, s; null if the run ended before.
        pub end_s: Option<f64>,
        /// Time since the onset of the global slip before it, s; null for the first.
        pub recurrence_s: Option<f64>,
        /// Fall of the driving force from onset to end, N; null if the run ended before.
        pub load_drop_n: Option<f64>,
        /// Fall of `F_T / F_N` from onset to end; null if the run ended before.
        pub ft_fn_drop: Option<f64>,
    }
}
