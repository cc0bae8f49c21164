//! The verdict on a log, shared by all readers of logs.

use std::fmt;

/// The verdicts from best to worst; the worst of several logs counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// It is complete, and was made by this code version with its detectors.
    Whole,
    /// It is complete, but was made by another code version or other detectors: it is consistent, and
    /// cannot be compared with runs of this program.
    OtherCode,
    /// The system failed to read it, which says nothing about the log.
    Unreadable,
    /// It ends before its run does; the part that exists is sound.
    Incomplete,
    /// It contains all of a run that the solver stopped: its time step was too long, or a number
    /// overflowed.
    Stopped,
    /// It was recovered from a damaged log, and states its gaps.
    Salvaged,
    /// It is not a run log, or there is no such file.
    NoRunLog,
    /// A checksum is wrong, or it contradicts itself.
    Damaged,
}

impl Verdict {
    /// The verdict as printed.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Whole => "whole",
            Verdict::OtherCode => "by other code or detectors",
            Verdict::Incomplete => "incomplete",
            Verdict::Stopped => "stopped",
            Verdict::Salvaged => "salvaged with gaps",
            Verdict::NoRunLog => "not a run log",
            Verdict::Unreadable => "unreadable",
            Verdict::Damaged => "damaged",
        }
    }

    /// Whether it tells nothing of a run: there is no log, or the system does not give it.
    pub fn tells_nothing(self) -> bool {
        matches!(self, Verdict::NoRunLog | Verdict::Unreadable)
    }

    /// Whether the log is complete, whichever program made it.
    pub fn holds_all(self) -> bool {
        matches!(self, Verdict::Whole | Verdict::OtherCode)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}
