//! What a caller sees of a run or a replay while it goes on.

use std::fmt;

use asperity_record::{Event, Record};

/// Looks on. All calls come from the thread that called, in the order of the log.
///
/// Every method does nothing unless it is written anew, and `()` looks at nothing.
pub trait Observer {
    /// A record: a step, the state of all blocks, or that of a dense window.
    fn record(&mut self, _record: &Record) {}

    /// An event, after the record that made it certain.
    fn event(&mut self, _event: &Event) {}

    /// The last step that records have come up to; for progress.
    fn reached(&mut self, _step: u64) {}

    /// Something that a user should know, and that is no error.
    fn notice(&mut self, _notice: Notice<'_>) {}
}

impl Observer for () {}

/// Something that a user should know of a run, in words by [`Display`](fmt::Display).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Notice<'a> {
    /// The run goes on from a checkpoint.
    GoesOn {
        /// The last step that had been taken.
        step: u64,
        /// Its time, s.
        time_s: f64,
    },
    /// The unfinished log lacked only its final name, and has it now.
    LackedItsName,
    /// What is accepted in its scenario and may surprise, see
    /// [`Scenario::warnings`](asperity_model::Scenario::warnings).
    Warning(&'a str),
    /// The load at which the drive was to stop was never reached.
    LoadNotReached {
        /// That load, `F_T / F_N`.
        ratio: f64,
    },
    /// A shortcut that the solver could not take in this run, and what it did instead.
    Fallback(&'a str),
}

impl fmt::Display for Notice<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Notice::GoesOn { step, time_s } => write!(f, "goes on from {time_s} s, step {step}"),
            Notice::LackedItsName => f.write_str("it was whole, but for its name"),
            Notice::Warning(warning) => write!(f, "warning: {warning}"),
            Notice::LoadNotReached { ratio } => write!(
                f,
                "F_T/F_N never reached {ratio} (drive.until_load_ratio): the drive never stopped; the log says so as \
                 its status"
            ),
            Notice::Fallback(what) => f.write_str(what),
        }
    }
}
