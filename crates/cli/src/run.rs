//! `asperity run`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use asperity_files::{FileError, is_taken};
use asperity_model::{Scenario, ScenarioSource};
use asperity_numbers::Summarizer;
use asperity_run::{Begin, LeftError, LogTo, RunError, SolverKind, Task, Verdict, check};
use asperity_runlog::{LogError, RunReader, Unfinished, WriteError, partial_path};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::exit::Failure;
use crate::outputs::{fits, refused};
use crate::progress::Board;
use crate::scenario::ScenarioChoice;
use crate::{interrupt, preview, summary, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity run default -o out/default.mcap
  asperity run out/mine.toml -o out/mine.mcap --set normal_load.tilt=-0.5
  asperity run out/long.toml -o out/long.mcap --resume

During the run its log is called RUN.mcap.partial. About once a second a
checkpoint, the complete state of the solver, is written to it. If the run is
killed or the disk is full, --resume continues from the last checkpoint and ends
with the same records and events as an uninterrupted run. With --resume, a
finished run is left unchanged, and a run that was never begun is started, so a
batch job can repeat the same command line.

A run is stopped, with exit code 1, if the work of its finite time step exceeds
30 % of the energy input, or if a number overflows; its log contains the run up
to there, and the reason. A time step above 0.4 dt_max causes a warning
(docs/model.md).")]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// The log to write; must not exist, except with --resume.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
    /// The solver to use; fast and plain give the same events. Default: adaptive for rate-and-state friction, fast
    /// for other laws.
    #[arg(long, value_parser = solvers())]
    pub(crate) solver: Option<SolverKind>,
    /// Print statistics of the solver on stderr, even with --quiet.
    #[arg(long)]
    pub(crate) stats: bool,
    /// Continue the run in RUN.mcap.partial, or start it if there is none.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Shortest wall-clock time between two checkpoints, in seconds. Below 1 s, they take up to
    /// 16 MB, and from then on 0.1 MB per second.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    pub(crate) checkpoint_s: f64,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity resume out/long.mcap

Continues the run in RUN.mcap.partial from its last checkpoint, with scenario
and solver as its log states them: neither the scenario nor its overrides are
named again. It ends with the same records and events as an uninterrupted run.")]
pub(crate) struct ResumeArguments {
    /// The log of the run; or its unfinished log, RUN.mcap.partial.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) log: PathBuf,
}

/// The solvers, as an option takes them.
pub(crate) fn solvers() -> impl TypedValueParser<Value = SolverKind> {
    let known = [
        ("fast", "Many steps at once wherever it is certain that no block switches"),
        ("plain", "One step at a time, as in the equations"),
        ("adaptive", "Steps as long as their error allows, for rate-and-state friction"),
    ];
    PossibleValuesParser::new(known.map(|(name, help)| PossibleValue::new(name).help(help)))
        .map(|name| SolverKind::named(&name).expect("these are its names"))
}

pub(crate) fn command(arguments: &RunArguments, board: &Board) -> Result<(), Failure> {
    let &RunArguments { ref choice, ref out, solver, resume, stats, checkpoint_s } = arguments;
    let scenario = match choice.resolve_and_tell(board) {
        Err(refused) if resume => in_logged_state(choice, out, board).ok_or(refused)?,
        resolved => resolved?,
    };
    let checkpoint_interval = Duration::try_from_secs_f64(checkpoint_s).map_err(|_| {
        Failure::BadInput(format!("--checkpoint-s {checkpoint_s} (accepted: a number of seconds from 0)"))
    })?;
    let log = LogTo { checkpoint_interval, ..LogTo::new(out) };
    make(Task::new(&scenario).solved_by(solver), log, resume, stats, board)
}

/// Continues the run of an unfinished log, which states scenario and solver.
pub(crate) fn resume_command(
    ResumeArguments { log }: &ResumeArguments,
    board: &Board,
) -> Result<(), Failure> {
    let is_partial = log.extension().is_some_and(|ending| ending == "partial");
    let out = if is_partial { log.with_extension("") } else { log.clone() };
    let (name, partial) = (out.display().to_string(), partial_path(&out));
    let left = Unfinished::of(&out).map_err(|error| failure(error.into(), board, &name))?;
    let Some(unfinished) = left.filter(|_| !is_taken(&out)) else {
        let checked = check(&out);
        return Err(match checked.verdict {
            Verdict::NoRunLog => verdict_exit::failure(&out, &checked),
            _ => Failure::BadInput(format!(
                "{name}: {checked} (accepted: a log whose unfinished run is in {})",
                partial.display()
            )),
        });
    };
    let Some((header, toml)) = unfinished.begun().map_err(Failure::failed)? else {
        return Err(Failure::BadInput(format!(
            "{}: it ends before its scenario (accepted: asperity run SCENARIO -o {name} --resume, which begins it again)",
            partial.display()
        )));
    };
    // Released, because the run locks it itself.
    drop(unfinished);
    let source = ScenarioSource::logged(format!("{}: scenario.toml", partial.display()), toml);
    let scenario = Scenario::resolve(&source).map_err(Failure::failed)?;
    let task = Task::new(&scenario).solved_by(SolverKind::named(&header.solver));
    make(task, LogTo::new(&out), true, false, board)
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

/// Makes a run and logs it. `resume` continues the run in an unfinished log, and leaves a whole one as it is; `stats` prints
/// statistics of the solver.
pub(crate) fn make(
    task: Task<'_>,
    log: LogTo<'_>,
    resume: bool,
    stats: bool,
    board: &Board,
) -> Result<(), Failure> {
    let (scenario, out) = (task.scenario, log.path);
    let task = task.log_to(log);
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
    let [(_, material), others @ ..] = preview::lines(scenario, &scenario.preview());
    board.line(&format!("{}: {material}", scenario.name));
    for (what, words) in others {
        board.aside(&format!("{}: {what}: {words}", scenario.name));
    }
    let header = task.header();
    // Progress, and notes about the physics at the end.
    let mut observers = (
        board.run(&scenario.name, header.steps, scenario.time.duration_s),
        Summarizer::new(&scenario.name, &header, Some(scenario)),
    );
    // Released, because the run locks it itself.
    drop(unfinished);
    let begin = if resume { Begin::GoOn } else { Begin::Anew };
    let outcome = asperity_run::run(task, begin, &interrupt::has_come, &mut observers);
    let outcome = outcome.map_err(|error| failure(error, board, &scenario.name))?;
    let (progress, summarizer) = observers;
    drop(progress);
    if outcome.has_run {
        let found = summarizer.finish(true, outcome.end.as_ref());
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
    refused("--out", &FileError::Exists(out.to_owned()), false)
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
        RunError::Write(WriteError::File(error)) if !matches!(error, FileError::Exists(_)) => {
            refused("--out", &error, false)
        }
        RunError::Write(WriteError::Foreign(_)) => {
            Failure::BadInput(format!("--out: {error} (accepted: another file)"))
        }
        RunError::Left(_) | RunError::Write(WriteError::Busy(_)) => Failure::failed(error),
        other => Failure::Failed(format!("{name}: {other}")),
    }
}
