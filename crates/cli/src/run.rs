//! `asperity run`.

use std::path::Path;
use std::time::Duration;

use asperity_files::is_taken;
use asperity_model::{Scenario, ScenarioSource};
use asperity_numbers::{RupturesFrom, Slider, Summarizer};
use asperity_run::{Begin, CHECKPOINT_INTERVAL, LeftError, LogTo, RunError, SolverKind, Task};
use asperity_runlog::{LogError, RunReader, Unfinished, WriteError, partial_path};

use crate::args::{RunArguments, ScenarioChoice};
use crate::exit::Failure;
use crate::interrupt;
use crate::outputs::{fits, refused};
use crate::preview;
use crate::progress::Board;
use crate::summary;

/// A run to be made and logged.
pub(crate) struct Making<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) out: &'a Path,
    pub(crate) solver: Option<SolverKind>,
    pub(crate) checkpoint_interval: Duration,
    /// Whether to continue the run in an unfinished log, and to leave a whole one as it is.
    pub(crate) resume: bool,
    /// Whether to print statistics of the solver.
    pub(crate) stats: bool,
}

impl<'a> Making<'a> {
    /// With the default solver, checkpoints as often as usual, from the beginning.
    pub(crate) fn new(scenario: &'a Scenario, out: &'a Path) -> Making<'a> {
        Making {
            scenario,
            out,
            solver: None,
            checkpoint_interval: CHECKPOINT_INTERVAL,
            resume: false,
            stats: false,
        }
    }
}

pub(crate) fn command(arguments: &RunArguments, board: &Board) -> Result<(), Failure> {
    let out = arguments.out.as_path();
    let scenario = match arguments.choice.resolve_and_tell(board) {
        Err(refused) if arguments.resume => in_logged_state(&arguments.choice, out, board).ok_or(refused)?,
        resolved => resolved?,
    };
    let checkpoint_interval = Duration::try_from_secs_f64(arguments.checkpoint_s).map_err(|_| {
        Failure::BadInput(format!(
            "--checkpoint-s {} (accepted: a number of seconds from 0)",
            arguments.checkpoint_s
        ))
    })?;
    let &RunArguments { solver, resume, stats, .. } = arguments;
    make(
        &Making {
            scenario: &scenario,
            out,
            solver: solver.map(SolverKind::from),
            checkpoint_interval,
            resume,
            stats,
        },
        board,
    )
}

/// The scenario of a run to be continued, in the initial state that its log holds: the log that it was read from may
/// be gone. None if that log or its time is another one, or there is another error.
fn in_logged_state(choice: &ScenarioChoice, out: &Path, board: &Board) -> Option<Scenario> {
    let logs = [partial_path(out), out.to_owned()];
    let (log, toml) = logs.iter().find_map(|log| Some((log, RunReader::scenario_of(log).ok()?)))?;
    let logged = Scenario::resolve(&ScenarioSource::logged("scenario.toml", toml)).ok()?.initial;
    let state = format!("initial.state={}", logged.state);
    let set = choice.set.iter().cloned().chain([state]).collect();
    let choice = ScenarioChoice { scenario: choice.scenario.clone(), set };
    let scenario = choice.resolve_and_tell(board).ok()?;
    let is_same = scenario.initial.from == logged.from && scenario.initial.at_s == logged.at_s;
    if logged.from.is_empty() || !is_same {
        return None;
    }
    board.line(&format!(
        "{}: {} cannot be read; its state is in {}",
        scenario.name,
        logged.from,
        log.display()
    ));
    Some(scenario)
}

/// Makes a run and logs it.
pub(crate) fn make(making: &Making<'_>, board: &Board) -> Result<(), Failure> {
    let &Making { scenario, out, solver, checkpoint_interval, resume, stats } = making;
    let log = LogTo { checkpoint_interval, ..LogTo::new(out) };
    let task = Task::new(scenario).solved_by(solver).log_to(log);
    if is_taken(out) {
        let refuse = |error: LogError| match error.problem.is_no_run_log() {
            true => Failure::BadInput(format!("--out: {error} (accepted: another file)")),
            false => Failure::failed(error),
        };
        if !(resume && task.is_whole(out).map_err(refuse)?) {
            return Err(taken(out));
        }
        board.line(&format!("{}: {} is whole already", scenario.name, out.display()));
        return Ok(());
    }
    fits("--out", out, "mcap", "a run log, from which `asperity export` makes tables")?;
    let unfinished = Unfinished::of(out).map_err(|error| failure(error.into(), board, &scenario.name))?;
    if let (Some(unfinished), false) = (&unfinished, resume) {
        return Err(Failure::BadInput(format!(
            "--out {}: {} contains an unfinished run (accepted: --resume to continue it, or another --out; \
             remove that file to start from the beginning)",
            out.display(),
            unfinished.partial_path().display()
        )));
    }
    interrupt::install()?;
    for (what, words) in preview::lines(scenario, &scenario.preview()) {
        board.aside(&format!("{}: {what}: {words}", scenario.name));
    }
    let header = task.header();
    // Progress, and notes about the physics at the end.
    let mut observers = (
        board.run(&scenario.name, header.steps, scenario.time.duration_s),
        Summarizer::new(&scenario.name, &header, Slider::of(scenario)),
    );
    // Released, because the run locks it itself.
    drop(unfinished);
    let begin = if resume { Begin::GoOn } else { Begin::Anew };
    let outcome = asperity_run::run(task, begin, &interrupt::has_come, &mut observers);
    let outcome = outcome.map_err(|error| failure(error, board, &scenario.name))?;
    let (progress, summarizer) = observers;
    progress.end(outcome.has_run);
    if outcome.has_run {
        let found = summarizer.finish(RupturesFrom::Log, outcome.end.as_ref());
        let as_coded = scenario.as_coded_in_words().map(|words| format!("; {words}")).unwrap_or_default();
        board.line(&format!("{}: {}{as_coded}", scenario.name, summary::in_short(&found)));
        summary::tell(&scenario.name, &found, board);
    }
    if stats {
        board.answer(outcome.counters.to_string().trim_end());
        let fallbacks = outcome.end.iter().flat_map(|end| &end.solver.fallbacks);
        fallbacks.for_each(|fallback| board.answer(fallback));
    }
    Ok(())
}

fn taken(out: &Path) -> Failure {
    if out.is_dir() {
        let file = out.join("run.mcap");
        let (out, file) = (out.display(), file.display());
        return Failure::BadInput(format!("--out {out} is a folder (accepted: a file, as {file})"));
    }
    Failure::BadInput(format!(
        "--out {} exists already (accepted: a path that does not exist)",
        out.display()
    ))
}

/// Converts the error of an unfinished run; an interruption is printed and is no error.
pub(crate) fn failure(error: RunError, board: &Board, name: &str) -> Failure {
    match error {
        RunError::Stopped { .. } => {
            board.line(&format!("{name}: {error}; --resume continues from there"));
            Failure::Said(interrupt::code().expect("a signal stopped it"))
        }
        RunError::Left(LeftError::OtherRun(_)) => Failure::BadInput(format!("--resume: {error}")),
        RunError::LogTarget(_) => Failure::bad_input(error),
        RunError::Solver { .. } => Failure::BadInput(format!("--solver: {error}")),
        RunError::Write(WriteError::File(error)) => refused("--out", &error, false),
        RunError::Write(WriteError::Foreign(_)) => {
            Failure::BadInput(format!("--out: {error} (accepted: another file)"))
        }
        RunError::Left(_) | RunError::Write(WriteError::Busy(_)) => Failure::failed(error),
        other => Failure::Failed(format!("{name}: {other}")),
    }
}
