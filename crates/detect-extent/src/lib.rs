//! Finds slip events and how far they run: the raw event table.

use asperity_detect::{Change, Detector, Slip, SlipRules, SlipTracker};
use asperity_record::{Event, EventKind, SlipEvent, StepRecord};

/// Emits a [`SlipEvent`] at the end of every slip event.
#[derive(Debug, Clone)]
pub struct ExtentDetector {
    tracker: SlipTracker,
}

impl ExtentDetector {
    /// A detector for a chain of `blocks` blocks.
    pub fn new(blocks: u32, rules: SlipRules) -> ExtentDetector {
        ExtentDetector { tracker: SlipTracker::new(blocks, rules) }
    }
}

impl Detector for ExtentDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<SlipEvent>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        self.tracker.observe(record, &mut |change| emit_ended(&change, emit));
    }

    fn finish(&mut self, emit: &mut dyn FnMut(Event)) {
        self.tracker.finish(&mut |change| emit_ended(&change, emit));
    }
}

fn emit_ended(change: &Change<'_>, emit: &mut dyn FnMut(Event)) {
    if let Change::Ended(slip) = change {
        emit(Event::new(&event(slip)));
    }
}

fn event(slip: &Slip) -> SlipEvent {
    SlipEvent {
        onset_s: slip.onset_s,
        end_s: slip.end.map(|end| end.time_s),
        first_block: slip.first_block(),
        last_block: slip.last_block(),
        max_sliding: slip.max_sliding,
        ft_fn_onset: slip.onset_load_ratio,
        ft_fn_end: slip.end.map(|end| end.load_ratio),
        event: slip.event,
        onset_step: slip.onset_step,
        end_step: slip.end.map(|end| end.step),
        blocks_slipped: slip.blocks_slipped(),
        nucleation_block: slip.nucleation.block,
        ft_fn_min: slip.min_load_ratio,
        ft_fn_max: slip.max_load_ratio,
        open: slip.end.is_none(),
    }
}
