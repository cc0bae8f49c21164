//! Which ruptures, and which slip events, count as precursors.
//!
//! Of ruptures: those that include block 1 and reach farther than every one before that does. The list ends
//! with the first that reaches every block; it is flagged, and no count of precursors includes it. The rest
//! is about slip events, which the thesis counts.
//!
//! A precursor starts at block 1 and runs farther than any before it; the list ends with the first slip of
//! the whole slider, even if an earlier event reached the last block without including all blocks. The
//! event table is full of events of one or two blocks or steps, which are real but may be unwanted, so
//! rules may drop short events and merge those that follow each other closely. By default nothing is
//! dropped or merged, and every table names its rules.

use asperity_record::{Extent, Reach, Rupture, SlipEvent};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::growth::{EventGrowth, RuptureGrowth};
use crate::required_data::RequiredData;
use crate::run_data::{NotKept, RunData, RunEvents};

/// What to do with slip events before they are taken for precursors.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PrecursorRules {
    /// Fewest distinct blocks of an event that counts; applied after merging.
    pub min_blocks: u32,
    /// Events no farther apart than this, from end to onset, are taken for one, s.
    /// 0 merges nothing: two events are at least a step apart.
    pub merge_gap_s: f64,
}

impl Default for PrecursorRules {
    fn default() -> PrecursorRules {
        PrecursorRules { min_blocks: 1, merge_gap_s: 0.0 }
    }
}

impl PrecursorRules {
    /// Checks that the rules make sense.
    ///
    /// # Errors
    /// In words: key, value and what would be accepted.
    pub fn check(&self) -> Result<(), String> {
        if !(self.merge_gap_s.is_finite() && self.merge_gap_s >= 0.0) {
            return Err(format!(
                "merge_gap_s: {} is not accepted (accepted: a number from 0)",
                self.merge_gap_s
            ));
        }
        Ok(())
    }

    /// The data that the rules need: blocks of merged events are counted again.
    pub fn required_data(&self) -> RequiredData {
        if self.merge_gap_s > 0.0 { RequiredData::DETACHMENTS } else { RequiredData::NOTHING }
    }
}

/// A precursor, or the slip of the whole slider that ends the list.
#[derive(Debug, Clone, PartialEq)]
pub struct Precursor<'a> {
    /// The slip event that it starts with.
    pub start: &'a SlipEvent,
    /// The slip event that it ends with; the same where nothing was merged.
    pub end: &'a SlipEvent,
    /// Number of slip events that it consists of.
    pub merged: u32,
    /// Farthest block, or column, reached.
    pub last_block: u32,
    /// Distinct blocks that slid.
    pub blocks_slipped: u32,
}

impl Precursor<'_> {
    /// `L_p / L` (5.17), for a slider of this many blocks, or columns.
    pub fn length_ratio(&self, columns: u32) -> f64 {
        f64::from(self.last_block) / f64::from(columns)
    }

    /// `A_p`, the share of all contacts that slid.
    pub fn area_ratio(&self, contacts: u32) -> f64 {
        f64::from(self.blocks_slipped) / f64::from(contacts)
    }
}

/// The precursors of a run by these rules, up to and including the first slip of the whole slider.
///
/// # Errors
/// If the rules merge events, and the run's detachments were not kept.
pub fn find<'a>(run: &'a RunData, rules: &PrecursorRules) -> Result<Vec<Precursor<'a>>, NotKept> {
    let detachments = if rules.merge_gap_s > 0.0 { run.detachments()? } else { &[] };
    Ok(among_groups(run, rules, detachments))
}

/// The precursors of a run, nothing merged or dropped, up to and including the first slip of the whole
/// slider.
pub fn one_by_one(run: &RunEvents) -> Vec<Precursor<'_>> {
    among_groups(run, &PrecursorRules::default(), &[])
}

/// These without the global slip that ends the list: measures of precursors use them.
pub fn alone(run: &RunEvents) -> Vec<Precursor<'_>> {
    let mut precursors = one_by_one(run);
    precursors.retain(|precursor| precursor.blocks_slipped < run.header.blocks);
    precursors
}

