//! Reads a log completely, judges it, and names what is wrong with it.

use std::fmt;
use std::path::Path;

use asperity_record::{
    Event, EventPayload, Observer, Record, RunEnd, RunHeader, RunStatus, Series, SlipEvent, counted,
    short_time,
};
use asperity_runlog::{LogError, LogItem, LogProblem, RunReader};

use crate::detectors::Settings;
use crate::event_check::{Difference, EventCheck, OtherDetectors};
use crate::header::is_ours;
use crate::open_log::OpenLog;
use crate::self_check::{self, Rerun, SelfCheckProblem};
use crate::verdict::Verdict;

/// The result of checking a log. [`Display`](fmt::Display) formats it, verdict first.
#[derive(Debug)]
pub struct Checked {
    /// The verdict.
    pub verdict: Verdict,
    /// The log's header, if it could be read.
    pub header: Option<RunHeader>,
    /// The part that was found sound.
    pub seen: Seen,
    /// Why the log is incomplete, if it is.
    pub problem: Option<CheckProblem>,
}

impl fmt::Display for Checked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.problem, self.verdict) {
            // The message contains the verdict already.
            (Some(problem), Verdict::NoRunLog) => write!(f, "{problem}"),
            (Some(problem), verdict) => write!(f, "{verdict}: {}: {problem}", self.seen),
            (None, _) if self.seen.is_skimmed => write!(f, "not verified: {}", self.seen),
            (None, verdict) => write!(f, "{verdict}: {}", self.seen),
        }
    }
}

/// Reads every byte of a log and judges it. All commands rely on this judgement:
///
/// - structure and checksums, counts and digests, every message against its schema;
/// - the order of steps and their times, and switches against the states of the blocks;
/// - the events against those that the detectors find in the step records and states;
/// - header and topics of a log of this code version against its own scenario.
///
/// Only [`check_again`] compares the records with the run itself.
pub fn check(log: &Path) -> Checked {
    OpenLog::open(log).map_or_else(|checked| *checked, |log| log.check(&mut ()))
}

/// Checks a log as [`check`] does and, if it is of this code version, repeats its run with the same solver:
/// every record and the status must agree. This costs about as much time as the run.
pub fn check_again(log: &Path) -> Checked {
    OpenLog::open(log).map_or_else(|checked| *checked, |log| log.check_again(&mut ()))
}

impl Checked {
    /// Whether the log has all of its run, and there is something to say about it all the same.
    pub fn has_note(&self) -> bool {
        self.verdict == Verdict::OtherCode
            || self.seen.is_skimmed
            || (self.verdict == Verdict::Whole && self.seen.rewritten_by.is_some())
    }

    pub(crate) fn new(seen: Seen, header: Option<RunHeader>, problem: Option<CheckProblem>) -> Checked {
        let is_ours = header.as_ref().is_some_and(is_ours);
        let verdict = match &problem {
            Some(problem) => problem.verdict(),
            None if is_ours && seen.other_detectors.is_none() => Verdict::Whole,
            None => Verdict::OtherCode,
        };
        Checked { verdict, header, seen, problem }
    }
}

