//! From where an unfinished run can go on.

/// The whole state of a solver, between two records: all records up to its step stand before
/// it in the stream, and a solver that restores it gives those that are to follow.
///
/// How often there is one depends on the wall clock, so none counts as a message of its run or
/// enters its digest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// The last step taken.
    pub step: u64,
    /// The state, as one JSON object. Only the solver that wrote it knows what it means.
    pub state: String,
}
