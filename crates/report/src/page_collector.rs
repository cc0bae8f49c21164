//! Keeps the data of a run for its page: a thinned load curve, its ruptures with their fronts, its slip
//! events.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use asperity_record::{Arrival, Contacts, Event, Observer, Record, Rupture, SlipEvent};

use crate::downsample::{Curve, Widest};

/// Limits on the data of a run on a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Columns of time of its load curve, each with the smallest and the largest load.
    pub columns: usize,
    /// Ruptures, and as many slip events: the precursors, and the widest of the others.
    pub ruptures: usize,
    /// Passages of fronts past blocks: of the precursors and of the widest other ruptures, in this order, until
    /// a front no longer fits. Over an area as many contacts of maps besides.
    pub passages: usize,
    /// Contacts of a map over the area, which leaves out columns and rows where there are more.
    pub cells: usize,
}

impl Limits {
    /// The limits for a page of that many runs: shares of what the page has room for, but no less than a run needs
    /// and no more than it shows. A column and a rupture are some 300 bytes of a page together, a passage 14, a contact
    /// 40.
    pub fn of_runs(runs: usize) -> Limits {
        let share = |all: usize, least: usize, most: usize| (all / runs.max(1)).clamp(least, most);
        Limits {
            columns: share(100_000, 100, 2000),
            ruptures: share(100_000, 100, 20_000),
            passages: share(200_000, 400, 50_000),
            cells: share(20_000, 400, 4000),
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
    /// last; over an area at columns, from the first arrival to the last stop of their contacts. None if the
    /// log lacks it or the page has no room for it.
    pub front: Option<Vec<Passage>>,
    /// Over an area its contacts, at every [`Collected::cell_stride`] columns and rows; none in a single row, and
    /// likewise.
    pub cells: Option<Vec<Cell>>,
}

/// How a rupture passed a contact over an area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Its place on the map: of the contacts that are on it, row by row, counted from 0.
    pub place: u32,
    /// The first step in which it slid.
    pub arrival_step: u64,
    /// The size of its slip; none if it slid to the end of the run.
    pub slip_m: Option<f64>,
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
    /// Maps over the area have column and row 1, and those that far apart.
    pub cell_stride: u32,
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
    contacts: Contacts,
    block_stride: u32,
    /// By rupture: its contacts on the map over the area, and how many there are of all.
    cells: BTreeMap<u64, Vec<Cell>>,
    cell_count: usize,
    cell_stride: u32,
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
            let (front, cells) = (None, None);
            let seen = CollectedRupture { rupture: rupture.clone(), is_precursor: false, front, cells };
            self.ruptures.push(rupture.slipped(), seen, &precursors_stay);
        } else if let Some(arrival) = event.get::<Arrival>() {
            self.arrival(arrival);
        } else if let Some(slip) = event.get::<SlipEvent>() {
            let row = (slip.onset_step, slip.end_step, slip.first_block, slip.last_block);
            self.events.push(slip.reach().count(), row, &|_| {});
        }
    }
}

impl PageCollector {
    /// Collects a run of that many steps, with these contacts.
    pub fn new(steps: u64, contacts: impl Into<Contacts>, limits: Limits) -> PageCollector {
        let contacts = contacts.into();
        let fits = |stride: &u32| {
            let of = |count: u32| count.div_ceil(*stride) as usize;
            of(contacts.columns()) * of(contacts.rows()) <= limits.cells.max(1)
        };
        PageCollector {
            curve: Curve::new(steps, limits.columns),
            ruptures: Widest::new(limits.ruptures),
            events: Widest::new(limits.ruptures),
            fronts: BTreeMap::new(),
            passages: 0,
            most_passages: limits.passages,
            contacts,
            block_stride: contacts.columns().div_ceil(ROWS).max(1),
            cells: BTreeMap::new(),
            cell_count: 0,
            cell_stride: (1..).find(fits).unwrap_or(1),
        }
    }

