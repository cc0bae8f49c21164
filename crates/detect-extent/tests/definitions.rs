//! The definitions of slip events, on made-up records, through the detectors of extents, onsets and
//! global slips.

use asperity_detect::{Detectors, SlipRules};
use asperity_detect_extent::ExtentDetector;
use asperity_record::{Direction, JunctionTotals, SlipEvent, StepRecord, Switch};
use asperity_testkit::{quiet_step, switch};

const BLOCKS: u32 = 4;

/// A record of step `step` in which `sliding` blocks slid; `switches` are blocks
/// that detach (positive) or attach (negative) at its end.
fn record(step: u64, sliding: u32, load: f64, switches: &[i32]) -> StepRecord {
    let switches = switches.iter().map(|&block| Switch {
        tangential_force_n: 71.0,
        threshold_n: 70.0,
        ..switch(block.unsigned_abs(), if block > 0 { Direction::Detach } else { Direction::Attach })
    });
    StepRecord { sliding, switches: switches.collect(), ..quiet_step(step, step as f64 / 10.0, load) }
}

fn slips(records: &[StepRecord]) -> Vec<SlipEvent> {
    slips_by(SlipRules::EVERY_SLIP, records)
}

fn slips_by(rules: SlipRules, records: &[StepRecord]) -> Vec<SlipEvent> {
    let events = Detectors::new(BLOCKS, rules, vec![Box::new(ExtentDetector::default())]).all_events(records);
    events.iter().filter_map(|event| event.get().cloned()).collect()
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
            ..SlipEvent::default()
        }]
    );
}

/// The totals of the records of onset and end, which are of the steps before; the end of a merged event is
/// that of its last part.
#[test]
fn an_event_has_the_totals_of_its_onset_and_its_end() {
    let records =
        [(10, 0, &[1][..]), (11, 1, &[-1]), (12, 0, &[1]), (13, 1, &[-1]), (14, 0, &[1]), (15, 1, &[])];
    let records = records.map(|(step, sliding, switches)| StepRecord {
        junctions: Some(JunctionTotals { breaks: 10 * step, repins: step }),
        ..record(step, sliding, 0.3, switches)
    });
    let totals = |slip: &SlipEvent| (slip.breaks_onset, slip.breaks_end, slip.repins_onset, slip.repins_end);
    let of = |onset, end: Option<u64>| (Some(10 * onset), end.map(|end| 10 * end), Some(onset), end);
    let every: Vec<_> = slips(&records).iter().map(totals).collect();
    assert_eq!(every, [of(11, Some(12)), of(13, Some(14)), of(15, None)]);
    let merged = slips_by(SlipRules { merge_gap_s: 0.15, min_blocks: 1 }, &records[..5]);
    assert_eq!(merged.iter().map(totals).collect::<Vec<_>>(), [of(11, Some(14))]);
}

