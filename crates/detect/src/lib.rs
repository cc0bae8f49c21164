//! The contract between a stream of step records and what looks for events in
//! it, and the bookkeeping that detectors of slip share.
//!
//! A detector sees step records and nothing else, so a live run and a replayed
//! log go through the same code and give the same events.
//!
//! A detector of one's own:
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

/// Looks for events in step records, given one by one in order of time.
///
/// To add one: a crate of its own that implements this trait, with a payload declared by
/// [`payload!`](asperity_record::payload), and a line in the list of detectors. Log, replay,
/// tables and export follow from what the payload says of itself. `fixtures/detector-template`
/// is such a crate to start from.
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
