//! Passes records from a source through detectors to a sink, each on a thread of its own, over
//! bounded channels.
//!
//! ```text
//! source --records--> detectors --records and their events--> sink
//! ```
//!
//! A pipeline, not a fan-out: the detectors forward every record, followed by the events it gave
//! rise to. The sink therefore receives one sequence that depends on the source alone, never on
//! scheduling. A slow sink fills the channels and so slows the source, in constant memory. A
//! failing stage stops the others, and its error is reported.
//!
//! Where every core runs a stream of its own, further threads only compete: [`run_in_turn`] passes
//! the same sequence to the sink on the calling thread.
//!
//! A live run and a replay differ in their source only.
//!
//! ```
//! use std::convert::Infallible;
//!
//! use asperity_detect::{Detectors, SlipRules};
//! use asperity_record::{Energy, Record, StepRecord};
//! use asperity_run::stream::Item;
//!
//! let record = |step: u64| StepRecord {
//!     step,
//!     time_s: step as f64 * 1e-7,
//!     driving_force_n: 100.0,
//!     normal_load_n: 400.0,
//!     ft_fn_error: None,
//!     end_forces_n: None,
//!     energy: Energy::default(),
//!     junctions: None,
//!     peak_velocity_m_per_s: None,
//!     sliding: 0,
//!     switches: Vec::new(),
//! };
//! let mut steps = 0..3;
//! let source = || Ok::<_, Infallible>(steps.next().map(|step| Item::Record(Record::Step(record(step)))));
//! let mut seen = Vec::new();
//! let sink = |item| {
//!     if let Item::Record(Record::Step(record)) = item {
//!         seen.push(record.step);
//!     }
//!     Ok::<_, Infallible>(())
//! };
//! // No detectors, so no events.
//! let detectors = Detectors::new(1, SlipRules::EVERY_SLIP, Vec::new());
//! asperity_run::stream::run(source, detectors, sink)?;
//! assert_eq!(seen, [0, 1, 2]);
//! # Ok::<(), asperity_run::stream::StreamError<Infallible, Infallible>>(())
//! ```
//!

use std::thread;

use asperity_detect::Detectors;
use asperity_record::{Checkpoint, Event, Record};
use crossbeam_channel::{Receiver, Sender, bounded};

/// What a source gives and the sink receives.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A record, which the detectors see as well.
    Record(Record),
    /// An event: of the detectors, right after the record that completed it, or one that the source itself
    /// found.
    Event(Event),
    /// A checkpoint, after the records that it includes and their events.
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
    /// The system cannot start a thread, or lacks memory for one.
    #[error("failed to start a thread: {0}")]
    Thread(String),
}

/// Capacity of a channel in records: enough to bridge a pause of the disk. Two channels full of
/// fields take half a megabyte for 100 blocks, 50 MB for 10,000 and 500 MB for 100,000, the longest
/// chain.
const CHANNEL_CAPACITY: usize = 64;

/// Runs a stream to its end: everything from `source` passes through `detectors` and, with their
/// events, into `sink`, which runs on the calling thread.
///
/// # Errors
/// The first failure of source, sink or thread creation. After a failure the detectors are not finished,
/// since they would end events that a complete run would not have ended.
pub fn run<SourceError, SinkError>(
    mut source: impl FnMut() -> Result<Option<Item>, SourceError> + Send,
    mut detectors: Detectors,
    mut sink: impl FnMut(Item) -> Result<(), SinkError>,
) -> Result<(), StreamError<SourceError, SinkError>>
where
    SourceError: Send,
{
    thread::scope(|scope| {
        let (to_detectors, records) = bounded(CHANNEL_CAPACITY);
        let (to_sink, items) = bounded(CHANNEL_CAPACITY);
        let no_thread = |error: std::io::Error| StreamError::Thread(error.to_string());
        // If the second thread fails to start, the first finds its channel closed and ends.
        let source_thread = thread::Builder::new()
            .spawn_scoped(scope, move || feed(&mut source, &to_detectors))
            .map_err(no_thread)?;
        let detector_thread = thread::Builder::new()
            .spawn_scoped(scope, move || detect(&mut detectors, &records, &to_sink))
            .map_err(no_thread)?;

        let drained = items.iter().try_for_each(&mut sink);
        // Senders stop when the receiver is gone.
        drop(items);
        if let Err(panic) = detector_thread.join() {
            std::panic::resume_unwind(panic);
        }
        let fed = source_thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        drained.map_err(StreamError::Sink)?;
        fed.map_err(StreamError::Source)
    })
}

/// As [`run`], but on the calling thread, one record after the other.
///
/// # Errors
/// The first failure of source or sink; the detectors are then not finished.
pub fn run_in_turn<SourceError, SinkError>(
    mut source: impl FnMut() -> Result<Option<Item>, SourceError>,
    mut detectors: Detectors,
    mut sink: impl FnMut(Item) -> Result<(), SinkError>,
) -> Result<(), StreamError<SourceError, SinkError>> {
    let mut events = Vec::new();
    loop {
        let fed = source().map_err(StreamError::Source)?;
        let ends = fed.is_none();
        pass_on(fed, &mut detectors, &mut events, &mut sink).map_err(StreamError::Sink)?;
        if ends {
            return Ok(());
        }
    }
}

/// The input of the detectors; none if the source is exhausted and did not fail.
type Fed = Option<Item>;

fn feed<E>(
    source: &mut impl FnMut() -> Result<Option<Item>, E>,
    to_detectors: &Sender<Fed>,
) -> Result<(), E> {
    loop {
        let fed = source()?;
        let ends = fed.is_none();
        if to_detectors.send(fed).is_err() || ends {
            return Ok(());
        }
    }
}

fn detect(detectors: &mut Detectors, records: &Receiver<Fed>, to_sink: &Sender<Item>) {
    let mut events = Vec::new();
    for fed in records {
        let ends = fed.is_none();
        let passed_on = pass_on(fed, detectors, &mut events, &mut |item| to_sink.send(item).map_err(drop));
        if passed_on.is_err() || ends {
            return;
        }
    }
}

/// Passes an input to the sink, with the events that the detectors find in it. `events` is a reused
/// buffer.
fn pass_on<E>(
    fed: Fed,
    detectors: &mut Detectors,
    events: &mut Vec<Event>,
    sink: &mut impl FnMut(Item) -> Result<(), E>,
) -> Result<(), E> {
    match fed {
        Some(item) => {
            if let Item::Record(record) = &item {
                detectors.observe(record, &mut |event| events.push(event));
            }
            sink(item)?;
        }
        None => {
            detectors.finish(&mut |event| events.push(event));
        }
    }
    events.drain(..).try_for_each(|event| sink(Item::Event(event)))
}
