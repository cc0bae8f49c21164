//! Makes runs of a plan: the log of a run with a name, the packed result of any other.

use std::error::Error;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use asperity_files::create_folder;
use asperity_model::Scenario;
use asperity_numbers::{Slider, Summarizer};
use asperity_record::{Event, EventPayload, Record, RunHeader, Rupture, SlipEvent};
use asperity_run::study::Job;
use asperity_run::{
    Begin, CHECKPOINT_INTERVAL, KeepLog, LogTo, Notice, Observer, Outcome, RunError, Task, Threads, at_once,
    run,
};
use asperity_runlog::{Existing, WriteError};

use crate::file::Keep;
use crate::plan::{Plan, Row};
use crate::results::Results;
use crate::runs;
use crate::segment::{Kind, Writer};
use crate::staging;
use crate::stored::{line_of, pack, reason_kept};

/// Computing time from which on a run keeps its unfinished log, to be resumed instead of repeated: balances
/// the loss from a kill against the cost of a log.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The outcome of a run.
#[derive(Debug)]
pub enum Made {
    /// It is done.
    Done {
        /// Its packed result; none for a named run, whose result is its log.
        content: Option<Vec<u8>>,
        /// The number of its slip events.
        events: u64,
    },
    /// It cannot be made, now or later, and why.
    Failed(String),
    /// The caller stopped it.
    Stopped,
    /// Another process is still making it after a long time.
    ByAnother,
}

/// How runs are made.
#[derive(Clone, Copy)]
pub struct Ways<'a> {
    /// The folder of the plan, which contains [`staging`].
    pub folder: &'a Path,
    /// Computing time from which on a run keeps its unfinished log, see [`PATIENCE`].
    pub patience: Duration,
    /// Whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Called with the number of a run that resumes instead of starting from its beginning.
    pub tell: &'a (dyn Fn(u64, Notice<'_>) + Sync),
    /// Makes runs over axes a second time: from their beginning and without a log, so that nothing of the
    /// first time is used or replaced.
    pub again: bool,
}

/// Makes a run, or resumes it. Once the result is on disk, [clear](staging::clear) its log in
/// [`staging`].
///
/// # Errors
/// If the system refuses something, independent of the run.
fn make(plan: &Plan, row: &Row, ways: Ways<'_>) -> Result<Made, String> {
    let (scenario, header) = match plan.scenario(row) {
        Ok(planned) => planned,
        Err(reason) => return Err(format!("run {}: {reason}", row.run)),
    };
    if plan.named(row.run).is_some() {
        return make_named(plan, row, scenario, ways);
    }
    let failed = |error: &dyn Error| format!("run {}: {error}", row.run);
    let tell = |notice: Notice<'_>| (ways.tell)(row.run, notice);
    let path = staging::log(ways.folder, row.run);
    let mut made = make_from(Begin::GoOn, plan, row, (&scenario, &header), &path, ways, &tell);
    // A run that cannot be resumed, or whose whole log has no recorded result, is repeated.
    if matches!(made.0, Err(RunError::Left(_)) | Ok(Outcome { has_run: false, .. })) {
        staging::discard(ways.folder, row.run).map_err(|error| failed(&error))?;
        made = make_from(Begin::Anew, plan, row, (&scenario, &header), &path, ways, &tell);
    }
    let (outcome, Kept { summarizer, lines, .. }) = made;
    let is_kept = match &outcome {
        Ok(outcome) => outcome.end.is_some(),
        Err(RunError::Simulation { log, .. }) => log.is_some(),
        Err(_) => false,
    };
    if is_kept {
        staging::keep(ways.folder, row.run).map_err(|error| failed(&error))?;
    }
    let outcome = match outcome {
        Ok(outcome) => outcome,
        Err(RunError::Stopped { .. }) => return Ok(Made::Stopped),
        Err(RunError::Simulation { error, .. }) => return Ok(Made::Failed(error.to_string())),
        Err(RunError::Write(WriteError::Busy(_))) => return Ok(Made::ByAnother),
        Err(error) => return Err(failed(&error)),
    };
    let end = outcome.into_end(header.steps);
    let summary = summarizer.finish(true, Some(&end));
    let content = pack(&summary, &lines).map_err(|error| error.to_string())?;
    Ok(Made::Done { content: Some(content), events: summary.event_count })
}

