//! The pinned definitions of slip events, on records made by hand, through all
//! that a detector may see: the same cases serve onsets and global slips.

use asperity_detect::{Detector, detect_all};
use asperity_detect_extent::ExtentDetector;
use asperity_record::{Direction, SlipEvent, StepRecord, Switch};

const BLOCKS: u32 = 4;

/// A record of step `step` in which `sliding` blocks slid; `switches` are blocks
/// that detach (positive) or attach (negative) at its end.
fn record(step: u64, sliding: u32, load: f64, switches: &[i32]) -> StepRecord {
    StepRecord {
        step,
        time_s: step as f64 / 10.0,
        driving_force_n: load * 100.0,
        normal_load_n: 100.0,
        end_forces_n: None,
        sliding,
        switches: switches
            .iter()
            .map(|&switch| Switch {
                block: switch.unsigned_abs(),
                direction: if switch > 0 { Direction::Detach } else { Direction::Attach },
                displacement_m: 0.0,
                velocity_m_per_s: 0.0,
                tangential_force_n: 71.0,
                stick_position_m: 0.0,
                threshold_n: 70.0,
            })
            .collect(),
    }
}

fn slips(records: &[StepRecord]) -> Vec<SlipEvent> {
    let mut detectors: Vec<Box<dyn Detector>> = vec![Box::new(ExtentDetector::new(BLOCKS))];
    detect_all(&mut detectors, records).iter().map(|event| event.decode().unwrap().unwrap()).collect()
}

#[test]
fn an_event_runs_from_the_first_sliding_step_to_the_first_still_one() {
    let events = slips(&[
        record(10, 0, 0.30, &[2, 3]),
        record(11, 2, 0.31, &[]),
        record(20, 2, 0.29, &[1]),
        record(30, 3, 0.28, &[-3]),
        record(40, 2, 0.25, &[-1, -2]),
        record(41, 0, 0.26, &[]),
    ]);
    assert_eq!(
        events,
        [SlipEvent {
            onset_s: 1.1,
            end_s: Some(4.1),
            first_block: 1,
            last_block: 3,
            max_sliding: 3,
            ft_fn_onset: 0.31,
            ft_fn_end: Some(0.26),
            event: 0,
            onset_step: 11,
            end_step: Some(41),
            blocks_slipped: 3,
            nucleation_block: 2,
            ft_fn_min: 0.25,
            ft_fn_max: 0.30,
            open: false,
        }]
    );
}

#[test]
fn events_a_step_apart_are_two_and_without_a_gap_one() {
    let apart = slips(&[
        record(10, 0, 0.3, &[1]),
        record(11, 1, 0.3, &[-1]),
        record(12, 0, 0.3, &[1]),
        record(13, 1, 0.3, &[-1]),
        record(14, 0, 0.3, &[]),
    ]);
    let spans: Vec<_> = apart.iter().map(|event| (event.onset_step, event.end_step)).collect();
    assert_eq!(spans, [(11, Some(12)), (13, Some(14))]);

    // Block 2 detaches in the very step in which block 1 attaches.
    let handed_over = slips(&[
        record(10, 0, 0.3, &[1]),
        record(11, 1, 0.3, &[-1, 2]),
        record(12, 1, 0.3, &[-2]),
        record(13, 0, 0.3, &[]),
    ]);
    assert_eq!(handed_over.len(), 1);
    assert_eq!((handed_over[0].first_block, handed_over[0].last_block), (1, 2));
    assert_eq!((handed_over[0].max_sliding, handed_over[0].blocks_slipped), (1, 2));
}

#[test]
fn an_event_that_the_run_cuts_off_is_kept_and_flagged() {
    let events = slips(&[record(10, 0, 0.3, &[1]), record(11, 1, 0.3, &[]), record(20, 1, 0.3, &[2])]);
    assert_eq!(events.len(), 1);
    assert!(events[0].open);
    assert_eq!((events[0].end_s, events[0].end_step, events[0].ft_fn_end), (None, None, None));
    assert_eq!(events[0].last_block, 1, "block 2 never got to slide");
}

#[test]
fn samples_in_between_change_nothing() {
    let bare = [
        record(10, 0, 0.3, &[2]),
        record(11, 1, 0.3, &[]),
        record(30, 1, 0.2, &[-2]),
        record(31, 0, 0.2, &[]),
    ];
    let mut sampled = bare.to_vec();
    sampled.insert(2, record(20, 1, 0.1, &[]));
    sampled.insert(0, record(5, 0, 0.9, &[]));
    assert_eq!(slips(&sampled), slips(&bare));
}
