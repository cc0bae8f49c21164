//! The interface between a stream of records and event detectors, and the slip events and ruptures
//! that detectors read from.
//!
//! A detector depends on records alone, so a live run and a replayed log use the same code and give the same
//! events. Step records decide which events there are; states add what contacts bore before and after a rupture.
//!
//! A new detector:
//!
//! ```
//! use asperity_detect::{Detector, Detectors, SlipRules};
//! use asperity_record::{Energy, Event, EventKind, EventPayload, StepRecord, payload};
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
//!             emit(Event::new(peak.clone()));
//!         }
//!     }
//! }
//!
//! let record = |step: u64, driving_force_n: f64| StepRecord {
//!     step,
//!     time_s: step as f64 / 8.0,
//!     driving_force_n,
//!     normal_load_n: 400.0,
//!     ft_fn_error: None,
//!     end_forces_n: None,
//!     energy: Energy::default(),
//!     junctions: None,
//!     peak_velocity_m_per_s: None,
//!     sliding: 0,
//!     switches: Vec::new(),
//! };
//! let records = [record(1, 10.0), record(2, 30.0), record(3, 20.0)];
//! let mut detectors = Detectors::new(1, SlipRules::EVERY_SLIP, vec![Box::new(PeakDetector::default())]);
//! let events = detectors.all_events(&records);
//! assert_eq!(events[0].get(), Some(&Peak { time_s: 0.25, driving_force_n: 30.0 }));
//! assert_eq!(Peak::COLUMNS[1].unit, Some("N"));
//! ```

mod rupture;
mod slip;

pub use rupture::{Passage, RuptureTracker, Slipped, Stop};
pub use slip::{Change, Slip, SlipEnd, SlipOnset, SlipRules, SlipTracker};

use asperity_record::{Contacts, Event, EventKind, Record, StepRecord};

/// Finds events in step records, which arrive one by one in order of time.
///
/// A new detector is a crate that implements this trait, with a payload declared by
/// [`payload!`](asperity_record::payload), and a line in the list of detectors. Log, replay, tables and
/// export follow from the description of the payload. `fixtures/detector-template` is such a crate to
/// start from.
pub trait Detector: Send {
    /// The kind of its events.
    fn emits(&self) -> EventKind;

    /// Receives a slip event that the next record begins or ends, before that record is observed, and
    /// passes events that are now certain to `emit`.
    fn slip(&mut self, _change: &Change, _emit: &mut dyn FnMut(Event)) {}

    /// Receives a rupture that is certain, with the state at its end if that is recorded, before the step record
    /// that shows this is observed or with that state, and passes events that are now certain to `emit`.
    fn rupture(&mut self, _rupture: &Slipped, _emit: &mut dyn FnMut(Event)) {}

    /// Processes the next record, and passes events that are now certain to `emit`.
    fn observe(&mut self, _record: &StepRecord, _emit: &mut dyn FnMut(Event)) {}

    /// Ends the run, after the slip event and ruptures that are still open were passed to
    /// [`Detector::slip`] and [`Detector::rupture`]: passes events that are still open to `emit`, flagged
    /// as such.
    fn finish(&mut self, _emit: &mut dyn FnMut(Event)) {}
}

/// The detectors of a run, and the trackers of slip events and ruptures that they read from.
pub struct Detectors {
    slips: SlipTracker,
    /// Slip events that the current record begins or ends; a reused buffer.
    changes: Vec<Change>,
    /// None where the scales that link detachments are unknown; then no ruptures are found.
    ruptures: Option<RuptureTracker>,
    /// Ruptures that the current record makes final; a reused buffer.
    slipped: Vec<Slipped>,
    list: Vec<Box<dyn Detector>>,
}

impl Detectors {
    /// Detectors for a run with these contacts, all stuck at the start. They emit in the order of the
    /// list.
    pub fn new(contacts: impl Into<Contacts>, rules: SlipRules, list: Vec<Box<dyn Detector>>) -> Detectors {
        Detectors {
            slips: SlipTracker::new(contacts, rules),
            changes: Vec::new(),
            ruptures: None,
            slipped: Vec::new(),
            list,
        }
    }

    /// Tracks ruptures for the detectors.
    #[must_use]
    pub fn with_ruptures(self, ruptures: RuptureTracker) -> Detectors {
        Detectors { ruptures: Some(ruptures), ..self }
    }

    /// Gives the ruptures the stiffness of each contact's friction spring over the mean one; empty where all are
    /// alike.
    #[must_use]
    pub fn with_spring_factors(mut self, factors: Vec<f64>) -> Detectors {
        if let Some(ruptures) = &mut self.ruptures {
            ruptures.spring_factors = factors;
        }
        self
    }

    /// Adds a detector behind the others.
    pub fn push(&mut self, detector: Box<dyn Detector>) {
        self.list.push(detector);
    }

    /// The kinds of their events, in order.
    pub fn kinds(&self) -> impl Iterator<Item = EventKind> {
        self.list.iter().map(|detector| detector.emits())
    }

    /// Processes the next record, and passes events that are now certain to `emit`.
    pub fn observe(&mut self, record: &Record, emit: &mut dyn FnMut(Event)) {
        match (record, &mut self.ruptures) {
            (Record::Step(record), _) => self.observe_step(record, emit),
            (Record::Fields(state), Some(ruptures)) if !self.list.is_empty() => {
                ruptures.observe_state(state, &mut self.slipped);
                self.pass_on(emit, |_, _| ());
            }
            _ => {}
        }
    }

    fn observe_step(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if self.list.is_empty() {
            return;
        }
        self.slips.observe(record, &mut self.changes);
        if let Some(ruptures) = &mut self.ruptures {
            ruptures.observe(record, &mut self.slipped);
        }
        self.pass_on(emit, |detector, emit| detector.observe(record, emit));
    }

    /// Ends the run: passes events that are still open to `emit`, flagged as such.
    pub fn finish(&mut self, emit: &mut dyn FnMut(Event)) {
        self.slips.conclude(&mut self.changes);
        if let Some(ruptures) = &mut self.ruptures {
            ruptures.finish(&mut self.slipped);
        }
        self.pass_on(emit, |detector, emit| detector.finish(emit));
    }

    /// Passes slip events and ruptures to each detector, and then calls `then` on it.
    fn pass_on(
        &mut self,
        emit: &mut dyn FnMut(Event),
        then: impl Fn(&mut dyn Detector, &mut dyn FnMut(Event)),
    ) {
        for detector in &mut self.list {
            self.changes.iter().for_each(|change| detector.slip(change, emit));
            self.slipped.iter().for_each(|slipped| detector.rupture(slipped, emit));
            then(&mut **detector, emit);
        }
        self.changes.clear();
        self.slipped.clear();
    }

    /// Runs over step records in memory, to the end of the run, without states and so without the forces before
    /// and after ruptures: for tests and analyses.
    pub fn all_events<'a>(&mut self, records: impl IntoIterator<Item = &'a StepRecord>) -> Vec<Event> {
        let mut events = Vec::new();
        for record in records {
            self.observe_step(record, &mut |event| events.push(event));
        }
        self.finish(&mut |event| events.push(event));
        events
    }
}
