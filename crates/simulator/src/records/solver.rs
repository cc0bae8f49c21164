//! The interface of solvers.

use asperity_record::{Record, RunStatus};

use crate::records::counters::Counters;
use crate::records::pace::Snapshot;
use crate::records::stop::Stop;

/// What a solver returns.
#[derive(Debug)]
pub enum Next {
    /// The next record.
    Record(Record),
    /// The run is over, and all records were returned.
    End,
    /// The stop has come before the next record; a further call goes on to the same records.
    Stopped,
}

/// A solver of a [`asperity_model::Plan`].
pub trait Solver: Send {
    /// Advances to the next record; `None` once the run is over and all records were returned.
    ///
    /// # Errors
    /// If the run cannot continue, see [`SimulationError`]; further calls return the error again.
    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        match self.next_record_unless(&Stop::never())? {
            Next::Record(record) => Ok(Some(record)),
            Next::End | Next::Stopped => Ok(None),
        }
    }

    /// As [`Solver::next_record`], with looks at `stop` after bounded work, the first not before. Looks change
    /// nothing: neither records nor states.
    ///
    /// # Errors
    /// As [`Solver::next_record`].
    fn next_record_unless(&mut self, stop: &Stop<'_>) -> Result<Next, SimulationError>;

    /// The last step taken.
    fn step(&self) -> u64;

    /// Whether a snapshot taken now can be continued by another solver: all records up to
    /// [`Solver::step`] were returned, and no step is begun behind it.
    fn is_between_records(&self) -> bool;

    /// The state, exact to the bit where [`Solver::is_between_records`]: a solver of the same kind that
    /// restores it yields the same switches, events and states from there on, with any cadences.
    fn snapshot(&self) -> Snapshot;

    /// Statistics of the steps up to now.
    fn counters(&self) -> Counters;

    /// Shortcuts that are unavailable in this run, and what the solver does instead.
    fn fallbacks(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Continues from a snapshot, and drops records that were not yet returned.
    ///
    /// # Panics
    /// If the state is of a slider of another size.
    fn restore(&mut self, snapshot: &Snapshot);
}

/// A run that cannot continue.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The time step has done more work than in any accurate run
    /// ([`MOST_SCHEME_SHARE`](crate::MOST_SCHEME_SHARE)).
    #[error(
        "in step {step} the time step itself has done {scheme_work_j:.3e} J of work, more than {:.0} % of the \
         {put_in_j:.3e} J that were put in ({put_in}); a shorter time.step_s is needed",
        share * 100.0
    )]
    Energy {
        /// The step in which this was detected.
        step: u64,
        /// The work of the scheme up to it.
        scheme_work_j: f64,
        /// Its bound, as a share of `put_in_j`.
        share: f64,
        /// The energy that it is compared with.
        put_in_j: f64,
        /// The kind of energy.
        put_in: &'static str,
    },
    /// A number to be recorded overflowed or became NaN.
    #[error("{0}")]
    NotFinite(String),
    /// The solver's own steps have become too short to end.
    #[error("{0}")]
    Stalled(String),
}

impl SimulationError {
    /// The status of a run that ends with this error.
    pub fn status(&self) -> RunStatus {
        match self {
            SimulationError::Energy { .. } => RunStatus::StoppedEnergy,
            SimulationError::NotFinite { .. } => RunStatus::StoppedNotFinite,
            SimulationError::Stalled { .. } => RunStatus::StoppedStalled,
        }
    }
}
