//! Progress of a run in cycles between global slips. It pairs ruptures and slip events of two parameter
//! sets where their times do not match.
//!
//! A *cycle* ends with a global rupture; the first one begins at 0 s. An event that starts at t in cycle k,
//! from T_k to T_(k+1), is compared with those of cycle k of the other run, by its share of the cycle, (t -
//! T_k) / (T_(k+1) - T_k), and by its blocks. So global slips pair by rank, and events between two of them
//! by blocks and share: under a drive of constant speed, the share of the load that builds up between two
//! global slips. Durations do not count, and one event pairs with one.
//!
//! - A global rupture that follows another within [`AFTERSHOCK`] of the usual cycle, as when the
//!   slider slips twice at once, ends no cycle: it would move all later ranks by one.
//! - In a cycle that not both runs complete, both use one unit of time: the length of that cycle in
//!   the run that completes it; else of the longer of the last complete ones; else of the longer run.
//! - Later cycles, which only one run reaches, pair with nothing.
//!
//! All of this is symmetric, and never decreases with time, which the matching relies on.
//!
//! Cycles are used (`between`) if the scenarios differ in a key that shapes the motion
//! (`provenance.rs`), no policy sets `window_s`, and more than half of the ruptures of both runs,
//! without those that the other run is too short for, would find no counterpart in time.

use asperity_numbers::median;

use crate::policy::{Spread, WINDOW_S};
use crate::report::{Class, RuptureDiff};

/// Share of a run's median time between global ruptures within which another one does not end a cycle.
pub const AFTERSHOCK: f64 = 0.1;

/// Distance between the beginnings of two cycles, in places: more than a share plus the window, so that
/// events of different cycles never pair.
const STRIDE: f64 = 3.0;

/// A run's clock: the time itself, or the cycles that it has completed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Progress {
    /// When each cycle begins, and how long it is, s; empty for the time itself.
    cycles_s: Vec<(f64, f64)>,
    /// Cycles that the other run does not reach: their beginning, s, and their place.
    beyond: Option<(f64, f64)>,
}

impl Progress {
    /// The place of an event that starts at this time: its share of its cycle, with cycles [`STRIDE`]
    /// apart; or the time itself, s.
    #[inline]
    pub(crate) fn place(&self, time_s: f64) -> f64 {
        if self.cycles_s.is_empty() {
            return time_s;
        }
        if let Some((from_s, place)) = self.beyond
            && time_s > from_s
        {
            return place + (time_s - from_s) / self.cycles_s[self.cycles_s.len() - 1].1;
        }
        let cycle = self.cycles_s.partition_point(|(from_s, _)| *from_s < time_s).max(1) - 1;
        let (from_s, length_s) = self.cycles_s[cycle];
        STRIDE * cycle as f64 + (time_s - from_s) / length_s
    }

    /// How many cycles it has completed that the other run has completed too.
    pub fn cycles(&self) -> usize {
        self.cycles_s.len().saturating_sub(1)
    }
}

/// The clocks of two runs, and how far from an event's place its counterpart is looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycles {
    /// Of the old run and of the new one.
    pub progress: [Progress; 2],
    /// The window for ruptures, in cycles.
    pub window: f64,
    /// Cycles per second of each side, up to the end of the last one that both begin.
    per_s: [f64; 2],
}

impl Cycles {
    /// The clocks of two runs: the onsets of their global ruptures, s, in order, and the time span of their
    /// ruptures.
    pub fn new(global_s: [&[f64]; 2], ruptures: [Spread; 2]) -> Cycles {
        let ends_s = global_s.map(ends_of_cycles);
        let complete = ends_s[0].len().min(ends_s[1].len());
        let length_s = |ends_s: &[f64], cycle: usize| {
            ends_s[cycle] - cycle.checked_sub(1).map_or(0.0, |last| ends_s[last])
        };
        let longest = |lengths: [Option<f64>; 2]| lengths.into_iter().flatten().reduce(f64::max);
        let of_both = |cycle: usize| {
            longest([0, 1].map(|side| (cycle < ends_s[side].len()).then(|| length_s(&ends_s[side], cycle))))
        };
        let unit_s = of_both(complete)
            .or_else(|| of_both(complete.checked_sub(1)?))
            .or_else(|| longest(ruptures.map(|side| Some(side.duration_s))))
            .filter(|unit_s| *unit_s > 0.0)
            .unwrap_or(1.0);
        let mut progress = [0, 1].map(|side| {
            let begin_s = |cycle: usize| cycle.checked_sub(1).map_or(0.0, |last: usize| ends_s[side][last]);
            let cycles_s = (0..=complete).map(|cycle| {
                let length_s = if cycle < complete { length_s(&ends_s[side], cycle) } else { unit_s };
                (begin_s(cycle), length_s)
            });
            Progress { cycles_s: cycles_s.collect(), beyond: None }
        });
        let until_s = [0, 1].map(|side| {
            let duration_s = ruptures[side].duration_s;
            ends_s[side].get(complete).map_or(duration_s, |end_s| end_s.min(duration_s))
        });
        let until = [0, 1].map(|side| progress[side].place(until_s[side]));
        let beyond = until[0].max(until[1]) + STRIDE;
        let per_s = [0, 1].map(|side| {
            let begin_s = progress[side].cycles_s[complete].0;
            let cycles = complete as f64 + (until_s[side] - begin_s) / unit_s;
            if until_s[side] > 0.0 { cycles / until_s[side] } else { 1.0 / unit_s }
        });
        for (progress, ends_s) in progress.iter_mut().zip(&ends_s) {
            progress.beyond = ends_s.get(complete).map(|&end_s| (end_s, beyond));
        }
        let mut cycles = Cycles { progress, window: 0.0, per_s };
        cycles.window = cycles.window_of(ruptures);
        cycles
    }

