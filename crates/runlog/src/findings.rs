//! The result of salvaging a damaged log: what is left, and where something is missing.

use std::collections::BTreeMap;

/// The parts that were kept and lost.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Salvaged {
    /// Messages kept, by topic.
    pub kept: BTreeMap<String, u64>,
    /// Messages lost, by topic, as far as message numbers or the log's end reveal. Messages after
    /// the last one left may be missing as well, unless [`Salvaged::end_is_known`].
    pub lost: BTreeMap<String, u64>,
    /// Where messages are missing, in order.
    pub gaps: Vec<Gap>,
    /// Unusable bytes of the file, and why.
    pub damage: Vec<Damage>,
    /// Other deviations from the original.
    pub remarks: Vec<String>,
    /// Whether the log's end, with the numbers of messages, was found.
    pub end_is_known: bool,
}

/// A stretch of a run without messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// The step of the last message before it; `None` at the beginning.
    pub after_step: Option<u64>,
    /// The step of the first message after it; `None` at the end.
    pub before_step: Option<u64>,
}

/// Unusable bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// The first byte.
    pub from_byte: u64,
    /// The first byte after them.
    pub to_byte: u64,
    /// The damage there.
    pub what: String,
}
