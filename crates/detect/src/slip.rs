//! Which blocks slide, and where slip events begin and end.
//!
//! The definitions are exact, because tables are compared to the digit. A block slides in step `s` if it
//! entered `s` detached. A slip event is a maximal run of consecutive steps in which at least one block
//! slides. The first step of every event, the first step after it, and every step at whose end a block
//! switches have a record; so between two records the set of sliding blocks is constant.
//!
//! [`SlipRules`] may merge events that follow closely, and leave out small ones. A live run never does:
//! its log has all events, and replays may select from them.

use asperity_record::{Contacts, Direction, Extent, JunctionTotals, StepRecord, Switch};

/// Which slip events are merged and which are left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipRules {
    /// Events separated by at most this, from the end of one to the onset of the next, are merged; 0
    /// merges none.
    pub merge_gap_s: f64,
    /// Fewest distinct blocks that an event must have slid, after merging; 1 leaves out none.
    pub min_blocks: u32,
}

impl SlipRules {
    /// Every run of sliding steps is an event: the rules of live runs.
    pub const EVERY_SLIP: SlipRules = SlipRules { merge_gap_s: 0.0, min_blocks: 1 };
}

/// Derives slip events from step records.
#[derive(Debug, Clone)]
pub struct SlipTracker {
    rules: SlipRules,
    /// Blocks that enter the next step detached.
    detached: Extent,
    /// Switches and load of the last record, at which an event may start.
    last_switches: Vec<Switch>,
    last_load_ratio: f64,
    /// The largest speed up to the last record: a slip may begin and end in one step of the grid.
    last_peak_m_per_s: Option<f64>,
    /// The current event, or one that has ended and may yet be merged with the next.
    open: Option<Slip>,
    /// Whether that event already has enough blocks to count.
    counts: bool,
    events: u64,
}

/// The onset of a slip event.
#[derive(Debug, Clone, PartialEq)]
pub struct SlipOnset {
    /// Number of the event in its run, counted from 0.
    pub event: u64,
    /// First step in which a block slides.
    pub step: u64,
    /// Time of that step, s.
    pub time_s: f64,
    /// Driving force used in it, N.
    pub force_n: f64,
    /// `F_T / F_N` used in it.
    pub load_ratio: f64,
    /// The detachment of the lowest-numbered block that slides in it.
    pub nucleation: Switch,
    /// How many blocks slide in it.
    pub nucleation_blocks: u32,
    /// What its record says of junctions.
    pub junctions: Option<JunctionTotals>,
}

/// A slip event up to now.
#[derive(Debug, Clone, PartialEq)]
pub struct Slip {
    /// Its onset.
    pub onset: SlipOnset,
    /// Which blocks slid.
    pub extent: Extent,
    /// Most blocks sliding in one step.
    pub max_sliding: u32,
    /// Smallest `F_T / F_N` over the event's switch records, from the detachment
    /// that starts it to the re-attachment that ends it.
    pub min_load_ratio: f64,
    /// Largest `F_T / F_N` over the same records.
    pub max_load_ratio: f64,
    /// Largest speed of any block, m/s; `None` by laws without a state.
    pub peak_velocity_m_per_s: Option<f64>,
    /// The first step after it; `None` until then.
    pub end: Option<SlipEnd>,
}

/// The first step after a slip event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipEnd {
    /// The step.
    pub step: u64,
    /// Its time, s.
    pub time_s: f64,
    /// Driving force used in it, N.
    pub force_n: f64,
    /// `F_T / F_N` used in it.
    pub load_ratio: f64,
    /// What its record says of junctions.
    pub junctions: Option<JunctionTotals>,
}

/// A change in the knowledge of slip events.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// One has begun, and has enough blocks to count.
    Begins(SlipOnset),
    /// One is over; without an [`end`](Slip::end) the run ended first.
    Ended(Slip),
}

impl SlipTracker {
    /// A tracker for these contacts, all stuck at the start.
    pub fn new(blocks: impl Into<Contacts>, rules: SlipRules) -> SlipTracker {
        SlipTracker {
            rules,
            detached: Extent::none(blocks),
            last_switches: Vec::new(),
            last_load_ratio: f64::NAN,
            last_peak_m_per_s: None,
            open: None,
            counts: false,
            events: 0,
        }
    }

