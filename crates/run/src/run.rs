//! A run: simulator, detectors and log writer, joined by the stream.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_detect::Detector;
use asperity_model::{Plan, Scenario};
use asperity_record::{Checkpoint, EventKind, RunEnd, RunHeader, RunStatus, SolverReport};
use asperity_runlog::{LogError, RunReader, Topics, Unfinished, WriteError, partial_path};
use asperity_simulator::{Counters, SimulationError, Solver, SolverKind};
use asperity_stream::{Given, Item, StreamError};

use crate::detectors::{self, TopicError};
use crate::header::header;
use crate::log::{CHECKPOINT_INTERVAL, Log, LogTo};
use crate::log_target::LogTargetError;
use crate::observer::{Notice, Observer};
use crate::resume::{Again, Left, LeftError, Saved};
use crate::self_check::ending;

/// Bytes of checkpoints for each second of work, at most: long chains have large states.
pub(crate) const CHECKPOINT_BYTES_PER_S: f64 = 1e5;

/// Bytes of checkpoints beyond that in a whole run, where they are asked for more often.
const CHECKPOINT_BYTES: f64 = 16e6;

/// What is to be run.
pub struct Task<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// Which solver takes the steps.
    pub solver: SolverKind,
    /// Where the log goes; without it none is kept.
    pub log: Option<LogTo<'a>>,
    /// Detectors of the caller's own. They look beside the registered ones, and what they emit
    /// stands after what those emit, in the log as well.
    pub detectors: Vec<Box<dyn Detector>>,
    /// Which threads it is made on.
    pub threads: Threads,
}

/// Which threads a run is made on. It is the same run either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Threads {
    /// Solver and detectors on two of their own, so that a run alone is over soonest.
    #[default]
    Several,
    /// All on the calling one, for runs of which there is one for every core.
    One,
}

