//! Finds slip events and how far they run: the raw event table.

use asperity_detect::{Change, Detector, Slip, SlipTracker};
use asperity_record::{Event, EventKind, SlipEvent, StepRecord};

/// Emits a [`SlipEvent`] at the end of every slip event.
#[derive(Debug, Clone)]
pub struct ExtentDetector {
    tracker: SlipTracker,
}

impl ExtentDetector {
    /// A detector for a chain of `blocks` blocks.
    pub fn new(blocks: u32) -> ExtentDetector {
        ExtentDetector { tracker: SlipTracker::new(blocks) }
    }
}

impl Detector for ExtentDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<SlipEvent>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if let Change::Ended(slip) = self.tracker.observe(record) {
            emit(Event::new(&SlipEvent {
                end_s: Some(record.time_s),
                end_step: Some(record.step),
                ft_fn_end: Some(record.load_ratio()),
                open: false,
                ..still_open(&slip)
            }));
        }
    }

    fn finish(&mut self, emit: &mut dyn FnMut(Event)) {
        if let Some(slip) = self.tracker.finish() {
            emit(Event::new(&still_open(&slip)));
        }
    }
}

fn still_open(slip: &Slip) -> SlipEvent {
    SlipEvent {
        onset_s: slip.onset_s,
        end_s: None,
        first_block: slip.first_block(),
        last_block: slip.last_block(),
        max_sliding: slip.max_sliding,
        ft_fn_onset: slip.onset_load_ratio,
        ft_fn_end: None,
        event: slip.event,
        onset_step: slip.onset_step,
        end_step: None,
        blocks_slipped: slip.blocks_slipped(),
        nucleation_block: slip.nucleation.block,
        ft_fn_min: slip.min_load_ratio,
        ft_fn_max: slip.max_load_ratio,
        open: true,
    }
}
