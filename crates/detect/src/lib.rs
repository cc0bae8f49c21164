//! The interface between a stream of step records and event detectors, and the bookkeeping that
//! detectors of slip share.
//!
//! A detector depends on step records alone, so a live run and a replayed log use the same code and give
//! the same events.
//!
//! A new detector:
//!
//! ```
//! use asperity_detect::{Detector, detect_all};
//! use asperity_record::{Event, EventKind, EventPayload, StepRecord, payload};
//!
//! payload! {
//!     topic: "/events/peak",
//!     table: "peaks",
//!     /// The largest driving force of a run.
//!     pub struct Peak {
//!         /// Time of the record that has it, s.
//!         pub time_s: f64,
//!         /// The driving force, N.
//!         pub driving_force_n: f64,
//!     }
//! }
//!
//! #[derive(Default)]
//! struct PeakDetector {
//!     peak: Option<Peak>,
//! }
//!
//! impl Detector for PeakDetector {
//!     fn emits(&self) -> EventKind {
//!         EventKind::of::<Peak>()
//!     }
//!
//!     fn observe(&mut self, record: &StepRecord, _emit: &mut dyn FnMut(Event)) {
//!         let &StepRecord { time_s, driving_force_n, .. } = record;
//!         if self.peak.as_ref().is_none_or(|peak| driving_force_n > peak.driving_force_n) {
//!             self.peak = Some(Peak { time_s, driving_force_n });
//!         }
//!     }
//!
//!     fn finish(&mut self, emit: &mut dyn FnMut(Event)) {
//!         if let Some(peak) = &self.peak {
//!             emit(Event::new(peak));
//!         }
//!     }
//! }
//!
//! let record = |step: u64, driving_force_n: f64| StepRecord {
//!     step,
//!     time_s: step as f64 / 8.0,
//!     driving_force_n,
//!     normal_load_n: 400.0,
//!     end_forces_n: None,
//!     energy: None,
//!     sliding: 0,
//!     switches: Vec::new(),
//! };
//! let records = [record(1, 10.0), record(2, 30.0), record(3, 20.0)];
//! let mut detectors: Vec<Box<dyn Detector>> = vec![Box::new(PeakDetector::default())];
//! let events = detect_all(&mut detectors, &records);
//! assert_eq!(events[0].decode::<Peak>().unwrap()?, Peak { time_s: 0.25, driving_force_n: 30.0 });
//! assert_eq!(Peak::COLUMNS[1].unit, Some("N"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod slip;

pub use slip::{Change, Slip, SlipEnd, SlipRules, SlipTracker};

use asperity_record::{Event, EventKind, StepRecord};

/// Finds events in step records, which come one by one in order of time.
///
/// A new detector is a crate that implements this trait, with a payload declared by
/// [`payload!`](asperity_record::payload), and a line in the list of detectors. Log, replay, tables and
/// export follow from the description of the payload. `fixtures/detector-template` is such a crate to
/// start from.
pub trait Detector: Send {
    /// The kind of its events.
    fn emits(&self) -> EventKind;

    /// Processes the next record, and passes events that are now certain to `emit`.
    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event));

    /// Ends the run: passes events that are still open to `emit`, flagged as such.
    fn finish(&mut self, emit: &mut dyn FnMut(Event));
}

/// Runs detectors over records in memory, in the order of the stream: for tests and analyses.
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
