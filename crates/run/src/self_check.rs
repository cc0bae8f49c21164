//! Verifies a log of this code version against its embedded scenario: the header and, if the
//! run is repeated, the records. Other code versions may interpret or record a scenario
//! otherwise.

use std::sync::Arc;

use asperity_model::{Plan, Scenario, ScenarioErrors, ScenarioSource};
use asperity_record::{Record, RunHeader, RunStatus};
use asperity_simulator::{Solver, SolverKind};
use serde_json::{Map, Value};

use crate::header::header;

/// How a log contradicts its own scenario, or what every run has.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SelfCheckProblem(String);

impl SelfCheckProblem {
    /// The scenario is invalid.
    pub(crate) fn scenario(errors: &ScenarioErrors) -> SelfCheckProblem {
        SelfCheckProblem(format!("scenario.toml cannot be read: {errors}"))
    }

    /// The repeated run differs at a step.
    pub(crate) fn rerun(step: u64, what: &str) -> SelfCheckProblem {
        SelfCheckProblem(format!("step {step}: the run, made again, {what}"))
    }
}

/// Resolves a log's scenario, which must agree with the header, and derives the plan.
///
/// # Errors
/// If the scenario is invalid or of another run.
pub(crate) fn resolve(logged: &RunHeader, scenario_toml: &str) -> Result<(Scenario, Plan), SelfCheckProblem> {
    let source = ScenarioSource::logged("scenario.toml", scenario_toml);
    let scenario = Scenario::resolve(&source).map_err(|errors| SelfCheckProblem::scenario(&errors))?;
    let plan = Plan::new(&scenario);
    agree(logged, scenario_toml, &scenario, &plan)?;
    Ok((scenario, plan))
}

/// Checks that a log's scenario and its plan agree with the header.
///
/// # Errors
/// If they are of another run.
pub(crate) fn agree(
    logged: &RunHeader,
    scenario_toml: &str,
    scenario: &Scenario,
    plan: &Plan,
) -> Result<(), SelfCheckProblem> {
    let solvers = SolverKind::of(scenario.friction.law);
    let solver = solvers.iter().find(|kind| kind.name() == logged.solver).unwrap_or(&solvers[0]);
    let of = header(scenario, plan, solver.name());
    let values = |header: &RunHeader| serde_json::to_value(header).unwrap_or_default();
    let (expected, found) = (values(&of), values(logged));
    let keys = [&expected, &found].into_iter().filter_map(Value::as_object).flat_map(Map::keys);
    if let Some(key) = keys.into_iter().find(|key| expected[key.as_str()] != found[key.as_str()]) {
        let text = |values: &Value| values.get(key).map_or("none".to_owned(), Value::to_string);
        return Err(SelfCheckProblem(format!(
            "scenario.toml is of a run with {key} {}, metadata `run` says {}",
            text(&expected),
            text(&found)
        )));
    }
    // The keys agree; what is derived from them, such as random offsets, must agree as well.
    if scenario.to_commented_toml() != scenario_toml {
        return Err(SelfCheckProblem(
            "scenario.toml is not the text that this program writes for that scenario".to_owned(),
        ));
    }
    Ok(())
}

/// Repeats the run of a log in parallel with its records.
pub(crate) struct Rerun {
    plan: Arc<Plan>,
    solver: Box<dyn Solver>,
    is_salvaged: bool,
}

impl Rerun {
    /// Starts the run of a log with that header, by the solver named there.
    pub(crate) fn new(plan: Plan, logged: &RunHeader, is_salvaged: bool) -> Rerun {
        let plan = Arc::new(plan);
        let solver = SolverKind::named(&logged.solver).unwrap_or_default().start(Arc::clone(&plan));
        Rerun { plan, solver, is_salvaged }
    }

    /// Checks that the run yields this record next; in a salvaged log, records before it may be
    /// missing.
    ///
    /// # Errors
    /// If it does not.
    pub(crate) fn record(&mut self, record: &Record) -> Result<(), SelfCheckProblem> {
        while let Ok(Some(made)) = self.solver.next_record() {
            if made == *record {
                return Ok(());
            }
            // Of rows of one step, some may be missing.
            if !self.is_salvaged || place(&made) > place(record) {
                break;
            }
        }
        Err(SelfCheckProblem::rerun(record.step(), "gives another record"))
    }

    /// Checks that the run ends here with that status and, if it was `stopped`, for that reason.
    ///
    /// # Errors
    /// If it does not.
    pub(crate) fn finish(mut self, status: RunStatus, stopped: Option<&str>) -> Result<(), SelfCheckProblem> {
        let what = match self.solver.next_record() {
            Ok(Some(more)) => {
                return Err(SelfCheckProblem::rerun(more.step(), "gives an additional record"));
            }
            Ok(None) if stopped.is_some() => "is not stopped",
            Ok(None) => match ending(&self.plan, &*self.solver) {
                made if made == status => return Ok(()),
                RunStatus::LoadNotReached => "does not reach the load that stops the drive",
                _ => "waits for no load, or reaches it",
            },
            Err(error) if error.status() == status && stopped == Some(&error.to_string()) => return Ok(()),
            Err(error) => &format!("is stopped: {error}"),
        };
        Err(SelfCheckProblem::rerun(self.solver.step(), what))
    }
}

/// The final status of a run that has taken all its steps.
pub(crate) fn ending(plan: &Plan, solver: &dyn Solver) -> RunStatus {
    match plan.drive.until_load_ratio {
        Some(_) if solver.snapshot().slider.hold_step == u64::MAX => RunStatus::LoadNotReached,
        _ => RunStatus::Complete,
    }
}

/// The sort key of a record within a run.
fn place(record: &Record) -> (u64, u32) {
    match record {
        Record::Step(record) => (record.step, 0),
        Record::Fields(record) => (record.step, 1),
        Record::Window(record) => (record.step, record.window.saturating_add(2)),
        other => (other.step(), u32::MAX),
    }
}
