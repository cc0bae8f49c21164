//! `asperity run`: simulator, detectors and log writer, joined by the stream.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_model::{Plan, Scenario};
use asperity_record::{Checkpoint, EventKind, RECORD_SCHEMA_VERSION, RunHeader, RunStatus, SolverReport};
use asperity_runlog::{
    Existing, LogError, RunReader, RunWriter, Topics, Unfinished, WriteError, partial_path,
};
use asperity_simulator::{Counters, SimulationError, Solver, SolverKind};
use asperity_stream::{Given, Item, StreamError};

use crate::args::RunArguments;
use crate::detectors;
use crate::exit::{Code, Failure};
use crate::interrupt;
use crate::progress::{Board, RunProgress};
use crate::resume::{Again, Left, Saved};

/// Hash over the sources that shape a run, from the build script.
pub(crate) const CODE_VERSION: &str = env!("ASPERITY_CODE_VERSION");

/// Bytes of checkpoints for each second of work, at most: long chains have large states.
const CHECKPOINT_BYTES_PER_S: f64 = 1e5;

/// What is to be run, and where its log goes.
pub(crate) struct Task<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) solver: SolverKind,
    pub(crate) out: &'a Path,
    pub(crate) existing: Existing,
    /// What progress and messages call it.
    pub(crate) name: &'a str,
    /// Least time between two checkpoints.
    pub(crate) checkpoint_interval: Duration,
}

/// The time between checkpoints where nobody asks for another.
pub(crate) const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(1);

pub(crate) fn command(arguments: &RunArguments, board: &Board) -> Result<(), Failure> {
    let scenario = arguments.choice.resolve()?;
    let out = arguments.out.as_path();
    let checkpoint_interval = Duration::try_from_secs_f64(arguments.checkpoint_s).map_err(|_| {
        Failure::BadInput(format!(
            "--checkpoint-s {} (accepted: a number of seconds from 0)",
            arguments.checkpoint_s
        ))
    })?;
    let task = Task {
        scenario: &scenario,
        solver: arguments.solver.into(),
        out,
        existing: Existing::Refuse,
        name: &scenario.name,
        checkpoint_interval,
    };
    if out.exists() {
        return if arguments.resume { task.is_whole(board) } else { Err(taken(out)) };
    }
    let unfinished = Unfinished::of(out).map_err(Failure::failed)?;
    if let (Some(unfinished), false) = (&unfinished, arguments.resume) {
        return Err(Failure::BadInput(format!(
            "--out {}: {} holds a run that did not come to its end (accepted: --resume to go on with it, or another \
             --out; without that file the run starts anew)",
            out.display(),
            unfinished.partial_path().display()
        )));
    }
    interrupt::install()?;
    let counters = execute(&task, unfinished, board).map_err(|error| error.into_failure(board, task.name))?;
    if arguments.stats {
        board.answer(counters.to_string().trim_end());
    }
    Ok(())
}

fn taken(out: &Path) -> Failure {
    Failure::BadInput(format!(
        "--out {} exists already (accepted: a path that does not exist)",
        out.display()
    ))
}

impl Task<'_> {
    fn header(&self, plan: &Plan) -> RunHeader {
        header(self.scenario, plan, self.solver.name())
    }

    /// Whether an unfinished log is of this run, and can be gone on with.
    #[cfg(feature = "analysis")]
    pub(crate) fn is_begun(&self, unfinished: &Unfinished) -> bool {
        let wanted = self.header(&Plan::new(self.scenario));
        RunReader::open(&unfinished.partial_path(), Topics::NONE)
            .is_ok_and(|reader| *reader.header() == wanted)
    }

    /// Makes sure that the log that stands there already is this run's.
    fn is_whole(&self, board: &Board) -> Result<(), Failure> {
        let mut reader = RunReader::open(self.out, Topics::NONE).map_err(Failure::failed)?;
        if *reader.header() != self.header(&Plan::new(self.scenario)) {
            return Err(taken(self.out));
        }
        while reader.next_item().map_err(Failure::failed)?.is_some() {}
        board.line(&format!("{}: {} is whole already", self.name, self.out.display()));
        Ok(())
    }
}

