//! The log of a run in progress: whether it is kept, and when it is started.
//!
//! Writing a log costs more than the steps of a short run. A log that only serves to resume a long
//! run, or to examine a failed one, is therefore started only once the run has taken some time;
//! until then records wait in memory.

use std::mem::{size_of, size_of_val, take};
use std::path::Path;
use std::time::Duration;

use asperity_model::Scenario;
use asperity_record::{EventKind, Record, RunEnd, RunHeader, RunStatus, SolverReport, Switch};
use asperity_runlog::{Existing, RunWriter, Unfinished, WriteError};
use asperity_simulator::SimulationError;

use crate::forecast::content;
use crate::stream::Item;

/// Default time between checkpoints.
pub const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(1);

/// The destination of a run's log.
#[derive(Debug, Clone, Copy)]
pub struct LogTo<'a> {
    /// Its path once complete; until then it is at [`partial_path`](asperity_runlog::partial_path).
    pub path: &'a Path,
    /// What to do with an existing log there.
    pub existing: Existing,
    /// Shortest computing time between two checkpoints.
    pub checkpoint_interval: Duration,
    /// Which logs are renamed to their path.
    pub keep: KeepLog,
    /// Computing time after which the run can be resumed. Before, records wait in memory, and a run
    /// that is stopped leaves no log.
    pub after: Duration,
}

impl<'a> LogTo<'a> {
    /// A new log, with about one checkpoint per second.
    pub fn new(path: &'a Path) -> LogTo<'a> {
        LogTo {
            path,
            existing: Existing::Refuse,
            checkpoint_interval: CHECKPOINT_INTERVAL,
            keep: KeepLog::Always,
            after: Duration::ZERO,
        }
    }
}

/// Which logs are renamed to their path at the end of their run. Others keep their temporary name,
/// so that the run can be resumed until the caller has stored its results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeepLog {
    /// All logs.
    Always,
    /// Logs of runs that the solver had to stop.
    IfStopped,
    /// No logs.
    Never,
}

/// Most bytes of records that wait in memory; beyond that the log is started.
const MOST_WAITING_BYTES: usize = 64 << 20;

/// The log of one run.
pub(crate) struct Log<'a> {
    to: LogTo<'a>,
    header: RunHeader,
    scenario: &'a Scenario,
    kinds: Vec<EventKind>,
    writer: Option<RunWriter>,
    /// Whether the run could be resumed from the log.
    has_checkpoint: bool,
    waiting: Vec<Item>,
    waiting_bytes: usize,
}

impl<'a> Log<'a> {
    /// The log of a new run.
    pub(crate) fn new(
        to: LogTo<'a>,
        unfinished: Option<Unfinished>,
        header: RunHeader,
        scenario: &'a Scenario,
        kinds: Vec<EventKind>,
    ) -> Result<Log<'a>, WriteError> {
        let (has_checkpoint, waiting, waiting_bytes) = (unfinished.is_some(), Vec::new(), 0);
        let mut log =
            Log { to, header, scenario, kinds, writer: None, has_checkpoint, waiting, waiting_bytes };
        if has_checkpoint || to.after.is_zero() {
            log.begin(unfinished)?;
        }
        Ok(log)
    }

    /// Writes or queues the next item. The first checkpoint starts the log.
    pub(crate) fn take(&mut self, item: Item) -> Result<(), WriteError> {
        let is_checkpoint = matches!(item, Item::Checkpoint(_));
        if self.writer.is_none() {
            self.waiting_bytes += bytes(&item);
            if !is_checkpoint && self.waiting_bytes < MOST_WAITING_BYTES {
                self.waiting.push(item);
                return Ok(());
            }
            self.begin(None)?;
        }
        self.has_checkpoint |= is_checkpoint;
        self.writer.as_mut().map_or(Ok(()), |writer| write(writer, &item))
    }

    fn begin(&mut self, unfinished: Option<Unfinished>) -> Result<(), WriteError> {
        let LogTo { path, existing, .. } = self.to;
        let scenario_toml = self.scenario.to_commented_toml();
        let (header, kinds, content) = (&self.header, &self.kinds, content(self.scenario));
        let mut writer = match unfinished {
            Some(left) => RunWriter::resume(left, existing, header, &scenario_toml, kinds, content)?,
            None => RunWriter::create(path, existing, header, &scenario_toml, kinds, content)?,
        };
        for item in take(&mut self.waiting) {
            write(&mut writer, &item)?;
        }
        self.writer = Some(writer);
        Ok(())
    }

    /// Closes the log after the last record; returns its end if it is kept.
    pub(crate) fn finish(
        mut self,
        status: RunStatus,
        stopped: Option<&SimulationError>,
        report: impl FnOnce() -> SolverReport,
    ) -> Result<Option<RunEnd>, WriteError> {
        let is_kept = match self.to.keep {
            KeepLog::Always => true,
            KeepLog::IfStopped => stopped.is_some(),
            KeepLog::Never => false,
        };
        if status == RunStatus::Interrupted {
            return self.interrupt(report());
        }
        if is_kept && self.writer.is_none() {
            self.begin(None)?;
        }
        let Some(writer) = self.writer.filter(|_| is_kept) else { return Ok(None) };
        writer.finish_stopped(status, stopped.map(ToString::to_string), report()).map(Some)
    }

    fn interrupt(self, report: SolverReport) -> Result<Option<RunEnd>, WriteError> {
        let Some(mut writer) = self.writer else { return Ok(None) };
        if self.has_checkpoint || self.to.after.is_zero() {
            return writer.finish(RunStatus::Interrupted, report).map(Some);
        }
        // Without a checkpoint nobody could resume from it.
        writer.discard()?;
        Ok(None)
    }

    /// After a failure, removes a log from which no run could be resumed.
    pub(crate) fn discard_if_empty(&mut self) {
        if let Some(writer) = &mut self.writer {
            writer.discard_if_empty();
        }
    }
}