    /// Processes the next record, and appends the resulting changes.
    pub fn observe(&mut self, record: &StepRecord, changes: &mut Vec<Change>) {
        let ended = self.open.as_ref().and_then(|slip| slip.end);
        if let Some(end) = ended
            && record.time_s - end.time_s > self.rules.merge_gap_s
        {
            self.conclude(changes);
        }
        match &mut self.open {
            None if record.sliding > 0 => {
                let slip = self.begin(record);
                self.open = Some(slip);
            }
            // It continues by the merging rule.
            Some(slip) if record.sliding > 0 && slip.end.is_some() => {
                slip.end = None;
                slip.take_extrema(self.last_load_ratio);
                slip.extent.add(&self.detached);
            }
            _ => {}
        }
        if let Some(slip) = self.open.as_mut().filter(|slip| slip.end.is_none()) {
            if let Some(peak) = record.peak_velocity_m_per_s {
                slip.peak_velocity_m_per_s = Some(slip.peak_velocity_m_per_s.unwrap_or(0.0).max(peak));
            }
            if record.sliding == 0 {
                slip.end = Some(SlipEnd {
                    step: record.step,
                    time_s: record.time_s,
                    force_n: record.driving_force_n,
                    load_ratio: record.load_ratio(),
                    junctions: record.junctions,
                });
            } else {
                slip.max_sliding = slip.max_sliding.max(record.sliding);
                if !record.switches.is_empty() {
                    slip.take_extrema(record.load_ratio());
                }
                // Blocks that detached at the last record have slid since.
                let switches = self.last_switches.iter();
                for switch in switches.filter(|switch| switch.direction == Direction::Detach) {
                    slip.extent.insert(switch.block);
                }
            }
        }
        self.count(changes);
        for switch in &record.switches {
            match switch.direction {
                Direction::Detach => self.detached.insert(switch.block),
                Direction::Attach => self.detached.remove(switch.block),
            }
        }
        self.last_switches.clone_from(&record.switches);
        self.last_load_ratio = record.load_ratio();
        self.last_peak_m_per_s = record.peak_velocity_m_per_s;
        if self.rules.merge_gap_s == 0.0 && record.sliding == 0 {
            self.conclude(changes);
        }
    }

    /// Reports the open event once it is large enough to count.
    fn count(&mut self, changes: &mut Vec<Change>) {
        let Some(slip) = self.open.as_mut().filter(|_| !self.counts) else { return };
        if slip.extent.count() >= self.rules.min_blocks {
            self.counts = true;
            slip.onset.event = self.events;
            self.events += 1;
            changes.push(Change::Begins(slip.onset.clone()));
        }
    }

    /// Appends the event that is still open: it is over, or the run ends.
    pub fn conclude(&mut self, changes: &mut Vec<Change>) {
        if let Some(slip) = self.open.take()
            && std::mem::take(&mut self.counts)
        {
            changes.push(Change::Ended(slip));
        }
    }

    fn begin(&self, record: &StepRecord) -> Slip {
        let nucleation = self
            .last_switches
            .iter()
            .find(|switch| switch.direction == Direction::Detach)
            .expect("the record before an onset holds the detachment that caused it")
            .clone();
        Slip {
            onset: SlipOnset {
                event: 0,
                step: record.step,
                time_s: record.time_s,
                force_n: record.driving_force_n,
                load_ratio: record.load_ratio(),
                nucleation,
                nucleation_blocks: record.sliding,
                junctions: record.junctions,
            },
            extent: self.detached.clone(),
            max_sliding: 0,
            min_load_ratio: self.last_load_ratio,
            max_load_ratio: self.last_load_ratio,
            peak_velocity_m_per_s: self.last_peak_m_per_s,
            end: None,
        }
    }
}

impl Slip {
    fn take_extrema(&mut self, load_ratio: f64) {
        self.min_load_ratio = self.min_load_ratio.min(load_ratio);
        self.max_load_ratio = self.max_load_ratio.max(load_ratio);
    }
}
