//! Keeps the data of a run for its page: a thinned load curve, its ruptures with their fronts, its slip
//! events.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use asperity_record::{Arrival, Event, Observer, Record, Rupture, SlipEvent};

use crate::downsample::{Curve, Widest};

/// Limits on the data of a run on a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Columns of time of its load curve, each with the smallest and the largest load.
    pub columns: usize,
    /// Ruptures, and as many slip events: the precursors, and the widest of the others.
    pub ruptures: usize,
    /// Passages of fronts past blocks: of the precursors and of the widest other ruptures, in this order, until
    /// a front no longer fits.
    pub passages: usize,
}

impl Limits {
    /// Most columns of a run.
    const COLUMNS: usize = 2000;
    /// Most ruptures of a run.
    const RUPTURES: usize = 20_000;
    /// Most passages of a run: some 14 bytes of a page each.
    const PASSAGES: usize = 50_000;
    /// The limit for all runs together, where that is lower.
    const ALL_COLUMNS: usize = 100_000;
    const ALL_RUPTURES: usize = 100_000;
    const ALL_PASSAGES: usize = 200_000;
    /// Number of columns and of ruptures that each run has at least: some 30 kB of a page.
    const LEAST: usize = 100;
    /// Number of passages that each run has at least: a few fronts.
    const LEAST_PASSAGES: usize = 400;

    /// The limits for a page of that many runs.
    pub fn of_runs(runs: usize) -> Limits {
        let share = |all: usize, least: usize, most: usize| (all / runs.max(1)).clamp(least, most);
        Limits {
            columns: share(Limits::ALL_COLUMNS, Limits::LEAST, Limits::COLUMNS),
            ruptures: share(Limits::ALL_RUPTURES, Limits::LEAST, Limits::RUPTURES),
            passages: share(Limits::ALL_PASSAGES, Limits::LEAST_PASSAGES, Limits::PASSAGES),
        }
    }
}

/// A rupture, as far as the page shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct CollectedRupture {
    /// The rupture.
    pub rupture: Rupture,
    /// Whether it is a precursor.
    pub is_precursor: bool,
    /// Passage of its front at every [stride](Collected::block_stride)-th block, from its first to its
    /// last; none if the log lacks it or the page has no room for it.
    pub front: Option<Vec<Passage>>,
}

/// The steps in which a block began to slide, and in which it no longer slid; none if it slid to the end of the run.
pub(crate) type Passage = (u64, Option<u64>);

/// The data of a run on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Collected {
    /// Step and `F_T / F_N`.
    pub curve: Vec<(u64, f64)>,
    /// Its ruptures by their onsets.
    pub ruptures: Vec<CollectedRupture>,
    /// How many there were.
    pub rupture_count: u64,
    /// Fronts have a passage for block 1 and for blocks that far apart: 1 unless the slider has more blocks
    /// than a map has rows.
    pub block_stride: u32,
    /// Its slip events, in order: onset, end, first and last block.
    pub events: Vec<(u64, Option<u64>, u32, u32)>,
    /// How many there were.
    pub event_count: u64,
}

/// Sees a run go by.
#[derive(Debug, Clone)]
pub struct PageCollector {
    curve: Curve,
    ruptures: Widest<CollectedRupture>,
    events: Widest<(u64, Option<u64>, u32, u32)>,
    /// By rupture: the passages with their blocks.
    fronts: BTreeMap<u64, Vec<(u32, Passage)>>,
    /// How many there are of all fronts.
    passages: usize,
    most_passages: usize,
    block_stride: u32,
}

/// Most blocks of a slider whose fronts a map shows block by block: the height of the map in dots.
const ROWS: u32 = 400;

impl Observer for PageCollector {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.step(record.step, record.load_ratio());
        }
    }

    fn event(&mut self, event: &Event) {
        if let Some(rupture) = event.get::<Rupture>() {
            let seen = CollectedRupture { rupture: rupture.clone(), is_precursor: false, front: None };
            self.ruptures.push(rupture.reach().count(), seen, &precursors_stay);
        } else if let Some(arrival) = event.get::<Arrival>() {
            self.arrival(arrival);
        } else if let Some(slip) = event.get::<SlipEvent>() {
            let row = (slip.onset_step, slip.end_step, slip.first_block, slip.last_block);
            self.events.push(slip.reach().count(), row, &|_| {});
        }
    }
}

