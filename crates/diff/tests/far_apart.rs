//! Events that are far from each other and start together on both sides.
//!
//! The new side was settled ahead while no old event was at hand, and an old
//! event that was read at the same onset came too late: one event in sixty was
//! missing on the old side and extra on the new one.

use std::convert::Infallible;

use asperity_diff::column::Columns;
use asperity_diff::policy::{Policy, WINDOW_S};
use asperity_diff::report::Class;
use asperity_diff::tally::{Comparison, Draft, compare};
use asperity_record::SlipEvent;
use asperity_testkit::slip_event;

fn event(number: u64, ft_fn: f64) -> SlipEvent {
    let onset_step = number * 100_000_000;
    SlipEvent {
        onset_s: number as f64,
        end_s: Some(number as f64 + 1e-6),
        ft_fn_onset: ft_fn,
        ft_fn_end: Some(ft_fn),
        event: number,
        blocks_slipped: 1,
        ft_fn_min: ft_fn,
        ft_fn_max: ft_fn,
        ..slip_event(onset_step, onset_step + 100, 1..=1 + (number % 7) as u32)
    }
}

#[test]
fn none_is_lost_where_only_the_last_digit_of_the_load_differs() {
    let events = |ft_fn: f64| (0..1000).map(move |number| Ok::<_, Infallible>(event(number, ft_fn)));
    let comparison = Comparison {
        columns: Columns::ALL,
        window_s: WINDOW_S,
        cycles: None,
        policy: &Policy::default(),
        old_until_s: None,
        new_until_s: None,
        keep_findings: 0,
        keep_matches: 0,
    };
    let run = compare(comparison, events(0.3), events(0.3_f64.next_up()), &mut Draft::default(), |_| Ok(()))
        .expect("both tables are in order");
    assert_eq!((run.counts[Class::Changed], run.counts.total()), (1000, 1000));
}
