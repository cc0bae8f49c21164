//! Makes runs of a plan: the log of a run with a name, the packed result of any other.

use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use asperity_files::{at_once, create_folder};
use asperity_model::Scenario;
use asperity_numbers::{RunOutcome, RunResult, Summarizer};
use asperity_record::{Event, Record, Rupture, SlipEvent};
use asperity_run::study::Job;
use asperity_run::{
    Begin, CHECKPOINT_INTERVAL, Derived, KeepLog, LogTo, Notice, Observer, Outcome, RunError, Task, Threads,
    run,
};
use asperity_runlog::{Existing, WriteError};

use crate::error::StudyError;
use crate::file::Keep;
use crate::plan::{Plan, Row};
use crate::results::Results;
use crate::runs;
use crate::segment::{Writer, packed};
use crate::staging;
use crate::watch::Watcher;

/// Computing time from which on a run keeps its unfinished log, to be resumed instead of repeated: balances
/// the loss from a kill against the cost of a log.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The outcome of a run.
#[derive(Debug)]
pub enum Made {
    /// It is done.
    Done,
    /// It cannot be made, now or later, and why.
    Failed(String),
    /// The caller stopped it.
    Stopped,
    /// Another process is still making it after a long time.
    ByAnother,
}

/// How runs are made.
#[derive(Clone, Copy)]
pub struct Making<'a> {
    /// The folder of the plan, which contains [`staging`].
    pub folder: &'a Path,
    /// How many at once; one per core by default.
    pub jobs: Option<NonZeroUsize>,
    /// How many may fail, if not all.
    pub max_fails: Option<u64>,
    /// Computing time from which on a run keeps its unfinished log, see [`PATIENCE`].
    pub patience: Duration,
    /// Makes runs over axes a second time: from their beginning and without a log, so that nothing of the
    /// first time is used or replaced.
    pub again: bool,
    /// Whoever waits for them.
    pub watcher: &'a dyn Watcher,
}

