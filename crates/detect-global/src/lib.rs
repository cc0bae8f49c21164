//! Finds global slips: slip events in which every block slid, with the time since the previous one and the
//! drop in load.
//!
//! ```
//! use asperity_detect::{Detectors, SlipRules};
//! use asperity_detect_global::GlobalDetector;
//! use asperity_record::{Direction, GlobalSlip, StepRecord};
//! use asperity_testkit::{quiet_step, switch};
//!
//! // In a chain of one block, block 1 detaches at the end of step 7 and attaches at that of step 9.
//! let records = [
//!     StepRecord { switches: vec![switch(1, Direction::Detach)], ..quiet_step(7, 0.7, 0.40) },
//!     StepRecord { sliding: 1, ..quiet_step(8, 0.8, 0.41) },
//!     StepRecord { sliding: 1, switches: vec![switch(1, Direction::Attach)], ..quiet_step(9, 0.9, 0.41) },
//!     quiet_step(10, 1.0, 0.38),
//! ];
//! let mut detectors =
//!     Detectors::new(1, SlipRules::EVERY_SLIP, vec![Box::new(GlobalDetector::default())]);
//! let events = detectors.all_events(&records);
//! let global: &GlobalSlip = events[0].get().expect("it is one");
//! assert_eq!((global.onset_s, global.end_s), (0.8, Some(1.0)));
//! ```

use asperity_detect::{Change, Detector, Slip};
use asperity_record::{Event, EventKind, GlobalSlip};

/// Emits a [`GlobalSlip`] at the end of every slip event that took all blocks.
#[derive(Debug, Clone, Default)]
pub struct GlobalDetector {
    count: u64,
    last_onset_s: Option<f64>,
}

impl GlobalDetector {
    fn next(&mut self, slip: &Slip) -> GlobalSlip {
        let global = GlobalSlip {
            global: self.count,
            event: slip.onset.event,
            onset_s: slip.onset.time_s,
            end_s: slip.end.map(|end| end.time_s),
            recurrence_s: self.last_onset_s.map(|last_s| slip.onset.time_s - last_s),
            load_drop_n: slip.end.map(|end| slip.onset.force_n - end.force_n),
            ft_fn_drop: slip.end.map(|end| slip.onset.load_ratio - end.load_ratio),
        };
        self.count += 1;
        self.last_onset_s = Some(slip.onset.time_s);
        global
    }
}

impl Detector for GlobalDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<GlobalSlip>()
    }

    fn slip(&mut self, change: &Change, emit: &mut dyn FnMut(Event)) {
        if let Change::Ended(slip) = change
            && slip.extent.is_whole()
        {
            emit(Event::new(self.next(slip)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::GlobalDetector;
    use asperity_detect::{Detectors, SlipRules};
    use asperity_record::{Direction, GlobalSlip, StepRecord};
    use asperity_testkit::{quiet_step, switch};

    fn record(step: u64, sliding: u32, load_n: f64, switches: &[(u32, Direction)]) -> StepRecord {
        StepRecord {
            driving_force_n: load_n,
            sliding,
            switches: switches.iter().map(|&(block, direction)| switch(block, direction)).collect(),
            ..quiet_step(step, step as f64, 0.0)
        }
    }

    #[test]
    fn a_slip_is_global_if_every_block_slid_even_in_turn() {
        use Direction::{Attach, Detach};
        let in_turn = |start: u64, load_n: f64| {
            [
                record(start, 0, load_n, &[(1, Detach)]),
                record(start + 1, 1, load_n, &[(1, Attach), (2, Detach)]),
                record(start + 5, 1, load_n - 10.0, &[(2, Attach)]),
                record(start + 6, 0, load_n - 10.0, &[]),
            ]
        };
        let partial = [
            record(50, 0, 20.0, &[(2, Detach)]),
            record(51, 1, 20.0, &[(2, Attach)]),
            record(52, 0, 20.0, &[]),
        ];
        let records: Vec<StepRecord> =
            in_turn(10, 30.0).into_iter().chain(partial).chain(in_turn(100, 40.0)).collect();
        let mut detectors =
            Detectors::new(2, SlipRules::EVERY_SLIP, vec![Box::new(GlobalDetector::default())]);
        let events = detectors.all_events(&records);
        let globals: Vec<&GlobalSlip> = events.iter().filter_map(|event| event.get()).collect();
        let seen: Vec<_> = globals.iter().map(|g| (g.global, g.event, g.onset_s, g.recurrence_s)).collect();
        assert_eq!(seen, [(0, 0, 11.0, None), (1, 2, 101.0, Some(90.0))]);
        assert_eq!((globals[0].load_drop_n, globals[0].ft_fn_drop), (Some(10.0), Some(0.3 - 0.2)));
    }
}
