//! Sends logged records through detectors again, with the rules of the live run or others.
//!
//! A replay reads a log once, front to back, in bounded memory: the detectors observe the records that
//! the check of the log finds sound, and logged and found events are compared as they arrive.

use std::cell::{Cell, RefCell};
use std::path::Path;

use asperity_detect::{Detector, Detectors};
use asperity_record::{Event, EventKind, EventPayload, Observer, Record, RunHeader, SlipEvent};

use crate::check::Checked;
use crate::detectors::{Settings, kinds_of};
use crate::event_check::{Difference, EventCheck, OtherDetectors};
use crate::open_log::OpenLog;

/// A log to be sent through detectors.
pub struct Replay {
    log: OpenLog,
    detectors: Detectors,
    /// Whether the found events must equal the logged ones.
    compares: bool,
    /// Whether the detectors are those that the check of the log starts itself.
    are_of_check: bool,
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
    #[error("{0}")]
    Topic(String),
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
        let compares = *settings == Settings::default();
        Ok(Replay { log, detectors, compares, are_of_check: compares })
    }

    /// Adds a custom detector.
    #[must_use]
    pub fn detect(mut self, detector: impl Detector + 'static) -> Replay {
        self.detectors.push(Box::new(detector));
        Replay { are_of_check: false, ..self }
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
        let Replay { log, detectors, compares, are_of_check } = self;
        kinds_of(&detectors).map_err(ReplayError::Topic)?;
        let (observer, slip_events) = (RefCell::new(observer), Cell::new(0));
        let mut tell = |event: Event| {
            slip_events.set(slip_events.get() + u64::from(event.topic() == SlipEvent::TOPIC));
            observer.borrow_mut().event(&event);
        };
        let mut passing = Passing { observer: &observer, others: None, stop, is_stopped: false };
        let checked = if are_of_check {
            log.judge(false, &mut passing, Some(&mut tell))
        } else {
            let event_check = compares.then(|| EventCheck::with(&detectors, &log.event_schemas()));
            passing.others = Some(Others { detectors, event_check, new: Vec::new(), tell: &mut tell });
            log.check(&mut passing)
        };
        if passing.is_stopped {
            return Err(ReplayError::Stopped);
        }
        if !checked.verdict.holds_all() {
            return Err(ReplayError::Log(Box::new(checked)));
        }
        let comparison = match passing.others {
            None => Some(Comparison {
                difference: checked.seen.other_events.clone(),
                other_detectors: checked.seen.other_detectors.clone(),
            }),
            Some(mut others) => {
                others.detectors.finish(&mut |event| others.new.push(event));
                others.pass();
                others.event_check.map(|event_check| Comparison {
                    other_detectors: event_check.other_detectors(),
                    difference: event_check.finish().err(),
                })
            }
        };
        Ok(Replayed { checked, slip_events: slip_events.get(), comparison })
    }
}

/// Passes the records of a log on, and through detectors other than those of its check.
struct Passing<'a, 'o> {
    observer: &'a RefCell<&'o mut dyn Observer>,
    others: Option<Others<'a>>,
    stop: &'a dyn Fn() -> bool,
    is_stopped: bool,
}

/// Such detectors, and who receives their events.
struct Others<'a> {
    detectors: Detectors,
    event_check: Option<EventCheck>,
    /// Events found in the current record.
    new: Vec<Event>,
    tell: &'a mut dyn FnMut(Event),
}

impl Others<'_> {
    fn pass(&mut self) {
        for event in self.new.drain(..) {
            (self.tell)(event.clone());
            if let Some(event_check) = &mut self.event_check {
                event_check.found(event);
            }
        }
    }
}

impl Observer for Passing<'_, '_> {
    fn record(&mut self, record: &Record) {
        self.observer.borrow_mut().record(record);
        if let Some(Others { detectors, new, .. }) = &mut self.others {
            detectors.observe(record, &mut |event| new.push(event));
        }
        self.is_stopped |= (self.stop)();
    }

    fn event(&mut self, event: &Event) {
        if let Some(Others { event_check: Some(event_check), .. }) = &mut self.others {
            event_check.logged(event.clone());
        }
    }

    fn reached(&mut self, step: u64) {
        self.observer.borrow_mut().reached(step);
        if let Some(others) = &mut self.others {
            others.pass();
        }
    }

    fn is_done(&self) -> bool {
        self.is_stopped
    }
}
