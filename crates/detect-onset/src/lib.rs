//! Finds stick-slip onsets: which block went first, when, at what load.

use asperity_detect::{Change, Detector, SlipTracker};
use asperity_record::{Event, EventKind, Onset, StepRecord};

/// Emits an [`Onset`] at the first step of every slip event.
#[derive(Debug, Clone)]
pub struct OnsetDetector {
    tracker: SlipTracker,
}

impl OnsetDetector {
    /// A detector for a chain of `blocks` blocks.
    pub fn new(blocks: u32) -> OnsetDetector {
        OnsetDetector { tracker: SlipTracker::new(blocks) }
    }
}

impl Detector for OnsetDetector {
    fn name(&self) -> &'static str {
        "onset"
    }

    fn emits(&self) -> EventKind {
        EventKind::of::<Onset>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if let Change::Begins(slip) = self.tracker.observe(record) {
            emit(Event::new(&Onset {
                event: slip.event,
                onset_step: slip.onset_step,
                onset_s: slip.onset_s,
                nucleation_block: slip.nucleation.block,
                nucleation_blocks: slip.nucleation_blocks,
                tangential_force_n: slip.nucleation.tangential_force_n,
                threshold_n: slip.nucleation.threshold_n,
                ft_fn_onset: slip.onset_load_ratio,
            }));
        }
    }

    fn finish(&mut self, _emit: &mut dyn FnMut(Event)) {}
}
