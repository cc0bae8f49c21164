//! Recovers the rest of a damaged log as a new log that states its gaps.

use std::path::Path;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{Parts, RunHeader};
use asperity_runlog::{RunReader, SalvageError, Salvaged, Topics};

use crate::check::{CheckProblem, Checked, check};
use crate::detectors;
use crate::header::{header, run_id};
use crate::verdict::Verdict;

/// Replaces a program version or solver that is no longer known.
const UNKNOWN: &str = "unknown";

/// Why nothing was salvaged.
#[derive(Debug, thiserror::Error)]
pub enum SalvageProblem {
    /// The log is not damaged.
    #[error("{0}: there is nothing to salvage")]
    Whole(Verdict),
    /// All checksums are right, and yet the log contradicts itself; or nothing is left of it.
    #[error("{checked}; {why}")]
    Hopeless {
        /// The verdict on the damaged log.
        checked: Box<Checked>,
        /// What is missing.
        why: String,
    },
    /// It cannot be read, or the result not written.
    #[error(transparent)]
    Failed(SalvageError),
}

/// Writes the sound parts of the log `input` to a new log `output`.
///
/// # Errors
/// If `input` is complete, cannot be read or has lost everything that identifies its run, or
/// `output` exists or cannot be written.
pub fn salvage(input: &Path, output: &Path) -> Result<Salvaged, SalvageProblem> {
    let checked = Box::new(check(input));
    if checked.verdict.holds_all() || checked.verdict == Verdict::Stopped {
        return Err(SalvageProblem::Whole(checked.verdict));
    }
    // The check stops at the first contradiction; there may be damage after it.
    let is_sound = || RunReader::open(input, Topics::ALL).and_then(|mut reader| reader.verify()).is_ok();
    if !matches!(checked.problem, Some(CheckProblem::Log(_))) && is_sound() {
        let why = "all checksums match, so no damaged part can be left out (accepted: the run, made again)";
        return Err(SalvageProblem::Hopeless { checked, why: why.to_owned() });
    }
    asperity_runlog::salvage(input, output, &detectors::event_kinds(Parts::default()), &settle).map_err(
        |error| match error {
            SalvageError::Hopeless(why) => SalvageProblem::Hopeless { checked, why },
            SalvageError::Read(_) if checked.verdict.tells_nothing() => {
                SalvageProblem::Hopeless { checked, why: "it cannot be read".to_owned() }
            }
            error => SalvageProblem::Failed(error),
        },
    )
}

/// Compares the header with the scenario.
fn settle(logged: Option<RunHeader>, scenario: Option<&str>) -> Result<(RunHeader, Vec<String>), String> {
    let resolved =
        scenario.and_then(|text| Scenario::resolve(&ScenarioSource::logged("scenario.toml", text)).ok());
    let why = match (logged, &resolved) {
        (Some(logged), Some(scenario)) if of(scenario, &logged.solver, &logged.code_version) == logged => {
            return Ok((logged, Vec::new()));
        }
        // Only its own id can confirm the header.
        (Some(logged), None) if logged.run_id == run_id(&logged) => return Ok((logged, Vec::new())),
        (Some(_), _) => "contradicts the scenario",
        (None, _) => "is lost",
    };
    match resolved {
        Some(scenario) => {
            let remark = format!("metadata `run` {why}, and was rebuilt from the scenario");
            Ok((of(&scenario, UNKNOWN, UNKNOWN), vec![remark]))
        }
        None => {
            Err("neither metadata `run` nor the scenario is left sound: nothing identifies its run"
                .to_owned())
        }
    }
}

/// The header of a scenario's run by the given program.
fn of(scenario: &Scenario, solver: &str, code_version: &str) -> RunHeader {
    let mut of = header(scenario, &Plan::new(scenario), solver);
    of.code_version = code_version.to_owned();
    of.run_id = run_id(&of);
    of
}
