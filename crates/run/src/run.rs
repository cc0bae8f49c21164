//! Runs a scenario: simulator, detectors and log writer, connected by the stream.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_detect::Detector;
use asperity_model::law::laws::FrictionLaw;
use asperity_model::{EVENT_SPEED_RATIO, Plan, Scenario};
use asperity_record::{Checkpoint, EventKind, Notice, Observer, Record, RunEnd, RunHeader, RunStatus};
use asperity_record::{SolverReport, StepRecord};
use asperity_runlog::{LogError, RunReader, Topics, Unfinished, WriteError, partial_path};
use asperity_simulator::{Counters, Next, SimulationError, Solver, SolverKind, Stop};

use crate::detectors::{self, Settings};
use crate::header::header;
use crate::log::{CHECKPOINT_INTERVAL, Log, LogTo};
use crate::resume::{Again, Left, LeftError, Saved};
use crate::self_check::ending;
use crate::stream::{Item, StreamError};

/// Most bytes of checkpoints per second of computing, since long chains have large states.
pub(crate) const CHECKPOINT_BYTES_PER_S: f64 = 1e5;

/// Further bytes of checkpoints in a whole run, for shorter intervals between them.
const CHECKPOINT_BYTES: f64 = 16e6;

/// Most rows of series of which a run says nothing: of 200 bytes each, some 2 GB before compression.
const MANY_ROWS: u64 = 10_000_000;

/// A run to be made.
pub struct Task<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// The solver that takes the steps.
    pub solver: SolverKind,
    /// The destination of the log; None for no log.
    pub log: Option<LogTo<'a>>,
    /// Custom detectors. They run after the registered ones, and their events follow in the log.
    pub detectors: Vec<Box<dyn Detector>>,
    /// The threads of the run.
    pub threads: Threads,
    /// What follows from scenario and solver, if it is known; whoever derived it has told the warnings.
    pub derived: Option<&'a Derived>,
}

/// What follows from the scenario of a run and its solver.
#[derive(Debug, Clone)]
pub struct Derived {
    /// The numbers of its physics.
    pub plan: Plan,
    /// The header of its log.
    pub header: RunHeader,
}

/// The threads of a run. The result is the same either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Threads {
    /// Solver and detectors on a thread each, for fewer runs than cores.
    #[default]
    Several,
    /// Everything on the calling thread, for one run per core.
    One,
}

