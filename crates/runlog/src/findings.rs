//! What was found in a damaged log: how much of it is left, and where something is missing.

use std::collections::BTreeMap;

/// What was kept and what was lost.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Salvaged {
    /// Messages kept, by topic.
    pub kept: BTreeMap<String, u64>,
    /// Messages lost, by topic, as far as their numbers or the log's end tell. After the
    /// last message that is left there may have been more, unless [`Salvaged::end_is_known`].
    pub lost: BTreeMap<String, u64>,
    /// Where messages are missing, in order.
    pub gaps: Vec<Gap>,
    /// Bytes of the file that nothing could be made of, and why.
    pub damage: Vec<Damage>,
    /// What else is not as it was.
    pub remarks: Vec<String>,
    /// Whether the log said how many messages it had.
    pub end_is_known: bool,
}

/// A stretch of a run that the log has nothing of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// The step of the last message before it; `None` if the gap is at the beginning.
    pub after_step: Option<u64>,
    /// The step of the first message after it; `None` if the rest is missing.
    pub before_step: Option<u64>,
}

/// Bytes that nothing could be made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where they begin.
    pub from_byte: u64,
    /// The first byte after them.
    pub to_byte: u64,
    /// What is wrong there.
    pub what: String,
}