impl<'a> Making<'a> {
    /// Makes runs once, as many at once as there are cores.
    pub fn new(folder: &'a Path, watcher: &'a dyn Watcher) -> Making<'a> {
        Making { folder, jobs: None, max_fails: None, patience: PATIENCE, again: false, watcher }
    }

    /// Makes the missing ones of the runs that are asked for, and returns all results.
    ///
    /// # Errors
    /// As [`Making::make`]; if results cannot be read.
    pub fn make_missing(&self, plan: &Plan, is_asked: impl Fn(u64) -> bool) -> Result<Results, StudyError> {
        let results = Results::read(self.folder, plan)?;
        let missing: Vec<u64> = results.missing().filter(|run| is_asked(*run)).collect();
        self.make(plan, results, &missing)
    }

    /// Makes these runs on the threads of this process, one on each, and returns all results.
    ///
    /// # Errors
    /// If the system refuses something, independent of a run; if too many runs fail, or the caller stops.
    pub fn make(&self, plan: &Plan, results: Results, runs: &[u64]) -> Result<Results, StudyError> {
        let &Making { folder, watcher, max_fails, .. } = self;
        clear_done(folder, &results)?;
        if runs.is_empty() {
            return Ok(results);
        }
        // A hundred thousand of them take memory.
        drop(results);
        create_folder(&folder.join(staging::FOLDER))?;
        // One for each thread.
        let segments: Mutex<Vec<Writer>> = Mutex::default();
        let idle = || segments.lock().unwrap_or_else(PoisonError::into_inner);
        let failed = AtomicU64::new(0);
        let make = |run: &u64| {
            if watcher.is_stopped() {
                return Err(StudyError::Stopped);
            }
            let mut segment = idle().pop();
            let made = self.make_and_store(plan, &plan.rows[*run as usize - 1], &mut segment);
            idle().extend(segment);
            let made = made?;
            let note = |what: &str| watcher.note(&format!("{}: {what}", plan.label(*run)));
            watcher.over(&made);
            match (made, max_fails) {
                (Made::Stopped, _) => return Err(StudyError::Stopped),
                (Made::ByAnother, _) => note("left to another process, which is making it"),
                (Made::Failed(reason), most) => {
                    note(&reason.replace('\n', " "));
                    let failed = failed.fetch_add(1, Ordering::Relaxed) + 1;
                    if let Some(most) = most.filter(|most| failed > *most) {
                        return Err(StudyError::Failed(format!(
                            "more than {most} runs failed (--max-fails)"
                        )));
                    }
                }
                (Made::Done, _) => {}
            }
            Ok(())
        };
        watcher.begin(runs.len() as u64, 0);
        let made = at_once(runs, self.jobs, make);
        watcher.end();
        let synced = idle().iter_mut().try_for_each(|segment| segment.sync().map_err(unwritten));
        // Also of runs that another process has finished meanwhile, no log stays.
        let results = Results::read(folder, plan);
        let results = results.and_then(|results| clear_done(folder, &results).map(|()| results));
        match made.map(drop).and(synced) {
            Ok(()) | Err(StudyError::Stopped) if watcher.is_stopped() => {
                watcher.note("interrupted; called again, the command continues from here");
                Err(StudyError::Stopped)
            }
            made => made.and(results),
        }
    }

    /// Makes a run, or resumes it, and stores its result, or why it failed, in this thread's segment, which its first
    /// result creates. The result of a run with a name is its log.
    fn make_and_store(
        &self,
        plan: &Plan,
        row: &Row,
        segment: &mut Option<Writer>,
    ) -> Result<Made, StudyError> {
        // The panic has printed the place in the program.
        let made = catch_unwind(AssertUnwindSafe(|| match plan.named(row.run) {
            Some(named) => self.make_named(plan, row, &named.name).map(|made| (made, None)),
            None => self.make_numbered(plan, row),
        }));
        let panicked = || "a defect of the program: the run panicked".to_owned();
        let (mut made, outcome) = made.unwrap_or_else(|_| Ok((Made::Failed(panicked()), None)))?;
        let outcome = match (&made, outcome) {
            (Made::Failed(reason), _) => Err(reason.clone()),
            (_, Some(outcome)) => Ok(outcome),
            _ => return Ok(made),
        };
        let mut result = RunResult { run: row.run, id: row.id.clone().unwrap_or_default(), outcome };
        let content = packed(&result).or_else(|error| {
            made = Made::Failed(error.to_string());
            result.outcome = Err(error.to_string());
            packed(&result)
        });
        let segment = match segment {
            Some(segment) => segment,
            none => none.insert(Writer::create(self.folder, &plan.hash)?),
        };
        segment.add(row.run, result.outcome.is_ok(), &content.map_err(unwritten)?).map_err(unwritten)?;
        if staging::is_begun(self.folder, row.run) {
            segment.sync().map_err(unwritten)?;
            staging::clear(self.folder, row.run).map_err(StudyError::failed)?;
        }
        Ok(made)
    }

    /// Makes a run over axes, or resumes it. Once the result is on disk, [clear](staging::clear) its log in
    /// [`staging`].
    fn make_numbered(&self, plan: &Plan, row: &Row) -> Result<(Made, Option<RunOutcome>), StudyError> {
        let failed = |error: &dyn std::fmt::Display| StudyError::Failed(format!("run {}: {error}", row.run));
        let (scenario, derived) = plan.derive(row).map_err(|error| failed(&error))?;
        let path = staging::log(self.folder, row.run);
        let begin = |begin| self.make_from(begin, plan, row, (&scenario, &derived), &path);
        let mut made = begin(Begin::GoOn);
        // A run that cannot be resumed, or whose whole log has no recorded result, is repeated.
        if matches!(made.0, Err(RunError::Left(_)) | Ok(Outcome { has_run: false, .. })) {
            staging::discard(self.folder, row.run).map_err(|error| failed(&error))?;
            made = begin(Begin::Anew);
        }
        let (outcome, Kept { summarizer, slips, ruptures, .. }) = made;
        let is_kept = match &outcome {
            Ok(outcome) => outcome.end.is_some(),
            Err(RunError::Simulation { log, .. }) => log.is_some(),
            Err(_) => false,
        };
        if is_kept {
            staging::keep(self.folder, row.run).map_err(|error| failed(&error))?;
        }
        let outcome = match outcome {
            Ok(outcome) => outcome,
            Err(error) => return unmade(error, |error| failed(error)).map(|made| (made, None)),
        };
        let summary = summarizer.finish(true, Some(&outcome.into_end(derived.header.steps)));
        Ok((Made::Done, Some(RunOutcome { summary, slips, ruptures })))
    }

    fn make_from<'b>(
        &'b self,
        begin: Begin,
        plan: &'b Plan,
        row: &Row,
        (scenario, derived): (&Scenario, &Derived),
        path: &Path,
    ) -> (Result<Outcome, RunError>, Kept<'b>) {
        let keeps = |keep: Keep| plan.common.keep.contains(&keep);
        let log = LogTo {
            existing: Existing::Replace,
            checkpoint_interval: CHECKPOINT_INTERVAL.min(self.patience),
            keep: match () {
                () if keeps(Keep::Log) => KeepLog::Always,
                () if keeps(Keep::LogOfFailed) => KeepLog::IfStopped,
                () => KeepLog::Never,
            },
            // A log that is kept anyway is started at once.
            after: if keeps(Keep::Log) { Duration::ZERO } else { self.patience },
            ..LogTo::new(path)
        };
        // The other cores have runs of their own.
        let task = Task { derived: Some(derived), threads: Threads::One, ..Task::new(scenario) };
        let task = if self.again { task } else { task.log_to(log) };
        let mut kept = Kept {
            label: (plan, row.run),
            watcher: self.watcher,
            keeps: [Keep::Events, Keep::Ruptures].map(keeps),
            summarizer: Summarizer::new(&row.run.to_string(), &derived.header, Some(scenario)),
            slips: Vec::new(),
            ruptures: Vec::new(),
        };
        (run(task, begin, &|| self.watcher.is_stopped(), &mut kept), kept)
    }

    /// Makes a run that has a name, or resumes it, with its log among those of the study.
    fn make_named(&self, plan: &Plan, row: &Row, name: &str) -> Result<Made, StudyError> {
        let failed = |error: &dyn std::fmt::Display| StudyError::Failed(format!("run {name}: {error}"));
        let (scenario, _) = plan.scenario(row).map_err(|error| failed(&error))?;
        let folder = self.folder.join(runs::FOLDER);
        create_folder(&folder)?;
        let job = Job { name: name.to_owned(), scenario };
        let mut watched = self.watcher.run(&job);
        let stop = || self.watcher.is_stopped();
        match job.make(&folder, None, false, Threads::One, &stop, &mut *watched) {
            Ok(_) => Ok(Made::Done),
            Err(error) => unmade(error, |error| failed(error)),
        }
    }
}

