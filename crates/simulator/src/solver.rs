//! What a solver is.

use asperity_record::{Record, RunStatus};

use crate::counters::Counters;
use crate::pace::Snapshot;

/// A solver of a [`asperity_model::Plan`].
pub trait Solver: Send {
    /// The solver's name in run headers and on the command line.
    fn name(&self) -> &'static str;

    /// Advances to the next thing to be recorded; `None` once the run is over
    /// and everything has been handed out.
    ///
    /// # Errors
    /// If the run cannot go on, see [`SimulationError`]; it is said again whenever it is asked.
    fn next_record(&mut self) -> Result<Option<Record>, SimulationError>;

    /// The last step taken.
    fn step(&self) -> u64;

    /// Whether another solver can go on from a snapshot taken now: all records up to
    /// [`Solver::step`] have been handed out.
    fn is_between_records(&self) -> bool;

    /// The whole state, to the bit where [`Solver::is_between_records`]: a solver of the same kind
    /// that restores it yields the same switches, events and states from there on, whatever the
    /// cadences.
    fn snapshot(&self) -> Snapshot;

    /// What the steps up to now were made of.
    fn counters(&self) -> Counters;

    /// Shortcuts that this solver cannot take in this run at all, and what it does
    /// instead.
    fn fallbacks(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// A copy, which continues on its own.
    fn fork(&self) -> Box<dyn Solver>;

    /// Continues from a state. Records not yet handed out are dropped.
    ///
    /// # Panics
    /// If the state is of a slider of another size.
    fn restore(&mut self, snapshot: &Snapshot);
}

impl<S: Solver + ?Sized> Solver for Box<S> {
    fn name(&self) -> &'static str {
        (**self).name()
    }

    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        (**self).next_record()
    }

    fn step(&self) -> u64 {
        (**self).step()
    }

    fn is_between_records(&self) -> bool {
        (**self).is_between_records()
    }

    fn snapshot(&self) -> Snapshot {
        (**self).snapshot()
    }

    fn counters(&self) -> Counters {
        (**self).counters()
    }

    fn fallbacks(&self) -> Vec<&'static str> {
        (**self).fallbacks()
    }

    fn fork(&self) -> Box<dyn Solver> {
        (**self).fork()
    }

    fn restore(&mut self, snapshot: &Snapshot) {
        (**self).restore(snapshot);
    }
}

/// A run that cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The time step had done more work than an honest run can have of it
    /// ([`MOST_SCHEME_SHARE`](crate::MOST_SCHEME_SHARE)).
    #[error(
        "in step {step} the time step itself has done {scheme_work_j:.3e} J of work, more than {:.0} % of the \
         {put_in_j:.3e} J that were put in ({put_in}); a shorter time.step_s is needed",
        share * 100.0
    )]
    Energy {
        /// The step in which it was seen.
        step: u64,
        /// The work of the scheme up to it.
        scheme_work_j: f64,
        /// Most that it may be, as a share of what it is held against.
        share: f64,
        /// What it is held against.
        put_in_j: f64,
        /// What that is.
        put_in: &'static str,
    },
    /// Something that was to be recorded overflowed or became no number.
    #[error(
        "in step {step} {what} is no longer finite: block {block} is at u = {displacement_m:.3e} m, \
         v = {velocity_m_per_s:.3e} m/s"
    )]
    NotFinite {
        /// The step after which it was seen.
        step: u64,
        /// What it is.
        what: &'static str,
        /// The block, counted from 1: the first of which it is not finite, or the fastest where it
        /// is of the whole slider.
        block: u32,
        /// Its displacement.
        displacement_m: f64,
        /// Its velocity.
        velocity_m_per_s: f64,
    },
}

impl SimulationError {
    /// How a run ends that it stops.
    pub fn status(&self) -> RunStatus {
        match self {
            SimulationError::Energy { .. } => RunStatus::StoppedEnergy,
            SimulationError::NotFinite { .. } => RunStatus::StoppedNotFinite,
        }
    }
}
