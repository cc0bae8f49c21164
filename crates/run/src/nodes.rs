//! The nodes of a slab, a sheet or a body at any time of its run, recomputed from its log.
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

use asperity_model::{NodeState, Plan, Scenario};
use asperity_runlog::{RunReader, Topics};
use asperity_simulator::{Snapshot, Solver, SolverKind, contact_loads_n};

use crate::states::{self, StatesError};

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
    /// If the log is not sound up to there, or of another code version.
    pub fn of_log(log: &Path, last_sound_step: u64, at_s: &[f64]) -> Result<Nodes, StatesError> {
        let mut reader = RunReader::open(log, Topics::RECORDS)?;
        let header = reader.header().clone();
        let (_, plan) = states::resolve(&header, &reader)?;
        let wanted = steps_at(&plan, at_s)?;
        let (last_step, saved) = states::saved(&mut reader, last_sound_step, &wanted, &|| false, &mut |_| ());
        let steps = within(&plan, wanted, last_step)?;
        let from = states::fitting(saved, &plan)?;
        Ok(Nodes { kind: states::kind(&header), plan: Arc::new(plan), solver: None, last: None, steps, from })
    }

    /// Of a run without a log.
    ///
    /// # Errors
    /// If it has no such time.
    pub fn of_scenario(scenario: &Scenario, kind: SolverKind, at_s: &[f64]) -> Result<Nodes, StatesError> {
        let plan = Plan::new(scenario);
        let steps = within(&plan, steps_at(&plan, at_s)?, plan.steps)?;
        Ok(Nodes { plan: Arc::new(plan), kind, solver: None, last: None, steps, from: BTreeMap::new() })
    }

    /// These, if there are nodes besides the blocks of a chain.
    ///
    /// # Errors
    /// If there are not.
    pub fn of_lattice(self) -> Result<Nodes, StatesError> {
        if self.plan.elastic.as_chain().is_some() { Err(StatesError::of_chain()) } else { Ok(self) }
    }

    /// The steps nearest to the times, ascending.
    pub fn steps(&self) -> Vec<u64> {
        self.steps.iter().rev().copied().collect()
    }

    /// Computes the nodes at the next of the times; `None` after the last. `stop` is polled between records, and within milliseconds.
    ///
    /// # Errors
    /// If the solver stops before, or the caller stops it.
    pub fn next_state_unless(&mut self, stop: &dyn Fn() -> bool) -> Result<Option<NodeState>, StatesError> {
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
            if solver.step() >= step || states::next(&mut **solver, stop)?.is_none() {
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
            while states::next(&mut *there, stop)?.is_some() {}
            state = there.snapshot();
        }
        Ok(Some(NodeState {
            step,
            time_s: self.plan.grid.time_s(step),
            lattice: self.plan.elastic,
            spacing_m: self.plan.spacing_m,
            normal_load_n: contact_loads_n(&self.plan, &state.slider),
            tangential_force_n: state.slider.tangential_force_n,
            slides: state.slider.slip,
            displacement_m: state.slider.displacement_m,
            velocity_m_per_s: state.slider.velocity_m_per_s,
        }))
    }
}

/// The nodes at all of the times, in order.
impl Iterator for Nodes {
    type Item = Result<NodeState, StatesError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_state_unless(&|| false).transpose()
    }
}

/// The step nearest to each time, in descending order.
fn steps_at(plan: &Plan, at_s: &[f64]) -> Result<Vec<u64>, StatesError> {
    if let Some(at_s) = at_s.iter().copied().find(|at_s| at_s.is_nan() || *at_s < 0.0) {
        return Err(StatesError::Outside { at_s, last_s: plan.grid.time_s(plan.steps) });
    }
    let mut steps: Vec<u64> = at_s.iter().map(|at_s| plan.grid.nearest_step(*at_s)).collect();
    steps.sort_unstable_by(|a, b| b.cmp(a));
    steps.dedup();
    Ok(steps)
}

/// These steps, if none is after the last.
fn within(plan: &Plan, steps: Vec<u64>, last_step: u64) -> Result<Vec<u64>, StatesError> {
    let time_s = |step| plan.grid.time_s(step);
    match steps.first() {
        Some(step) if *step > last_step => {
            Err(StatesError::Outside { at_s: time_s(*step), last_s: time_s(last_step) })
        }
        _ => Ok(steps),
    }
}