impl PageCollector {
    /// Collects a run of that many steps and blocks.
    pub fn new(steps: u64, blocks: u32, limits: Limits) -> PageCollector {
        PageCollector {
            curve: Curve::new(steps, limits.columns),
            ruptures: Widest::new(limits.ruptures),
            events: Widest::new(limits.ruptures),
            fronts: BTreeMap::new(),
            passages: 0,
            most_passages: limits.passages,
            block_stride: blocks.div_ceil(ROWS).max(1),
        }
    }

    /// How a completed rupture passed a block.
    fn arrival(&mut self, arrival: &Arrival) {
        if arrival.block.saturating_sub(1).is_multiple_of(self.block_stride) {
            let passage = (arrival.block, (arrival.arrival_step, arrival.stop_step));
            self.fronts.entry(arrival.rupture).or_default().push(passage);
            self.passages += 1;
            if self.passages > 2 * self.most_passages {
                self.thin_fronts();
            }
        }
    }

    /// Drops the fronts for which there is no room.
    fn thin_fronts(&mut self) {
        let ranked = self.ruptures.ranked(&precursors_stay).iter();
        let mut ranked: Vec<(Reverse<u32>, u64)> =
            ranked.map(|(blocks, seen)| (Reverse(*blocks), seen.rupture.rupture)).collect();
        ranked.sort_unstable();
        let mut all = std::mem::take(&mut self.fronts);
        self.passages = 0;
        for (_, number) in ranked {
            let Some(front) = all.remove(&number) else { continue };
            if self.passages + front.len() > self.most_passages {
                break;
            }
            self.passages += front.len();
            self.fronts.insert(number, front);
        }
    }

    /// The front of a rupture, if it has one passage for each block that it should have.
    fn front(&mut self, rupture: &Rupture) -> Option<Vec<Passage>> {
        let places = places(rupture, self.block_stride);
        if places.clone().next().is_none() {
            return Some(Vec::new());
        }
        let front = self.fronts.remove(&rupture.rupture)?;
        let is_whole = front.iter().map(|(block, _)| *block).eq(places);
        is_whole.then(|| front.into_iter().map(|(_, passage)| passage).collect())
    }

    /// `F_T / F_N` in a step, later than those before.
    pub fn step(&mut self, step: u64, load_ratio: f64) {
        // Without any normal load there is no ratio.
        if load_ratio.is_finite() {
            self.curve.push(step, load_ratio);
        }
    }

    /// Completes the run.
    pub fn finish(mut self) -> Collected {
        self.thin_fronts();
        let widest = std::mem::replace(&mut self.ruptures, Widest::new(0));
        let (mut ruptures, rupture_count) = widest.finish(&precursors_stay);
        ruptures.sort_by_key(|seen| (seen.rupture.onset_step, seen.rupture.rupture));
        let mut farthest = 0;
        for seen in &mut ruptures {
            seen.is_precursor = extends(&mut farthest, &seen.rupture) && !seen.rupture.reached_every_block;
            seen.front = self.front(&seen.rupture);
        }
        let (mut events, event_count) = self.events.finish(&|_| {});
        events.sort_unstable();
        let block_stride = self.block_stride;
        Collected { curve: self.curve.points(), ruptures, rupture_count, block_stride, events, event_count }
    }
}

/// The blocks of a rupture whose passages its front lists.
fn places(rupture: &Rupture, stride: u32) -> std::iter::StepBy<std::ops::RangeInclusive<u32>> {
    let from = 1 + rupture.first_block.saturating_sub(1).div_ceil(stride) * stride;
    (from..=rupture.last_block).step_by(stride as usize)
}

