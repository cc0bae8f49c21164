//! What stands in the place of a run's log, and whether it may be replaced.

use std::path::{Path, PathBuf};

use asperity_record::RunHeader;
use asperity_runlog::{LogError, LogProblem, NoRunLog, RunReader, Topics, partial_path};

/// Something that is not replaced stands in the place of a run's log.
#[derive(Debug, thiserror::Error)]
pub enum PlaceError {
    /// It is no run log.
    #[error("{0}; it is not replaced (accepted: another folder)")]
    Foreign(LogError),
    /// It is the log of another run, which may have taken hours.
    #[error(
        "{} is of another {what}, {found}, not {wanted}; it is not replaced (accepted: another folder, or --fresh)",
        log.display()
    )]
    OtherRun {
        /// The log.
        log: PathBuf,
        /// What differs.
        what: &'static str,
        /// What the log has.
        found: String,
        /// What this run has.
        wanted: String,
    },
}

/// Makes sure that what stands at a path, or at its [`partial_path`], may be replaced: nothing, or
/// a log of the same scenario and solver; of whatever run if it is to be `fresh`.
pub(crate) fn check(log: &Path, wanted: &RunHeader, fresh: bool) -> Result<(), PlaceError> {
    for path in [&partial_path(log), log] {
        match RunReader::open(path, Topics::NONE) {
            Err(LogError { problem: LogProblem::NoRunLog(NoRunLog::Missing | NoRunLog::Empty), .. }) => {}
            Err(error) if error.problem.is_no_run_log() => return Err(PlaceError::Foreign(error)),
            // Damaged before it says what it is.
            Err(_) => {}
            Ok(reader) if !fresh => is_same_run(path, reader.header(), wanted)?,
            Ok(_) => {}
        }
    }
    Ok(())
}

fn is_same_run(log: &Path, found: &RunHeader, wanted: &RunHeader) -> Result<(), PlaceError> {
    let differs = [
        ("scenario", &found.scenario_hash, &wanted.scenario_hash),
        ("solver", &found.solver, &wanted.solver),
    ];
    match differs.into_iter().find(|(_, found, wanted)| found != wanted) {
        None => Ok(()),
        Some((what, found, wanted)) => Err(PlaceError::OtherRun {
            log: log.to_owned(),
            what,
            found: found.clone(),
            wanted: wanted.clone(),
        }),
    }
}
