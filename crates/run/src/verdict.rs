//! What a log is worth: one judgement, in one set of words, for whoever reads logs.

use std::fmt;

/// What a log is worth, from best to worst: of several logs the worst counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// It holds all of its run, made by this very program with its detectors, and says so.
    Whole,
    /// It holds all of its run, but another version of the program or other detectors made it:
    /// what it holds agrees with itself, and cannot be compared with what this program makes.
    OtherCode,
    /// It ends before its run does; what it holds is sound.
    Incomplete,
    /// It holds all that there is of a run that was stopped because it could not go on: its time
    /// step was too long for it, or a number overflowed.
    Stopped,
    /// It is what was left of a damaged one, and says what it lacks.
    Salvaged,
    /// It is no run log, or there is no such file.
    NoRunLog,
    /// Something in it is not what was written, or contradicts the rest.
    Damaged,
}

impl Verdict {
    /// All of them, from best to worst.
    pub const ALL: [Verdict; 7] = [
        Verdict::Whole,
        Verdict::OtherCode,
        Verdict::Incomplete,
        Verdict::Stopped,
        Verdict::Salvaged,
        Verdict::NoRunLog,
        Verdict::Damaged,
    ];

    /// As it is written.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Whole => "whole",
            Verdict::OtherCode => "by other code or detectors",
            Verdict::Incomplete => "incomplete",
            Verdict::Stopped => "stopped",
            Verdict::Salvaged => "salvaged with gaps",
            Verdict::NoRunLog => "not a run log",
            Verdict::Damaged => "damaged",
        }
    }

    /// Whether the log holds all of its run, whichever program made it.
    pub fn holds_all(self) -> bool {
        matches!(self, Verdict::Whole | Verdict::OtherCode)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}
