//! Finds stick-slip onsets: which block went first, when, at what load.
//!
//! ```
//! use asperity_detect::{Detector, SlipRules, detect_all};
//! use asperity_detect_onset::OnsetDetector;
//! use asperity_record::{Direction, Onset, StepRecord};
//! use asperity_testkit::{quiet_step, switch};
//!
//! // In a chain of three blocks, block 2 detaches at the end of step 7 and attaches at that of step 9.
//! let records = [
//!     StepRecord { switches: vec![switch(2, Direction::Detach)], ..quiet_step(7, 0.7, 0.40) },
//!     StepRecord { sliding: 1, ..quiet_step(8, 0.8, 0.41) },
//!     StepRecord { sliding: 1, switches: vec![switch(2, Direction::Attach)], ..quiet_step(9, 0.9, 0.41) },
//!     quiet_step(10, 1.0, 0.38),
//! ];
//! let detector = OnsetDetector::new(3, SlipRules::EVERY_SLIP);
//! let mut detectors: Vec<Box<dyn Detector>> = vec![Box::new(detector)];
//! let events = detect_all(&mut detectors, &records);
//! let onset: Onset = events[0].decode().expect("it is one")?;
//! assert_eq!((onset.onset_step, onset.nucleation_block, onset.ft_fn_onset), (8, 2, 0.41));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use asperity_detect::{Change, Detector, SlipRules, SlipTracker};
use asperity_record::{Contacts, Event, EventKind, Onset, StepRecord};

/// Emits an [`Onset`] for every slip event as soon as it counts: in its first step, unless small events
/// are left out.
#[derive(Debug, Clone)]
pub struct OnsetDetector {
    tracker: SlipTracker,
}

impl OnsetDetector {
    /// A detector for these contacts.
    pub fn new(blocks: impl Into<Contacts>, rules: SlipRules) -> OnsetDetector {
        OnsetDetector { tracker: SlipTracker::new(blocks, rules) }
    }
}

impl Detector for OnsetDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<Onset>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        self.tracker.observe(record, &mut |change| {
            if let Change::Begins(slip) = change {
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
        });
    }

    fn finish(&mut self, _emit: &mut dyn FnMut(Event)) {}
}

#[cfg(test)]
mod tests {
    use super::OnsetDetector;
    use asperity_detect::{Detector, SlipRules, detect_all};
    use asperity_record::{Direction, Onset, StepRecord, Switch};
    use asperity_testkit::{quiet_step, switch};

    #[test]
    fn an_onset_names_the_lowest_block_of_the_first_sliding_step() {
        let detach = |block: u32| Switch {
            tangential_force_n: f64::from(block) + 0.5,
            threshold_n: f64::from(block),
            ..switch(block, Direction::Detach)
        };
        let record = |step: u64, sliding: u32, blocks: &[u32]| StepRecord {
            sliding,
            switches: blocks.iter().map(|&block| detach(block)).collect(),
            ..quiet_step(step, step as f64, 0.25)
        };
        let records = [record(7, 0, &[3, 5]), record(8, 2, &[1]), record(9, 3, &[])];
        let mut detectors: Vec<Box<dyn Detector>> =
            vec![Box::new(OnsetDetector::new(6, SlipRules::EVERY_SLIP))];
        let onsets: Vec<Onset> = detect_all(&mut detectors, &records)
            .iter()
            .map(|event| event.decode().unwrap().unwrap())
            .collect();
        assert_eq!(
            onsets,
            [Onset {
                event: 0,
                onset_step: 8,
                onset_s: 8.0,
                nucleation_block: 3,
                nucleation_blocks: 2,
                tangential_force_n: 3.5,
                threshold_n: 3.0,
                ft_fn_onset: 0.25,
            }]
        );
    }
}