/// A run that was not finished.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RunError {
    #[error("failed to simulate: {0}")]
    Simulation(#[from] SimulationError),
    #[error("failed to write the log: {0}")]
    Write(#[from] WriteError),
    #[error("failed to go on with what there is: {0}")]
    Log(#[from] LogError),
    #[error("{0}")]
    Left(#[from] Failure),
    #[error("interrupted; {} holds what there is, and --resume goes on from there", .1.display())]
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
            RunError::Left(failure) => failure,
            other => Failure::Failed(format!("{name}: {other}")),
        }
    }
}

/// Why records stopped coming.
enum Stop {
    Simulation(SimulationError),
    Log(LogError),
    Signal(Code),
}

/// What a run of this scenario by this program is called in its log.
pub(crate) fn header(scenario: &Scenario, plan: &Plan, solver: &str) -> RunHeader {
    let mut header = RunHeader {
        record_schema_version: RECORD_SCHEMA_VERSION,
        scenario: scenario.name.clone(),
        scenario_hash: scenario.hash(),
        run_id: String::new(),
        code_version: CODE_VERSION.to_owned(),
        parameter_set: scenario.parameter_set.word().to_owned(),
        solver: solver.to_owned(),
        blocks: scenario.slider.blocks,
        time_step_s: plan.grid.step_s(),
        steps: plan.steps,
    };
    header.run_id = run_id(&header);
    header
}

/// What a run with the rest of that header is called.
pub(crate) fn run_id(header: &RunHeader) -> String {
    let id = blake3::Hasher::new()
        .update(header.scenario_hash.as_bytes())
        .update(&header.record_schema_version.to_le_bytes())
        .update(header.code_version.as_bytes())
        .finalize();
    id.to_hex().to_string()
}

/// Runs a scenario and logs it, going on from what is left of it if there is any; what the
/// run was made of.
pub(crate) fn execute(
    task: &Task<'_>,
    unfinished: Option<Unfinished>,
    board: &Board,
) -> Result<Counters, RunError> {
    let &Task { scenario, out, existing, name, .. } = task;
    let plan = Plan::new(scenario);
    let header = task.header(&plan);
    let detectors = detectors::all(&header);
    let kinds: Vec<EventKind> = detectors.iter().map(|detector| detector.emits()).collect();
    let scenario_toml = scenario.to_commented_toml();
    let left = match unfinished {
        Some(unfinished) => Left::of(unfinished, &header, &plan)?,
        None => Left::Nothing,
    };
    let mut source = Source {
        solver: task.solver.start(plan.clone()),
        again: None,
        before: Before::default(),
        interval: task.checkpoint_interval,
        next_checkpoint: Instant::now() + task.checkpoint_interval,
        saved_for: None,
    };
    let mut writer = match left {
        Left::Nothing => RunWriter::create(out, existing, &header, &scenario_toml, &kinds)?,
        Left::Whole(unfinished) => {
            unfinished.publish()?;
            board.line(&format!("{name}: it was whole, but for its name"));
            return Ok(Counters::default());
        }
        Left::Part { unfinished, saved } => {
            board.line(&format!(
                "{name}: goes on from {} s, step {}",
                plan.grid.time_s(saved.chain.step),
                saved.chain.step
            ));
            source.resume(&unfinished, *saved)?;
            RunWriter::resume(unfinished, existing, &header, &scenario_toml, &kinds)?
        }
    };
    let mut progress: RunProgress = board.run(name, plan.steps, scenario.time.duration_s);

    let outcome = asperity_stream::run(
        || source.next(),
        detectors,
        |item| {
            match &item {
                Item::Record(record) => writer.record(record)?,
                Item::Event(event) => writer.event(event)?,
                Item::Checkpoint(checkpoint) => writer.checkpoint(checkpoint)?,
            }
            progress.saw(&item);
            Ok(())
        },
    );
    let interrupted = match outcome {
        Ok(()) => None,
        Err(StreamError::Source(Stop::Signal(code))) => Some(code),
        Err(StreamError::Source(Stop::Simulation(error))) => return Err(error.into()),
        Err(StreamError::Source(Stop::Log(error))) => return Err(error.into()),
        Err(StreamError::Sink(error)) => return Err(RunError::Write(error)),
    };
    let Source { solver, before, .. } = source;
    let counters = before.counters + solver.counters();
    let fallbacks = solver.fallbacks();
    let never_stopped = plan.drive.until_load_ratio.filter(|_| solver.snapshot().hold_step == u64::MAX);
    let status = if never_stopped.is_some() { RunStatus::LoadNotReached } else { RunStatus::Complete };
    let mut report = SolverReport {
        counts: counters.by_name(),
        fallbacks: fallbacks.iter().map(|&fallback| fallback.to_owned()).collect(),
    };
    if before.resumed > 0 {
        report.counts.insert("resumed".to_owned(), before.resumed);
    }
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

/// What the run was made of before it was taken up again.
#[derive(Debug, Clone, Copy, Default)]
struct Before {
    counters: Counters,
    /// How often it was taken up.
    resumed: u64,
}

/// Gives the records of a run: those that are to go through the detectors again, then the
/// solver's, and now and then a checkpoint between them.
struct Source {
    solver: Box<dyn Solver>,
    again: Option<Again>,
    before: Before,
    interval: Duration,
    next_checkpoint: Instant,
    /// The signal that the last checkpoint was made for.
    saved_for: Option<Code>,
}

impl Source {
    /// Has the solver go on from a checkpoint, once the records before it have been given.
    fn resume(&mut self, unfinished: &Unfinished, saved: Saved) -> Result<(), RunError> {
        self.again = Some(Again::new(unfinished, &saved)?);
        self.before = Before { counters: saved.counters, resumed: saved.resumed };
        self.solver.restore(&saved.chain);
        Ok(())
    }

    fn next(&mut self) -> Result<Option<Given>, Stop> {
        let signal = interrupt::code();
        if let Some(again) = &mut self.again {
            if let Some(code) = signal {
                return Err(Stop::Signal(code));
            }
            return match again.next_record().map_err(Stop::Log)? {
                Some(record) => Ok(Some(Given::Record(record))),
                None => {
                    self.again = None;
                    self.before.resumed += 1;
                    Ok(Some(Given::Checkpoint(self.checkpoint())))
                }
            };
        }
        if let Some(code) = self.saved_for {
            return Err(Stop::Signal(code));
        }
        if self.solver.is_between_records() && (signal.is_some() || Instant::now() >= self.next_checkpoint) {
            self.saved_for = signal;
            return Ok(Some(Given::Checkpoint(self.checkpoint())));
        }
        Ok(self.solver.next_record().map_err(Stop::Simulation)?.map(Given::Record))
    }

    fn checkpoint(&mut self) -> Checkpoint {
        let saved = Saved {
            chain: self.solver.snapshot(),
            counters: self.before.counters + self.solver.counters(),
            resumed: self.before.resumed,
        };
        let checkpoint = saved.checkpoint();
        let share = Duration::from_secs_f64(checkpoint.state.len() as f64 / CHECKPOINT_BYTES_PER_S);
        // A shorter interval was asked for by somebody who knows what it costs.
        let interval =
            if self.interval < CHECKPOINT_INTERVAL { self.interval } else { self.interval.max(share) };
        self.next_checkpoint = Instant::now() + interval;
        checkpoint
    }
}
