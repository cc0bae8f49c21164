//! Checks whether the target of a run's log is free or may be replaced.

use std::path::{Path, PathBuf};

use asperity_model::scenario::text;
use asperity_record::RunHeader;
use asperity_runlog::{LogError, LogProblem, NoRunLog, RunReader, Topics, must_be_ours, partial_path};

/// A log is of another run than required.
#[derive(Debug, thiserror::Error)]
#[error("{} is of another {what}, {found}, not {wanted}", log.display())]
pub struct OtherRun {
    /// The log.
    pub log: PathBuf,
    /// The part of the header that differs.
    pub what: &'static str,
    /// Its value in the log.
    pub found: String,
    /// Its value for this run.
    pub wanted: String,
}

/// Most keys that a message lists.
const LISTED_KEYS: usize = 3;

fn listed(differing: &[String]) -> String {
    let more = match differing.len().saturating_sub(LISTED_KEYS) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    match differing {
        [] => String::new(),
        _ => format!(": {}{more}", differing[..differing.len().min(LISTED_KEYS)].join(", ")),
    }
}

/// The keys that two scenarios, as TOML, have with other values.
fn differing_keys(found: &str, wanted: &str) -> Vec<String> {
    let [Ok(found), Ok(wanted)] = [found, wanted].map(text::keys_of) else { return Vec::new() };
    let differing = wanted.iter().filter_map(|(key, wanted)| {
        let found = found.get(key).filter(|found| *found != wanted)?;
        Some(format!("{key} = {found} in it, not {wanted}"))
    });
    differing.collect()
}

impl OtherRun {
    /// Compares the chosen parts of two headers. The name of the scenario is a label and does not
    /// distinguish runs.
    ///
    /// # Errors
    /// If one of the parts differs.
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

    /// Adds what distinguishes the scenarios, given as TOML.
    pub(crate) fn with_keys(self, found_toml: &str, wanted_toml: &str) -> OtherRun {
        let wanted = self.wanted + &listed(&differing_keys(found_toml, wanted_toml));
        OtherRun { wanted, ..self }
    }
}

/// A part of a header that identifies a run, and its name in messages.
pub(crate) type Part = (&'static str, fn(&RunHeader) -> &String);
pub(crate) const SCENARIO: Part = ("scenario", |header| &header.scenario_hash);
pub(crate) const SOLVER: Part = ("solver", |header| &header.solver);
pub(crate) const CODE_VERSION: Part = ("code version", |header| &header.code_version);
pub(crate) const RUN_ID: Part = ("run", |header| &header.run_id);

/// Checks that a path and its [`partial_path`] may be replaced: they are free, or contain a log of the same
/// scenario and solver, or, with `fresh`, of any run. Another run may have taken hours.
///
/// # Errors
/// A message, if one contains anything else, or the system cannot read it.
pub(crate) fn check(log: &Path, wanted: &RunHeader, fresh: bool) -> Result<(), String> {
    let foreign = |error: LogError| format!("{error}; it is not replaced (accepted: another folder)");
    for path in [&partial_path(log), log] {
        match RunReader::open(path, Topics::NONE) {
            Err(LogError {
                problem: LogProblem::NoRunLog(NoRunLog::Missing | NoRunLog::Empty | NoRunLog::Torn),
                ..
            }) => {}
            Err(error) if error.problem.is_no_run_log() || matches!(error.problem, LogProblem::Io(_)) => {
                return Err(foreign(error));
            }
            // Damaged before its header.
            Err(_) => must_be_ours(path).map_err(foreign)?,
            Ok(reader) if !fresh => {
                OtherRun::unless_same(path, reader.header(), wanted, &[SCENARIO, SOLVER]).map_err(
                    |other| format!("{other}; it is not replaced (accepted: another folder, or --fresh)"),
                )?;
            }
            Ok(_) => {}
        }
    }
    Ok(())
}
