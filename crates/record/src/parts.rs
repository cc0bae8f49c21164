//! What only some runs have: records, events and tables of other runs lack it.

/// What a run may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Counts of the junctions of contacts, by laws that have junctions.
    Junctions,
    /// Components across the sliding direction, and extents of rows, where contacts lie in several rows.
    Area,
    /// Radiated energy, where sliding contacts radiate.
    Radiation,
    /// Fracture energy, where contacts weaken by slip.
    Weakening,
    /// The state of contacts, by rate-and-state friction.
    State,
    /// Errors of what is measured, in the recording of a laboratory.
    Recording,
}

/// What one run has; nothing by default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Parts {
    /// [`Part::Junctions`].
    pub junctions: bool,
    /// [`Part::Area`].
    pub area: bool,
    /// [`Part::Radiation`].
    pub radiation: bool,
    /// [`Part::Weakening`].
    pub weakening: bool,
    /// [`Part::State`].
    pub state: bool,
    /// [`Part::Recording`].
    pub recording: bool,
}

impl Parts {
    /// What any run may have.
    pub const ALL: Parts =
        Parts { junctions: true, area: true, radiation: true, weakening: true, state: true, recording: true };

    /// Whether the run has this.
    pub fn has(self, part: Part) -> bool {
        match part {
            Part::Junctions => self.junctions,
            Part::Area => self.area,
            Part::Radiation => self.radiation,
            Part::Weakening => self.weakening,
            Part::State => self.state,
            Part::Recording => self.recording,
        }
    }
}
