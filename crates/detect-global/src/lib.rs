//! Finds global slips: slip events in which every block slid, how long after
//! the one before, and how far the load fell.

use asperity_detect::{Change, Detector, Slip, SlipTracker};
use asperity_record::{Event, EventKind, GlobalSlip, StepRecord};

/// Emits a [`GlobalSlip`] at the end of every slip event that took all blocks.
#[derive(Debug, Clone)]
pub struct GlobalDetector {
    tracker: SlipTracker,
    blocks: u32,
    globals: u64,
    last_onset_s: Option<f64>,
}

impl GlobalDetector {
    /// A detector for a chain of `blocks` blocks.
    pub fn new(blocks: u32) -> GlobalDetector {
        GlobalDetector { tracker: SlipTracker::new(blocks), blocks, globals: 0, last_onset_s: None }
    }

    fn global(&mut self, slip: &Slip, end: Option<&StepRecord>) -> Option<Event> {
        if slip.blocks_slipped() < self.blocks {
            return None;
        }
        let event = Event::new(&GlobalSlip {
            global: self.globals,
            event: slip.event,
            onset_s: slip.onset_s,
            end_s: end.map(|record| record.time_s),
            recurrence_s: self.last_onset_s.map(|last_s| slip.onset_s - last_s),
            load_drop_n: end.map(|record| slip.onset_force_n - record.driving_force_n),
            ft_fn_drop: end.map(|record| slip.onset_load_ratio - record.load_ratio()),
        });
        self.globals += 1;
        self.last_onset_s = Some(slip.onset_s);
        Some(event)
    }
}

impl Detector for GlobalDetector {
    fn name(&self) -> &'static str {
        "global"
    }

    fn emits(&self) -> EventKind {
        EventKind::of::<GlobalSlip>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if let Change::Ended(slip) = self.tracker.observe(record)
            && let Some(event) = self.global(&slip, Some(record))
        {
            emit(event);
        }
    }

    fn finish(&mut self, emit: &mut dyn FnMut(Event)) {
        if let Some(slip) = self.tracker.finish()
            && let Some(event) = self.global(&slip, None)
        {
            emit(event);
        }
    }
}
