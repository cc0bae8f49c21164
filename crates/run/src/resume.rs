//! Going on with a run that did not come to its end: what is left of it, and the records
//! that go through the detectors once more before the solver goes on.
//!
//! The solver restores its state from a checkpoint to the bit. Detectors and log have none of
//! their own: they are given the records up to the checkpoint again, out of the unfinished
//! log, and so stand where they stood. What comes out is what one run would have given.
//!
//! A checkpoint is used if its checksum holds, it fits the plan, and the same contacts are detached in it
//! as the switches before it leave so: detectors rely on that. Whether it is what the records before it lead
//! to tells `check --again` of the finished log.

use std::path::PathBuf;

use asperity_model::Plan;
use asperity_record::{Checkpoint, Direction, EventKind, Record, RunEnd, RunHeader};
use asperity_runlog::{LogError, LogItem, LogProblem, RunReader, Topics, Unfinished};
use asperity_simulator::{ChainState, Counters};
use serde::{Deserialize, Serialize};

use crate::detectors::has_events_of;
use crate::log_target::{CODE_VERSION, OtherRun, RUN_ID, SCENARIO, SOLVER};

/// What a checkpoint holds.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Saved {
    /// The solver's state.
    pub(crate) chain: ChainState,
    /// What the steps up to it were made of.
    pub(crate) counters: Counters,
    /// How often the run had gone on before.
    pub(crate) resumed: u64,
}

impl Saved {
    pub(crate) fn checkpoint(&self) -> Checkpoint {
        let state = serde_json::to_string(self).expect("a state is a plain struct of numbers");
        Checkpoint { step: self.chain.step, state }
    }

    /// That a solver of the plan can go on from it, and counts go on as numbers.
    ///
    /// # Errors
    /// In words, what does not fit.
    pub(crate) fn fits(&self, plan: &Plan) -> Result<(), String> {
        if !self.chain.fits(plan) {
            return Err("it is not a state of this scenario".to_owned());
        }
        if !self.counters.fit(self.chain.step - plan.initial.step) {
            return Err(format!("it is of step {}, and counts other steps", self.chain.step));
        }
        if self.resumed > MOST_RESUMED {
            return Err(format!("it says that the run was resumed {} times", self.resumed));
        }
        Ok(())
    }

    /// The first block, counted from 1, that is detached in it and not by the switches before it, or the
    /// other way.
    fn differing_block(&self, again: &mut Again) -> Result<Option<usize>, LogError> {
        let mut slip = vec![0.0; self.chain.slip.len()];
        while let Some(record) = again.next_record()? {
            let Record::Step(record) = record else { continue };
            for switch in &record.switches {
                slip[switch.block as usize - 1] = f64::from(switch.direction == Direction::Detach);
            }
        }
        let differs = slip.iter().zip(&self.chain.slip).position(|(left, found)| left != found);
        Ok(differs.map(|n| n + 1))
    }
}

/// A run takes some time between one interruption and the next.
const MOST_RESUMED: u64 = 1 << 32;

/// What is left of a run that did not come to its end.
pub(crate) enum Left {
    /// Nothing that one could go on from.
    Nothing,
    /// All of it: only its final name is missing.
    Whole { unfinished: Unfinished, end: Box<RunEnd> },
    /// A state, as it is and as it stands in the log, and the records that led to it.
    Part { unfinished: Unfinished, saved: Box<Saved>, state: String },
}

/// An unfinished log that a run cannot go on with.
#[derive(Debug, thiserror::Error)]
pub enum LeftError {
    /// It cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// It is of another run.
    #[error("{0} (accepted: the scenario, solver and program it was begun with, or another log)")]
    OtherRun(#[from] OtherRun),
    /// Its checkpoint is none of this run.
    #[error(
        "{}: its last checkpoint is not a state of this run: {problem}; without the file the run starts from the \
         beginning",
        log.display()
    )]
    NoState {
        /// The log.
        log: PathBuf,
        /// What does not fit.
        problem: String,
    },
}

impl Left {
    /// Reads an unfinished log, up to where it is sound, for the run with that header and events
    /// of these kinds.
    pub(crate) fn of(
        unfinished: Unfinished,
        header: &RunHeader,
        plan: &Plan,
        kinds: &[EventKind],
    ) -> Result<Left, LeftError> {
        let mut reader = match RunReader::open(&unfinished.partial_path(), Topics::NONE) {
            Ok(reader) => reader,
            Err(LogError { problem, .. }) if is_beginning(&problem) => return Ok(Left::Nothing),
            Err(error) => return Err(error.into()),
        };
        let parts = [SCENARIO, CODE_VERSION, SOLVER, RUN_ID];
        OtherRun::unless_same(&unfinished.partial_path(), reader.header(), header, &parts)?;
        loop {
            match reader.next_item() {
                Ok(Some(_)) => {}
                Ok(None) => {
                    let end = reader.end().expect("the log was read to its end").clone();
                    if has_events_of(&end, kinds) {
                        return Ok(Left::Whole { unfinished, end: Box::new(end) });
                    }
                    // Fewer detectors looked: the records go through all of them now.
                    break;
                }
                Err(error @ LogError { problem: LogProblem::Salvaged, .. }) => return Err(error.into()),
                // Whatever is wrong behind the last checkpoint: it stands on what is before.
                Err(_) => break,
            }
        }
        let Some(state) = reader.checkpoint() else { return Ok(Left::Nothing) };
        let log = unfinished.partial_path();
        let refused = |problem| Err(LeftError::NoState { log, problem });
        let saved: Box<Saved> = match serde_json::from_str(state) {
            Ok(saved) => saved,
            Err(error) => return refused(error.to_string()),
        };
        let state = state.to_owned();
        if let Err(problem) = saved.fits(plan) {
            return refused(problem);
        }
        let mut again = Again::new(&unfinished, saved.chain.step, &state)?;
        match saved.differing_block(&mut again)? {
            None => Ok(Left::Part { unfinished, saved, state }),
            Some(block) => {
                refused(format!("its block {block} is detached or stuck, its switches leave it otherwise"))
            }
        }
    }
}

/// Whether a log breaks off before it says what it is.
fn is_beginning(problem: &LogProblem) -> bool {
    problem.is_early_end() || matches!(problem, LogProblem::NoHeader)
}

/// Gives the records up to a checkpoint once more.
pub(crate) struct Again {
    old: RunReader,
    until_step: u64,
    state: String,
}

impl Again {
    /// Of an unfinished log that was found to hold a checkpoint of that step, in these words.
    pub(crate) fn new(unfinished: &Unfinished, step: u64, state: &str) -> Result<Again, LogError> {
        let old = RunReader::open(&unfinished.partial_path(), Topics::RECORDS)?;
        Ok(Again { old, until_step: step, state: state.to_owned() })
    }

    /// The next record; `None` once the solver is to go on.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record>, LogError> {
        while self.old.checkpoint() != Some(&self.state) {
            match self.old.next_item() {
                Ok(Some(LogItem::Record(record))) if record.step() <= self.until_step => {
                    return Ok(Some(record));
                }
                // Recorded inside a leap from the checkpoint, and to be recorded again.
                Ok(Some(_)) => {}
                Ok(None) => break,
                // The checkpoint is all that is needed; after it the log may just end.
                Err(_) if self.old.checkpoint() == Some(&self.state) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}
