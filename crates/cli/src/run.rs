//! `asperity run`: simulator, detectors and log writer, joined by the stream.

use std::path::{Path, PathBuf};

use asperity_model::{Plan, Scenario};
use asperity_record::{EventKind, RECORD_SCHEMA_VERSION, RunHeader, RunStatus, SolverReport};
use asperity_runlog::{Existing, RunWriter, WriteError, partial_path};
use asperity_simulator::{Counters, SimulationError, SolverKind};
use asperity_stream::{Item, StreamError};

use crate::args::RunArguments;
use crate::detectors;
use crate::exit::{Code, Failure};
use crate::interrupt;
use crate::progress::{Board, RunProgress};

/// Hash over the sources that shape a run, from the build script.
pub(crate) const CODE_VERSION: &str = env!("ASPERITY_CODE_VERSION");

pub(crate) fn command(arguments: &RunArguments) -> Result<(), Failure> {
    let scenario = arguments.choice.resolve()?;
    if arguments.out.exists() {
        return Err(Failure::BadInput(format!(
            "--out {} exists already (accepted: a path that does not exist)",
            arguments.out.display()
        )));
    }
    interrupt::install()?;
    let board = Board::new();
    let counters =
        execute(&scenario, &arguments.out, Existing::Refuse, arguments.solver.into(), &board, &scenario.name)
            .map_err(|error| error.into_failure(&board, &scenario.name))?;
    if arguments.stats {
        board.line(counters.to_string().trim_end());
    }
    Ok(())
}

/// A run that was not finished.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RunError {
    #[error("failed to simulate: {0}")]
    Simulation(#[from] SimulationError),
    #[error("failed to write the log: {0}")]
    Write(#[from] WriteError),
    #[error("interrupted; {} holds what there is", .1.display())]
    Interrupted(Code, PathBuf),
}

impl RunError {
    /// What the command makes of it; an interruption is told and is no error.
    pub(crate) fn into_failure(self, board: &Board, name: &str) -> Failure {
        match self {
            RunError::Interrupted(code, _) => {
                board.line(&format!("{name}: {self}"));
                Failure::Said(code)
            }
            other => Failure::Failed(format!("{name}: {other}")),
        }
    }
}

/// Why records stopped coming.
enum Stop {
    Simulation(SimulationError),
    Signal(Code),
}

/// What a run of this scenario by this program is called in its log.
pub(crate) fn header(scenario: &Scenario, plan: &Plan, solver: &str) -> RunHeader {
    let scenario_hash = scenario.hash();
    let run_id = blake3::Hasher::new()
        .update(scenario_hash.as_bytes())
        .update(&RECORD_SCHEMA_VERSION.to_le_bytes())
        .update(CODE_VERSION.as_bytes())
        .finalize();
    RunHeader {
        record_schema_version: RECORD_SCHEMA_VERSION,
        scenario: scenario.name.clone(),
        scenario_hash,
        run_id: run_id.to_hex().to_string(),
        code_version: CODE_VERSION.to_owned(),
        parameter_set: scenario.parameter_set.word().to_owned(),
        solver: solver.to_owned(),
        blocks: scenario.slider.blocks,
        time_step_s: plan.grid.step_s(),
        steps: plan.steps,
    }
}

/// Runs a scenario and logs it to `out`; what the run was made of.
pub(crate) fn execute(
    scenario: &Scenario,
    out: &Path,
    existing: Existing,
    solver: SolverKind,
    board: &Board,
    name: &str,
) -> Result<Counters, RunError> {
    let plan = Plan::new(scenario);
    let mut solver = solver.start(plan.clone());
    let header = header(scenario, &plan, solver.name());
    let detectors = detectors::all(&header);
    let kinds: Vec<EventKind> = detectors.iter().map(|detector| detector.emits()).collect();
    let mut writer = RunWriter::create(out, existing, &header, &scenario.to_commented_toml(), &kinds)?;
    let mut progress: RunProgress = board.run(name, plan.steps, scenario.time.duration_s);

    let outcome = asperity_stream::run(
        || match interrupt::code() {
            Some(code) => Err(Stop::Signal(code)),
            None => solver.next_record().map_err(Stop::Simulation),
        },
        detectors,
        |item| {
            match &item {
                Item::Record(record) => writer.record(record)?,
                Item::Event(event) => writer.event(event)?,
            }
            progress.saw(&item);
            Ok(())
        },
    );
    let interrupted = match outcome {
        Ok(()) => None,
        Err(StreamError::Source(Stop::Signal(code))) => Some(code),
        Err(StreamError::Source(Stop::Simulation(error))) => return Err(error.into()),
        Err(StreamError::Sink(error)) => return Err(RunError::Write(error)),
    };
    let counters = solver.counters();
    let fallbacks = solver.fallbacks();
    let never_stopped = plan.drive.until_load_ratio.filter(|_| solver.snapshot().hold_step == u64::MAX);
    let status = if never_stopped.is_some() { RunStatus::LoadNotReached } else { RunStatus::Complete };
    let report = SolverReport {
        counts: counters.by_name(),
        fallbacks: fallbacks.iter().map(|&fallback| fallback.to_owned()).collect(),
    };
    if let Some(code) = interrupted {
        writer.finish(RunStatus::Interrupted, report)?;
        return Err(RunError::Interrupted(code, partial_path(out)));
    }
    writer.finish(status, report)?;
    progress.finish();
    if let Some(ratio) = never_stopped {
        board.line(&format!(
            "{name}: F_T/F_N never reached {ratio} (drive.until_load_ratio): the drive never stopped; the log says so as its status"
        ));
    }
    for fallback in fallbacks {
        board.line(&format!("{name}: {fallback}"));
    }
    Ok(counters)
}
