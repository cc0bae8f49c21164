//! What a solver is.

use asperity_record::Record;

use crate::counters::Counters;
use crate::state::ChainState;

/// A solver of a [`asperity_model::Plan`].
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
