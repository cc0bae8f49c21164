//! The chain of blocks and its solvers.
//!
//! A solver is a state machine: asked for the next [`Record`], it advances as
//! far as it must and answers. It does no I/O, reads no clock and starts no
//! thread, so that the same plan gives the same records wherever it runs.
//!
//! [`Plain`] takes every step and reads like the equations; it is the oracle
//! that [`Fast`] is held against, which computes the same discrete trajectory for
//! a cost that follows the switches: certified windows (`window.rs`, `basis.rs`) where no block
//! switches, certified jumps (`jump.rs`, `modes.rs`, `waves.rs`) where all are stuck, plain steps
//! in between.

mod basis;
mod complex;
mod counters;
pub mod equality;
mod exact;
mod fast;
mod jump;
mod modes;
mod plain;
mod recorder;
mod state;
mod sweep;
mod waves;
mod window;

pub use counters::Counters;
pub use exact::Exact;
pub use fast::Fast;
pub use plain::Plain;
pub use state::ChainState;

use asperity_model::Plan;
use asperity_record::Record;

/// Which solver is to take the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverKind {
    /// [`Fast`].
    #[default]
    Fast,
    /// [`Plain`].
    Plain,
}

impl SolverKind {
    /// The solver's name in run headers and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            SolverKind::Fast => "fast",
            SolverKind::Plain => "plain",
        }
    }

    /// A solver of this kind at the start of a plan.
    pub fn start(self, plan: Plan) -> Box<dyn Solver> {
        match self {
            SolverKind::Fast => Box::new(Fast::new(plan)),
            SolverKind::Plain => Box::new(Plain::new(plan)),
        }
    }
}

/// A solver of a [`Plan`].
pub trait Solver: Send {
    /// The solver's name in run headers and on the command line.
    fn name(&self) -> &'static str;

    /// Advances to the next thing to be recorded; `None` once the run is over
    /// and everything has been handed out.
    ///
    /// # Errors
    /// If a displacement or velocity is no longer finite.
    fn next_record(&mut self) -> Result<Option<Record>, SimulationError>;

    /// The last step taken.
    fn step(&self) -> u64;

    /// Whether all records up to [`Solver::step`] have been handed out, so that nothing is
    /// lost if another solver goes on from a snapshot taken now.
    fn is_between_records(&self) -> bool;

    /// The whole state, to the bit: a solver of the same kind that restores it
    /// yields the same switches, events and states from there on, whatever the
    /// cadences.
    fn snapshot(&self) -> ChainState;

    /// What the steps up to now were made of.
    fn counters(&self) -> Counters;

    /// Shortcuts that this solver cannot take in this run at all, and what it does
    /// instead.
    fn fallbacks(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Continues from a state. Records not yet handed out are dropped.
    ///
    /// # Panics
    /// If the state is of a chain of another size.
    fn restore(&mut self, state: &ChainState);
}

/// A run that cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// A displacement or velocity overflowed or became no number.
    #[error(
        "block {block} is no longer finite after step {step}: u = {displacement_m} m, v = {velocity_m_per_s} m/s"
    )]
    NotFinite {
        /// The step after which it was seen.
        step: u64,
        /// The block, counted from 1.
        block: u32,
        /// Its displacement.
        displacement_m: f64,
        /// Its velocity.
        velocity_m_per_s: f64,
    },
}
