//! What is left of a damaged log, as a log that says what it lacks.

use std::path::Path;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{RECORD_SCHEMA_VERSION, RunHeader, Scales};
use asperity_runlog::{RunReader, SalvageError, Salvaged, Topics};

use crate::check::{CheckProblem, Checked, check};
use crate::detectors;
use crate::header::{header, run_id};
use crate::verdict::Verdict;

/// Stands where nobody knows any more which program or solver it was.
const UNKNOWN: &str = "unknown";

/// A log of which nothing was salvaged.
#[derive(Debug, thiserror::Error)]
pub enum SalvageProblem {
    /// There is nothing to do.
    #[error("{0}: there is nothing to salvage")]
    Whole(Verdict),
    /// Whatever could vouch for its parts does, and still it contradicts itself.
    #[error("{0}; all checksums hold, so there is no part to leave out (accepted: the run, made again)")]
    Contradictory(Box<Checked>),
    /// There is nothing left of it, or its remains cannot be written.
    #[error("{error}")]
    Failed {
        /// Why.
        error: SalvageError,
        /// What the log is worth as it stands.
        checked: Box<Checked>,
    },
}

/// Writes what is left of the log `input` to a new log `output`.
///
/// # Errors
/// If `input` holds all there is of its run, cannot be read or has nothing left that says what run it is of,
/// or `output` exists or cannot be written.
pub fn salvage(input: &Path, output: &Path) -> Result<Salvaged, SalvageProblem> {
    let checked = check(input);
    if checked.verdict.holds_all() || checked.verdict == Verdict::Stopped {
        return Err(SalvageProblem::Whole(checked.verdict));
    }
    // The check stops at the first contradiction; behind it there may be damage.
    let is_sound = || RunReader::open(input, Topics::ALL).and_then(|mut reader| reader.verify()).is_ok();
    if !matches!(checked.problem, Some(CheckProblem::Log(_))) && is_sound() {
        return Err(SalvageProblem::Contradictory(Box::new(checked)));
    }
    asperity_runlog::salvage(input, output, &detectors::event_kinds(), &settle)
        .map_err(|error| SalvageProblem::Failed { error, checked: Box::new(checked) })
}

/// Compares the header with the scenario, of which a checksum says that it is what was
/// written: nothing else says so of the header.
fn settle(logged: Option<RunHeader>, scenario: Option<&str>) -> Result<(RunHeader, Vec<String>), String> {
    let resolved =
        scenario.and_then(|text| Scenario::resolve(&ScenarioSource::logged("scenario.toml", text)).ok());
    match (logged, resolved) {
        (Some(logged), Some(scenario)) => {
            let (solver, code_version) = (logged.solver.clone(), logged.code_version.clone());
            let mut expected = of(&scenario, &solver, &code_version, logged.record_schema_version);
            // Those of versions before 4 do not say them, those before 6 not all of them.
            expected.scales = logged.scales.zip(expected.scales).map(|(logged, expected)| Scales {
                modulus_n_per_m: logged.modulus_n_per_m.and(expected.modulus_n_per_m),
                interfacial_stiffness_n_per_m: logged
                    .interfacial_stiffness_n_per_m
                    .and(expected.interfacial_stiffness_n_per_m),
                ..expected
            });
            expected.longest_stable_step_s = logged.longest_stable_step_s.and(expected.longest_stable_step_s);
            if expected == logged {
                return Ok((logged, Vec::new()));
            }
            let remark =
                "metadata `run` was not what the scenario says, and was made again from it".to_owned();
            Ok((of(&scenario, UNKNOWN, UNKNOWN, logged.record_schema_version), vec![remark]))
        }
        (None, Some(scenario)) => {
            let remark = "metadata `run` is lost, and was made again from the scenario".to_owned();
            Ok((of(&scenario, UNKNOWN, UNKNOWN, RECORD_SCHEMA_VERSION), vec![remark]))
        }
        // Its own id is all there is to compare it with.
        (Some(logged), None) if logged.run_id == run_id(&logged) => Ok((logged, Vec::new())),
        (Some(_), None) => Err("metadata `run` contradicts itself, and the scenario is lost".to_owned()),
        (None, None) => {
            Err("neither metadata `run` nor the scenario is left: nothing says what run it is of".to_owned())
        }
    }
}

/// The header of a run of a scenario, by whatever program.
fn of(scenario: &Scenario, solver: &str, code_version: &str, version: u32) -> RunHeader {
    let mut of = header(scenario, &Plan::new(scenario), solver);
    of.code_version = code_version.to_owned();
    of.record_schema_version = version;
    of.run_id = run_id(&of);
    of
}
