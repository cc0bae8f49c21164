//! What stays of a run that goes by: a thinned load curve, its ruptures, its slip events.

use asperity_record::{Event, Observer, Record, Rupture, SlipEvent};

use crate::downsample::{Curve, Widest};

/// How much of a run a page holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Columns of time of its load curve, each with the smallest and the largest load.
    pub columns: usize,
    /// Ruptures, and as many slip events: the precursors, and the widest of the others.
    pub ruptures: usize,
}

impl Limits {
    /// Most columns of a run.
    const COLUMNS: usize = 2000;
    /// Most ruptures of a run.
    const RUPTURES: usize = 20_000;
    /// What all runs share, as soon as that is less.
    const ALL_COLUMNS: usize = 100_000;
    const ALL_RUPTURES: usize = 100_000;
    /// What each has at least, of both: some 30 kB of a page.
    const LEAST: usize = 100;

    /// The limits for a page of that many runs.
    pub fn of_runs(runs: usize) -> Limits {
        let share = |all: usize, most: usize| (all / runs.max(1)).clamp(Limits::LEAST, most);
        Limits {
            columns: share(Limits::ALL_COLUMNS, Limits::COLUMNS),
            ruptures: share(Limits::ALL_RUPTURES, Limits::RUPTURES),
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
}

/// What a page holds of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Collected {
    /// Step and `F_T / F_N`.
    pub curve: Vec<(u64, f64)>,
    /// Its ruptures by their onsets.
    pub ruptures: Vec<CollectedRupture>,
    /// How many there were.
    pub rupture_count: u64,
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
}

impl Observer for PageCollector {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.step(record.step, record.load_ratio());
        }
    }

    fn event(&mut self, event: &Event) {
        if let Some(rupture) = event.get::<Rupture>() {
            let seen = CollectedRupture { rupture: rupture.clone(), is_precursor: false };
            self.ruptures.push(rupture.reach().count(), seen, &precursors_stay);
        } else if let Some(slip) = event.get::<SlipEvent>() {
            let row = (slip.onset_step, slip.end_step, slip.first_block, slip.last_block);
            self.events.push(slip.reach().count(), row, &|_| {});
        }
    }
}

impl PageCollector {
    /// Collects a run with that many steps.
    pub fn new(steps: u64, limits: Limits) -> PageCollector {
        PageCollector {
            curve: Curve::new(steps, limits.columns),
            ruptures: Widest::new(limits.ruptures),
            events: Widest::new(limits.ruptures),
        }
    }

    /// `F_T / F_N` in a step, later than those before.
    pub fn step(&mut self, step: u64, load_ratio: f64) {
        // Without any normal load there is no ratio.
        if load_ratio.is_finite() {
            self.curve.push(step, load_ratio);
        }
    }

    /// It has gone by.
    pub fn finish(self) -> Collected {
        let (mut ruptures, rupture_count) = self.ruptures.finish(&precursors_stay);
        ruptures.sort_by_key(|seen| (seen.rupture.onset_step, seen.rupture.rupture));
        let mut farthest = 0;
        for seen in &mut ruptures {
            seen.is_precursor = extends(&mut farthest, &seen.rupture) && !seen.rupture.reached_every_block;
        }
        let (mut events, event_count) = self.events.finish(&|_| {});
        events.sort_unstable();
        Collected { curve: self.curve.points(), ruptures, rupture_count, events, event_count }
    }
}

/// Whoever reaches farther than all before it is kept, however narrow. One that another began before
/// and reached as far is none, whatever else there is.
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