/// A rupture that reaches farther than all before is kept, however narrow. It does not count as such if an
/// earlier one reached as far.
fn precursors_stay(kept: &mut [(u32, CollectedRupture)]) {
    let mut in_order: Vec<&mut (u32, CollectedRupture)> = kept.iter_mut().collect();
    in_order.sort_by_key(|(_, seen)| (seen.rupture.onset_step, seen.rupture.rupture));
    let mut farthest = 0;
    for (blocks, seen) in in_order {
        if extends(&mut farthest, &seen.rupture) {
            *blocks = u32::MAX;
        }
    }
}

/// Whether a rupture grows from block 1 and reaches farther than those that began before it: a precursor,
/// or the slip of the whole slider.
fn extends(farthest: &mut u32, rupture: &Rupture) -> bool {
    let extends = rupture.reach().extends(*farthest);
    if extends {
        *farthest = rupture.last_block;
    }
    extends
}

#[cfg(test)]
mod tests {
    use asperity_record::{Arrival, Event, Observer, Rupture};

    use super::{Collected, Limits, PageCollector};

    /// A run of ruptures from the first block to the last, each with the arrivals of its front one step after the
    /// other.
    fn gone_by(blocks: u32, passages: usize, ruptures: &[(u32, u32)]) -> Collected {
        let limits = Limits { passages, ..Limits::of_runs(1) };
        let mut collector = PageCollector::new(1_000_000, blocks, limits);
        for (number, &(first, last)) in ruptures.iter().enumerate() {
            let onset = 1000 * number as u64;
            let rupture = serde_json::json!({
                "rupture": number, "onset_s": 0.0, "first_block": first, "last_block": last, "nucleation_block": first,
                "reached_every_block": (first, last) == (1, blocks), "ft_fn_onset": 0.0, "ft_fn_arrival": 0.0,
                "onset_step": onset, "end_step": onset + 999, "arrival_s": 0.0, "detachments": 1, "overlapping": false,
                "open": false,
            });
            let rupture: Rupture = serde_json::from_value(rupture).unwrap();
            collector.event(&Event::new(rupture));
            for block in first..=last {
                let arrival = serde_json::json!({
                    "rupture": number, "block": block, "arrival_s": 0.0, "arrival_step": onset + u64::from(block - first),
                    "stop_step": onset + 999, "detachments": 1, "force_detach_n": 0.0,
                });
                let arrival: Arrival = serde_json::from_value(arrival).unwrap();
                collector.event(&Event::new(arrival));
            }
        }
        collector.finish()
    }

    fn lengths(collected: &Collected) -> Vec<Option<usize>> {
        collected.ruptures.iter().map(|seen| seen.front.as_ref().map(Vec::len)).collect()
    }

    #[test]
    fn fronts_of_precursors_and_of_the_widest_stay() {
        let ruptures = [(1, 3), (5, 9), (1, 6), (3, 9), (1, 10), (2, 9)];
        let all = gone_by(10, 100, &ruptures);
        assert_eq!(lengths(&all), [3, 5, 6, 7, 10, 8].map(Some));
        assert_eq!(all.ruptures[2].front.as_ref().unwrap()[5], (2005, Some(2999)));
        // Ruptures that extend the slip rank before wide ones: 3 + 6 + 10, then 8.
        assert_eq!(lengths(&gone_by(10, 27, &ruptures)), [Some(3), None, Some(6), None, Some(10), Some(8)]);
        assert_eq!(lengths(&gone_by(10, 19, &ruptures)), [Some(3), None, Some(6), None, Some(10), None]);
        assert_eq!(lengths(&gone_by(10, 5, &ruptures)), [Some(3), None, None, None, None, None]);
    }

    #[test]
    fn long_sliders_have_no_more_rows_than_a_map() {
        let collected = gone_by(1000, 10_000, &[(1, 1000), (2, 3), (5, 12)]);
        assert_eq!(collected.block_stride, 3);
        // Blocks 1, 4, ... 1000; none of 2 and 3; 7 and 10.
        assert_eq!(lengths(&collected), [Some(334), Some(0), Some(2)]);
        assert_eq!(collected.ruptures[2].front.as_ref().unwrap()[0], (2002, Some(2999)));
    }
}
