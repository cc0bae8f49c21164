//! Reads a study for the commands of `asperity sweep`, and decides their exit codes.

use std::path::Path;

use asperity_files::FileError;
use asperity_study::plan::FILE;
use asperity_study::{Plan, Results, StudyError};

use crate::exit::{Code, Failure};
use crate::given::{self, Taken};
use crate::interrupt;
use crate::outputs::refused;
use crate::terminal::say;

/// Files that are refused are those of `--out`.
impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Failure {
        match error {
            StudyError::Refused(problem) => Failure::BadInput(problem),
            StudyError::File(error) => error.into(),
            StudyError::Failed(problem) => Failure::Failed(problem),
            StudyError::Stopped => Failure::Said(interrupt::code().unwrap_or(Code::Failed)),
        }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Failure {
        refused("--out", &error, false)
    }
}

/// Reads the plan in a folder.
pub(crate) fn read_plan(folder: &Path) -> Result<Plan, Failure> {
    Plan::read(folder).map_err(|error| match given::check(folder, Taken::Study) {
        Err(other) if !folder.join(FILE).exists() => other,
        _ => error.into(),
    })
}

/// Reads the plan and the results in a folder.
pub(crate) fn read(folder: &Path) -> Result<(Plan, Results), Failure> {
    let plan = read_plan(folder)?;
    let results = Results::read(folder, &plan)?;
    Ok((plan, results))
}

/// Prints the results that differ, if there are such, and fails.
pub(crate) fn tell_faults(results: &Results) -> Result<(), Failure> {
    match results.check() {
        Ok(()) => Ok(()),
        Err(faults) => {
            faults.to_string().lines().try_for_each(say)?;
            Code::Failed.said()
        }
    }
}

/// The exit code of the runs that were asked for.
pub(crate) fn outcome(results: &Results, is_asked: impl Fn(&u64) -> bool) -> Result<(), Failure> {
    let is_any = |word| results.runs(word).any(|run| is_asked(&run));
    let code = match () {
        () if is_any("missing") => Code::Incomplete,
        () if is_any("failed") => Code::Failed,
        () => Code::Success,
    };
    code.said()
}