/// The record of the detachment covers what a grid step contains, and that of the end what follows within the event.
#[test]
fn an_event_has_the_largest_speed_of_its_records_and_of_the_one_before() {
    let records = [
        (10, 0, &[1][..], 0.3),
        (11, 1, &[-1], 0.1),
        (12, 0, &[1], 0.2),
        (13, 1, &[], 0.4),
        (14, 0, &[], 0.5),
    ];
    let records = records.map(|(step, sliding, switches, speed)| StepRecord {
        peak_velocity_m_per_s: Some(speed),
        ..record(step, sliding, 0.3, switches)
    });
    let peaks: Vec<_> = slips(&records).iter().map(|slip| slip.peak_velocity_m_per_s).collect();
    assert_eq!(peaks, [Some(0.3), Some(0.5)]);
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
fn blocks_between_those_that_slid_do_not_count() {
    let apart = slips(&[record(10, 0, 0.3, &[1, 4]), record(11, 2, 0.3, &[-1, -4]), record(12, 0, 0.3, &[])]);
    assert_eq!((apart[0].first_block, apart[0].last_block, apart[0].blocks_slipped), (1, 4, 2));
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

/// Three events: blocks 1 and 2, half a second later block 3, two seconds later block 4 to the
/// end of the run.
fn three() -> Vec<StepRecord> {
    vec![
        record(10, 0, 0.30, &[1, 2]),
        record(11, 2, 0.31, &[-1, -2]),
        record(12, 0, 0.29, &[]),
        record(16, 0, 0.33, &[3]),
        record(17, 1, 0.34, &[-3]),
        record(18, 0, 0.28, &[]),
        record(37, 0, 0.35, &[4]),
        record(38, 1, 0.36, &[]),
    ]
}

#[test]
fn events_no_farther_apart_than_the_gap_are_one() {
    let gap = |merge_gap_s| slips_by(SlipRules { merge_gap_s, ..SlipRules::EVERY_SLIP }, &three());
    let seen = |events: &[SlipEvent]| {
        let row = |e: &SlipEvent| (e.event, e.onset_step, e.end_step, e.blocks_slipped, e.max_sliding);
        events.iter().map(row).collect::<Vec<_>>()
    };
    let (first, second, third) = ((0, 11, Some(12), 2, 2), (1, 17, Some(18), 1, 1), (2, 38, None, 1, 1));
    assert_eq!(seen(&gap(0.0)), [first, second, third]);
    // The second begins 0.5 s after the end of the first, the third 2 s after that of the second.
    assert_eq!(seen(&gap(0.49)), [first, second, third]);
    let merged = (0, 11, Some(18), 3, 2);
    // Exactly as far apart as the gap is no farther.
    let apart = gap(0.0);
    let exactly = apart[1].onset_s - apart[0].end_s.expect("it has ended");
    assert_eq!(seen(&gap(exactly)), [merged, (1, 38, None, 1, 1)]);
    assert_eq!(seen(&gap(0.51)), [merged, (1, 38, None, 1, 1)]);
    assert_eq!(seen(&gap(1.99)), [merged, (1, 38, None, 1, 1)]);
    let all = gap(2.01);
    assert_eq!(seen(&all), [(0, 11, None, 4, 2)]);
    // Onset, nucleation and extrema are those of all its parts; loads between the parts are ignored.
    assert_eq!((all[0].nucleation_block, all[0].ft_fn_onset, all[0].open), (1, 0.31, true));
    assert_eq!((all[0].ft_fn_min, all[0].ft_fn_max), (0.30, 0.35));
    // Whether an event continues depends on time alone, so samples in between change nothing.
    let mut sampled = three();
    sampled.insert(3, record(13, 0, 0.2, &[]));
    sampled.insert(4, record(14, 0, 0.9, &[]));
    for merge_gap_s in [0.0, 0.05, 0.15, 0.51, 2.01] {
        let rules = SlipRules { merge_gap_s, ..SlipRules::EVERY_SLIP };
        assert_eq!(slips_by(rules, &sampled), slips_by(rules, &three()));
    }
}

#[test]
fn small_events_are_left_out_after_merging() {
    let rules = |merge_gap_s, min_blocks| {
        let events = slips_by(SlipRules { merge_gap_s, min_blocks }, &three());
        events.iter().map(|e| (e.event, e.onset_step, e.blocks_slipped)).collect::<Vec<_>>()
    };
    assert_eq!(rules(0.0, 2), [(0, 11, 2)]);
    assert_eq!(rules(0.0, 3), []);
    assert_eq!(rules(0.51, 3), [(0, 11, 3)]);
    assert_eq!(rules(2.01, 4), [(0, 11, 4)]);
    // Numbers count the remaining events.
    let mut later = three();
    later.splice(..3, []);
    later.push(record(39, 1, 0.36, &[1]));
    later.push(record(40, 2, 0.36, &[-1]));
    let left = slips_by(SlipRules { merge_gap_s: 0.0, min_blocks: 2 }, &later);
    assert_eq!((left.len(), left[0].event, left[0].onset_step), (1, 0, 38));
}
