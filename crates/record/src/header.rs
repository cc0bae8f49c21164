//! What a run says of itself before its first record and after its last.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::TimeGrid;

/// Version of the meaning and layout of records, events and header. A change to
/// any of them raises it.
pub const RECORD_SCHEMA_VERSION: u32 = 2;

/// What a run is, known before it starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunHeader {
    /// [`RECORD_SCHEMA_VERSION`] of the program that wrote the run.
    pub record_schema_version: u32,
    /// Name of the scenario; for people, without influence on the run.
    pub scenario: String,
    /// BLAKE3 hash of the resolved scenario, hexadecimal.
    pub scenario_hash: String,
    /// BLAKE3 hash over scenario hash, schema version and code version.
    pub run_id: String,
    /// Content hash of the code that shapes a trajectory and its events.
    pub code_version: String,
    /// `as-coded` or `as-stated`.
    pub parameter_set: String,
    /// Which solver took the steps.
    pub solver: String,
    /// Number of blocks `N`.
    pub blocks: u32,
    /// Time step `dt`, s.
    pub time_step_s: f64,
    /// Number of steps that the run is to take.
    pub steps: u64,
}

impl RunHeader {
    /// The grid of this run's time steps.
    pub fn time_grid(&self) -> TimeGrid {
        TimeGrid::new(self.time_step_s)
    }
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// All steps were taken.
    Complete,
    /// The same, but the load at which the drive was to stop was never reached.
    LoadNotReached,
    /// A signal stopped the run early; what it holds is sound.
    Interrupted,
    /// The log was put together from what was left of a damaged one.
    Salvaged,
}

/// What a run says of itself once it is over. Only a log that holds this is whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunEnd {
    /// How it ended.
    pub status: RunStatus,
    /// The last step taken.
    pub last_step: u64,
    /// Number of messages per topic.
    pub message_counts: BTreeMap<String, u64>,
    /// Number of block switches.
    pub switches: u64,
    /// BLAKE3 hash over topic and payload of every message in order, hexadecimal.
    pub digest: String,
    /// What the solver's work was made of.
    pub solver: SolverReport,
}

/// What a solver's work in a run was made of. Nothing follows from it for the
/// physics, and none of it is in the digest.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolverReport {
    /// Counts by name: steps, jumps, windows, ...
    pub counts: BTreeMap<String, u64>,
    /// Shortcuts that it could not take in this run, and what it did instead.
    pub fallbacks: Vec<String>,
}
