//! What stands in the place of a run's log, and whether it may be replaced.

use std::path::{Path, PathBuf};

use asperity_record::RunHeader;
use asperity_runlog::{LogError, LogProblem, NoRunLog, RunReader, Topics, partial_path};

/// Something that is not replaced stands in the place of a run's log.
#[derive(Debug, thiserror::Error)]
pub enum LogTargetError {
    /// It is no run log.
    #[error("{0}; it is not replaced (accepted: another folder)")]
    Foreign(LogError),
    /// It is the log of another run, which may have taken hours.
    #[error("{0}; it is not replaced (accepted: another folder, or --fresh)")]
    OtherRun(#[from] OtherRun),
}

/// A log is not of the run that it would have to be of.
#[derive(Debug, thiserror::Error)]
#[error("{} is of another {what}, {found}, not {wanted}", log.display())]
pub struct OtherRun {
    /// The log.
    pub log: PathBuf,
    /// What differs.
    pub what: &'static str,
    /// What the log has.
    pub found: String,
    /// What this run has.
    pub wanted: String,
}

impl OtherRun {
    /// Compares what a log says of itself with what a run would say of itself. The name of the
    /// scenario is for people; another one does not make another run.
    ///
    /// # Errors
    /// If one of these parts differs.
    pub(crate) fn unless_same(
        log: &Path,
        found: &RunHeader,
        wanted: &RunHeader,
        parts: &[Part],
    ) -> Result<(), OtherRun> {
        for (what, of) in parts {
            let (found, wanted) = (of(found), of(wanted));
            if found != wanted {
                let (found, wanted) = (found.clone(), wanted.clone());
                return Err(OtherRun { log: log.to_owned(), what, found, wanted });
            }
        }
        Ok(())
    }
}

/// A part of a header that tells runs apart, and what it is called.
pub(crate) type Part = (&'static str, fn(&RunHeader) -> &String);
pub(crate) const SCENARIO: Part = ("scenario", |header| &header.scenario_hash);
pub(crate) const SOLVER: Part = ("solver", |header| &header.solver);
pub(crate) const CODE_VERSION: Part = ("code version", |header| &header.code_version);
pub(crate) const RUN_ID: Part = ("run", |header| &header.run_id);

/// Makes sure that what stands at a path, or at its [`partial_path`], may be replaced: nothing, or
/// a log of the same scenario and solver; of whatever run if it is to be `fresh`.
pub(crate) fn check(log: &Path, wanted: &RunHeader, fresh: bool) -> Result<(), LogTargetError> {
    for path in [&partial_path(log), log] {
        match RunReader::open(path, Topics::NONE) {
            Err(LogError { problem: LogProblem::NoRunLog(NoRunLog::Missing | NoRunLog::Empty), .. }) => {}
            Err(error) if error.problem.is_no_run_log() => return Err(LogTargetError::Foreign(error)),
            // Damaged before it says what it is.
            Err(_) => {}
            Ok(reader) if !fresh => {
                OtherRun::unless_same(path, reader.header(), wanted, &[SCENARIO, SOLVER])?;
            }
            Ok(_) => {}
        }
    }
    Ok(())
}