    /// How a completed rupture passed a block.
    fn arrival(&mut self, arrival: &Arrival) {
        // Tables from elsewhere may have any number.
        let place = self.contacts.column(arrival.block.max(1));
        if (place - 1).is_multiple_of(self.block_stride) {
            let passage = (arrival.arrival_step, arrival.stop_step);
            let front = self.fronts.entry(arrival.rupture).or_default();
            // In a single row blocks come in their order, each once.
            match front.binary_search_by_key(&place, |(place, _)| *place) {
                Err(at) => {
                    front.insert(at, (place, passage));
                    self.passages += 1;
                }
                Ok(at) => {
                    let (came, stopped) = &mut front[at].1;
                    *came = passage.0.min(*came);
                    *stopped = stopped.zip(passage.1).map(|(a, b)| a.max(b));
                }
            }
            if self.passages > 2 * self.most_passages {
                self.thin_fronts();
            }
        }
        self.cell(arrival);
    }

    /// Adds a contact to the map over the area.
    fn cell(&mut self, arrival: &Arrival) {
        let Some((column, row)) = arrival.column.zip(arrival.across) else { return };
        let stride = self.cell_stride;
        let is_on = |place: u32| place > 0 && (place - 1).is_multiple_of(stride);
        let is_within = column <= self.contacts.columns() && row <= self.contacts.rows();
        if self.contacts.is_area() && is_within && is_on(column) && is_on(row) {
            let place = (row - 1) / stride * self.contacts.columns().div_ceil(stride) + (column - 1) / stride;
            let (arrival_step, slip_m) = (arrival.arrival_step, arrival.slip_size_m());
            let cells = self.cells.entry(arrival.rupture).or_default();
            cells.push(Cell { place, arrival_step, slip_m });
            self.cell_count += 1;
            if self.cell_count > 2 * self.most_passages {
                self.thin_fronts();
            }
        }
    }

    /// Drops the fronts and the maps for which there is no room.
    fn thin_fronts(&mut self) {
        let ranked = self.ruptures.ranked(&precursors_stay).iter();
        let mut ranked: Vec<(Reverse<u32>, u64)> =
            ranked.map(|(blocks, seen)| (Reverse(*blocks), seen.rupture.rupture)).collect();
        ranked.sort_unstable();
        let ranked: Vec<u64> = ranked.into_iter().map(|(_, number)| number).collect();
        self.passages = thin(&mut self.fronts, &ranked, self.most_passages);
        self.cell_count = thin(&mut self.cells, &ranked, self.most_passages);
    }

    /// The front of a rupture, if it has one passage for each block that it should have.
    fn front(&mut self, rupture: &Rupture) -> Option<Vec<Passage>> {
        let stride = self.block_stride;
        let from = 1 + rupture.first_block.saturating_sub(1).div_ceil(stride) * stride;
        let places = (from..=rupture.last_block).step_by(stride as usize);
        if from > rupture.last_block {
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
            seen.cells = self.cells.remove(&seen.rupture.rupture);
            seen.cells.iter_mut().for_each(|cells| cells.sort_by_key(|cell| cell.place));
        }
        let (mut events, event_count) = self.events.finish(&|_| {});
        events.sort_unstable();
        let (block_stride, cell_stride, curve) = (self.block_stride, self.cell_stride, self.curve.points());
        Collected { curve, ruptures, rupture_count, block_stride, cell_stride, events, event_count }
    }
}

