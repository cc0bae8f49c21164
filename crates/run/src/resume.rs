//! Resumes an interrupted run: reads its unfinished log, and sends its records through the
//! detectors again before the solver continues.
//!
//! A checkpoint restores the solver's state to the bit. Detectors and log store no state: the
//! records up to the checkpoint, read from the unfinished log, bring them to theirs. The result
//! equals that of an uninterrupted run.
//!
//! A checkpoint is used if its checksum is right, it fits the plan, and its detached contacts are
//! those that the switches before it leave detached, which detectors rely on. Only `check --again`
//! of the finished log verifies that the records lead to it.

use asperity_model::{Plan, Scenario};
use asperity_record::{Checkpoint, Direction, EventKind, Record, RunEnd, RunHeader};
use asperity_runlog::{LogError, LogItem, LogProblem, RunReader, Topics, Unfinished};
use asperity_simulator::{Counters, Snapshot};
use serde::{Deserialize, Serialize};

use crate::detectors::has_events_of;
use crate::log_target::{CODE_VERSION, OtherRun, RUN_ID, SCENARIO, SOLVER};

/// The contents of a checkpoint.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Saved {
    /// The slider, and how the solver takes its steps.
    pub(crate) solver: Snapshot,
    /// The solver's counters up to it.
    pub(crate) counters: Counters,
    /// How often the run had been resumed before.
    pub(crate) resumed: u64,
}

impl Saved {
    /// The last step taken.
    pub(crate) fn step(&self) -> u64 {
        self.solver.slider.step
    }

    pub(crate) fn checkpoint(&self) -> Checkpoint {
        let state = serde_json::to_string(self).expect("a state is a plain struct of numbers");
        Checkpoint { step: self.step(), state }
    }

    /// Checks that a solver of the plan can continue from it, and that its counters are in range.
    ///
    /// # Errors
    /// A message about what does not fit.
    pub(crate) fn fits(&self, plan: &Plan) -> Result<(), String> {
        if !self.solver.fits(plan) {
            return Err("it is not a state of this scenario".to_owned());
        }
        if !self.counters.fit(self.step() - plan.initial.step) {
            return Err(format!("it is of step {}, and counts other steps", self.step()));
        }
        if self.resumed > MOST_RESUMED {
            return Err(format!("it says that the run was resumed {} times", self.resumed));
        }
        Ok(())
    }

    /// The first block, counted from 1, whose contact is detached in the checkpoint but not by the
    /// switches before it, or the reverse.
    fn differing_block(&self, again: &mut Again) -> Result<Option<usize>, LogError> {
        let mut slip = vec![0.0; self.solver.slider.slip.len()];
        while let Some(record) = again.next_record()? {
            let Record::Step(record) = record else { continue };
            for switch in &record.switches {
                slip[switch.block as usize - 1] = f64::from(switch.direction == Direction::Detach);
            }
        }
        let differs = slip.iter().zip(&self.solver.slider.slip).position(|(left, found)| left != found);
        Ok(differs.map(|n| n + 1))
    }
}

/// Most interruptions of a run; each costs some time.
const MOST_RESUMED: u64 = 1 << 32;

/// The remainder of an interrupted run.
pub(crate) enum Left {
    /// Nothing to resume from.
    Nothing,
    /// A complete log that lacks only its final name.
    Whole { unfinished: Unfinished, end: Box<RunEnd> },
    /// A state, decoded and as text in the log; the log contains the records before it.
    Part { unfinished: Unfinished, saved: Box<Saved>, state: String },
}

/// Why a run cannot resume from an unfinished log.
#[derive(Debug, thiserror::Error)]
pub enum LeftError {
    /// It cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// It is of another run.
    #[error("{0} (accepted: the scenario, solver and program it was begun with, or another log)")]
    OtherRun(#[from] OtherRun),
    /// Its checkpoint does not belong to this run.
    #[error("{0}")]
    NoState(String),
}

impl Left {
    /// Reads the sound part of an unfinished log of the run with that header and events of these
    /// kinds.
    pub(crate) fn of(
        unfinished: Unfinished,
        header: &RunHeader,
        scenario: &Scenario,
        plan: &Plan,
        kinds: &[EventKind],
    ) -> Result<Left, LeftError> {
        let mut reader = match RunReader::open(&unfinished.partial_path(), Topics::NONE) {
            Ok(reader) => reader,
            Err(LogError { problem, .. }) if is_beginning(&problem) => return Ok(Left::Nothing),
            Err(error) => return Err(error.into()),
        };
        let parts = [SCENARIO, CODE_VERSION, SOLVER, RUN_ID];
        OtherRun::unless_same(&unfinished.partial_path(), reader.header(), header, &parts)
            .map_err(|other| other.with_keys(reader.scenario_toml(), &scenario.to_commented_toml()))?;
        loop {
            match reader.next_item() {
                Ok(Some(_)) => {}
                Ok(None) => {
                    let end = reader.end().expect("the log was read to its end").clone();
                    if has_events_of(&end, kinds) {
                        return Ok(Left::Whole { unfinished, end: Box::new(end) });
                    }
                    // It was written with fewer detectors: the records go through all of them now.
                    break;
                }
                Err(error @ LogError { problem: LogProblem::Salvaged | LogProblem::Io(_), .. }) => {
                    return Err(error.into());
                }
                // Damage after the last checkpoint does not matter.
                Err(_) => break,
            }
        }
        let Some(state) = reader.checkpoint() else { return Ok(Left::Nothing) };
        let log = unfinished.partial_path();
        let refused = |problem: String| {
            Err(LeftError::NoState(format!(
                "{}: its last checkpoint is not a state of this run: {problem}; remove the file to start from the \
                 beginning",
                log.display()
            )))
        };
        let saved: Box<Saved> = match serde_json::from_str(state) {
            Ok(saved) => saved,
            Err(error) => return refused(error.to_string()),
        };
        let state = state.to_owned();
        if let Err(problem) = saved.fits(plan) {
            return refused(problem);
        }
        let mut again = Again::new(&unfinished, saved.step(), &state)?;
        match saved.differing_block(&mut again)? {
            None => Ok(Left::Part { unfinished, saved, state }),
            Some(block) => {
                refused(format!("its block {block} is detached or stuck, contrary to its switches"))
            }
        }
    }
}

/// Whether a log ends before its header.
fn is_beginning(problem: &LogProblem) -> bool {
    problem.is_early_end() || matches!(problem, LogProblem::NoHeader)
}

/// Yields the records up to a checkpoint again.
pub(crate) struct Again {
    old: RunReader,
    until_step: u64,
    state: String,
}

impl Again {
    /// Opens an unfinished log known to contain a checkpoint of that step with this text.
    pub(crate) fn new(unfinished: &Unfinished, step: u64, state: &str) -> Result<Again, LogError> {
        let old = RunReader::open(&unfinished.partial_path(), Topics::RECORDS)?;
        Ok(Again { old, until_step: step, state: state.to_owned() })
    }

    /// The next record; `None` at the checkpoint.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record>, LogError> {
        while self.old.checkpoint() != Some(&self.state) {
            match self.old.next_item() {
                Ok(Some(LogItem::Record(record))) if record.step() <= self.until_step => {
                    return Ok(Some(record));
                }
                // Recorded inside a leap from the checkpoint; it will be recorded again.
                Ok(Some(_)) => {}
                Ok(None) => break,
                // Damage after the checkpoint does not matter.
                Err(_) if self.old.checkpoint() == Some(&self.state) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}
