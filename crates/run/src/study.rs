//! Runs of a study: which there are already, and making those that are missing.

use std::path::{Path, PathBuf};

use asperity_model::{Plan, Scenario};
use asperity_runlog::{Existing, RunReader, Topics};
use asperity_simulator::SolverKind;

use crate::detectors;
use crate::header::CODE_VERSION;
use crate::place::{self, PlaceError};
use crate::run::{Begin, LogTo, Outcome, RunError, Task, run};
use crate::watch::Watch;

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

    /// Whether a whole log of this scenario, made by this program, is there.
    pub fn is_done(&self, folder: &Path, solver: SolverKind) -> bool {
        let log = self.log(folder);
        let task = Task { solver, ..Task::new(&self.scenario) };
        // The name of the scenario is for people; another one does not make another run.
        let Ok(mut reader) = RunReader::open(&log, Topics::NONE) else { return false };
        let (found, wanted) = (reader.header(), task.header());
        found.run_id == wanted.run_id
            && found.solver == wanted.solver
            && reader.verify().is_ok_and(|end| detectors::has_events_of(&end, &detectors::event_kinds()))
    }

    /// Makes sure that what stands in the place of its log, whole or unfinished, may be replaced:
    /// nothing, or a log of the same scenario and solver; of whatever run if it is to be `fresh`.
    ///
    /// # Errors
    /// If it is something else.
    pub fn check_place(&self, folder: &Path, solver: SolverKind, fresh: bool) -> Result<(), PlaceError> {
        let wanted = Task { solver, ..Task::new(&self.scenario) }.header();
        place::check(&self.log(folder), &wanted, fresh)
    }

    /// The code version of the program that made the log which is there, if that is another one.
    pub fn other_code(&self, folder: &Path) -> Option<String> {
        let reader = RunReader::open(&self.log(folder), Topics::NONE).ok()?;
        let found = &reader.header().code_version;
        (found != CODE_VERSION).then(|| found.clone())
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
        stop: &(dyn Fn() -> bool + Sync),
        watch: &mut dyn Watch,
    ) -> Result<Outcome, RunError> {
        self.check_place(folder, solver, fresh)?;
        let path = self.log(folder);
        let log = LogTo { existing: Existing::Replace, ..LogTo::new(&path) };
        let task = Task { solver, ..Task::new(&self.scenario) }.log_to(log);
        let begin = if !fresh && task.is_begun() { Begin::GoOn } else { Begin::Anew };
        run(task, begin, stop, watch)
    }
}