/// Keeps of the elements of ruptures those of the first in this order, until one no longer fits; how many they are.
fn thin<T>(of_ruptures: &mut BTreeMap<u64, Vec<T>>, ranked: &[u64], most: usize) -> usize {
    let mut all = std::mem::take(of_ruptures);
    let mut count = 0;
    for number in ranked {
        let Some(elements) = all.remove(number) else { continue };
        if count + elements.len() > most {
            break;
        }
        count += elements.len();
        of_ruptures.insert(*number, elements);
    }
    count
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
    use asperity_record::{Arrival, Contacts, Event, Observer, Rupture};

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

    /// Three columns of two rows, numbered 1 to 3 and 4 to 6: what the contacts of a column do together.
    #[test]
    fn over_an_area_fronts_pass_columns() {
        let contacts = Contacts::in_rows(6, 2).unwrap();
        let mut collector = PageCollector::new(1_000_000, contacts, Limits::of_runs(1));
        let rupture = serde_json::json!({
            "rupture": 0, "onset_s": 0.0, "first_block": 1, "last_block": 3, "nucleation_block": 5,
            "reached_every_block": false, "ft_fn_onset": 0.0, "ft_fn_arrival": 0.0, "onset_step": 10,
            "end_step": null, "arrival_s": 0.0, "detachments": 5, "overlapping": false, "open": true,
            "first_across": 1, "last_across": 2, "contacts": 5,
        });
        collector.event(&Event::new(serde_json::from_value::<Rupture>(rupture).unwrap()));
        for (block, came, stopped) in
            [(1, 20, Some(30)), (2, 15, Some(25)), (3, 18, Some(40)), (4, 17, Some(28)), (5, 10, None)]
        {
            let arrival = serde_json::json!({
                "rupture": 0, "block": block, "arrival_s": 0.0, "arrival_step": came, "stop_step": stopped,
                "detachments": 1, "force_detach_n": 0.0, "column": contacts.column(block),
                "across": contacts.row(block),
            });
            collector.event(&Event::new(serde_json::from_value::<Arrival>(arrival).unwrap()));
        }
        let collected = collector.finish();
        let front = collected.ruptures[0].front.as_deref();
        assert_eq!(front, Some(&[(17, Some(30)), (10, None), (18, Some(40))][..]));
        let cells = collected.ruptures[0].cells.as_deref().unwrap();
        let places: Vec<(u32, u64)> = cells.iter().map(|cell| (cell.place, cell.arrival_step)).collect();
        assert_eq!((collected.cell_stride, places), (1, vec![(0, 20), (1, 15), (2, 18), (3, 17), (4, 10)]));
    }

    /// Ten columns of eight rows: maps of six contacts have columns 1, 5 and 9 of rows 1 and 5.
    #[test]
    fn maps_have_no_more_contacts_than_there_is_room_for() {
        let contacts = Contacts::in_rows(80, 8).unwrap();
        let limits = Limits { cells: 6, passages: 10, ..Limits::of_runs(1) };
        let mut collector = PageCollector::new(1000, contacts, limits);
        for number in 0..3_u64 {
            let rupture = serde_json::json!({
                "rupture": number, "onset_s": 0.0, "first_block": 1, "last_block": 10, "nucleation_block": 1,
                "reached_every_block": true, "ft_fn_onset": 0.0, "ft_fn_arrival": 0.0, "onset_step": 100 * number,
                "end_step": 100 * number + 99, "arrival_s": 0.0, "detachments": 80, "overlapping": false,
                "open": false, "first_across": 1, "last_across": 8, "contacts": 80,
            });
            collector.event(&Event::new(serde_json::from_value::<Rupture>(rupture).unwrap()));
            for block in 1..=80_u32 {
                let arrival = serde_json::json!({
                    "rupture": number, "block": block, "arrival_s": 0.0, "arrival_step": 100 * number,
                    "stop_step": 100 * number + 99, "detachments": 1, "force_detach_n": 0.0, "slip_m": 3e-6,
                    "slip_across_m": -4e-6, "column": contacts.column(block), "across": contacts.row(block),
                });
                collector.event(&Event::new(serde_json::from_value::<Arrival>(arrival).unwrap()));
            }
        }
        let collected = collector.finish();
        let places = |n: usize| {
            let cells = collected.ruptures[n].cells.as_ref()?;
            Some(cells.iter().map(|cell| cell.place).collect::<Vec<u32>>())
        };
        // The second map is one too many.
        assert_eq!((collected.cell_stride, places(0), places(1)), (4, Some((0..6).collect()), None));
        let slip_m = collected.ruptures[0].cells.as_ref().unwrap()[0].slip_m.unwrap();
        assert!((slip_m - 5e-6).abs() < 1e-18, "{slip_m}");
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