pub(crate) fn write(writer: &mut RunWriter, item: &Item) -> Result<(), WriteError> {
    match item {
        Item::Record(record) => writer.record(record),
        Item::Event(event) => writer.event(event),
        Item::Checkpoint(checkpoint) => writer.checkpoint(checkpoint),
    }
}

/// Approximate memory of an item.
fn bytes(item: &Item) -> usize {
    let held = match item {
        Item::Record(Record::Step(record)) => record.switches.len() * size_of::<Switch>(),
        Item::Record(Record::Row(row)) => row.values.bytes(),
        // The state of all blocks has a third more.
        Item::Record(record) => {
            record.motion().map_or(0, |motion| motion.map(size_of_val).iter().sum::<usize>()) * 4 / 3
        }
        Item::Event(event) => event.bytes(),
        Item::Checkpoint(checkpoint) => checkpoint.state.len(),
    };
    size_of::<Item>() + held
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use crate::stream::Item;
    use asperity_model::Plan;
    use asperity_record::{Checkpoint, FieldRecord, Record, RunStatus, SolverReport};
    use asperity_runlog::partial_path;

    use super::{KeepLog, Log, LogTo, MOST_WAITING_BYTES};
    use crate::header::header;

    fn state(step: u64) -> Item {
        let zeros = || vec![0.0; 100];
        let state = FieldRecord {
            step,
            time_s: step as f64 * 1e-7,
            displacement_m: zeros(),
            velocity_m_per_s: zeros(),
            tangential_force_n: zeros(),
            normal_load_n: Vec::new(),
            stick_position_m: zeros(),
            detached: vec![0; 100],
            ..FieldRecord::default()
        };
        Item::Record(Record::Fields(Box::new(state)))
    }

    #[test]
    fn a_log_that_need_not_be_kept_is_begun_at_a_checkpoint_or_when_too_much_waits() {
        let folder = tempfile::tempdir().unwrap();
        let scenario = asperity_model::resolve::<&str>("default", &[]).unwrap();
        let header = header(&scenario, &Plan::new(&scenario), "fast");
        for (n, checkpoint_after) in [Some(3), None].into_iter().enumerate() {
            let path = folder.path().join(format!("{n}.mcap"));
            let after = Duration::from_secs(60);
            let to = LogTo { keep: KeepLog::Never, after, ..LogTo::new(&path) };
            let mut log = Log::new(to, None, header.clone(), &scenario, Vec::new()).unwrap();
            let mut steps = 0;
            while !partial_path(&path).exists() {
                assert!(log.waiting_bytes < MOST_WAITING_BYTES && log.waiting.len() == steps as usize);
                if checkpoint_after == Some(steps) {
                    log.take(Item::Checkpoint(Checkpoint { step: steps, state: "{}".to_owned() })).unwrap();
                } else {
                    log.take(state(steps)).unwrap();
                    steps += 1;
                }
            }
            assert!(log.waiting.is_empty());
            match checkpoint_after {
                Some(expected) => assert_eq!(steps, expected),
                // A state has between three and four kilobytes.
                None => assert!(
                    (MOST_WAITING_BYTES / 4000..MOST_WAITING_BYTES / 3000).contains(&(steps as usize))
                ),
            }
            // It keeps its temporary name; the caller removes it.
            assert_eq!(log.finish(RunStatus::Complete, None, SolverReport::default).unwrap(), None);
            assert!(partial_path(&path).exists() && !path.exists());
        }
    }
}
