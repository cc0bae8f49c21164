//! Sends logged records through detectors again, with the rules of the live run or others.
//!
//! A replay reads a log once, front to back, in bounded memory: the detectors observe the records that
//! the check of the log finds sound, and logged and found events are compared as they arrive.

use std::cell::{Cell, RefCell};
use std::path::Path;

use asperity_detect::{Detector, Detectors};
use asperity_record::{Event, EventKind, EventPayload, Observer, Record, RunHeader, SlipEvent};

use crate::check::Checked;
use crate::detectors::{Settings, TopicError, kinds_of};
use crate::event_check::{Difference, OtherDetectors};
use crate::open_log::OpenLog;

/// A log to be sent through detectors.
pub struct Replay {
    log: OpenLog,
    detectors: Detectors,
    /// Whether the found events must equal the logged ones.
    compares: bool,
}

/// The result of a replay.
#[derive(Debug)]
pub struct Replayed {
    /// The verdict on the log, which is complete.
    pub checked: Checked,
    /// Number of slip events found.
    pub slip_events: u64,
    /// Comparison of found and logged events. None for rules other than those of a live run, which find
    /// other events without contradicting the log.
    pub comparison: Option<Comparison>,
}

/// Comparison of found events with those of the log.
#[derive(Debug)]
pub struct Comparison {
    /// The first difference, if there is one.
    pub difference: Option<Difference>,
    /// Topics of only one side, which were not compared.
    pub other_detectors: OtherDetectors,
}

/// Why a replay did not complete.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The log is incomplete.
    #[error("{0}")]
    Log(Box<Checked>),
    /// A custom detector uses a topic that it must not.
    #[error(transparent)]
    Topic(#[from] TopicError),
    /// The caller stopped it.
    #[error("stopped")]
    Stopped,
}

impl Replay {
    /// Opens a log for the registered detectors that `settings` chooses.
    ///
    /// # Errors
    /// The verdict, if it has no header that can be read.
    pub fn open(log: &Path, settings: &Settings) -> Result<Replay, Box<Checked>> {
        let log = OpenLog::open(log)?;
        let detectors = settings.start(log.header(), log.scenario().unwrap_or(None));
        Ok(Replay { log, detectors, compares: *settings == Settings::default() })
    }

    /// Adds a custom detector.
    #[must_use]
    pub fn detect(mut self, detector: impl Detector + 'static) -> Replay {
        self.detectors.push(Box::new(detector));
        self
    }

    /// The header of the run.
    pub fn header(&self) -> &RunHeader {
        self.log.header()
    }

    /// The kinds of events of its detectors.
    pub fn kinds(&self) -> Vec<EventKind> {
        self.detectors.kinds().collect()
    }

    /// Replays the log while it is checked: the verdict, at the end, decides whether the observer received
    /// a complete log. `stop` is polled between records.
    ///
    /// # Errors
    /// If the log is incomplete, a detector uses a topic that it must not, or the caller stops the replay.
    pub fn run(self, stop: &dyn Fn() -> bool, observer: &mut dyn Observer) -> Result<Replayed, ReplayError> {
        let Replay { log, detectors, compares } = self;
        kinds_of(&detectors)?;
        let observer = RefCell::new(observer);
        let slip_events = Cell::new(0);
        let mut found = |event: Event| {
            slip_events.set(slip_events.get() + u64::from(event.topic() == SlipEvent::TOPIC));
            observer.borrow_mut().event(&event);
        };
        let mut passing = Passing { observer: &observer, others: None, stop, is_stopped: false };
        let mut checked = if compares {
            // The detectors of the check are those of the replay.
            log.judge(false, &mut passing, Some((detectors, &mut found)))
        } else {
            passing.others = Some((detectors, &mut found));
            log.check(&mut passing)
        };
        if passing.is_stopped {
            return Err(ReplayError::Stopped);
        }
        if !checked.verdict.holds_all() {
            return Err(ReplayError::Log(Box::new(checked)));
        }
        if let Some((mut detectors, found)) = passing.others {
            detectors.finish(found);
        }
        let comparison = compares.then(|| Comparison {
            difference: checked.seen.other_events.take(),
            other_detectors: checked.seen.other_detectors.clone(),
        });
        Ok(Replayed { checked, slip_events: slip_events.get(), comparison })
    }
}

/// Passes the records of a log on, and through detectors other than those of its check.
struct Passing<'a, 'o> {
    observer: &'a RefCell<&'o mut dyn Observer>,
    others: Option<(Detectors, &'a mut dyn FnMut(Event))>,
    stop: &'a dyn Fn() -> bool,
    is_stopped: bool,
}

impl Observer for Passing<'_, '_> {
    fn record(&mut self, record: &Record) {
        self.observer.borrow_mut().record(record);
        if let Some((detectors, found)) = &mut self.others {
            detectors.observe(record, *found);
        }
        self.is_stopped |= (self.stop)();
    }

    fn reached(&mut self, step: u64) {
        self.observer.borrow_mut().reached(step);
    }

    fn is_done(&self) -> bool {
        self.is_stopped
    }
}