/// Why a log is incomplete.
#[derive(Debug, thiserror::Error)]
pub enum CheckProblem {
    /// It cannot be read to its end.
    #[error("{}", .0.problem)]
    Log(#[from] LogError),
    /// A step that does not follow the previous one.
    #[error("step {step} follows step {before}")]
    Order {
        /// The step.
        step: u64,
        /// The previous step.
        before: u64,
    },
    /// A step whose time is not that of the step.
    #[error("step {step} is at {found_s} s, not {expected_s} s")]
    Time {
        /// The step.
        step: u64,
        /// The time in the record.
        found_s: f64,
        /// The time of the step.
        expected_s: f64,
    },
    /// The step records and states give other events.
    #[error("its steps give {0}")]
    Events(#[from] Difference),
    /// Topics of events that every log of this code version has, and this one lacks.
    #[error("{}, which this program emits, is not in it", .0.join(", "))]
    Topics(Vec<String>),
    /// It contradicts its own scenario.
    #[error(transparent)]
    SelfCheck(#[from] SelfCheckProblem),
    /// Its observer was done ([`Observer::is_done`]) before its end.
    #[error("the rest was not read")]
    Unread,
}

impl CheckProblem {
    pub(crate) fn verdict(&self) -> Verdict {
        match self {
            CheckProblem::Log(LogError { problem: LogProblem::Salvaged, .. }) => Verdict::Salvaged,
            CheckProblem::Log(LogError { problem: LogProblem::Stopped(_), .. }) => Verdict::Stopped,
            CheckProblem::Log(LogError { problem, .. }) if problem.is_early_end() => Verdict::Incomplete,
            CheckProblem::Log(LogError { problem, .. }) if problem.is_no_run_log() => Verdict::NoRunLog,
            CheckProblem::Log(LogError { problem: LogProblem::Io(_), .. }) => Verdict::Unreadable,
            CheckProblem::Unread => Verdict::Incomplete,
            _ => Verdict::Damaged,
        }
    }
}

/// The part of a log that has been read and found sound.
#[derive(Debug, Default)]
pub struct Seen {
    /// Whether only some topics were read, by the index, and nothing was verified.
    pub is_skimmed: bool,
    /// Number of records and events.
    pub messages: u64,
    /// The last step.
    pub last_step: u64,
    /// Its time, s.
    pub last_s: f64,
    /// Number of slip events.
    pub slips: u64,
    /// Number of events of all topics.
    pub events: u64,
    /// The code version that made the log, if it is not this one.
    pub other_code: Option<String>,
    /// The first difference between the events of a log of another code version and those found now.
    pub other_events: Option<Difference>,
    /// Topics of events that only the log or only this program has.
    pub other_detectors: OtherDetectors,
    /// Topics of events that the log announces.
    pub topics: Vec<String>,
    /// The library that the file names, if another program wrote it, or wrote it again.
    pub rewritten_by: Option<String>,
    /// The log's `run_end`, once it has been read; none of a damaged log.
    pub end: Option<RunEnd>,
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let messages = self.messages;
        if self.is_skimmed {
            return write!(f, "{messages} records and events found by the index of the file");
        }
        let (slips, step, time_s) =
            (counted(self.slips, "slip event"), self.last_step, short_time(self.last_s));
        write!(f, "{messages} records and events, {slips}, up to step {step} ({time_s} s)")?;
        if let Some(version) = &self.other_code {
            write!(f, ", by code version {}", shortened(version))?;
        }
        if let Some(Difference { number, .. }) = &self.other_events {
            write!(f, ", by another version, whose events differ from number {number} on")?;
        }
        if !self.other_detectors.is_none() {
            write!(f, ", {}", self.other_detectors)?;
        }
        if let Some(library) = &self.rewritten_by {
            write!(f, ", in a file that another program wrote (library {library:?})")?;
        }
        Ok(())
    }
}

/// The beginning of a hash, long enough to identify it in messages.
fn shortened(version: &str) -> String {
    version.chars().take(12).collect()
}

impl Seen {
    /// Reads a log, which has been read ahead to its first item, as [`OpenLog::judge`] does.
    pub(crate) fn read(
        &mut self,
        log: &mut OpenLog,
        again: bool,
        observer: &mut dyn Observer,
        found: Option<&mut dyn FnMut(Event)>,
    ) -> Result<(), CheckProblem> {
        let read = match log.skims {
            [] => self.read_items(log, again, observer, found),
            topics => self.skim(&mut log.reader, topics, observer),
        };
        let verdict = read.as_ref().err().map(CheckProblem::verdict);
        if !matches!(verdict, Some(Verdict::Damaged | Verdict::Unreadable)) {
            self.end = log.reader.end().cloned();
            self.topics = log.reader.event_topics().collect();
        }
        read
    }

    /// Passes on the records and events of these topics alone, as [`RunReader::skim`] finds them.
    fn skim(
        &mut self,
        reader: &mut RunReader,
        topics: &'static [&'static str],
        observer: &mut dyn Observer,
    ) -> Result<(), CheckProblem> {
        self.is_skimmed = true;
        let read = reader.skim(topics, &mut |item| {
            self.messages += 1;
            match item {
                LogItem::Record(record) => observer.record(&record),
                LogItem::Event(event) => observer.event(&event),
            }
        });
        self.topics = reader.event_topics().collect();
        Ok(read?)
    }

    fn read_items(
        &mut self,
        log: &mut OpenLog,
        again: bool,
        observer: &mut dyn Observer,
        mut found: Option<&mut dyn FnMut(Event)>,
    ) -> Result<(), CheckProblem> {
        let header = log.header().clone();
        let ours = is_ours(&header);
        self.rewritten_by = log.reader.rewritten_by().map(str::to_owned);
        self.other_code = (!ours).then(|| header.code_version.clone());
        let mut detectors = Settings::default().start(&header, log.scenario().unwrap_or(None));
        let mut both = Some(EventCheck::with(&detectors, &log.event_schemas()));
        let mut plan = log.self_check(ours)?.filter(|_| again);
        // A salvaged log may have lost its scenario; whether it was salvaged is known only later.
        let scenario_is_lost = log.scenario_toml().is_empty();
        let reader = &mut log.reader;
        // Events found in the current record, for those who asked.
        let mut new = Vec::new();
        let mut made_again = None;
        // The difference in a salvaged log, kept until the reader finds a gap that explains it.
        let mut differs = None;
        // The log of a stopped run contains all of its records.
        let mut stopped = None;
        loop {
            let item = match reader.next_item() {
                Ok(Some(item)) => item,
                Ok(None) => break,
                Err(salvaged @ LogError { problem: LogProblem::Salvaged, .. }) if differs.is_some() => {
                    if let Some(difference) = differs.filter(|_| !reader.says_lost()) {
                        self.events_differ(&header, difference)?;
                    }
                    return Err(salvaged.into());
                }
                Err(error @ LogError { problem: LogProblem::Stopped(_), .. }) => {
                    stopped = Some(error);
                    break;
                }
                Err(error) => return Err(error.into()),
            };
            if self.messages == 0 {
                made_again = plan.take().map(|plan| Rerun::new(plan, &header, reader.is_salvaged()));
                self.other_detectors = both.as_ref().map(EventCheck::other_detectors).unwrap_or_default();
                self.topics = reader.event_topics().collect();
            }
            if reader.has_gap() {
                // The gap may contain the beginning of an event.
                (both, differs) = (None, None);
            }
            match &item {
                LogItem::Event(event) => {
                    self.slips += u64::from(event.topic() == SlipEvent::TOPIC);
                    self.events += 1;
                    if let Some(both) = &mut both {
                        both.logged(event.clone());
                    }
                }
                LogItem::Record(record) => {
                    self.record(&header, record, reader.has_gap())?;
                    if let Some(made_again) = &mut made_again {
                        made_again.record(record)?;
                    }
                    if both.is_some() || found.is_some() {
                        detectors.observe(record, &mut |event| {
                            if found.is_some() {
                                new.push(event.clone());
                            }
                            if let Some(both) = &mut both {
                                both.found(event);
                            }
                        });
                    }
                }
            }
            if let Some(Err(difference)) = both.as_ref().map(EventCheck::compare) {
                if reader.is_salvaged() {
                    differs = Some(difference);
                } else {
                    self.events_differ(&header, difference)?;
                }
                both = None;
            }
            match &item {
                LogItem::Record(record) => {
                    observer.record(record);
                    observer.reached(record.step());
                    if let Some(found) = &mut found {
                        new.drain(..).for_each(found);
                    }
                }
                LogItem::Event(event) => observer.event(event),
            }
            self.messages += 1;
            if observer.is_done() {
                return Err(CheckProblem::Unread);
            }
        }
        if ours && scenario_is_lost {
            self_check::resolve(&header, "")?;
        }
        let end = reader.end();
        let status = end.map_or(RunStatus::Complete, |end| end.status);
        let why = end.and_then(|end| end.stopped.as_deref());
        // Without any message the loop has not started the rerun.
        if let Some(made) = made_again.or_else(|| plan.map(|plan| Rerun::new(plan, &header, false))) {
            made.finish(status, why)?;
        }
        if both.is_some() || found.is_some() {
            detectors.finish(&mut |event| {
                if let Some(found) = &mut found {
                    found(event.clone());
                }
                if let Some(both) = &mut both {
                    both.found(event);
                }
            });
        }
        if let Some(both) = both {
            self.other_detectors = both.other_detectors();
            // A log of this code version has all topics of its detectors, and may have more.
            if ours && !self.other_detectors.only_found.is_empty() {
                return Err(CheckProblem::Topics(self.other_detectors.only_found.clone()));
            }
            if let Err(difference) = both.finish() {
                self.events_differ(&header, difference)?;
            }
        }
        stopped.map_or(Ok(()), |error| Err(error.into()))
    }

    /// Events other than those of this program's detectors are damage, unless another code version
    /// found them.
    fn events_differ(&mut self, header: &RunHeader, difference: Difference) -> Result<(), CheckProblem> {
        if is_ours(header) {
            return Err(CheckProblem::Events(difference));
        }
        self.other_events = Some(difference);
        Ok(())
    }

    fn record(&mut self, header: &RunHeader, record: &Record, has_gap: bool) -> Result<(), CheckProblem> {
        let (step, time_s) = (record.step(), record.time_s());
        // States follow the step that they belong to; the first state precedes the run.
        let in_order = match record {
            // Contacts that slide at the start are recorded there, which may be in step 0.
            Record::Step(_) => step > self.last_step || self.messages == 0,
            // Only the reader knows whether that step may be missing.
            Record::Fields(_) if !has_gap => step == self.last_step || self.messages == 0,
            // A rupture's state may be the only record of its step.
            _ => step >= self.last_step || self.messages == 0,
        };
        if !in_order {
            return Err(CheckProblem::Order { step, before: self.last_step });
        }
        let expected_s = header.time_grid().time_s(step);
        // The step of the grid before it, and rounding.
        let is_of_series =
            matches!(record, Record::Row(row) if row.values.topic().starts_with(Series::TOPIC));
        let off_s = if is_of_series { 2.0 * header.time_step_s } else { 0.0 };
        if (time_s - expected_s).abs() > off_s {
            return Err(CheckProblem::Time { step, found_s: time_s, expected_s });
        }
        (self.last_step, self.last_s) = (step, expected_s);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{FieldRecord, Record, StepRecord};
    use asperity_testkit::{quiet_step, run_header};

    use super::{CheckProblem, Seen};

    fn step(step: u64) -> StepRecord {
        quiet_step(step, 0.5 * step as f64, 0.5)
    }

    fn fields(step: u64, velocity_m_per_s: f64) -> Record {
        Record::Fields(Box::new(FieldRecord {
            step,
            time_s: 0.5 * step as f64,
            displacement_m: vec![0.0; 2],
            velocity_m_per_s: vec![velocity_m_per_s; 2],
            tangential_force_n: vec![0.0; 2],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 2],
            detached: vec![0; 2],
            ..FieldRecord::default()
        }))
    }

    fn read(records: &[Record]) -> Result<(), CheckProblem> {
        let mut seen = Seen::default();
        records.iter().try_for_each(|record| {
            seen.record(&run_header(), record, false)?;
            seen.messages += 1;
            Ok(())
        })
    }

    #[test]
    fn what_no_run_writes_is_damage() {
        let wrong = |record: StepRecord| read(&[Record::Step(record)]).unwrap_err();
        assert!(
            read(&[fields(0, 0.0), Record::Step(step(1)), fields(1, 1.0), Record::Step(step(4))]).is_ok()
        );
        assert!(matches!(
            read(&[Record::Step(step(2)), Record::Step(step(2))]),
            Err(CheckProblem::Order { .. })
        ));
        assert!(matches!(read(&[Record::Step(step(2)), fields(3, 0.0)]), Err(CheckProblem::Order { .. })));
        assert!(matches!(wrong(StepRecord { time_s: 0.6, ..step(1) }), CheckProblem::Time { .. }));
    }
}
