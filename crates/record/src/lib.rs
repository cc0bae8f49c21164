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

mod checkpoint;
mod event;
mod fields;
mod header;
mod step;
mod time;

pub use checkpoint::Checkpoint;
pub use event::{Event, EventKind, EventPayload, GlobalSlip, Onset, SlipEvent};
pub use fields::{FieldRecord, WindowRecord};
pub use header::{RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, SolverReport, TopicComparison};
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
