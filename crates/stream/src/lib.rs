//! Carries records from a source through the detectors to a sink, each on a
//! thread of its own, over bounded channels.
//!
//! ```text
//! source --records--> detectors --records and their events--> sink
//! ```
//!
//! It is a line, not a fan: the detectors pass every record on and put the
//! events that it gave rise to right after it. So the sink sees one sequence,
//! and that sequence depends on the source alone, never on scheduling. A slow
//! sink fills the channels and slows the source; memory stays flat. Whoever
//! fails stops the others, and its error is the one that is reported.
//!
//! Where every core has a stream of its own, threads within one only get in each other's way:
//! [`run_in_turn`] gives the sink the same sequence on the calling thread.
//!
//! A live run and a replay differ in their source only.
//!
//! ```
//! use std::convert::Infallible;
//!
//! use asperity_record::{Record, StepRecord};
//! use asperity_stream::{Given, Item};
//!
//! let record = |step: u64| StepRecord {
//!     step,
//!     time_s: step as f64 * 1e-7,
//!     driving_force_n: 100.0,
//!     normal_load_n: 400.0,
//!     end_forces_n: None,
//!     energy: None,
//!     sliding: 0,
//!     switches: Vec::new(),
//! };
//! let mut steps = 0..3;
//! let source = || Ok::<_, Infallible>(steps.next().map(|step| Given::Record(Record::Step(record(step)))));
//! let mut seen = Vec::new();
//! let sink = |item| {
//!     if let Item::Record(Record::Step(record)) = item {
//!         seen.push(record.step);
//!     }
//!     Ok::<_, Infallible>(())
//! };
//! // No detectors, so no events.
//! asperity_stream::run(source, Vec::new(), sink)?;
//! assert_eq!(seen, [0, 1, 2]);
//! # Ok::<(), asperity_stream::StreamError<Infallible, Infallible>>(())
//! ```
//!
//! Beside the line there is [`at_once`], for work on many runs: several jobs at a time, with
//! the results in the order of the jobs.

mod at_once;

use std::thread;

use asperity_detect::Detector;
use asperity_record::{Checkpoint, Event, Record};
use crossbeam_channel::{Receiver, Sender, bounded};

pub use at_once::at_once;

/// What a source gives.
#[derive(Debug, Clone, PartialEq)]
pub enum Given {
    /// For the detectors and the sink.
    Record(Record),
    /// For the sink alone.
    Checkpoint(Checkpoint),
}

/// What reaches the sink.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A record, as the source gave it.
    Record(Record),
    /// An event, right after the record that made it certain.
    Event(Event),
    /// A checkpoint, after the records that it stands on and their events.
    Checkpoint(Checkpoint),
}

/// Why a stream stopped before its source was exhausted.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum StreamError<Source, Sink> {
    /// The source failed.
    #[error(transparent)]
    Source(Source),
    /// The sink failed.
    #[error(transparent)]
    Sink(Sink),
    /// The system gives no further thread, or no memory for one.
    #[error("failed to start a thread: {0}")]
    Thread(String),
}

/// Records under way between two threads: enough to ride out a pause of the
/// disk. The two channels full of fields take half a megabyte for 100 blocks,
/// 50 MB for 10,000 and 500 MB for 100,000, the largest chain there may be.
const CHANNEL_CAPACITY: usize = 64;

