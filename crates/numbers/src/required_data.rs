//! The data to keep of a run while its records pass: each number, figure and table declares its inputs, and
//! nothing else stays in memory.

use std::collections::BTreeSet;
use std::ops::{BitOr, BitOrAssign};

use asperity_runlog::Topics;
use schemars::JsonSchema;
use serde::Deserialize;

/// Data of a run that tables, figures and numbers require besides its summary, slip events, ruptures and
/// the history of each block, which are always kept.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RequiredData {
    /// The loads at every step record.
    pub loads: bool,
    /// The states of all blocks that something is measured in: the first one, that at the first
    /// onset and those at the ends of precursors; and the largest displacement in any.
    pub states: bool,
    /// The states nearest to these times, s.
    pub states_near_s: Vec<f64>,
    /// The displacement of these blocks, counted from 1, in all states.
    pub displacements_of: BTreeSet<u32>,
    /// The displacements of all blocks in all states.
    pub displacements: bool,
    /// The dense windows, and the states of all blocks while many slide.
    pub windows: bool,
    /// Every detachment: which block, and when.
    pub detachments: bool,
    /// How each rupture passed its blocks.
    pub arrivals: bool,
    /// The states of all nodes of a lattice at these times, s. They are in no record: `draw`, `reproduce` and
    /// Python compute them by repeating steps of the run.
    pub nodes_at_s: Vec<f64>,
    /// Where all nodes were at times while ruptures ran.
    pub films: Vec<Film>,
    /// How fast contacts were at such times, of chains as well: no record has this either.
    pub velocities: Vec<Film>,
    /// The states at the onsets of precursors, beside those at their ends.
    pub precursor_onsets: bool,
    /// Load drops and noise, of recordings.
    pub measured: bool,
    /// Series as solved.
    pub series: bool,
    /// Ruptures of which the samples of all sensors are wanted, which recordings have.
    pub traces: Vec<Film>,
}

/// Which rupture, where no number is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RuptureSelector {
    /// The first that reaches every block.
    FirstGlobalSlip,
    /// The precursor that reaches farthest.
    LongestPrecursor,
    /// That of the most blocks, the first of several.
    Widest,
}

/// A rupture, or a part of a run, at times that lie evenly between its onset and its end, for which the states of all
/// nodes are wanted: they are known only once the run has passed.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// The number of the rupture.
    pub rupture: Option<u64>,
    /// The rupture, where there is no number.
    pub which: RuptureSelector,
    /// How many times.
    pub count: u32,
    /// The end of the last span, s after the onset; by default that of the rupture.
    pub until_s: Option<f64>,
    /// In place of a rupture two times of the run, s.
    pub between_s: Option<[f64; 2]>,
}

impl RequiredData {
    /// Nothing more.
    pub const NOTHING: RequiredData = RequiredData::these(false, false, false, false);
    /// The loads.
    pub const LOADS: RequiredData = RequiredData::these(true, false, false, false);
    /// The states.
    pub const STATES: RequiredData = RequiredData::these(false, true, false, false);
    /// The dense windows.
    pub const WINDOWS: RequiredData = RequiredData::these(false, false, true, false);
    /// The detachments.
    pub const DETACHMENTS: RequiredData = RequiredData::these(false, false, false, true);

    const fn these(loads: bool, states: bool, windows: bool, detachments: bool) -> RequiredData {
        RequiredData {
            loads,
            states,
            states_near_s: Vec::new(),
            displacements_of: BTreeSet::new(),
            displacements: false,
            windows,
            detachments,
            arrivals: false,
            precursor_onsets: false,
            measured: false,
            series: false,
            traces: Vec::new(),
            nodes_at_s: Vec::new(),
            films: Vec::new(),
            velocities: Vec::new(),
        }
    }

    /// How fronts passed.
    pub fn arrivals() -> RequiredData {
        RequiredData { arrivals: true, ..RequiredData::NOTHING }
    }

    /// Series as solved.
    pub fn series() -> RequiredData {
        RequiredData { series: true, ..RequiredData::NOTHING }
    }

    /// How fronts passed, and the states that they found.
    pub fn fronts() -> RequiredData {
        RequiredData { arrivals: true, precursor_onsets: true, ..RequiredData::LOADS | RequiredData::STATES }
    }

    /// How fronts passed, and how blocks moved.
    pub fn motion() -> RequiredData {
        RequiredData { arrivals: true, displacements: true, ..RequiredData::WINDOWS }
    }

    /// The inputs of all numbers.
    pub fn all() -> RequiredData {
        RequiredData::fronts() | RequiredData::motion() | RequiredData::DETACHMENTS | RequiredData::series()
    }

    /// The parts of a log that must be decoded.
    pub fn topics(&self) -> Topics {
        let moved = self.displacements || !self.displacements_of.is_empty();
        let fields = moved || self.states || !self.states_near_s.is_empty();
        Topics { steps: true, events: true, fields, windows: self.windows || self.series }
    }
}

impl BitOrAssign for RequiredData {
    fn bitor_assign(&mut self, other: RequiredData) {
        self.loads |= other.loads;
        self.states |= other.states;
        self.windows |= other.windows;
        self.detachments |= other.detachments;
        self.arrivals |= other.arrivals;
        self.precursor_onsets |= other.precursor_onsets;
        self.measured |= other.measured;
        self.series |= other.series;
        self.traces.extend(other.traces);
        self.nodes_at_s.extend(other.nodes_at_s);
        self.films.extend(other.films);
        self.velocities.extend(other.velocities);
        self.states_near_s.extend(other.states_near_s);
        self.displacements_of.extend(other.displacements_of);
        self.displacements |= other.displacements;
    }
}

impl BitOr for RequiredData {
    type Output = RequiredData;

    fn bitor(mut self, other: RequiredData) -> RequiredData {
        self |= other;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::RequiredData;

    #[test]
    fn what_two_want_is_what_both_want() {
        let near = RequiredData { states_near_s: vec![0.5], ..RequiredData::default() };
        let both = RequiredData::LOADS | near;
        assert!(both.loads && !both.states && both.states_near_s == [0.5]);
        // States are decoded for any use, windows only where they are shown.
        assert!(both.topics().fields && !both.topics().windows);
        assert!(!RequiredData::LOADS.topics().fields && RequiredData::all().topics().windows);
    }
}
