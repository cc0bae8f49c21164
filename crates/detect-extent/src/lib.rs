//! Finds slip events and how far they run: the table of slip events.
//!
//! ```
//! use asperity_detect::{Detectors, SlipRules};
//! use asperity_detect_extent::ExtentDetector;
//! use asperity_record::{Direction, SlipEvent, StepRecord};
//! use asperity_testkit::{quiet_step, switch};
//!
//! // In a chain of three blocks, block 2 detaches at the end of step 7 and attaches at that of step 9.
//! let records = [
//!     StepRecord { switches: vec![switch(2, Direction::Detach)], ..quiet_step(7, 0.7, 0.40) },
//!     StepRecord { sliding: 1, ..quiet_step(8, 0.8, 0.41) },
//!     StepRecord { sliding: 1, switches: vec![switch(2, Direction::Attach)], ..quiet_step(9, 0.9, 0.41) },
//!     quiet_step(10, 1.0, 0.38),
//! ];
//! let mut detectors = Detectors::new(3, SlipRules::EVERY_SLIP, vec![Box::new(ExtentDetector::default())]);
//! let events = detectors.all_events(&records);
//! let slip: &SlipEvent = events[0].get().expect("it is one");
//! assert_eq!((slip.onset_step, slip.end_step, slip.blocks_slipped), (8, Some(10), 1));
//! ```

use asperity_detect::{Change, Detector};
use asperity_record::{BoundingBox, Event, EventKind, Parts, Reach, SlipEvent};

/// Emits a [`SlipEvent`] at the end of every slip event.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExtentDetector {
    /// What the run has; nothing by default.
    pub parts: Parts,
}

impl Detector for ExtentDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<SlipEvent>().with(self.parts)
    }

    fn slip(&mut self, change: &Change, emit: &mut dyn FnMut(Event)) {
        let Change::Ended(slip) = change else { return };
        let BoundingBox { columns: Reach { first, last }, rows } =
            slip.extent.bounding_box().expect("a slip event has a block that slid");
        let rows = self.parts.area.then_some(rows);
        let (onset, end) = (slip.onset.junctions, slip.end.and_then(|end| end.junctions));
        emit(Event::new(SlipEvent {
            onset_s: slip.onset.time_s,
            end_s: slip.end.map(|end| end.time_s),
            first_block: first,
            last_block: last,
            max_sliding: slip.max_sliding,
            ft_fn_onset: slip.onset.load_ratio,
            ft_fn_end: slip.end.map(|end| end.load_ratio),
            event: slip.onset.event,
            onset_step: slip.onset.step,
            end_step: slip.end.map(|end| end.step),
            blocks_slipped: slip.extent.count(),
            nucleation_block: slip.onset.nucleation.block,
            ft_fn_min: slip.min_load_ratio,
            ft_fn_max: slip.max_load_ratio,
            open: slip.end.is_none(),
            breaks_onset: onset.map(|totals| totals.breaks),
            breaks_end: end.map(|totals| totals.breaks),
            repins_onset: onset.map(|totals| totals.repins),
            repins_end: end.map(|totals| totals.repins),
            peak_velocity_m_per_s: slip.peak_velocity_m_per_s,
            first_across: rows.map(|rows| rows.first),
            last_across: rows.map(|rows| rows.last),
        }));
    }
}