/// Runs a stream to its end: everything `source` gives goes through `detectors`
/// and, with their events, into `sink`, which runs on the calling thread.
///
/// # Errors
/// The first failure of source or sink, or that there is no thread to be had. After a failure the detectors are not
/// told that the run is over, so no event is closed that a whole run would not
/// have closed.
pub fn run<SourceError, SinkError>(
    mut source: impl FnMut() -> Result<Option<Given>, SourceError> + Send,
    mut detectors: Vec<Box<dyn Detector>>,
    mut sink: impl FnMut(Item) -> Result<(), SinkError>,
) -> Result<(), StreamError<SourceError, SinkError>>
where
    SourceError: Send,
{
    thread::scope(|scope| {
        let (to_detectors, records) = bounded(CHANNEL_CAPACITY);
        let (to_sink, items) = bounded(CHANNEL_CAPACITY);
        let no_thread = |error: std::io::Error| StreamError::Thread(error.to_string());
        // Without the second, the first finds nobody to send to, and ends.
        let source_thread = thread::Builder::new()
            .spawn_scoped(scope, move || feed(&mut source, &to_detectors))
            .map_err(no_thread)?;
        let detector_thread = thread::Builder::new()
            .spawn_scoped(scope, move || detect(&mut detectors, &records, &to_sink))
            .map_err(no_thread)?;

        let drained = items.iter().try_for_each(&mut sink);
        // With the receiver gone, whoever still sends finds out and stops.
        drop(items);
        if let Err(panic) = detector_thread.join() {
            std::panic::resume_unwind(panic);
        }
        let fed = source_thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        drained.map_err(StreamError::Sink)?;
        fed.map_err(StreamError::Source)
    })
}

/// Does the same as [`run`] on the calling thread, one record after the other.
///
/// # Errors
/// The first failure of source or sink, after which the detectors are not told that the run is over.
pub fn run_in_turn<SourceError, SinkError>(
    mut source: impl FnMut() -> Result<Option<Given>, SourceError>,
    mut detectors: Vec<Box<dyn Detector>>,
    mut sink: impl FnMut(Item) -> Result<(), SinkError>,
) -> Result<(), StreamError<SourceError, SinkError>> {
    let mut events = Vec::new();
    loop {
        let fed = source().map_err(StreamError::Source)?.map_or(Fed::End, Fed::Given);
        let ends = matches!(fed, Fed::End);
        pass_on(fed, &mut detectors, &mut events, &mut sink).map_err(StreamError::Sink)?;
        if ends {
            return Ok(());
        }
    }
}

/// What goes to the detectors.
enum Fed {
    Given(Given),
    /// The source is exhausted, and did not fail.
    End,
}

fn feed<E>(
    source: &mut impl FnMut() -> Result<Option<Given>, E>,
    to_detectors: &Sender<Fed>,
) -> Result<(), E> {
    loop {
        let fed = source()?.map_or(Fed::End, Fed::Given);
        let ends = matches!(fed, Fed::End);
        if to_detectors.send(fed).is_err() || ends {
            return Ok(());
        }
    }
}

fn detect(detectors: &mut [Box<dyn Detector>], records: &Receiver<Fed>, to_sink: &Sender<Item>) {
    let mut events = Vec::new();
    for fed in records {
        let ends = matches!(fed, Fed::End);
        let passed_on = pass_on(fed, detectors, &mut events, &mut |item| to_sink.send(item).map_err(drop));
        if passed_on.is_err() || ends {
            return;
        }
    }
}

/// Gives the sink what was fed, and the events that the detectors make of it. `events` is room to
/// work in.
fn pass_on<E>(
    fed: Fed,
    detectors: &mut [Box<dyn Detector>],
    events: &mut Vec<Event>,
    sink: &mut impl FnMut(Item) -> Result<(), E>,
) -> Result<(), E> {
    match fed {
        Fed::Given(Given::Checkpoint(checkpoint)) => sink(Item::Checkpoint(checkpoint))?,
        Fed::Given(Given::Record(record)) => {
            if let Record::Step(step) = &record {
                for detector in detectors.iter_mut() {
                    detector.observe(step, &mut |event| events.push(event));
                }
            }
            sink(Item::Record(record))?;
        }
        Fed::End => {
            for detector in detectors.iter_mut() {
                detector.finish(&mut |event| events.push(event));
            }
        }
    }
    events.drain(..).try_for_each(|event| sink(Item::Event(event)))
}
