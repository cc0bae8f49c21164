//! What a caller observes of a run or a replay in progress.

use std::fmt;

use asperity_record::{Event, Record};

/// Observes a run. All calls are made on the calling thread, in the order of the log.
///
/// All methods default to no-ops; `()` ignores everything.
pub trait Observer {
    /// A record: a step, the state of all blocks, or that of a dense window.
    fn record(&mut self, _record: &Record) {}

    /// An event, after the record that completed it.
    fn event(&mut self, _event: &Event) {}

    /// The last step that the records have reached; for progress.
    fn reached(&mut self, _step: u64) {}

    /// A note for the user that is not an error.
    fn notice(&mut self, _notice: Notice<'_>) {}
}

impl Observer for () {}

/// A note for the user about a run; [`Display`](fmt::Display) formats it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Notice<'a> {
    /// The run resumes from a checkpoint.
    GoesOn {
        /// The last step before.
        step: u64,
        /// Its time, s.
        time_s: f64,
    },
    /// The unfinished log was complete except for its final name, which it now has.
    LackedItsName,
    /// A warning about the scenario, see
    /// [`Scenario::warnings`](asperity_model::Scenario::warnings).
    Warning(&'a str),
    /// The load at which the drive would stop was never reached.
    LoadNotReached {
        /// That load, `F_T / F_N`.
        ratio: f64,
    },
    /// A shortcut that the solver could not use in this run, and what it used instead.
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