/// Makes a run as [`make`] does, and stores its packed result, or why it failed, in this thread's segment,
/// which its first result creates.
fn make_and_store(
    plan: &Plan,
    row: &Row,
    ways: Ways<'_>,
    segment: &mut Option<Writer>,
) -> Result<Made, String> {
    // The panic has printed the place in the program.
    let made = catch_unwind(AssertUnwindSafe(|| make(plan, row, ways)))
        .unwrap_or_else(|_| Ok(Made::Failed("a defect of the program: the run panicked".to_owned())))?;
    let (kind, content) = match &made {
        Made::Done { content: Some(content), .. } => (Kind::Done, &content[..]),
        Made::Failed(reason) => (Kind::Failed, reason_kept(reason).as_bytes()),
        Made::Done { content: None, .. } | Made::Stopped | Made::ByAnother => return Ok(made),
    };
    let segment = match segment {
        Some(segment) => segment,
        none => none.insert(Writer::create(ways.folder, &plan.hash).map_err(|error| error.to_string())?),
    };
    let unwritten = |error| format!("failed to write a result: {error}");
    segment.add(kind, row, content).map_err(unwritten)?;
    if staging::is_begun(ways.folder, row.run) {
        segment.sync().map_err(unwritten)?;
        staging::clear(ways.folder, row.run).map_err(|error| error.to_string())?;
    }
    Ok(made)
}

/// Removes logs of runs that are no longer missing: left by processes that died between storing a result and
/// clearing its log, or whose run another process finished first.
///
/// # Errors
/// If the system refuses.
fn clear_done(folder: &Path, results: &Results) -> Result<(), String> {
    let left = staging::left(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut done = left.into_iter().filter(|run| !results.is_missing(*run));
    done.try_for_each(|run| staging::clear(folder, run)).map_err(|error| error.to_string())
}

/// Makes these runs on the threads of this process, one on each, and returns all results. `watch` is called after each
/// run that was not stopped, and decides whether another one begins.
///
/// # Errors
/// If the system refuses something, independent of a run.
pub fn make_runs(
    plan: &Plan,
    results: Results,
    runs: &[u64],
    jobs: Option<NonZeroUsize>,
    ways: Ways<'_>,
    watch: &(dyn Fn(u64, &Made) -> bool + Sync),
) -> Result<Results, String> {
    let folder = ways.folder;
    clear_done(folder, &results)?;
    if runs.is_empty() {
        return Ok(results);
    }
    // A hundred thousand of them take memory.
    drop(results);
    create_folder(&folder.join(staging::FOLDER)).map_err(|error| error.to_string())?;
    let next = AtomicUsize::new(0);
    let end = || next.store(runs.len(), Ordering::Relaxed);
    let worker = |_: &usize| {
        let mut segment = None;
        let mut make_all = || {
            while let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed)).filter(|_| !(ways.stop)()) {
                let made = make_and_store(plan, &plan.rows[*run as usize - 1], ways, &mut segment)?;
                if matches!(made, Made::Stopped) || !watch(*run, &made) {
                    end();
                }
            }
            Ok(())
        };
        let made: Result<(), String> = make_all();
        if made.is_err() {
            end();
        }
        let synced = segment.map_or(Ok(()), |mut segment| segment.sync().map_err(|error| error.to_string()));
        made.and(synced)
    };
    let jobs = jobs.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    let workers: Vec<usize> = (0..jobs.min(runs.len())).collect();
    at_once(&workers, NonZeroUsize::new(workers.len()), worker)?;
    let results = Results::read(folder, plan).map_err(|error| format!("{}: {error}", folder.display()))?;
    clear_done(folder, &results)?;
    Ok(results)
}

