//! The vocabulary that every other crate speaks: what a solver yields
//! ([`Record`]), what detectors emit ([`Event`]) and what describes a run
//! ([`RunHeader`], [`RunEnd`]).
//!
//! These are plain data with serde and JSON schemas. They know nothing of the
//! physics behind them, of files or of channels, so that a detector that reads
//! a stored log a year from now needs this crate and no other.
//!
//! Blocks are numbered from 1, as in the source thesis. Units stand last in
//! names and are SI throughout.
//!
//! Events say of themselves what a table of them holds:
//!
//! ```
//! use asperity_record::{Event, EventKind, GlobalSlip, markdown};
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
//! let event = Event::new(&slip);
//! assert_eq!(event.topic, "/events/global");
//! assert_eq!(event.decode::<GlobalSlip>().unwrap()?, slip);
//!
//! // What reads events of any kind needs no more than what their detector announces.
//! let kind = EventKind::of::<GlobalSlip>();
//! for (column, cell) in kind.columns.iter().zip(kind.cells(&event.payload)?) {
//!     println!("{} = {cell} {}", column.name, column.unit.unwrap_or_default());
//! }
//! assert!(markdown(kind.columns).contains("| `onset_s` | double | s | Time of its onset. |"));
//! # Ok::<(), serde_json::Error>(())
//! ```

// Lets `payload!` name this crate by its own name, here as in crates that use it.
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
mod payload;
mod printable;
mod rupture;
mod scales;
mod slip;
mod step;
mod time;

pub use checkpoint::Checkpoint;
pub use column::{Cell, CellValue, Column, ColumnKind, markdown, unit_of};
pub use contacts::Contacts;
pub use energy::Energy;
pub use event::{Event, EventKind, EventPayload};
pub use extent::{Extent, Reach};
pub use fields::{FieldRecord, WindowRecord};
pub use header::{RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, SolverReport, TopicComparison};
#[doc(hidden)]
pub use payload::macros;
pub use printable::printable;
pub use rupture::{Arrival, Rupture};
pub use scales::Scales;
pub use slip::{GlobalSlip, Onset, SlipEvent};
pub use step::{Direction, StepRecord, Switch};
pub use time::TimeGrid;

/// The most blocks that a scenario, and so a run log, may have.
pub const MOST_BLOCKS: u64 = 100_000;

/// Anything a solver yields, in the order in which it happened.
///
/// Within one step the order is [`Record::Step`], [`Record::Fields`],
/// [`Record::Window`].
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// What detectors see.
    Step(StepRecord),
    /// The state of the whole chain.
    Fields(FieldRecord),
    /// The state of chosen blocks inside a dense window.
    Window(WindowRecord),
}

impl Record {
    /// The step after which this record describes the chain.
    pub fn step(&self) -> u64 {
        match self {
            Record::Step(record) => record.step,
            Record::Fields(record) => record.step,
            Record::Window(record) => record.step,
        }
    }
}