impl<'a> Task<'a> {
    /// A run by the default solver, without a log, with the registered detectors.
    pub fn new(scenario: &'a Scenario) -> Task<'a> {
        Task {
            scenario,
            solver: SolverKind::default(),
            log: None,
            detectors: Vec::new(),
            threads: Threads::default(),
        }
    }

    /// With a log.
    #[must_use]
    pub fn log_to(self, log: LogTo<'a>) -> Task<'a> {
        Task { log: Some(log), ..self }
    }

    /// On the calling thread alone.
    #[must_use]
    pub fn on_one_thread(self) -> Task<'a> {
        Task { threads: Threads::One, ..self }
    }

    /// With one more detector.
    #[must_use]
    pub fn detect(mut self, detector: impl Detector + 'static) -> Task<'a> {
        self.detectors.push(Box::new(detector));
        self
    }

    /// What the run says of itself in its log.
    pub fn header(&self) -> RunHeader {
        header(self.scenario, &Plan::new(self.scenario), self.solver.name())
    }

    /// Whether an unfinished log of this run stands in the place of its log.
    pub fn is_begun(&self) -> bool {
        let Some(log) = &self.log else { return false };
        RunReader::open(&partial_path(log.path), Topics::NONE)
            .is_ok_and(|reader| *reader.header() == self.header())
    }

    /// Whether a log is of this run, with the events of all its detectors, and whole.
    ///
    /// # Errors
    /// If it is of this run and not whole, or no run log.
    pub fn is_whole(&self, log: &Path) -> Result<bool, LogError> {
        let mut reader = RunReader::open(log, Topics::NONE)?;
        if *reader.header() != self.header() {
            return Ok(false);
        }
        let own = self.detectors.iter().map(|detector| detector.emits());
        let kinds: Vec<EventKind> = detectors::event_kinds().into_iter().chain(own).collect();
        reader.verify().map(|end| detectors::has_events_of(&end, &kinds))
    }
}

/// Where a run begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Begin {
    /// At its first step. An unfinished log that stands in the place of this run's is overwritten.
    Anew,
    /// At the last checkpoint of the unfinished log that stands in the place of this run's; at the
    /// first step if there is none.
    GoOn,
}

/// What came of a run.
#[derive(Debug)]
pub struct Outcome {
    /// How it ended.
    pub status: RunStatus,
    /// What its steps were made of.
    pub counters: Counters,
    /// Whether it took any steps. The unfinished log of a run that goes on may lack its name only.
    pub has_run: bool,
    /// What its log says at its end, if a log was written.
    pub end: Option<RunEnd>,
}

/// A run that was not finished.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The solver could not go on. The log, if there is one, holds all there is of the run.
    #[error(
        "stopped: {error}{}",
        log.as_ref().map_or(String::new(), |log| {
            format!("; {} holds what there is", log.display())
        })
    )]
    Simulation {
        /// Why.
        error: SimulationError,
        /// Where the log stands.
        log: Option<PathBuf>,
    },
    /// The log could not be written.
    #[error("failed to write the log: {0}")]
    Write(#[from] WriteError),
    /// The system gives no thread.
    #[error("failed to start a thread: {0}")]
    Thread(String),
    /// The records before a checkpoint could not be read again.
    #[error("failed to go on with what there is: {0}")]
    Log(#[from] LogError),
    /// What stands in the place of the log is not one that may be replaced.
    #[error(transparent)]
    LogTarget(#[from] LogTargetError),
    /// One cannot go on with the unfinished log.
    #[error(transparent)]
    Left(#[from] LeftError),
    /// A detector of the caller's own emits what it must not.
    #[error(transparent)]
    Topic(#[from] TopicError),
    /// The caller asked it to stop. The log, if there is one, holds what there is.
    #[error(
        "interrupted{}",
        log.as_ref().map_or(String::new(), |log| {
            format!("; {} holds what there is", log.display())
        })
    )]
    Stopped {
        /// Where the unfinished log stands.
        log: Option<PathBuf>,
    },
}

/// Why records stopped coming.
enum End {
    Log(LogError),
    Stopped,
}

/// Makes a run, and its log if one is asked for. `stop` is asked between records, from another
/// thread; once it has said yes, the run stores its state and ends.
///
/// # Errors
/// If the run could not be finished, see [`RunError`].
pub fn run(
    task: Task<'_>,
    begin: Begin,
    stop: &(dyn Fn() -> bool + Sync),
    observer: &mut dyn Observer,
) -> Result<Outcome, RunError> {
    let plan = Plan::new(task.scenario);
    let header = header(task.scenario, &plan, task.solver.name());
    for warning in task.scenario.warnings() {
        observer.notice(Notice::Warning(&warning));
    }
    let Task { scenario, solver, log, detectors: own, threads } = task;
    let mut detectors = detectors::all(&header, "");
    detectors.extend(own);
    let kinds = detectors::kinds_of(&detectors)?;
    let mut source = Source {
        solver: solver.start(plan.clone()),
        stop,
        again: None,
        before: Before::default(),
        checkpoints: log.map(|log| Checkpoints::every(log.checkpoint_interval, log.after)),
        is_asked_to_stop: false,
        is_stopping: false,
        stopped: None,
    };
    let mut writing = None;
    if let Some(to) = log {
        let unfinished = match begin {
            Begin::GoOn => Unfinished::of(to.path)?,
            Begin::Anew => None,
        };
        let left = match unfinished {
            Some(unfinished) => Left::of(unfinished, &header, &plan, &kinds)?,
            None => Left::Nothing,
        };
        writing = Some(match left {
            Left::Nothing => Log::new(to, header, scenario, kinds)?,
            Left::Whole { unfinished, end } => {
                unfinished.publish(to.existing)?;
                observer.notice(Notice::LackedItsName);
                let (status, counters) = (end.status, Counters::default());
                return Ok(Outcome { status, counters, has_run: false, end: Some(*end) });
            }
            Left::Part { unfinished, saved, state } => {
                let step = saved.chain.step;
                observer.notice(Notice::GoesOn { step, time_s: plan.grid.time_s(step) });
                source.go_on(&unfinished, *saved, &state)?;
                Log::resume(to, unfinished, header, scenario, kinds)?
            }
        });
    }

    let sink = |item| {
        match &item {
            Item::Record(record) => {
                observer.record(record);
                observer.reached(record.step());
            }
            Item::Event(event) => observer.event(event),
            Item::Checkpoint(_) => {}
        }
        writing.as_mut().map_or(Ok(()), |log| log.take(item))
    };
    let outcome = match threads {
        Threads::Several => asperity_stream::run(|| source.next(), detectors, sink),
        Threads::One => asperity_stream::run_in_turn(|| source.next(), detectors, sink),
    };
    if let (Err(StreamError::Sink(_) | StreamError::Thread(_)), Some(log)) = (&outcome, &mut writing) {
        log.discard_if_empty();
    }
    let is_stopped = match outcome {
        Ok(()) => false,
        Err(StreamError::Source(End::Stopped)) => true,
        Err(StreamError::Source(End::Log(error))) => return Err(error.into()),
        Err(StreamError::Sink(error)) => return Err(RunError::Write(error)),
        Err(StreamError::Thread(error)) => return Err(RunError::Thread(error)),
    };
    let Source { solver, before, stopped, .. } = source;
    let counters = before.counters + solver.counters();
    let fallbacks = solver.fallbacks();
    let status = if is_stopped { RunStatus::Interrupted } else { ending(&plan, &*solver) };
    let mut report = SolverReport {
        counts: counters.by_name(),
        fallbacks: fallbacks.iter().map(|&fallback| fallback.to_owned()).collect(),
    };
    if before.resumed > 0 {
        report.counts.insert("resumed".to_owned(), before.resumed);
    }
    let status = stopped.as_ref().map_or(status, SimulationError::status);
    let end = writing.map_or(Ok(None), |log| log.finish(status, stopped.as_ref(), report))?;
    if let Some(error) = stopped {
        let log = log.filter(|_| end.is_some()).map(|log| log.path.to_owned());
        return Err(RunError::Simulation { error, log });
    }
    if is_stopped {
        let log = log.filter(|_| end.is_some()).map(|log| partial_path(log.path));
        return Err(RunError::Stopped { log });
    }
    if let (RunStatus::LoadNotReached, Some(ratio)) = (status, plan.drive.until_load_ratio) {
        observer.notice(Notice::LoadNotReached { ratio });
    }
    for fallback in fallbacks {
        observer.notice(Notice::Fallback(fallback));
    }
    Ok(Outcome { status, counters, has_run: true, end })
}

/// What the run was made of before it went on.
#[derive(Debug, Clone, Copy, Default)]
struct Before {
    counters: Counters,
    /// How often it had gone on.
    resumed: u64,
}

/// When the next checkpoint is due.
struct Checkpoints {
    interval: Duration,
    /// When the first is of use.
    from: Instant,
    next: Instant,
    /// What is left of [`CHECKPOINT_BYTES`].
    left_bytes: f64,
}

impl Checkpoints {
    fn every(interval: Duration, after: Duration) -> Checkpoints {
        let now = Instant::now();
        let (from, next) = (now + after, now + interval.max(after));
        Checkpoints { interval, from, next, left_bytes: CHECKPOINT_BYTES }
    }

    fn are_of_use(&self) -> bool {
        Instant::now() >= self.from
    }

    fn are_due(&self) -> bool {
        Instant::now() >= self.next
    }

    /// Puts the next one off by the time that one of so many bytes is worth.
    fn written(&mut self, bytes: usize) {
        let bytes = bytes as f64;
        let share = Duration::from_secs_f64(bytes / CHECKPOINT_BYTES_PER_S);
        let interval = if self.interval < CHECKPOINT_INTERVAL && self.left_bytes >= bytes {
            self.left_bytes -= bytes;
            self.interval
        } else {
            self.interval.max(share)
        };
        self.next = Instant::now() + interval;
    }
}

/// Gives the records of a run: those that are to go through the detectors again, then the
/// solver's, and now and then a checkpoint between them.
struct Source<'a> {
    solver: Box<dyn Solver>,
    stop: &'a (dyn Fn() -> bool + Sync),
    again: Option<Again>,
    before: Before,
    /// None where there is no log to hold them.
    checkpoints: Option<Checkpoints>,
    /// Whether the caller has asked to stop.
    is_asked_to_stop: bool,
    /// Whether the last checkpoint has been given, and only the end is left.
    is_stopping: bool,
    /// Why the solver could not go on: the run ends there, and detectors bring to an end what they
    /// have.
    stopped: Option<SimulationError>,
}

impl Source<'_> {
    /// Has the solver go on from a checkpoint, once the records before it have been given.
    fn go_on(&mut self, unfinished: &Unfinished, saved: Saved, state: &str) -> Result<(), RunError> {
        self.again = Some(Again::new(unfinished, saved.chain.step, state)?);
        self.before = Before { counters: saved.counters, resumed: saved.resumed };
        self.solver.restore(&saved.chain);
        if let Some(checkpoints) = &mut self.checkpoints {
            checkpoints.from = Instant::now();
        }
        Ok(())
    }

    fn next(&mut self) -> Result<Option<Given>, End> {
        self.is_asked_to_stop |= (self.stop)();
        let stop = self.is_asked_to_stop;
        if let Some(again) = &mut self.again {
            if stop {
                return Err(End::Stopped);
            }
            return match again.next_record().map_err(End::Log)? {
                Some(record) => Ok(Some(Given::Record(record))),
                None => {
                    self.again = None;
                    self.before.resumed += 1;
                    Ok(Some(Given::Checkpoint(self.checkpoint())))
                }
            };
        }
        if self.is_stopping {
            return Err(End::Stopped);
        }
        match &self.checkpoints {
            None if stop => return Err(End::Stopped),
            Some(checkpoints) if stop && !checkpoints.are_of_use() => return Err(End::Stopped),
            Some(checkpoints) if self.solver.is_between_records() && (stop || checkpoints.are_due()) => {
                self.is_stopping = stop;
                return Ok(Some(Given::Checkpoint(self.checkpoint())));
            }
            _ => {}
        }
        match self.solver.next_record() {
            Ok(record) => Ok(record.map(Given::Record)),
            Err(error) => {
                self.stopped = Some(error);
                Ok(None)
            }
        }
    }

    fn checkpoint(&mut self) -> Checkpoint {
        let saved = Saved {
            chain: self.solver.snapshot(),
            counters: self.before.counters + self.solver.counters(),
            resumed: self.before.resumed,
        };
        let checkpoint = saved.checkpoint();
        if let Some(checkpoints) = &mut self.checkpoints {
            checkpoints.written(checkpoint.state.len());
        }
        checkpoint
    }
}