/// Makes a run that has a name, or resumes it, with its log among those of the study.
fn make_named(plan: &Plan, row: &Row, scenario: Scenario, ways: Ways<'_>) -> Result<Made, String> {
    let label = plan.label(row.run);
    let name = plan.named(row.run).map(|named| named.name.clone()).unwrap_or_default();
    let folder = ways.folder.join(runs::FOLDER);
    create_folder(&folder).map_err(|error| format!("{label}: {error}"))?;
    let tell = |notice: Notice<'_>| (ways.tell)(row.run, notice);
    let mut counted = Counted { events: 0, tell: &tell };
    let threads = Threads::One;
    let job = Job { name, scenario };
    match job.make(&folder, None, false, threads, ways.stop, &mut counted) {
        Ok(_) => Ok(Made::Done { content: None, events: counted.events }),
        Err(RunError::Stopped { .. }) => Ok(Made::Stopped),
        Err(RunError::Simulation { error, .. }) => Ok(Made::Failed(error.to_string())),
        Err(RunError::Write(WriteError::Busy(_))) => Ok(Made::ByAnother),
        Err(error) => Err(format!("{label}: {error}")),
    }
}

/// Counts the slip events of a run with a complete log.
struct Counted<'a> {
    events: u64,
    tell: &'a dyn Fn(Notice<'_>),
}

impl Observer for Counted<'_> {
    fn event(&mut self, event: &Event) {
        self.events += u64::from(event.topic() == SlipEvent::TOPIC);
    }

    fn notice(&mut self, notice: Notice<'_>) {
        if matches!(notice, Notice::GoesOn { .. }) {
            (self.tell)(notice);
        }
    }
}

fn make_from<'a>(
    begin: Begin,
    plan: &Plan,
    row: &Row,
    (scenario, header): (&Scenario, &RunHeader),
    path: &Path,
    ways: Ways<'_>,
    tell: &'a dyn Fn(Notice<'_>),
) -> (Result<Outcome, RunError>, Kept<'a>) {
    let keeps = |keep: Keep| plan.common.keep.contains(&keep);
    let log = LogTo {
        existing: Existing::Replace,
        checkpoint_interval: CHECKPOINT_INTERVAL.min(ways.patience),
        keep: match () {
            () if keeps(Keep::Log) => KeepLog::Always,
            () if keeps(Keep::LogOfFailed) => KeepLog::IfStopped,
            () => KeepLog::Never,
        },
        // A log that is kept anyway is started at once.
        after: if keeps(Keep::Log) { Duration::ZERO } else { ways.patience },
        ..LogTo::new(path)
    };
    // The other cores have runs of their own.
    let task = Task::new(scenario).on_one_thread();
    let task = if ways.again { task } else { task.log_to(log) };
    let summarizer = Summarizer::new(&row.run.to_string(), header, Slider::of(scenario));
    let (events, ruptures) = (keeps(Keep::Events), keeps(Keep::Ruptures));
    let mut kept = Kept { events, ruptures, summarizer, lines: String::new(), tell };
    (run(task, begin, ways.stop, &mut kept), kept)
}

/// Collects the result of a run from its records and events.
struct Kept<'a> {
    tell: &'a dyn Fn(Notice<'_>),
    events: bool,
    ruptures: bool,
    summarizer: Summarizer,
    lines: String,
}

impl Observer for Kept<'_> {
    fn record(&mut self, record: &Record) {
        self.summarizer.record(record);
    }

    fn event(&mut self, event: &Event) {
        self.summarizer.event(event);
        let is_kept = match event.topic() {
            SlipEvent::TOPIC => self.events,
            Rupture::TOPIC => self.ruptures,
            _ => false,
        };
        if is_kept {
            self.lines.push_str(&line_of(event));
        }
    }

    fn notice(&mut self, notice: Notice<'_>) {
        if matches!(notice, Notice::GoesOn { .. }) {
            (self.tell)(notice);
        }
    }
}