impl<'a> Task<'a> {
    /// A run with the default solver of its law and the registered detectors, without a log.
    pub fn new(scenario: &'a Scenario) -> Task<'a> {
        Task {
            scenario,
            solver: SolverKind::of(scenario.friction.law)[0],
            log: None,
            detectors: Vec::new(),
            threads: Threads::default(),
            derived: None,
        }
    }

    /// Writes a log.
    #[must_use]
    pub fn log_to(self, log: LogTo<'a>) -> Task<'a> {
        Task { log: Some(log), ..self }
    }

    /// Solves it by this solver instead of its law's default.
    #[must_use]
    pub fn solved_by(self, solver: Option<SolverKind>) -> Task<'a> {
        Task { solver: solver.unwrap_or(self.solver), ..self }
    }

    /// Adds a custom detector.
    #[must_use]
    pub fn detect(mut self, detector: impl Detector + 'static) -> Task<'a> {
        self.detectors.push(Box::new(detector));
        self
    }

    /// What follows from its scenario and solver.
    pub fn derive(&self) -> Derived {
        let plan = Plan::new(self.scenario);
        Derived { header: header(self.scenario, &plan, self.solver.name()), plan }
    }

    /// The header of the run's log.
    pub fn header(&self) -> RunHeader {
        self.derive().header
    }

    /// Whether an unfinished log of this run exists at its target.
    pub fn is_begun(&self) -> bool {
        let Some(log) = &self.log else { return false };
        RunReader::open(&partial_path(log.path), Topics::NONE)
            .is_ok_and(|reader| *reader.header() == self.header())
    }

    /// Whether a log is of this run, whole, and with the events of all its detectors.
    ///
    /// # Errors
    /// If it is of this run and not whole, or not a run log.
    pub fn is_whole(&self, log: &Path) -> Result<bool, LogError> {
        let mut reader = RunReader::open(log, Topics::NONE)?;
        if *reader.header() != self.header() {
            return Ok(false);
        }
        let own = self.detectors.iter().map(|detector| detector.emits());
        let kinds: Vec<EventKind> =
            detectors::event_kinds(self.header().parts()).into_iter().chain(own).collect();
        reader.verify().map(|end| detectors::has_events_of(&end, &kinds))
    }
}

/// Where a run begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Begin {
    /// At its first step. Overwrites an unfinished log at the target.
    Anew,
    /// At the last checkpoint of the unfinished log at the target, or at the first step if there is
    /// none.
    GoOn,
}

/// The result of a run.
#[derive(Debug)]
pub struct Outcome {
    /// Its final status.
    pub status: RunStatus,
    /// The solver's counters.
    pub counters: Counters,
    /// Whether it took any steps; the unfinished log of a resumed run may lack only its name.
    pub has_run: bool,
    /// The `run_end` of its log, if one was written.
    pub end: Option<RunEnd>,
}

impl Outcome {
    /// The `run_end` of its log, or, without a log, what it would say apart from digests and counts of
    /// messages. `last_step` is that of the run's header.
    pub fn into_end(self, last_step: u64) -> RunEnd {
        let Outcome { status, counters, end, .. } = self;
        end.unwrap_or_else(|| RunEnd {
            status,
            stopped: None,
            last_step,
            message_counts: Default::default(),
            switches: counters.switches,
            energy: None,
            digest: String::new(),
            topic_digests: Default::default(),
            solver: SolverReport { counts: counters.by_name(), fallbacks: Vec::new() },
        })
    }
}

/// Why a run did not finish.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The solver is not one of the law's.
    #[error(
        "the solver {} does not solve friction.law = {:?} (accepted: {})",
        solver.name(),
        law.word(),
        SolverKind::of(*law).iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ")
    )]
    Solver {
        /// The solver.
        solver: SolverKind,
        /// The law.
        law: FrictionLaw,
    },
    /// The solver stopped. The log, if any, contains all records up to there.
    #[error(
        "stopped: {error}{}",
        log.as_ref().map_or(String::new(), |log| {
            format!("; {} contains the run so far", log.display())
        })
    )]
    Simulation {
        /// The reason.
        error: SimulationError,
        /// The path of the log.
        log: Option<PathBuf>,
    },
    /// The log could not be written.
    #[error("failed to write the log: {0}")]
    Write(#[from] WriteError),
    /// The system cannot start a thread.
    #[error("failed to start a thread: {0}")]
    Thread(String),
    /// The records before a checkpoint could not be read.
    #[error("failed to resume: {0}")]
    Log(#[from] LogError),
    /// The log's target must not be replaced.
    #[error("{0}")]
    LogTarget(String),
    /// The unfinished log cannot be resumed from.
    #[error(transparent)]
    Left(#[from] LeftError),
    /// A custom detector uses a topic that it must not.
    #[error("{0}")]
    Topic(String),
    /// The caller stopped the run. The log, if any, contains its records up to there.
    #[error(
        "interrupted{}",
        log.as_ref().map_or(String::new(), |log| {
            format!("; {} contains the run so far", log.display())
        })
    )]
    Stopped {
        /// The path of the unfinished log.
        log: Option<PathBuf>,
    },
}

/// Why records ended.
enum End {
    Log(LogError),
    Stopped,
}

