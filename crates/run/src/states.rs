//! States of a logged run, computed from its checkpoints by the solver that made it: what [`Nodes`](crate::Nodes)
//! and [`Field`](crate::Field) have in common.

use std::collections::BTreeMap;

use asperity_model::{Plan, Scenario};
use asperity_record::{Record, RunHeader};
use asperity_runlog::{LogError, LogItem, RunReader};
use asperity_simulator::{Next, SimulationError, Snapshot, Solver, SolverKind, Stop};

use crate::header::CODE_VERSION;
use crate::resume::Saved;
use crate::self_check;

/// Why states of a run cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum StatesError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A time outside the run.
    #[error("there is no state at {at_s} s (accepted: 0 to {last_s} s)")]
    Outside {
        /// The requested time.
        at_s: f64,
        /// The time of the last step in the log.
        last_s: f64,
    },
    /// Nothing of the run is what was asked for, or this program cannot compute it: why.
    #[error("{0}")]
    Refused(String),
    /// The caller stopped it.
    #[error("stopped")]
    Interrupted,
    /// The solver stops before the requested time.
    #[error(transparent)]
    Stopped(#[from] SimulationError),
}

impl StatesError {
    /// The run is of a chain.
    pub fn of_chain() -> StatesError {
        StatesError::Refused(
            "a chain has no nodes but its blocks, whose states are in /fields (accepted: a run of a slab, a sheet or a \
             body)"
                .to_owned(),
        )
    }
}

/// The next record; none at the end.
///
/// # Errors
/// If the solver stops before, or the caller stops it.
pub(crate) fn next(solver: &mut dyn Solver, stop: &dyn Fn() -> bool) -> Result<Option<Record>, StatesError> {
    match solver.next_record_unless(&Stop::when(stop))? {
        Next::Record(record) if !stop() => Ok(Some(record)),
        Next::End => Ok(None),
        Next::Record(_) | Next::Stopped => Err(StatesError::Interrupted),
    }
}

/// The solver that made a run.
pub(crate) fn kind(header: &RunHeader) -> SolverKind {
    SolverKind::named(&header.solver).unwrap_or_default()
}

/// The scenario and the plan of a run of this code version.
///
/// # Errors
/// If the log is of other code, or its scenario is of another run.
pub(crate) fn resolve(header: &RunHeader, reader: &RunReader) -> Result<(Scenario, Plan), StatesError> {
    if header.code_version != CODE_VERSION {
        return Err(StatesError::Refused(format!(
            "its states can only be computed by the code that made it, {}, and this is {CODE_VERSION} (accepted: a run \
             by this program)",
            header.code_version
        )));
    }
    self_check::resolve(header, reader.scenario_toml())
        .map_err(|problem| StatesError::Refused(problem.to_string()))
}

/// The states that a solver of the plan can start from.
///
/// # Errors
/// If one of them is of another run.
pub(crate) fn fitting(
    saved: BTreeMap<u64, Saved>,
    plan: &Plan,
) -> Result<BTreeMap<u64, Snapshot>, StatesError> {
    let fitting = saved.into_iter().map(|(step, saved)| match saved.fits(plan) {
        Ok(()) => Ok((step, saved.solver)),
        Err(problem) => Err(StatesError::Refused(format!(
            "the checkpoint at step {step} is not a state of this run: {problem}"
        ))),
    });
    fitting.collect()
}

/// The last step with a record in the sound part of a log, before any gap, and the last checkpoint
/// at or before each of the steps, where there is one. `observe` receives the records; `stop` is polled.
pub(crate) fn saved(
    reader: &mut RunReader,
    last_sound_step: u64,
    steps: &[u64],
    stop: &dyn Fn() -> bool,
    observe: &mut dyn FnMut(&Record),
) -> (u64, BTreeMap<u64, Saved>) {
    let mut last_step = 0;
    let mut found: BTreeMap<u64, Saved> = BTreeMap::new();
    let mut seen = String::new();
    // The verdict reports where the log cannot be read.
    while let Ok(Some(item)) = reader.next_item() {
        let LogItem::Record(record) = item else { continue };
        // Records after a gap need not follow from those before.
        if record.step() > last_sound_step || reader.has_gap() || stop() {
            break;
        }
        last_step = record.step();
        observe(&record);
        if let Some(text) = reader.checkpoint().filter(|text| **text != *seen) {
            text.clone_into(&mut seen);
            if let Ok(saved) = serde_json::from_str::<Saved>(text) {
                found.insert(saved.step(), saved);
            }
            // Only the last of several checkpoints before one step is needed.
            let needed: Vec<u64> = steps
                .iter()
                .filter_map(|step| found.range(..=*step).next_back())
                .map(|(at, _)| *at)
                .collect();
            found.retain(|step, _| needed.contains(step));
        }
    }
    (last_step, found)
}

/// The last checkpoint at or before a step, if there is one before any gap. What follows it is not read. `stop` is
/// polled at each.
pub(crate) fn last_saved(reader: &mut RunReader, step: u64, stop: &dyn Fn() -> bool) -> BTreeMap<u64, Saved> {
    let mut last = BTreeMap::new();
    // The verdict reports where the log cannot be read.
    while let Ok(Some(text)) = reader.next_checkpoint() {
        let Ok(saved) = serde_json::from_str::<Saved>(text) else { continue };
        if saved.step() > step || reader.has_gap() || stop() {
            break;
        }
        last = BTreeMap::from([(saved.step(), saved)]);
    }
    last
}