fn among_groups<'a>(
    run: &'a RunEvents,
    rules: &PrecursorRules,
    detachments: &[(u64, u32)],
) -> Vec<Precursor<'a>> {
    let mut precursors = Vec::new();
    let mut growth = EventGrowth::new(run.header.blocks);
    let belongs_together = |before: &SlipEvent, next: &SlipEvent| {
        let gap_s = before.end_s.map(|end_s| next.onset_s - end_s);
        rules.merge_gap_s > 0.0 && gap_s.is_some_and(|gap_s| gap_s <= rules.merge_gap_s)
    };
    for group in run.slips.chunk_by(belongs_together) {
        let (Some(start), Some(end)) = (group.first(), group.last()) else { continue };
        let Some(reach) = Reach::over(group.iter().map(SlipEvent::reach)) else { continue };
        let blocks_slipped = match group {
            [slip] => slip.blocks_slipped,
            _ => {
                let end_step = end.end_step.unwrap_or(run.header.steps);
                distinct_blocks(run, detachments, start.onset_step, end_step)
            }
        };
        if blocks_slipped < rules.min_blocks {
            continue;
        }
        if growth.extends(reach, blocks_slipped) {
            let (merged, last_block) = (group.len() as u32, reach.last);
            precursors.push(Precursor { start, end, merged, last_block, blocks_slipped });
        }
        if growth.is_over() {
            break;
        }
    }
    precursors
}

/// The ruptures that include block 1 and reach farther than every one that does and began before, by onset.
/// The last may be the first slip of the whole slider, see [`Rupture::reached_every_block`]. Ruptures of
/// fewer blocks than the rules require are left out; none are merged, since a rupture already contains
/// everything that belongs together. On a fault line, which has no driven end, none is a precursor.
pub fn among_ruptures<'a>(run: &'a RunEvents, rules: &PrecursorRules) -> Vec<&'a Rupture> {
    let mut growth = RuptureGrowth::default();
    for rupture in run.ruptures.iter().flatten().filter(|_| run.plan.medium.is_none()) {
        growth.take((rupture.onset_step, rupture.rupture), rupture.reach(), || rupture);
    }
    growth.iter().map(|(_, rupture)| *rupture).filter(|one| one.slipped() >= rules.min_blocks).collect()
}

/// Distinct blocks that slid in steps from `onset_step` up to before `end_step`:
/// each detached at the step before the onset or later.
fn distinct_blocks(run: &RunEvents, detachments: &[(u64, u32)], onset_step: u64, end_step: u64) -> u32 {
    let from = detachments.partition_point(|(step, _)| step + 1 < onset_step);
    let slid = detachments[from..].iter().take_while(|(step, _)| step + 1 < end_step);
    Extent::with(run.header.contacts(), slid.map(|(_, block)| *block)).count()
}

#[cfg(test)]
mod tests {
    use super::{PrecursorRules, alone, find, one_by_one};
    use crate::growth::EventGrowth;
    use crate::made_up;
    use crate::made_up::EVENTS;
    use crate::run_data::RunData;

    fn found(run: &RunData, min_blocks: u32, merge_gap_s: f64) -> Vec<(u64, u32, u32, u32)> {
        find(run, &PrecursorRules { min_blocks, merge_gap_s })
            .unwrap()
            .iter()
            .map(|found| (found.start.event, found.merged, found.last_block, found.blocks_slipped))
            .collect()
    }

    #[test]
    fn precursors_start_at_block_1_grow_and_end_with_the_first_global_slip() {
        let all = [(0, 1, 1, 1), (1, 1, 2, 2), (4, 1, 3, 2), (5, 1, 3, 3)];
        let run = made_up::run("", &EVENTS);
        assert_eq!(found(&run, 1, 0.0), all);
        // The third reaches the last block without taking all; the fourth is no precursor.
        assert_eq!((one_by_one(&run).len(), alone(&run).len()), (4, 3));
        assert_eq!(found(&made_up::run("", &EVENTS[5..]), 1, 0.0), [(0, 1, 3, 3)]);
    }

    #[test]
    fn one_by_one_events_are_told_as_in_a_whole_run() {
        let run = made_up::run("", &EVENTS);
        let mut growth = EventGrowth::new(3);
        let told = run.slips.iter().filter(|slip| growth.extends(slip.reach(), slip.blocks_slipped));
        let numbers: Vec<u64> = told.map(|slip| slip.event).collect();
        let whole = found(&run, 1, 0.0);
        assert_eq!(numbers, whole.iter().map(|(event, ..)| *event).collect::<Vec<u64>>());
    }

    #[test]
    fn rules_drop_short_events_and_merge_close_ones() {
        assert_eq!(found(&made_up::run("", &EVENTS), 2, 0.0), [(1, 1, 2, 2), (4, 1, 3, 2), (5, 1, 3, 3)]);
        // Events 3 and 4 are two steps, 2e-7 s, apart, and together take all blocks.
        assert_eq!(found(&made_up::run("", &EVENTS), 1, 2.5e-7), [(0, 1, 1, 1), (1, 1, 2, 2), (3, 2, 3, 3)]);
    }

    #[test]
    fn rules_that_make_no_sense_are_refused() {
        let rules = PrecursorRules { merge_gap_s: -1.0, ..PrecursorRules::default() };
        assert_eq!(rules.check().unwrap_err(), "merge_gap_s: -1 is not accepted (accepted: a number from 0)");
    }
}
