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

#[cfg(test)]
mod tests {
    use super::GlobalDetector;
    use asperity_detect::{Detector, detect_all};
    use asperity_record::{Direction, GlobalSlip, StepRecord, Switch};

    fn record(step: u64, sliding: u32, load_n: f64, switches: &[(u32, Direction)]) -> StepRecord {
        StepRecord {
            step,
            time_s: step as f64,
            driving_force_n: load_n,
            normal_load_n: 100.0,
            end_forces_n: None,
            sliding,
            switches: switches
                .iter()
                .map(|&(block, direction)| Switch {
                    block,
                    direction,
                    displacement_m: 0.0,
                    velocity_m_per_s: 0.0,
                    tangential_force_n: 0.0,
                    stick_position_m: 0.0,
                    threshold_n: 0.0,
                })
                .collect(),
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
        let mut detectors: Vec<Box<dyn Detector>> = vec![Box::new(GlobalDetector::new(2))];
        let globals: Vec<GlobalSlip> = detect_all(&mut detectors, &records)
            .iter()
            .map(|event| event.decode().unwrap().unwrap())
            .collect();
        let seen: Vec<_> = globals.iter().map(|g| (g.global, g.event, g.onset_s, g.recurrence_s)).collect();
        assert_eq!(seen, [(0, 0, 11.0, None), (1, 2, 101.0, Some(90.0))]);
        assert_eq!((globals[0].load_drop_n, globals[0].ft_fn_drop), (Some(10.0), Some(0.3 - 0.2)));
    }
}
