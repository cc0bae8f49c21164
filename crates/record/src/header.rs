//! The description of a run before its first record and after its last.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::{Contacts, Energy, Parts, Scales, Sensors, TimeGrid};

/// Version of the format of logs: the meaning and layout of records, events and header. Topics, columns and keys
/// that are added leave it as it is: a reader takes what is absent as absent, and refuses the scenario of a run that
/// has [`Parts`] unknown to it.
pub const RECORD_SCHEMA_VERSION: u32 = 7;

/// What a run is, known before it starts.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RunHeader {
    /// [`RECORD_SCHEMA_VERSION`] of the program that wrote the run.
    pub record_schema_version: u32,
    /// Name of the scenario; for people; it does not affect the run.
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
    /// In how many rows of equal length they lie: 1 where nothing is said of it.
    #[serde(skip_serializing_if = "is_one_row")]
    pub rows: u32,
    /// How many junctions each contact has, `N_s`; 0 by laws without junctions.
    #[serde(skip_serializing_if = "is_none")]
    pub junction_count: u32,
    /// What others lack, but for what the other keys tell: see [`RunHeader::parts`].
    #[serde(flatten)]
    pub flags: Parts,
    /// Time step `dt`, s.
    pub time_step_s: f64,
    /// The time step beyond which the scheme is unstable even if no block switches, `dt_max`, s;
    /// none where the solver chooses its steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_stable_step_s: Option<f64>,
    /// Number of steps that the run is to take.
    pub steps: u64,
    /// What makes fronts of blocks and steps.
    pub scales: Scales,
    /// The sensors, in the recording of a laboratory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensors: Option<Sensors>,
}

fn is_one_row(rows: &u32) -> bool {
    *rows == 1
}

fn is_none(count: &u32) -> bool {
    *count == 0
}

impl RunHeader {
    /// The arrangement of its blocks.
    ///
    /// # Panics
    /// If the number of blocks is not a multiple of the number of rows. Readers refuse such logs.
    pub fn contacts(&self) -> Contacts {
        Contacts::in_rows(self.blocks, self.rows).expect("reading a log checks its rows")
    }

    /// What this run has that others lack.
    pub fn parts(&self) -> Parts {
        Parts {
            junctions: self.junction_count > 0,
            area: self.rows > 1,
            recording: self.sensors.is_some(),
            ..self.flags
        }
    }

    /// `L_p / L` of what reached this column of blocks, or sensor, and its standard error, which only sensors have.
    pub fn length_ratio(&self, last: u32) -> [f64; 2] {
        let behind =
            self.sensors.as_ref().and_then(|sensors| Some((sensors.behind_m(last)?, sensors.length_m)));
        match behind {
            // Anywhere before the next sensor is as likely.
            Some(([middle_m, gap_m], length_m)) => [middle_m / length_m, gap_m / 12f64.sqrt() / length_m],
            None => [f64::from(last) / f64::from(self.contacts().columns()), 0.0],
        }
    }

    /// The grid of this run's time steps.
    pub fn time_grid(&self) -> TimeGrid {
        TimeGrid::new(self.time_step_s)
    }
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// All steps were taken.
    Complete,
    /// The same, but the load at which the drive was to stop was never reached.
    LoadNotReached,
    /// A signal stopped the run early; what it holds is sound.
    Interrupted,
    /// The time step had done more work than an honest run can have of it, by the last step: what
    /// the run would have given from there on is none of the slider's.
    StoppedEnergy,
    /// The step after the last could not be recorded: a number was no longer finite.
    StoppedNotFinite,
    /// The solver's own steps had become too short to end.
    StoppedStalled,
    /// The log was put together from what was left of a damaged one.
    Salvaged,
}

impl RunStatus {
    /// Whether the run was stopped because it could not continue.
    pub fn is_stopped(self) -> bool {
        matches!(self, RunStatus::StoppedEnergy | RunStatus::StoppedNotFinite | RunStatus::StoppedStalled)
    }
}

/// What a run says of itself once it is over. Only a log that holds this is whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunEnd {
    /// How it ended.
    pub status: RunStatus,
    /// Why a run was stopped that could not go on, in words; none of any other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stopped: Option<String>,
    /// The last step taken; of a run that was stopped, the last one that is recorded.
    pub last_step: u64,
    /// Number of messages per topic.
    pub message_counts: BTreeMap<String, u64>,
    /// Number of block switches.
    pub switches: u64,
    /// What became of the work, all in all: the energies of the last step; none in salvaged logs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
    /// BLAKE3 hash over topic and payload of every message in order, hexadecimal.
    pub digest: String,
    /// The same for each topic, over its messages alone.
    #[serde(default)]
    pub topic_digests: BTreeMap<String, String>,
    /// What the solver's work was made of.
    pub solver: SolverReport,
}

/// What a solver's work in a run was made of. Nothing follows from it for the
/// physics, and none of it is in the digest.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolverReport {
    /// Counts by name: steps, jumps, windows, ...
    pub counts: BTreeMap<String, u64>,
    /// Shortcuts that it could not take in this run, and what it did instead.
    pub fallbacks: Vec<String>,
}