/// Makes a run, and its log if the task has one. `stop` is polled after each record and, where these are rare, after
/// milliseconds of steps, on another thread; once it returns true, the run stores its state and ends.
///
/// # Errors
/// If the run did not finish, see [`RunError`].
pub fn run(
    task: Task<'_>,
    begin: Begin,
    stop: &(dyn Fn() -> bool + Sync),
    observer: &mut dyn Observer,
) -> Result<Outcome, RunError> {
    let law = task.scenario.friction.law;
    if !SolverKind::of(law).contains(&task.solver) {
        return Err(RunError::Solver { solver: task.solver, law });
    }
    let own;
    let Derived { plan, header } = match task.derived {
        Some(derived) => derived,
        None => {
            for warning in task.scenario.warnings() {
                observer.notice(Notice::Warning(&warning.text));
            }
            own = task.derive();
            &own
        }
    };
    let Task { scenario, solver, log, detectors: others, threads, .. } = task;
    let mut detectors = Settings::default().start(header, Some(scenario));
    others.into_iter().for_each(|detector| detectors.push(detector));
    let kinds = detectors::kinds_of(&detectors).map_err(RunError::Topic)?;
    let solver = solver.start(plan.clone());
    let mut source = Source {
        solver,
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
            Some(unfinished) => Left::of(unfinished, header, scenario, plan, &kinds)?,
            None => Left::Nothing,
        };
        writing = Some(match left {
            Left::Nothing => Log::new(to, None, header.clone(), scenario, kinds)?,
            Left::Whole { unfinished, end } => {
                unfinished.publish(to.existing)?;
                observer.notice(Notice::LackedItsName);
                let (status, counters) = (end.status, Counters::default());
                return Ok(Outcome { status, counters, has_run: false, end: Some(*end) });
            }
            Left::Part { unfinished, saved, state } => {
                let step = saved.step();
                observer.notice(Notice::GoesOn { step, time_s: plan.grid.time_s(step) });
                source.go_on(&unfinished, *saved, &state)?;
                Log::new(to, Some(unfinished), header.clone(), scenario, kinds)?
            }
        });
    }

    let (mut events, mut rows, mut peak_m_per_s) = (0_u64, 0_u64, 0.0_f64);
    let sink = |item| {
        match &item {
            Item::Record(record) => {
                observer.record(record);
                observer.reached(record.step());
                if let Record::Step(StepRecord { peak_velocity_m_per_s: Some(speed_m_per_s), .. }) = record {
                    peak_m_per_s = peak_m_per_s.max(*speed_m_per_s);
                }
                let is_row = matches!(record, Record::Row(_));
                rows += u64::from(is_row);
                if is_row && rows == MANY_ROWS {
                    observer
                        .notice(Notice::Warning("recording.series_every: ten million rows of series so far"));
                }
            }
            Item::Event(event) => {
                events += 1;
                observer.event(event);
            }
            Item::Checkpoint(_) => {}
        }
        writing.as_mut().map_or(Ok(()), |log| log.take(item))
    };
    let outcome = match threads {
        Threads::Several => crate::stream::run(|| source.next(), detectors, sink),
        Threads::One => crate::stream::run_in_turn(|| source.next(), detectors, sink),
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
    let status = if is_stopped { RunStatus::Interrupted } else { ending(plan, &*solver) };
    let report = || {
        let mut counts = counters.by_name();
        counts.extend((before.resumed > 0).then(|| ("resumed".to_owned(), before.resumed)));
        SolverReport { counts, fallbacks: fallbacks.iter().map(|&fallback| fallback.to_owned()).collect() }
    };
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
    if let Some(law) = plan.friction.law.rate_and_state()
        && events == 0
        && peak_m_per_s > EVENT_SPEED_RATIO * scenario.speed_at_start_m_per_s()
    {
        observer.notice(Notice::NoEvents { event_speed_m_per_s: law.event_speed_m_per_s, peak_m_per_s });
    }
    for fallback in fallbacks {
        observer.notice(Notice::Fallback(fallback));
    }
    Ok(Outcome { status, counters, has_run: true, end })
}

