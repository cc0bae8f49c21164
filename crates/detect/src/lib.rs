//! The contract between a stream of step records and what looks for events in
//! it, and the bookkeeping that detectors of slip share.
//!
//! A detector sees step records and nothing else, so a live run and a replayed
//! log go through the same code and give the same events.

mod slip;

pub use slip::{Change, Slip, SlipEnd, SlipRules, SlipTracker};

use asperity_record::{Event, EventKind, StepRecord};

/// Looks for events in step records, given one by one in order of time.
///
/// To add one: a crate of its own that implements this trait, a payload type
/// that implements [`EventPayload`](asperity_record::EventPayload), and a line
/// in the list of detectors of the `cli` crate.
pub trait Detector: Send {
    /// What it emits.
    fn emits(&self) -> EventKind;

    /// Takes the next record, and hands events that are now certain to `emit`.
    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event));

    /// Takes the news that the run is over, and hands what is still open to
    /// `emit`, flagged as such.
    fn finish(&mut self, emit: &mut dyn FnMut(Event));
}

/// Runs detectors over records that are at hand, in the order in which the
/// stream would: for tests, and for analyses in memory.
pub fn detect_all<'a>(
    detectors: &mut [Box<dyn Detector>],
    records: impl IntoIterator<Item = &'a StepRecord>,
) -> Vec<Event> {
    let mut events = Vec::new();
    for record in records {
        for detector in detectors.iter_mut() {
            detector.observe(record, &mut |event| events.push(event));
        }
    }
    for detector in detectors {
        detector.finish(&mut |event| events.push(event));
    }
    events
}
