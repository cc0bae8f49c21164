//! Records of a topic of their own that are flat rows.

use crate::{Cell, Estimate, Event, EventKind, EventPayload, FirstReach, LoadNoise, Noise, Part, Parts};
use crate::{Series, SeriesBlock};

/// All kinds of such records. [`payload!`](crate::payload) declares one as it does events, with `step` and `time_s` as
/// its first columns; it stands behind the states of its step. Logs, checks and tables follow from this list.
pub const ROWS: &[RowKind] = &[
    RowKind::of::<Noise>(Part::Recording),
    RowKind::of::<LoadNoise>(Part::Recording),
    RowKind::of::<Estimate>(Part::Recording),
    RowKind::of::<FirstReach>(Part::Recording),
    RowKind::of::<Series>(Part::Series),
    RowKind::of::<SeriesBlock>(Part::Series),
];

/// A kind of such records.
pub struct RowKind {
    /// The log topic.
    pub topic: &'static str,
    /// Its columns and schema.
    pub kind: fn() -> EventKind,
    /// Only runs with this have such records.
    pub only: Part,
    /// Reads one from the JSON object of its payload.
    pub read: fn(&str) -> Result<Row, serde_json::Error>,
}

impl RowKind {
    /// The kind with payload `P`, in runs with a part.
    pub const fn of<P: EventPayload>(only: Part) -> RowKind {
        RowKind {
            topic: P::TOPIC,
            kind: EventKind::of::<P>,
            only,
            read: |json| serde_json::from_str::<P>(json).map(Row::new),
        }
    }

    /// The kinds in a run with these parts.
    pub fn all_in(parts: Parts) -> impl Iterator<Item = &'static RowKind> {
        ROWS.iter().filter(move |row| parts.has(row.only))
    }

    /// The kind with that topic.
    pub fn with(topic: &str) -> Option<&'static RowKind> {
        ROWS.iter().find(|row| row.topic == topic)
    }
}

/// A row.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The step.
    pub step: u64,
    /// Simulated time at the end of the step, s; of series, when the solver's step ended, less than a step later.
    pub time_s: f64,
    /// All columns.
    pub values: Event,
}

impl Row {
    /// The row with this payload.
    ///
    /// # Panics
    /// If it does not begin with step and time.
    pub fn new<P: EventPayload>(payload: P) -> Row {
        let cells = payload.cells();
        let [Cell::Step(step), Cell::Number(time_s), ..] = *cells.as_ref() else {
            panic!("{} begins with step and time_s", P::TOPIC)
        };
        drop(cells);
        Row { step, time_s, values: Event::new(payload) }
    }
}
