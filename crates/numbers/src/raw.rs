//! Raw slip events, and whether they misrepresent the ruptures.

use asperity_record::{Rupture, SlipEvent};

use crate::rupture_numbers::{WIDE_BLOCKS, crossing_s};

/// Ratio of the duration of a raw slip event to the crossing time of a front that is too long.
/// Blocks slide on behind a front, for up to six crossings in the scenarios of the thesis; creep
/// sustains events a hundred times as long.
const MISLEADING_CROSSINGS: f64 = 20.0;

/// Share of the wide raw slip events with several wide ruptures above which they describe
/// coincidences rather than ruptures.
const MISLEADING_JOINED: f64 = 0.25;

/// The accumulated data of raw slip events.
#[derive(Debug, Clone, Default)]
pub(crate) struct RawEvents {
    blocks: u32,
    pub(crate) first: Option<SlipEvent>,
    pub(crate) first_global: Option<SlipEvent>,
    pub(crate) count: u64,
    pub(crate) global: u64,
    /// Of completed events.
    longest_s: Option<f64>,
    /// Onset of the event in progress.
    open_s: Option<f64>,
    /// Onset and end, s, of events that began before the earliest known global rupture.
    spans: Vec<(f64, Option<f64>)>,
    earliest_global_s: Option<f64>,
    /// First step, and the step after the last, of wide events.
    wide: Vec<(u64, u64)>,
    /// First steps of wide ruptures.
    wide_ruptures: Vec<u64>,
    longest_crossing_s: f64,
}

impl RawEvents {
    pub(crate) fn new(blocks: u32) -> RawEvents {
        RawEvents { blocks, ..RawEvents::default() }
    }

    /// Adds a raw slip event.
    pub(crate) fn take(&mut self, slip: &SlipEvent) {
        self.count += 1;
        self.first.get_or_insert_with(|| slip.clone());
        if slip.is_global(self.blocks) {
            self.global += 1;
            self.first_global.get_or_insert_with(|| slip.clone());
        }
        match slip.end_s {
            Some(end_s) => {
                let duration_s = end_s - slip.onset_s;
                self.longest_s = Some(self.longest_s.map_or(duration_s, |longest| longest.max(duration_s)));
            }
            None => self.open_s = Some(slip.onset_s),
        }
        if self.earliest_global_s.is_none_or(|global_s| slip.onset_s < global_s) {
            self.spans.push((slip.onset_s, slip.end_s));
        }
        if slip.blocks_slipped >= WIDE_BLOCKS {
            self.wide.push((slip.onset_step, slip.end_step.unwrap_or(u64::MAX)));
        }
    }

    /// Adds a wide rupture.
    pub(crate) fn wide_rupture(&mut self, rupture: &Rupture) {
        self.wide_ruptures.push(rupture.onset_step);
        self.longest_crossing_s = self.longest_crossing_s.max(crossing_s(rupture));
    }

    /// Adds a rupture that reached every block.
    pub(crate) fn global_rupture(&mut self, rupture: &Rupture) {
        let onset_s = self.earliest_global_s.map_or(rupture.onset_s, |known| known.min(rupture.onset_s));
        self.earliest_global_s = Some(onset_s);
        self.spans.retain(|(from_s, _)| *from_s < onset_s);
    }

    pub(crate) fn wide_count(&self) -> u64 {
        self.wide.len() as u64
    }

    /// The duration of the longest event in a run that ended at that time.
    pub(crate) fn longest_s(&self, run_end_s: f64) -> Option<f64> {
        let open_s = self.open_s.map(|onset_s| run_end_s - onset_s);
        self.longest_s.into_iter().chain(open_s).max_by(f64::total_cmp)
    }

    /// Share of the time up to `until_s`, or to the end of the run, in which some block slid.
    pub(crate) fn sliding_time_ratio(&self, until_s: Option<f64>, run_end_s: f64) -> Option<f64> {
        let until_s = until_s.unwrap_or(run_end_s);
        let slid = |(onset_s, end_s): &(f64, Option<f64>)| {
            (end_s.unwrap_or(run_end_s).min(until_s) - onset_s).max(0.0)
        };
        // An empty sum of floats is -0.
        let slid_s = self.spans.iter().map(slid).fold(0.0, |sum_s, time_s| sum_s + time_s);
        (until_s > 0.0).then(|| slid_s / until_s)
    }

    /// Number of wide events that contain the beginnings of more than one wide rupture.
    pub(crate) fn joined_count(&self) -> u64 {
        let mut began = vec![0_u64; self.wide.len()];
        for step in &self.wide_ruptures {
            let after = self.wide.partition_point(|(from, _)| from <= step);
            if let Some(event) = after.checked_sub(1)
                && *step < self.wide[event].1
            {
                began[event] += 1;
            }
        }
        began.iter().filter(|count| **count > 1).count() as u64
    }

    /// Whether they are misleading, given the time `wave_s` of a wave along the slider.
    pub(crate) fn mislead(&self, wave_s: f64, run_end_s: f64) -> bool {
        let crossing_s = self.longest_crossing_s.max(wave_s);
        let outlast =
            self.longest_s(run_end_s).is_some_and(|longest| longest > MISLEADING_CROSSINGS * crossing_s);
        let joined = self.joined_count() as f64 > MISLEADING_JOINED * self.wide_count() as f64;
        // No front crosses a single block.
        (outlast && self.blocks > 1) || joined
    }
}
