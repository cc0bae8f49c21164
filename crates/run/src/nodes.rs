//! The nodes of a slab at any time of its run, recomputed from its log.
//!
//! A log records the contacts. The state of the other nodes is stored only in checkpoints and
//! recomputed from them with the solver that made the run: from the last checkpoint before the
//! requested time, or from the initial state, it repeats the steps. A checkpoint is used if its
//! checksum is right and it fits the plan.
//!
//! Where the run took single steps, the states are exact to the bit: everywhere for the plain
//! solver, and for the fast one while contacts slide and at onsets and ends of events. Inside a
//! leap of the fast solver the run has no state; there a shorter leap gives one, which rounds
//! differently.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use asperity_model::Plan;
use asperity_record::RunHeader;
use asperity_runlog::{LogError, LogItem, RunReader, Topics};
use asperity_simulator::{SimulationError, Snapshot, Solver, SolverKind};

use crate::header::CODE_VERSION;
use crate::resume::Saved;
use crate::self_check::{self, SelfCheckProblem};

/// The state of all nodes after a step.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeState {
    /// The step.
    pub step: u64,
    /// Its time, s.
    pub time_s: f64,
    /// Nodes per row; rows are counted from the bottom.
    pub columns: usize,
    /// Displacement of every node from the grid, m: first all components along the sliding
    /// direction, row by row, then all vertical ones.
    pub displacement_m: Vec<f64>,
    /// Velocities, m/s, in the order of the displacements.
    pub velocity_m_per_s: Vec<f64>,
}

/// Why the nodes cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum NodesError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The run is of a chain.
    #[error("a chain has no nodes but its blocks, whose states are in /fields (accepted: a run of a slab)")]
    Chain,
    /// Another code version made the run and would take other steps.
    #[error(
        "its nodes can only be computed by the code that made it, {found}, and this is {} (accepted: a run \
         by this program)",
        CODE_VERSION
    )]
    OtherCode {
        /// The code version of the log.
        found: String,
    },
    /// A time outside the run.
    #[error("the log has no state at {at_s} s (accepted: 0 to {last_s} s)")]
    Outside {
        /// The requested time.
        at_s: f64,
        /// The time of the last step in the log.
        last_s: f64,
    },
    /// The scenario of the log contradicts its header.
    #[error(transparent)]
    Scenario(#[from] SelfCheckProblem),
    /// A checkpoint does not belong to this run.
    #[error("the checkpoint at step {step} is not a state of this run: {problem}")]
    NoState {
        /// The step that the checkpoint claims.
        step: u64,
        /// The mismatch.
        problem: String,
    },
    /// The solver stops before the requested time.
    #[error(transparent)]
    Stopped(#[from] SimulationError),
}

/// Computes the nodes of a logged run at chosen times, one after the other.
pub struct Nodes {
    plan: Arc<Plan>,
    kind: SolverKind,
    /// None until the first request.
    solver: Option<Box<dyn Solver>>,
    /// The solver's last state at or before the last time.
    last: Option<Snapshot>,
    /// The remaining steps, in descending order.
    steps: Vec<u64>,
    /// States that the solver can start from, by step.
    from: BTreeMap<u64, Snapshot>,
}

impl Nodes {
    /// Reads a log up to its last sound step, as [`check`](crate::check) found it, or its first
    /// gap. Each time is rounded to the nearest step.
    ///
    /// # Errors
    /// If the log is not sound up to there, not of a slab, or of another code version.
    pub fn of_log(log: &Path, last_sound_step: u64, at_s: &[f64]) -> Result<Nodes, NodesError> {
        let mut reader = RunReader::open(log, Topics::RECORDS)?;
        let header = reader.header().clone();
        if header.code_version != CODE_VERSION {
            return Err(NodesError::OtherCode { found: header.code_version });
        }
        let plan = self_check::plan(&header, reader.scenario_toml())?;
        if !plan.elastic.has_inside() {
            return Err(NodesError::Chain);
        }
        let nearest = |at_s: &f64| if *at_s >= 0.0 { plan.grid.nearest_step(*at_s) } else { u64::MAX };
        let mut steps: Vec<u64> = at_s.iter().map(nearest).collect();
        let (last_step, saved) = saved(&mut reader, last_sound_step, &steps);
        if let Some(at_s) = at_s.iter().find(|at_s| nearest(at_s) > last_step) {
            return Err(NodesError::Outside { at_s: *at_s, last_s: plan.grid.time_s(last_step) });
        }
        steps.sort_unstable_by(|a, b| b.cmp(a));
        steps.dedup();
        let fitting = saved.into_iter().map(|(step, saved)| match saved.fits(&plan) {
            Ok(()) => Ok((step, saved.solver)),
            Err(problem) => Err(NodesError::NoState { step, problem }),
        });
        let from = fitting.collect::<Result<_, _>>()?;
        Ok(Nodes { kind: kind(&header), plan: Arc::new(plan), solver: None, last: None, steps, from })
    }

    /// Computes the nodes at the next of the times; `None` after the last.
    ///
    /// # Errors
    /// If the solver stops before.
    pub fn next_state(&mut self) -> Result<Option<NodeState>, NodesError> {
        let Some(step) = self.steps.pop() else { return Ok(None) };
        let solver = self.solver.get_or_insert_with(|| self.kind.start(Arc::clone(&self.plan)));
        let checkpoint = self.from.range(..=step).next_back();
        if let Some((_, state)) = checkpoint.filter(|(at, _)| **at > solver.step()) {
            solver.restore(state);
        }
        // The last state up to there, saved after each record. While the solver reports records within a
        // leap, it is at the start of the leap.
        let mut last = self.last.take().filter(|state| state.slider.step <= step);
        loop {
            if solver.step() <= step {
                last = Some(solver.snapshot());
            }
            if solver.step() >= step || solver.next_record()?.is_none() {
                break;
            }
        }
        let mut state = last.expect("a solver begins before any step that a log has");
        self.last = Some(state.clone());
        if state.slider.step < step {
            // It has passed the step, by unrecorded steps or by a leap.
            let plan = Arc::new(Plan { steps: step, ..(*self.plan).clone() });
            let mut there = self.kind.start(plan);
            there.restore(&state);
            while there.next_record()?.is_some() {}
            state = there.snapshot();
        }
        Ok(Some(NodeState {
            step,
            time_s: self.plan.grid.time_s(step),
            columns: self.plan.elastic.contacts(),
            displacement_m: state.slider.displacement_m,
            velocity_m_per_s: state.slider.velocity_m_per_s,
        }))
    }
}

/// The solver that made a run.
fn kind(header: &RunHeader) -> SolverKind {
    SolverKind::named(&header.solver).unwrap_or_default()
}

/// The last step with a record in the sound part of a log, before any gap, and the last checkpoint
/// before each of the steps, where there is one.
fn saved(reader: &mut RunReader, last_sound_step: u64, steps: &[u64]) -> (u64, BTreeMap<u64, Saved>) {
    let mut last_step = 0;
    let mut found: BTreeMap<u64, Saved> = BTreeMap::new();
    let mut seen = String::new();
    // The verdict reports where the log cannot be read.
    while let Ok(Some(item)) = reader.next_item() {
        let LogItem::Record(record) = item else { continue };
        // Records after a gap need not follow from those before.
        if record.step() > last_sound_step || reader.has_gap() {
            break;
        }
        last_step = record.step();
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
