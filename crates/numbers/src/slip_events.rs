//! Slip events, and whether they misrepresent the ruptures.

use std::sync::Arc;

use asperity_record::{Rupture, SlipEvent};

use crate::rupture_numbers::{WIDE_BLOCKS, crossing_s};
use crate::slip_steps::SlipSteps;

/// Ratio of the duration of a slip event to the crossing time of a front that is too long.
/// Blocks slide on behind a front, for up to six crossings in the scenarios of the thesis; creep
/// sustains events a hundred times as long.
const MISLEADING_CROSSINGS: f64 = 20.0;

/// Share of the wide slip events with several wide ruptures above which they describe
/// coincidences rather than ruptures.
const MISLEADING_JOINED: f64 = 0.25;

/// The accumulated data of slip events.
#[derive(Debug, Clone, Default)]
pub(crate) struct SlipEvents {
    blocks: u32,
    pub(crate) first: Option<SlipEvent>,
    pub(crate) first_global: Option<SlipEvent>,
    pub(crate) global: u64,
    pub(crate) steps: Arc<SlipSteps>,
    /// First step, and the step after the last, of wide events.
    wide: Vec<(u64, u64)>,
    /// First steps of wide ruptures.
    wide_ruptures: Vec<u64>,
    longest_crossing_s: f64,
}

impl SlipEvents {
    pub(crate) fn new(blocks: u32) -> SlipEvents {
        SlipEvents { blocks, ..SlipEvents::default() }
    }

    /// Adds a slip event.
    pub(crate) fn take(&mut self, slip: &SlipEvent) {
        self.first.get_or_insert_with(|| slip.clone());
        if slip.is_global(self.blocks) {
            self.global += 1;
            self.first_global.get_or_insert_with(|| slip.clone());
        }
        Arc::make_mut(&mut self.steps).push(slip);
        if slip.blocks_slipped >= WIDE_BLOCKS {
            self.wide.push((slip.onset_step, slip.end_step.unwrap_or(u64::MAX)));
        }
    }

    /// Adds a wide rupture.
    pub(crate) fn wide_rupture(&mut self, rupture: &Rupture) {
        self.wide_ruptures.push(rupture.onset_step);
        self.longest_crossing_s = self.longest_crossing_s.max(crossing_s(rupture));
    }

    pub(crate) fn wide_count(&self) -> u64 {
        self.wide.len() as u64
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

    /// Whether they are misleading, given the time `wave_s` of a wave along the slider and the duration of the longest.
    pub(crate) fn mislead(&self, wave_s: f64, longest_s: Option<f64>) -> bool {
        let crossing_s = self.longest_crossing_s.max(wave_s);
        let outlast = longest_s.is_some_and(|longest_s| longest_s > MISLEADING_CROSSINGS * crossing_s);
        let joined = self.joined_count() as f64 > MISLEADING_JOINED * self.wide_count() as f64;
        // No front crosses a single block.
        (outlast && self.blocks > 1) || joined
    }
}
