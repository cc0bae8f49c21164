//! The runs of a study: finds those that exist, and makes the missing ones.

use std::path::{Path, PathBuf};

use asperity_model::{Plan, Scenario};
use asperity_record::Observer;
use asperity_record::{RunEnd, RunHeader};
use asperity_runlog::Existing;
use asperity_simulator::SolverKind;

use crate::log::LogTo;
use crate::log_target::{self, OtherRun, SCENARIO, SOLVER};
use crate::open_log::OpenLog;
use crate::run::{Begin, Outcome, RunError, Task, Threads, run};
use crate::verdict::Verdict;

/// The existing log of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Stored {
    /// Its log is whole, of this code version with its detectors, and of this scenario and solver.
    /// Contains its end.
    Whole(Box<RunEnd>),
    /// No log.
    Nothing,
    /// A log that cannot be used, and why.
    Unfit(String),
}

/// A resolved run of a study.
#[derive(Debug, Clone)]
pub struct Job {
    /// Its name in the study, and of its log.
    pub name: String,
    /// Its scenario.
    pub scenario: Scenario,
}

impl Job {
    /// The number of its steps.
    pub fn steps(&self) -> u64 {
        Plan::new(&self.scenario).steps
    }

    /// Work in block steps.
    pub fn cost(&self) -> u64 {
        self.steps().saturating_mul(u64::from(self.scenario.slider.contacts()))
    }

    /// The path of its log in a folder of runs.
    pub fn log(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.mcap", self.name))
    }

    /// The header of the run's log, by a solver or the default of its law.
    pub fn header(&self, solver: Option<SolverKind>) -> RunHeader {
        Task::new(&self.scenario).solved_by(solver).header()
    }

    /// Looks for a usable log of the run. `observer` sees its contents if its header is that of
    /// this run, even if the log turns out to be unusable.
    pub fn stored(&self, folder: &Path, solver: Option<SolverKind>, observer: &mut dyn Observer) -> Stored {
        let log = self.log(folder);
        let wanted = self.header(solver);
        let checked = match OpenLog::open(&log) {
            Err(checked) => *checked,
            // Observers rely on the blocks and steps of this run.
            Ok(log) if *log.header() == wanted => log.check(observer),
            Ok(log) => log.check(&mut ()),
        };
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

    /// Checks that the target of its log, whole or unfinished, may be replaced: it is free, or contains a
    /// log of the same scenario and solver, or, with `fresh`, of any run.
    ///
    /// # Errors
    /// A message, if it contains anything else.
    pub fn check_log_target(
        &self,
        folder: &Path,
        solver: Option<SolverKind>,
        fresh: bool,
    ) -> Result<(), String> {
        log_target::check(&self.log(folder), &self.header(solver), fresh)
    }

    /// Makes the run, or resumes it unless `fresh`. Replaces an existing run log once the new one
    /// is whole.
    ///
    /// # Errors
    /// If the run did not finish, or the target must not be replaced.
    pub fn make(
        &self,
        folder: &Path,
        solver: Option<SolverKind>,
        fresh: bool,
        threads: Threads,
        stop: &(dyn Fn() -> bool + Sync),
        observer: &mut dyn Observer,
    ) -> Result<Outcome, RunError> {
        self.check_log_target(folder, solver, fresh).map_err(RunError::LogTarget)?;
        let path = self.log(folder);
        let log = LogTo { existing: Existing::Replace, ..LogTo::new(&path) };
        let task = Task { threads, ..Task::new(&self.scenario) }.solved_by(solver).log_to(log);
        let begin = if !fresh && task.is_begun() { Begin::GoOn } else { Begin::Anew };
        run(task, begin, stop, observer)
    }
}
