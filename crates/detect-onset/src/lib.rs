//! Finds stick-slip onsets: which block went first, when, at what load.
//!
//! ```
//! use asperity_detect::{Detectors, SlipRules};
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
//! let mut detectors = Detectors::new(3, SlipRules::EVERY_SLIP, vec![Box::new(OnsetDetector::default())]);
//! let events = detectors.all_events(&records);
//! let onset: &Onset = events[0].get().expect("it is one");
//! assert_eq!((onset.onset_step, onset.nucleation_block, onset.ft_fn_onset), (8, 2, 0.41));
//! ```

use asperity_detect::{Change, Detector};
use asperity_record::{Event, EventKind, Onset, Parts};

/// Emits an [`Onset`] for every slip event as soon as it counts: in its first step, unless small events
/// are left out.
#[derive(Debug, Clone, Copy, Default)]
pub struct OnsetDetector {
    /// What the run has; nothing by default.
    pub parts: Parts,
}

impl Detector for OnsetDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<Onset>().with(self.parts)
    }

    fn slip(&mut self, change: &Change, emit: &mut dyn FnMut(Event)) {
        if let Change::Begins(onset) = change {
            emit(Event::new(Onset {
                event: onset.event,
                onset_step: onset.step,
                onset_s: onset.time_s,
                nucleation_block: onset.nucleation.block,
                nucleation_blocks: onset.nucleation_blocks,
                tangential_force_n: onset.nucleation.tangential_force_n,
                threshold_n: onset.nucleation.threshold_n,
                ft_fn_onset: onset.load_ratio,
                tangential_force_across_n: onset.nucleation.across.map(|across| across.tangential_force_n),
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::OnsetDetector;
    use asperity_detect::{Detectors, SlipRules};
    use asperity_record::{Direction, Onset, Parts, StepRecord, Switch, SwitchAcross};
    use asperity_testkit::{quiet_step, switch};

    #[test]
    fn an_onset_names_the_lowest_block_of_the_first_sliding_step() {
        let detach = |block: u32, across: Option<SwitchAcross>| Switch {
            tangential_force_n: f64::from(block) + 0.5,
            threshold_n: f64::from(block),
            across,
            ..switch(block, Direction::Detach)
        };
        let force = SwitchAcross { tangential_force_n: -2.0, ..SwitchAcross::default() };
        for (across, tangential_force_across_n) in [(None, None), (Some(force), Some(-2.0))] {
            let record = |step: u64, sliding: u32, blocks: &[u32]| StepRecord {
                sliding,
                switches: blocks.iter().map(|&block| detach(block, across)).collect(),
                ..quiet_step(step, step as f64, 0.25)
            };
            let records = [record(7, 0, &[3, 5]), record(8, 2, &[1]), record(9, 3, &[])];
            let parts = Parts { area: across.is_some(), ..Parts::default() };
            let list = vec![Box::new(OnsetDetector { parts }) as _];
            let events = Detectors::new(6, SlipRules::EVERY_SLIP, list).all_events(&records);
            let onsets: Vec<&Onset> = events.iter().filter_map(|event| event.get()).collect();
            assert_eq!(
                onsets,
                [&Onset {
                    event: 0,
                    onset_step: 8,
                    onset_s: 8.0,
                    nucleation_block: 3,
                    nucleation_blocks: 2,
                    tangential_force_n: 3.5,
                    threshold_n: 3.0,
                    ft_fn_onset: 0.25,
                    tangential_force_across_n,
                }]
            );
        }
    }
}
