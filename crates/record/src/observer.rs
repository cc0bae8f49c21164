//! What a run, a replay or the reading of a log passes to whoever makes something of it.

use std::fmt;

use crate::{Event, Record, short_time};

/// Observes a run as it is made, replayed or read out of its log. All calls are made on one thread, in
/// the order of the log. Summaries, tables, pages and progress bars are observers, and a pair of
/// observers is one that passes everything to both.
///
/// All methods default to no-ops; `()` ignores everything.
pub trait Observer {
    /// A record: a step, the state of all blocks, or that of a dense window.
    fn record(&mut self, _record: &Record) {}

    /// An event, after the record that completed it.
    fn event(&mut self, _event: &Event) {}

    /// The last step that the records have reached; for progress.
    fn reached(&mut self, _step: u64) {}

    /// Whether nothing more is made of a log that is read, so that the reading can end; asked between
    /// records.
    fn is_done(&self) -> bool {
        false
    }

    /// A note for the user that is not an error.
    fn notice(&mut self, _notice: Notice<'_>) {}
}

impl Observer for () {}

impl<O: Observer + ?Sized> Observer for &mut O {
    fn record(&mut self, record: &Record) {
        (**self).record(record);
    }

    fn event(&mut self, event: &Event) {
        (**self).event(event);
    }

    fn reached(&mut self, step: u64) {
        (**self).reached(step);
    }

    fn is_done(&self) -> bool {
        (**self).is_done()
    }

    fn notice(&mut self, notice: Notice<'_>) {
        (**self).notice(notice);
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    fn record(&mut self, record: &Record) {
        self.0.record(record);
        self.1.record(record);
    }

    fn event(&mut self, event: &Event) {
        self.0.event(event);
        self.1.event(event);
    }

    fn reached(&mut self, step: u64) {
        self.0.reached(step);
        self.1.reached(step);
    }

    fn is_done(&self) -> bool {
        self.0.is_done() && self.1.is_done()
    }

    fn notice(&mut self, notice: Notice<'_>) {
        self.0.notice(notice);
        self.1.notice(notice);
    }
}

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
    /// A warning about the scenario.
    Warning(&'a str),
    /// The load at which the drive would stop was never reached.
    LoadNotReached {
        /// That load, `F_T / F_N`.
        ratio: f64,
    },
    /// Nothing slipped by the threshold of events, though blocks were far faster than the drive at the start.
    NoEvents {
        /// That threshold, m/s.
        event_speed_m_per_s: f64,
        /// The largest speed of any block, m/s.
        peak_m_per_s: f64,
    },
    /// A shortcut that the solver could not use in this run, and what it used instead.
    Fallback(&'a str),
}

impl Notice<'_> {
    /// The beginning of the words for [`Notice::GoesOn`], by which a message of another process is recognised.
    pub const RESUMES: &'static str = "resumes from ";
}

impl fmt::Display for Notice<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Notice::GoesOn { step, time_s } => {
                write!(f, "{}{} s, step {step}", Notice::RESUMES, short_time(*time_s))
            }
            Notice::LackedItsName => f.write_str("its log was whole and only had to be renamed"),
            Notice::Warning(warning) => write!(f, "warning: {warning}"),
            Notice::LoadNotReached { ratio } => write!(
                f,
                "F_T/F_N never reached {ratio} (drive.until_load_ratio): the drive never stopped; the log says so as \
                 its status"
            ),
            Notice::NoEvents { event_speed_m_per_s, peak_m_per_s } => write!(
                f,
                "no block came above V_th = {event_speed_m_per_s:.4e} m/s; the largest speed was {peak_m_per_s:.4e} m/s \
                 (friction.event_speed_m_per_s)"
            ),
            Notice::Fallback(what) => f.write_str(what),
        }
    }
}