    /// The window for events of a spread, at most one cycle: the distance between events on average, on the side that
    /// has fewer, as between runs of different time steps.
    pub(crate) fn window_of(&self, events: [Spread; 2]) -> f64 {
        let windows = [0, 1].map(|side| {
            let Spread { events, duration_s } = events[side];
            (duration_s / events.max(1) as f64).max(WINDOW_S) * self.per_s[side]
        });
        windows[0].max(windows[1]).min(1.0)
    }
}

/// Ends of cycles, s: the global ruptures, except those that follow another one at once.
fn ends_of_cycles(global_s: &[f64]) -> Vec<f64> {
    let usual_s = median(global_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
    let mut ends_s: Vec<f64> = Vec::new();
    for &end_s in global_s {
        let last_s = ends_s.last().copied().unwrap_or(0.0);
        if end_s > last_s && (ends_s.is_empty() || end_s - last_s >= AFTERSHOCK * usual_s) {
            ends_s.push(end_s);
        }
    }
    ends_s
}

/// The cycles for pairing two runs, if their ruptures do not match in time: from the onsets of their global
/// ruptures, s, and the time span of all.
pub(crate) fn between(in_time: &RuptureDiff, global_s: [&[f64]; 2], ruptures: [Spread; 2]) -> Option<Cycles> {
    let counts = &in_time.table.counts;
    let alone = counts[Class::Missing] + counts[Class::Extra];
    // One on each side at least; classes of pairs would depend on the policy.
    (alone > 2 * in_time.matches_in_time).then(|| Cycles::new(global_s, ruptures))
}

#[cfg(test)]
mod tests {
    use super::{Cycles, Progress};
    use crate::policy::Spread;

    fn spread(duration_s: f64) -> Spread {
        Spread { events: 50, duration_s }
    }

    #[test]
    fn without_cycles_the_place_is_the_time() {
        assert_eq!(Progress::default().place(0.25), 0.25);
    }

    #[test]
    fn the_place_is_the_share_of_the_cycle_and_cycles_lie_apart() {
        let cycles = Cycles::new([&[2.0, 3.0], &[4.0, 4.5]], [spread(3.5), spread(5.0)]);
        let [old, new] = &cycles.progress;
        assert_eq!([0.0, 1.0, 2.0, 2.25, 3.0].map(|time_s| old.place(time_s)), [0.0, 0.5, 1.0, 3.25, 4.0]);
        assert_eq!([0.0, 2.0, 4.0, 4.125, 4.5].map(|time_s| new.place(time_s)), [0.0, 0.5, 1.0, 3.25, 4.0]);
        // Neither completes the third cycle: the longer of the second ones, 1 s, is its unit.
        assert_eq!((old.place(3.5), new.place(5.0)), (6.5, 6.5));
        let swapped = Cycles::new([&[4.0, 4.5], &[2.0, 3.0]], [spread(5.0), spread(3.5)]);
        assert_eq!(swapped.progress, [new.clone(), old.clone()]);
        assert_eq!(swapped.window, cycles.window);
    }

    #[test]
    fn cycles_that_one_run_does_not_come_to_lie_beyond_its_end() {
        let cycles = Cycles::new([&[2.0, 3.0], &[]], [spread(4.0), spread(5.0)]);
        let [old, new] = &cycles.progress;
        // The new run continues to build up load in its first cycle, in units of the old one.
        assert_eq!((old.place(2.0), new.place(2.0), new.place(5.0)), (1.0, 1.0, 2.5));
        assert!(old.place(2.0_f64.next_up()) > new.place(5.0) + 1.0);
        assert!(old.place(3.5) > old.place(3.0));
    }

    #[test]
    fn a_global_slip_right_after_another_ends_no_cycle() {
        let with = Cycles::new([&[1.0, 2.0, 2.01, 3.0, 4.0], &[1.0]], [spread(5.0); 2]);
        let without = Cycles::new([&[1.0, 2.0, 3.0, 4.0], &[1.0]], [spread(5.0); 2]);
        assert_eq!(with, without);
    }

    #[test]
    fn runs_without_global_slips_have_one_unit_of_time() {
        let [old, new] = Cycles::new([&[], &[]], [spread(2.0), spread(4.0)]).progress;
        assert_eq!((old.place(1.0), new.place(1.0)), (0.25, 0.25));
    }

    #[test]
    fn places_never_decrease() {
        let mut random = asperity_testkit::Random::new(5);
        for _ in 0..200 {
            let mut global_s: Vec<f64> = (0..random.below(9)).map(|_| random.uniform(0.0, 9.0)).collect();
            global_s.sort_by(f64::total_cmp);
            let other = &global_s[..global_s.len() / 2];
            let cycles = Cycles::new([&global_s, other], [spread(9.0), spread(7.0)]);
            let mut times_s: Vec<f64> =
                (0..200).map(|_| random.uniform(0.0, 9.0)).chain(global_s.clone()).collect();
            times_s.sort_by(f64::total_cmp);
            for progress in &cycles.progress {
                assert!(times_s.is_sorted_by_key(|time_s| progress.place(*time_s)), "{global_s:?}");
            }
        }
    }
}
