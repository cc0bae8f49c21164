//! Sends logged records through detectors again, with the rules of the live run or others.
//!
//! A replay reads a log once, front to back, in bounded memory: logged and found events are
//! compared as they arrive.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use asperity_detect::{Detector, Detectors};
use asperity_record::Observer;
use asperity_record::{EventKind, EventPayload, RunHeader, SlipEvent};
use asperity_runlog::{LogError, LogItem, LogProblem, RunReader, Topics};

use crate::detectors::{Settings, TopicError, kinds_of};
use crate::event_check::{Difference, EventCheck, OtherDetectors};
use crate::stream::{Given, Item, StreamError};

/// A log to be sent through detectors.
pub struct Replay {
    path: PathBuf,
    reader: RunReader,
    detectors: Detectors,
    /// Whether the found events must equal the logged ones.
    compares: bool,
}

/// The result of a replay.
#[derive(Debug)]
pub struct Replayed {
    /// The header of the run.
    pub header: RunHeader,
    /// The digest of its messages.
    pub digest: String,
    /// Number of slip events found.
    pub slip_events: u64,
    /// Comparison of found and logged events. None with rules other than those of a live run, which
    /// find other events without contradicting the log.
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
    /// The log cannot be read to its end, or is not whole.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system cannot start a thread.
    #[error("failed to start a thread: {0}")]
    Thread(String),
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
    /// If it is not a readable run log.
    pub fn open(log: &Path, settings: &Settings) -> Result<Replay, LogError> {
        let compares = *settings == Settings::default();
        let topics = Topics { events: compares, ..Topics::STEPS };
        let reader = RunReader::open(log, topics)?;
        let detectors = settings.start(reader.header(), reader.scenario_toml());
        Ok(Replay { path: log.to_owned(), reader, detectors, compares })
    }

    /// Adds a custom detector.
    #[must_use]
    pub fn detect(mut self, detector: impl Detector + 'static) -> Replay {
        self.detectors.push(Box::new(detector));
        self
    }

    /// The header of the run.
    pub fn header(&self) -> &RunHeader {
        self.reader.header()
    }

    /// The kinds of events of its detectors.
    pub fn kinds(&self) -> Vec<EventKind> {
        self.detectors.kinds().collect()
    }

    /// Replays the log. `stop` is polled between records, on another thread.
    ///
    /// # Errors
    /// If the log is not whole, a detector uses a topic that it must not, or the caller stops the
    /// replay.
    pub fn run(
        self,
        stop: &(dyn Fn() -> bool + Sync),
        observer: &mut dyn Observer,
    ) -> Result<Replayed, ReplayError> {
        let Replay { path, mut reader, detectors, compares } = self;
        kinds_of(&detectors)?;
        let header = reader.header().clone();
        let event_check = Mutex::new(compares.then(|| EventCheck::with(&detectors, &header)));
        let mut slip_events = 0;
        let outcome = crate::stream::run(
            || loop {
                if stop() {
                    return Err(ReplayError::Stopped);
                }
                let item = reader.next_item()?;
                if reader.has_gap() {
                    // The gap may contain the beginning of an event.
                    return Err(LogError { path: path.clone(), problem: LogProblem::Salvaged }.into());
                }
                let mut event_check = event_check.lock().expect("no one panics with it");
                if let Some(event_check) = &mut *event_check {
                    event_check.announced(reader.event_topics());
                }
                match (item, &mut *event_check) {
                    (None, _) => return Ok(None),
                    (Some(LogItem::Record(record)), _) => return Ok(Some(Given::Record(record))),
                    (Some(LogItem::Event(event)), Some(event_check)) => event_check.logged(event),
                    (Some(LogItem::Event(_)), None) => {}
                }
            },
            detectors,
            |item| {
                match item {
                    Item::Event(event) => {
                        slip_events += u64::from(event.topic() == SlipEvent::TOPIC);
                        observer.event(&event);
                        let mut event_check = event_check.lock().expect("no one panics with it");
                        if let Some(event_check) = &mut *event_check {
                            event_check.found(event);
                            // Differences are reported at the end; this only drops equal pairs.
                            event_check.let_go();
                        }
                    }
                    Item::Record(record) => {
                        observer.record(&record);
                        observer.reached(record.step());
                    }
                    Item::Checkpoint(_) => {}
                }
                Ok::<(), ReplayError>(())
            },
        );
        match outcome {
            Ok(()) => {}
            Err(StreamError::Source(error) | StreamError::Sink(error)) => return Err(error),
            Err(StreamError::Thread(error)) => return Err(ReplayError::Thread(error)),
        }
        let event_check = event_check.into_inner().expect("no one panics with it");
        let end = reader.end().expect("the log was read to its end");
        Ok(Replayed {
            header,
            digest: end.digest.clone(),
            slip_events,
            comparison: event_check.map(|event_check| Comparison {
                other_detectors: event_check.other_detectors(),
                difference: event_check.finish().err(),
            }),
        })
    }
}
