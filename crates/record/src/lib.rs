//! The common types of all crates: the records of a solver ([`Record`]), the events of detectors
//! ([`Event`]) and the description of a run ([`RunHeader`], [`RunEnd`]).
//!
//! These are plain data with serde and schemas, independent of physics, files and channels. So a
//! detector that reads a stored log a year from now needs this crate and no other.
//!
//! Blocks are numbered from 1, as in the source thesis. Units stand last in
//! names and are SI throughout.
//!
//! Events describe the columns of their tables:
//!
//! ```
//! use asperity_record::{Event, EventKind, GlobalSlip};
//!
//! let slip = GlobalSlip {
//!     global: 0,
//!     event: 41,
//!     onset_s: 2.25,
//!     end_s: Some(2.5),
//!     recurrence_s: None,
//!     load_drop_n: Some(30.5),
//!     ft_fn_drop: Some(0.0625),
//! };
//! let event = Event::new(slip.clone());
//! assert_eq!(event.topic(), "/events/global");
//! assert_eq!(event.get(), Some(&slip));
//!
//! // Code for events of any kind needs only what their detector announces.
//! let kind = EventKind::of::<GlobalSlip>();
//! for (column, cell) in kind.columns().iter().zip(kind.cells(&event)?) {
//!     println!("{} = {cell} {}", column.name, column.unit.unwrap_or_default());
//! }
//! # Ok::<(), serde_json::Error>(())
//! ```

// Lets `payload!` refer to this crate by its name, here as in other crates.
extern crate self as asperity_record;

pub mod bounds;
mod checkpoint;
mod column;
mod contacts;
mod energy;
mod event;
mod extent;
mod fields;
mod header;
mod magnitude;
mod measured;
mod observer;
mod parts;
mod payload;
mod printable;
mod row;
mod rupture;
mod scales;
mod series;
mod slip;
mod statistics;
mod step;
mod time;
mod wording;

pub use checkpoint::Checkpoint;
pub use column::{Cell, CellValue, Column, ColumnKind, Role, unit_of};
pub use contacts::Contacts;
pub use energy::Energy;
pub use event::{Event, EventKind, EventPayload};
pub use extent::{BoundingBox, Extent, Reach};
pub use fields::{BulkField, BulkRecord, FieldRecord, SignalRecord, TraceRecord, WindowRecord};
pub use header::{RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, SolverReport};
pub use magnitude::magnitude;
pub use measured::{Estimate, FirstReach, LoadDrop, LoadNoise, Measured, Noise, Recorded, Sensors};
pub use observer::{Notice, Observer};
pub use parts::{Part, Parts};
#[doc(hidden)]
pub use payload::macros;
pub use printable::printable;
pub use row::{ROWS, Row, RowKind};
pub use rupture::{Arrival, Rupture, drop_n};
pub use scales::Scales;
pub use series::{Series, SeriesBlock};
pub use slip::{GlobalSlip, Onset, SlipEvent};
pub use statistics::{Line, median, median_and_scatter};
pub use step::{Direction, JunctionTotals, StepRecord, Switch, SwitchAcross};
pub use time::{MOST_STEPS, TimeGrid};
pub use wording::{GREEK, YEAR_S, counted, greek, rounded, short, short_time, unit_of_time};

/// The most blocks that a scenario, and so a run log, may have.
pub const MOST_BLOCKS: u64 = 100_000;

/// A record of a solver, in the order in which they occur.
///
/// Within one step the order is [`Record::Step`], [`Record::Fields`], [`Record::Window`], [`Record::Row`]; of a
/// recording, [`Record::Signal`] and [`Record::Traces`] stand before the first or behind the last of these.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// The step record, the input of detectors.
    Step(StepRecord),
    /// The state of all blocks; large, and rare beside steps.
    Fields(Box<FieldRecord>),
    /// The state of chosen blocks inside a dense window.
    Window(WindowRecord),
    /// A flat row of a topic of its own.
    Row(Row),
    /// What the channels of a recording read.
    Signal(SignalRecord),
    /// Samples about a rupture of a recording.
    Traces(TraceRecord),
}

impl Record {
    /// The step whose end this record describes.
    pub fn step(&self) -> u64 {
        self.at().0
    }

    /// The simulated time at the end of that step, of a row its own time, s.
    pub fn time_s(&self) -> f64 {
        self.at().1
    }

    fn at(&self) -> (u64, f64) {
        match self {
            Record::Step(record) => (record.step, record.time_s),
            Record::Fields(record) => (record.step, record.time_s),
            Record::Window(record) => (record.step, record.time_s),
            Record::Row(record) => (record.step, record.time_s),
            Record::Signal(record) => (record.step, record.time_s),
            Record::Traces(record) => (record.step, record.time_s),
        }
    }

    /// Displacements, velocities and tangential forces of the blocks of a state, then the same across the sliding
    /// direction, m, m/s, N; none of other records.
    pub fn motion(&self) -> Option<[&[f64]; 6]> {
        match self {
            Record::Fields(record) => Some([
                &record.displacement_m,
                &record.velocity_m_per_s,
                &record.tangential_force_n,
                &record.displacement_across_m,
                &record.velocity_across_m_per_s,
                &record.tangential_force_across_n,
            ]),
            Record::Window(record) => Some([
                &record.displacement_m,
                &record.velocity_m_per_s,
                &record.tangential_force_n,
                &record.displacement_across_m,
                &record.velocity_across_m_per_s,
                &record.tangential_force_across_n,
            ]),
            _ => None,
        }
    }
}
