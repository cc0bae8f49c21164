//! A run of a plan, made: from its row to what is kept of it.

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use asperity_model::Scenario;
use asperity_record::{Event, EventPayload, Record, RunEnd, RunHeader, Rupture, SlipEvent, SolverReport};
use asperity_run::{
    Begin, CHECKPOINT_INTERVAL, KeepLog, LogTo, Notice, Observer, Outcome, RunError, Task, run,
};
use asperity_runlog::{Existing, WriteError};
use asperity_summary::{RupturesFrom, Slider, Summarizer};

use crate::plan::{Plan, Row};
use crate::staging;
use crate::stored::{line_of, pack};
use crate::sweep::Keep;

/// Work of a run from which on it keeps its unfinished log, and is gone on with instead of made
/// again: what a kill may cost, against what a log costs.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// What became of a run.
#[derive(Debug)]
pub enum Made {
    /// It is done.
    Done {
        /// What is kept of it, packed.
        content: Vec<u8>,
        /// How many slip events it had.
        events: u64,
    },
    /// It cannot be made, now or later, and why.
    Failed(String),
    /// It was stopped from outside.
    Stopped,
    /// Another process has been making it for so long that it is left to that one.
    ByAnother,
}

/// How runs are made.
#[derive(Clone, Copy)]
pub struct Ways<'a> {
    /// The folder of the plan, with [`staging`] in it.
    pub folder: &'a Path,
    /// What the summary needs to know of a scenario.
    pub slider: fn(&Scenario) -> Slider,
    /// Work of a run from which on it keeps its unfinished log, see [`PATIENCE`].
    pub patience: Duration,
    /// Whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Is told that a run goes on, instead of from its beginning.
    pub tell: &'a dyn Fn(Notice<'_>),
}

/// Makes a run, or goes on with what was begun of it. Once the result is on the disk, what is left
/// of it in [`staging`] is to be [cleared](staging::clear).
///
/// # Errors
/// If the system refuses something, which says nothing of the run.
pub fn make(plan: &Plan, row: &Row, ways: Ways<'_>) -> Result<Made, String> {
    let (scenario, header) = match plan.scenario(row) {
        Ok(planned) => planned,
        Err(reason) => return Err(format!("run {}: {reason}", row.run)),
    };
    let failed = |error: &dyn Error| format!("run {}: {error}", row.run);
    let path = staging::log(ways.folder, row.run);
    let mut made = make_from(Begin::GoOn, plan, row, (&scenario, &header), &path, ways);
    // What nobody can go on with, or is whole without having been noted down, is made again.
    if matches!(made.0, Err(RunError::Left(_)) | Ok(Outcome { has_run: false, .. })) {
        staging::discard(ways.folder, row.run).map_err(|error| failed(&error))?;
        made = make_from(Begin::Anew, plan, row, (&scenario, &header), &path, ways);
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
    let steps = header.steps;
    let end = outcome.end.unwrap_or_else(|| RunEnd {
        status: outcome.status,
        stopped: None,
        last_step: steps,
        message_counts: Default::default(),
        switches: outcome.counters.switches,
        energy: None,
        digest: String::new(),
        topic_digests: Default::default(),
        solver: SolverReport { counts: outcome.counters.by_name(), fallbacks: Vec::new() },
    });
    let summary = summarizer.finish(RupturesFrom::Log, Some(&end));
    let content = pack(&summary, &lines).map_err(|error| error.to_string())?;
    Ok(Made::Done { content, events: summary.event_count })
}

fn make_from<'a>(
    begin: Begin,
    plan: &Plan,
    row: &Row,
    (scenario, header): (&Scenario, &RunHeader),
    path: &Path,
    ways: Ways<'a>,
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
        // One that is kept anyway need not wait.
        after: if keeps(Keep::Log) { Duration::ZERO } else { ways.patience },
        ..LogTo::new(path)
    };
    // The other cores have runs of their own.
    let task = Task::new(scenario).on_one_thread().log_to(log);
    let summarizer = Summarizer::new(&row.run.to_string(), header, (ways.slider)(scenario));
    let (events, ruptures) = (keeps(Keep::Events), keeps(Keep::Ruptures));
    let mut kept = Kept { events, ruptures, summarizer, lines: String::new(), tell: ways.tell };
    (run(task, begin, ways.stop, &mut kept), kept)
}

/// Looks on at a run, for what is kept of it.
struct Kept<'a> {
    tell: &'a dyn Fn(Notice<'_>),
    events: bool,
    ruptures: bool,
    summarizer: Summarizer,
    lines: String,
}

impl Observer for Kept<'_> {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.summarizer.record(record);
        }
    }

    fn event(&mut self, event: &Event) {
        self.summarizer.event(event).expect("a detector of this program emits what its topic promises");
        let is_kept = match event.topic.as_str() {
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
