//! Logged records through detectors again, by the rules of the live run or by others.
//!
//! A replay reads a log once, from its first byte to its last, and holds no more of it than is
//! under way: what the log says of events and what the detectors find are compared as they come.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use asperity_detect::Detector;
use asperity_record::{EventKind, EventPayload, RunHeader, SlipEvent};
use asperity_runlog::{LogError, LogItem, LogProblem, RunReader, Topics};
use asperity_stream::{Given, Item, StreamError};

use crate::detectors::{Settings, TopicError, kinds_of};
use crate::event_check::{Difference, EventCheck, OtherDetectors};
use crate::observer::Observer;

/// A log that is to go through detectors again.
pub struct Replay {
    path: PathBuf,
    reader: RunReader,
    detectors: Vec<Box<dyn Detector>>,
    /// Whether what is found is to be what the log holds.
    compares: bool,
}

/// What came of a replay.
#[derive(Debug)]
pub struct Replayed {
    /// What the run said of itself.
    pub header: RunHeader,
    /// The digest of its messages.
    pub digest: String,
    /// Slip events found.
    pub slip_events: u64,
    /// What the events found are beside those logged; none by other rules than those of a live
    /// run, by which other events are found, and are no contradiction.
    pub comparison: Option<Comparison>,
}

/// Events as they were found, beside those of the log.
#[derive(Debug)]
pub struct Comparison {
    /// The first that differ, if any do.
    pub difference: Option<Difference>,
    /// Topics that only one of them has, which were not compared.
    pub other_detectors: OtherDetectors,
}

/// A replay that did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The log cannot be read to its end, or is not whole.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system gives no thread.
    #[error("failed to start a thread: {0}")]
    Thread(String),
    /// A detector of the caller's own emits what it must not.
    #[error(transparent)]
    Topic(#[from] TopicError),
    /// The caller asked it to stop.
    #[error("stopped")]
    Stopped,
}

impl Replay {
    /// Opens a log, for the registered detectors that `settings` chooses.
    ///
    /// # Errors
    /// If it is no run log that can be read.
    pub fn open(log: &Path, settings: &Settings) -> Result<Replay, LogError> {
        let compares = *settings == Settings::default();
        let topics = Topics { events: compares, ..Topics::STEPS };
        let reader = RunReader::open(log, topics)?;
        let detectors = settings.start(reader.header(), reader.scenario_toml());
        Ok(Replay { path: log.to_owned(), reader, detectors, compares })
    }

    /// With one more detector, of the caller's own.
    #[must_use]
    pub fn detect(mut self, detector: impl Detector + 'static) -> Replay {
        self.detectors.push(Box::new(detector));
        self
    }

    /// What the run says of itself.
    pub fn header(&self) -> &RunHeader {
        self.reader.header()
    }

    /// What its detectors emit.
    pub fn kinds(&self) -> Vec<EventKind> {
        self.detectors.iter().map(|detector| detector.emits()).collect()
    }

    /// Replays it. `stop` is asked between records, from another thread.
    ///
    /// # Errors
    /// If the log is not whole, a detector emits what it must not, or the caller asked to stop.
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
        let outcome = asperity_stream::run(
            || loop {
                if stop() {
                    return Err(ReplayError::Stopped);
                }
                let item = reader.next_item()?;
                if reader.has_gap() {
                    // What is missing may have been the beginning of an event.
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
                        slip_events += u64::from(event.topic == SlipEvent::TOPIC);
                        observer.event(&event);
                        let mut event_check = event_check.lock().expect("no one panics with it");
                        if let Some(event_check) = &mut *event_check {
                            event_check.found(event);
                            // Told at the end; only that what agrees is let go of matters here.
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
