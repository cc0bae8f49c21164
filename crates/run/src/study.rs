//! Runs of a study: which there are already, and making those that are missing.

use std::path::{Path, PathBuf};

use asperity_model::{Plan, Scenario};
use asperity_record::{RunEnd, RunHeader};
use asperity_runlog::{Existing, RunReader, Topics};
use asperity_simulator::SolverKind;

use crate::check::{check, check_seen};
use crate::log::LogTo;
use crate::log_target::{self, LogTargetError, OtherRun, SCENARIO, SOLVER};
use crate::observer::Observer;
use crate::run::{Begin, Outcome, RunError, Task, Threads, run};
use crate::verdict::Verdict;

/// What there is of a run already.
#[derive(Debug, Clone, PartialEq)]
pub enum Stored {
    /// Its log: whole, by this very program with its detectors, of this scenario and solver; and what
    /// it says at its end.
    Whole(Box<RunEnd>),
    /// No log.
    Nothing,
    /// A log that cannot stand for it, and why.
    Unfit(String),
}

/// A run of a study, resolved.
#[derive(Debug, Clone)]
pub struct Job {
    /// Its name in the study, which is that of its log.
    pub name: String,
    /// What it is a run of.
    pub scenario: Scenario,
}

impl Job {
    /// Steps that it takes.
    pub fn steps(&self) -> u64 {
        Plan::new(&self.scenario).steps
    }

    /// Work in block steps.
    pub fn cost(&self) -> u64 {
        self.steps().saturating_mul(u64::from(self.scenario.slider.blocks))
    }

    /// Where its log stands in a folder of runs.
    pub fn log(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.mcap", self.name))
    }

    /// What the run says of itself in its log.
    pub fn header(&self, solver: SolverKind) -> RunHeader {
        Task { solver, ..Task::new(&self.scenario) }.header()
    }

    /// Whether its log is there already, so that it need not be made. `observer` sees what is read of it if
    /// it says that it is of this run, by this very program; in vain if it cannot stand for it all the
    /// same.
    pub fn stored(&self, folder: &Path, solver: SolverKind, observer: &mut dyn Observer) -> Stored {
        let log = self.log(folder);
        let wanted = self.header(solver);
        // Who watches counts on the blocks and steps of this run.
        let is_wanted = RunReader::open(&log, Topics::NONE).is_ok_and(|reader| *reader.header() == wanted);
        let checked = if is_wanted { check_seen(&log, observer) } else { check(&log) };
        let Some(found) = checked.header.as_ref().filter(|_| checked.verdict != Verdict::NoRunLog) else {
            return Stored::Nothing;
        };
        if let Err(other) = OtherRun::unless_same(&log, found, &wanted, &[SCENARIO, SOLVER]) {
            return Stored::Unfit(format!("its log is of another {}", other.what));
        }
        match (checked.verdict, &checked.seen.end) {
            (Verdict::Whole, Some(end)) => Stored::Whole(Box::new(end.clone())),
            _ => Stored::Unfit(format!("its log is {checked}")),
        }
    }

    /// Makes sure that what stands in the place of its log, whole or unfinished, may be replaced:
    /// nothing, or a log of the same scenario and solver; of whatever run if it is to be `fresh`.
    ///
    /// # Errors
    /// If it is something else.
    pub fn check_log_target(
        &self,
        folder: &Path,
        solver: SolverKind,
        fresh: bool,
    ) -> Result<(), LogTargetError> {
        log_target::check(&self.log(folder), &self.header(solver), fresh)
    }

    /// Makes the run, or goes on with what was begun of it, unless it is to be made `fresh`. A
    /// run log that stands there is replaced once the new one is whole.
    ///
    /// # Errors
    /// If the run could not be finished, or something that is not replaced stands there.
    pub fn make(
        &self,
        folder: &Path,
        solver: SolverKind,
        fresh: bool,
        threads: Threads,
        stop: &(dyn Fn() -> bool + Sync),
        observer: &mut dyn Observer,
    ) -> Result<Outcome, RunError> {
        self.check_log_target(folder, solver, fresh)?;
        let path = self.log(folder);
        let log = LogTo { existing: Existing::Replace, ..LogTo::new(&path) };
        let task = Task { solver, threads, ..Task::new(&self.scenario) }.log_to(log);
        let begin = if !fresh && task.is_begun() { Begin::GoOn } else { Begin::Anew };
        run(task, begin, stop, observer)
    }
}