/// Counters of the run before it was resumed.
#[derive(Debug, Clone, Copy, Default)]
struct Before {
    counters: Counters,
    /// How often it had been resumed.
    resumed: u64,
}

/// The schedule of checkpoints.
struct Checkpoints {
    interval: Duration,
    /// When the first becomes useful.
    from: Instant,
    next: Instant,
    /// The rest of [`CHECKPOINT_BYTES`].
    left_bytes: f64,
    /// Whether the state has been written: without it, an interval of zero spends the bytes on one state.
    is_written: bool,
}

impl Checkpoints {
    fn every(interval: Duration, after: Duration) -> Checkpoints {
        let now = Instant::now();
        let (from, next) = (now + after, now + interval.max(after));
        Checkpoints { interval, from, next, left_bytes: CHECKPOINT_BYTES, is_written: false }
    }

    fn are_of_use(&self) -> bool {
        Instant::now() >= self.from
    }

    fn are_due(&self) -> bool {
        !self.is_written && Instant::now() >= self.next
    }

    /// The state is another one.
    fn gone_on(&mut self) {
        self.is_written = false;
    }

    /// Schedules the next checkpoint, later the larger this one is.
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
        self.is_written = true;
    }
}

/// Yields the records of a run: first those that go through the detectors again, then the solver's,
/// interspersed with checkpoints.
struct Source<'a> {
    solver: Box<dyn Solver>,
    stop: &'a (dyn Fn() -> bool + Sync),
    again: Option<Again>,
    before: Before,
    /// None without a log.
    checkpoints: Option<Checkpoints>,
    /// Whether the caller has requested a stop.
    is_asked_to_stop: bool,
    /// Whether the last checkpoint has been yielded and only the end is left.
    is_stopping: bool,
    /// Why the solver stopped: the run ends there, and detectors finish their events.
    stopped: Option<SimulationError>,
}

impl Source<'_> {
    /// Restores the solver from a checkpoint; the records before it are yielded first.
    fn go_on(&mut self, unfinished: &Unfinished, saved: Saved, state: &str) -> Result<(), RunError> {
        self.again = Some(Again::new(unfinished, saved.step(), state)?);
        self.before = Before { counters: saved.counters, resumed: saved.resumed };
        self.solver.restore(&saved.solver);
        if let Some(checkpoints) = &mut self.checkpoints {
            checkpoints.from = Instant::now();
        }
        Ok(())
    }

    fn next(&mut self) -> Result<Option<Item>, End> {
        self.is_asked_to_stop |= (self.stop)();
        let stop = self.is_asked_to_stop;
        if let Some(again) = &mut self.again {
            if stop {
                return Err(End::Stopped);
            }
            return match again.next_record().map_err(End::Log)? {
                Some(record) => Ok(Some(Item::Record(record))),
                None => {
                    self.again = None;
                    self.before.resumed += 1;
                    Ok(Some(Item::Checkpoint(self.checkpoint())))
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
                return Ok(Some(Item::Checkpoint(self.checkpoint())));
            }
            _ => {}
        }
        if let Some(checkpoints) = &mut self.checkpoints {
            checkpoints.gone_on();
        }
        match self.solver.next_record_unless(&Stop::when(self.stop)) {
            Ok(Next::Record(record)) => Ok(Some(Item::Record(record))),
            Ok(Next::End) => Ok(None),
            Ok(Next::Stopped) if self.solver.is_between_records() => {
                self.is_asked_to_stop = true;
                self.next()
            }
            Ok(Next::Stopped) => Err(End::Stopped),
            Err(error) => {
                self.stopped = Some(error);
                Ok(None)
            }
        }
    }

    fn checkpoint(&mut self) -> Checkpoint {
        let saved = Saved {
            solver: self.solver.snapshot(),
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
