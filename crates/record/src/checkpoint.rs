//! The point from which an unfinished run continues.

/// The state of a solver between two records: the stream has all records up to its step before it, and a
/// solver that restores it yields those that follow.
///
/// Checkpoints are written by the wall clock, so they are not among the messages of a run, and do not
/// enter its digest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// The last step taken.
    pub step: u64,
    /// The state as a JSON object, in a format of the solver that wrote it.
    pub state: String,
}
