//! Which blocks slide, and where slip events begin and end.
//!
//! The definitions are pinned, because tables are compared to the digit. A block
//! slides in step `s` if it entered `s` detached. A slip event is a maximal run
//! of consecutive steps in which at least one block slides. There is a record of
//! the first step of every event, of the first step after it, and of every step
//! at whose end a block switches: between two records the set of sliding blocks
//! is that which the earlier one left.

use asperity_record::{Direction, StepRecord, Switch};

/// Follows step records and gathers slip events.
#[derive(Debug, Clone)]
pub struct SlipTracker {
    /// Blocks that enter the next step detached.
    detached: Vec<bool>,
    /// The last record's switches and load: what starts an event stands there.
    last_switches: Vec<Switch>,
    last_load_ratio: f64,
    open: Option<Slip>,
    events: u64,
}

/// A slip event as far as it has come.
#[derive(Debug, Clone, PartialEq)]
pub struct Slip {
    /// Number of the event in its run, counted from 0.
    pub event: u64,
    /// First step in which a block slides.
    pub onset_step: u64,
    /// Time of that step.
    pub onset_s: f64,
    /// Driving force used in it.
    pub onset_force_n: f64,
    /// `F_T / F_N` used in it.
    pub onset_load_ratio: f64,
    /// The detachment of the lowest-numbered block that slides in it.
    pub nucleation: Switch,
    /// How many blocks slide in it.
    pub nucleation_blocks: u32,
    /// Which blocks slid, counted from 0.
    pub slipped: Vec<bool>,
    /// Most blocks sliding in one step.
    pub max_sliding: u32,
    /// Smallest `F_T / F_N` over the event's switch records, from the detachment
    /// that starts it to the re-attachment that ends it.
    pub min_load_ratio: f64,
    /// Largest `F_T / F_N` over the same records.
    pub max_load_ratio: f64,
}

impl Slip {
    /// Lowest-numbered block that slid, counted from 1.
    pub fn first_block(&self) -> u32 {
        let first = self.slipped.iter().position(|&slipped| slipped);
        first.expect("a slip event has a block that slid") as u32 + 1
    }

    /// Highest-numbered block that slid, counted from 1.
    pub fn last_block(&self) -> u32 {
        let last = self.slipped.iter().rposition(|&slipped| slipped);
        last.expect("a slip event has a block that slid") as u32 + 1
    }

    /// Number of distinct blocks that slid.
    pub fn blocks_slipped(&self) -> u32 {
        self.slipped.iter().filter(|&&slipped| slipped).count() as u32
    }
}

/// What a record changed.
#[derive(Debug)]
pub enum Change<'a> {
    /// Nothing begins or ends here.
    None,
    /// A slip event begins with this record's step.
    Begins(&'a Slip),
    /// The slip event ended: this record's step is the first after it.
    Ended(Slip),
}

impl SlipTracker {
    /// A tracker for a chain in which every block is stuck.
    pub fn new(blocks: u32) -> SlipTracker {
        SlipTracker {
            detached: vec![false; blocks as usize],
            last_switches: Vec::new(),
            last_load_ratio: f64::NAN,
            open: None,
            events: 0,
        }
    }

    /// Takes the next record.
    pub fn observe(&mut self, record: &StepRecord) -> Change<'_> {
        // One event can end and the next begin no sooner than a step later, so a
        // record does one or the other.
        let ended = if record.sliding == 0 { self.open.take() } else { None };
        let begins = record.sliding > 0 && self.open.is_none();
        if begins {
            self.open = Some(self.begin(record));
        }
        if let Some(slip) = &mut self.open {
            slip.max_sliding = slip.max_sliding.max(record.sliding);
            if !record.switches.is_empty() {
                slip.take_extrema(record.load_ratio());
            }
            // What detached at the last record has slid since.
            for switch in self.last_switches.iter().filter(|switch| switch.direction == Direction::Detach) {
                slip.slipped[switch.block as usize - 1] = true;
            }
        }
        for switch in &record.switches {
            self.detached[switch.block as usize - 1] = switch.direction == Direction::Detach;
        }
        self.last_switches.clone_from(&record.switches);
        self.last_load_ratio = record.load_ratio();
        match (ended, begins) {
            (Some(slip), _) => Change::Ended(slip),
            (None, true) => Change::Begins(self.open.as_ref().expect("an event that begins is open")),
            (None, false) => Change::None,
        }
    }

    /// The event that is going on, if there is one.
    pub fn finish(&mut self) -> Option<Slip> {
        self.open.take()
    }

    fn begin(&mut self, record: &StepRecord) -> Slip {
        let event = self.events;
        self.events += 1;
        let nucleation = self
            .last_switches
            .iter()
            .find(|switch| switch.direction == Direction::Detach)
            .expect("the record before an onset holds the detachment that caused it")
            .clone();
        Slip {
            event,
            onset_step: record.step,
            onset_s: record.time_s,
            onset_force_n: record.driving_force_n,
            onset_load_ratio: record.load_ratio(),
            nucleation,
            nucleation_blocks: record.sliding,
            slipped: self.detached.clone(),
            max_sliding: 0,
            min_load_ratio: self.last_load_ratio,
            max_load_ratio: self.last_load_ratio,
        }
    }
}

impl Slip {
    fn take_extrema(&mut self, load_ratio: f64) {
        self.min_load_ratio = self.min_load_ratio.min(load_ratio);
        self.max_load_ratio = self.max_load_ratio.max(load_ratio);
    }
}
