//! Sends logged records through detectors again, with the rules of the live run or others.
//!
//! A replay reads a log once, front to back, in bounded memory: the detectors observe the records that
//! the check of the log finds sound, and logged and found events are compared as they arrive.

use std::path::Path;

use asperity_detect::{Detector, Detectors};
use asperity_record::{Event, EventKind, EventPayload, Observer, Record, RunHeader, SlipEvent};

use crate::check::{Checked, Unchecked};
use crate::detectors::{Settings, TopicError, kinds_of};
use crate::event_check::{Difference, EventCheck, OtherDetectors};

/// A log to be sent through detectors.
pub struct Replay {
    log: Unchecked,
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
        let log = Unchecked::open(log)?;
        let detectors = settings.start(log.header(), log.scenario_toml());
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
        let event_check = compares.then(|| EventCheck::with(&detectors, &log.event_schemas()));
        let found = Found { observer, event_check, slip_events: 0 };
        let mut detecting = Detecting { detectors, found, stop, is_stopped: false };
        let checked = log.check(&mut detecting);
        let Detecting { mut detectors, mut found, is_stopped, .. } = detecting;
        if is_stopped {
            return Err(ReplayError::Stopped);
        }
        if !checked.verdict.holds_all() {
            return Err(ReplayError::Log(Box::new(checked)));
        }
        detectors.finish(&mut |event| found.add(event));
        let Found { slip_events, event_check, .. } = found;
        Ok(Replayed {
            checked,
            slip_events,
            comparison: event_check.map(|event_check| Comparison {
                other_detectors: event_check.other_detectors(),
                difference: event_check.finish().err(),
            }),
        })
    }
}

/// Passes the records of a log through detectors.
struct Detecting<'a> {
    detectors: Detectors,
    found: Found<'a>,
    stop: &'a dyn Fn() -> bool,
    is_stopped: bool,
}

/// Receives the events that detectors find.
struct Found<'a> {
    observer: &'a mut dyn Observer,
    event_check: Option<EventCheck>,
    slip_events: u64,
}

impl Observer for Detecting<'_> {
    fn record(&mut self, record: &Record) {
        self.found.observer.record(record);
        self.detectors.observe(record, &mut |event| self.found.add(event));
        self.is_stopped |= (self.stop)();
    }

    fn event(&mut self, event: &Event) {
        if let Some(event_check) = &mut self.found.event_check {
            event_check.logged(event.clone());
        }
    }

    fn reached(&mut self, step: u64) {
        self.found.observer.reached(step);
    }

    fn is_done(&self) -> bool {
        self.is_stopped
    }
}

impl Found<'_> {
    fn add(&mut self, event: Event) {
        self.slip_events += u64::from(event.topic() == SlipEvent::TOPIC);
        self.observer.event(&event);
        if let Some(event_check) = &mut self.event_check {
            event_check.found(event);
        }
    }
}