/// What a run comes to that is not done, if the system did not refuse anything.
fn unmade(error: RunError, failed: impl FnOnce(&RunError) -> StudyError) -> Result<Made, StudyError> {
    match error {
        RunError::Stopped { .. } => Ok(Made::Stopped),
        RunError::Simulation { error, .. } => Ok(Made::Failed(error.to_string())),
        RunError::Write(WriteError::Busy(_)) => Ok(Made::ByAnother),
        error => Err(failed(&error)),
    }
}

fn unwritten(error: std::io::Error) -> StudyError {
    StudyError::Failed(format!("failed to write a result: {error}"))
}

/// Removes logs of runs that are no longer missing: left by processes that died between storing a result and
/// clearing its log, or whose run another process finished first.
fn clear_done(folder: &Path, results: &Results) -> Result<(), StudyError> {
    let begun = staging::begun(folder).map_err(StudyError::at(folder))?;
    let mut done = begun.into_keys().filter(|run| !results.is_missing(*run));
    done.try_for_each(|run| staging::clear(folder, run)).map_err(StudyError::failed)
}

/// Collects the result of a run from its records and events.
struct Kept<'a> {
    /// By which messages name it.
    label: (&'a Plan, u64),
    watcher: &'a dyn Watcher,
    /// Whether slip events and ruptures are kept.
    keeps: [bool; 2],
    summarizer: Summarizer,
    slips: Vec<SlipEvent>,
    ruptures: Vec<Rupture>,
}

impl Observer for Kept<'_> {
    fn record(&mut self, record: &Record) {
        self.summarizer.record(record);
    }

    fn event(&mut self, event: &Event) {
        self.summarizer.event(event);
        let [slips, ruptures] = self.keeps;
        self.slips.extend(event.get().filter(|_| slips).cloned());
        self.ruptures.extend(event.get().filter(|_| ruptures).cloned());
    }

    fn notice(&mut self, notice: Notice<'_>) {
        if matches!(notice, Notice::GoesOn { .. }) {
            let (plan, run) = self.label;
            self.watcher.note(&format!("{}: {notice}", plan.label(run)));
        }
    }
}
