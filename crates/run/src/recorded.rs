//! The log of a recording: its step records pass through the detectors as those of a run do.

use std::fmt;
use std::iter;
use std::path::Path;

use asperity_record::{
    Event, EventPayload, LoadDrop, Observer, Record, Recorded, RunEnd, RunHeader, RunStatus, SolverReport,
    TimeGrid,
};
use asperity_runlog::{Content, Existing, RunWriter, WriteError};

use crate::check::{CheckProblem, Checked};
use crate::detectors::{Settings, event_kinds};
use crate::header::{RECORDING_CODE_VERSION, is_ours, run_id};
use crate::log::write;
use crate::open_log::OpenLog;
use crate::self_check::SelfCheckProblem;
use crate::stream::{Item, StreamError, run_in_turn};
use crate::verdict::Verdict;

/// Writes the log of a recording with these records, in order.
///
/// # Errors
/// If there is no next record, or the log cannot be written, or exists and must not be replaced.
pub fn write_recording<E>(
    recorded: Recorded,
    path: &Path,
    existing: Existing,
    records: impl Iterator<Item = Result<Record, E>>,
) -> Result<RunEnd, StreamError<E, WriteError>> {
    let Recorded { header, toml, inputs, drops } = recorded;
    let (sink, header) = (StreamError::Sink, named(header));
    let detectors = Settings::default().start(&header, None);
    let kinds = event_kinds(header.parts());
    let mut writer =
        RunWriter::create(path, existing, &header, &toml, &kinds, Content::States).map_err(sink)?;
    writer.inputs(inputs).map_err(sink)?;
    let mut given = in_order(header.time_grid(), drops, records);
    let written = run_in_turn(|| given.next().transpose(), detectors, |item| write(&mut writer, &item));
    match written {
        Ok(()) => writer.finish(RunStatus::Complete, SolverReport::default()).map_err(sink),
        Err(error) => {
            writer.discard().map_err(sink)?;
            Err(error)
        }
    }
}

/// Checks a log as [`OpenLog::check`] does, and compares it with this recording of its inputs, which has these records.
pub fn check_recording<E: fmt::Display>(
    recorded: Recorded,
    log: OpenLog,
    records: impl Iterator<Item = Result<Record, E>>,
) -> Checked {
    if !is_ours(log.header()) {
        return log.check(&mut ());
    }
    let header = named(recorded.header);
    let differs = (recorded.inputs != *log.reader.inputs() || header != *log.header())
        .then(|| (0, "is of other files, or has another header".to_owned()));
    let given = in_order(header.time_grid(), recorded.drops, records);
    let mut again = Again { given, step: 0, differs };
    let mut checked = log.check(&mut again);
    if checked.verdict == Verdict::Whole {
        again.step = header.steps;
        again.compare(None);
        if let Some((step, what)) = again.differs {
            checked.problem = Some(CheckProblem::SelfCheck(SelfCheckProblem::rerun(step, &what)));
            checked.verdict = Verdict::Damaged;
        }
    }
    checked
}

/// The header with code version and run id.
fn named(header: RunHeader) -> RunHeader {
    let mut header = RunHeader { code_version: RECORDING_CODE_VERSION.to_owned(), ..header };
    header.run_id = run_id(&header);
    header
}

/// Records with load drops among them, each behind the record of its end.
fn in_order<E>(
    grid: TimeGrid,
    drops: Vec<LoadDrop>,
    records: impl Iterator<Item = Result<Record, E>>,
) -> impl Iterator<Item = Result<Item, E>> {
    let (mut drops, mut records, mut last) = (drops.into_iter().peekable(), records.peekable(), None);
    iter::from_fn(move || {
        let is_over = records.peek().is_none();
        let is_due = |drop: &LoadDrop| is_over || last >= Some(grid.nearest_step(drop.end_s));
        if let Some(drop) = drops.next_if(is_due) {
            return Some(Ok(Item::Event(Event::new(drop))));
        }
        let next = records.next()?;
        last = next.as_ref().ok().map(Record::step);
        Some(next.map(Item::Record))
    })
}

/// Compares what a log has with what its recording gives again.
struct Again<G> {
    given: G,
    /// The step of the last record.
    step: u64,
    /// The first step that differs, and how.
    differs: Option<(u64, String)>,
}

impl<E: fmt::Display, G: Iterator<Item = Result<Item, E>>> Again<G> {
    fn compare(&mut self, logged: Option<Item>) {
        if self.differs.is_some() {
            return;
        }
        let what = match self.given.next().transpose() {
            Ok(given) if given == logged => return,
            Ok(Some(_)) if logged.is_none() => "gives an additional record".to_owned(),
            Ok(_) => "gives another record".to_owned(),
            Err(error) => format!("ends: {error}"),
        };
        self.differs = Some((self.step, what));
    }
}

impl<E: fmt::Display, G: Iterator<Item = Result<Item, E>>> Observer for Again<G> {
    fn record(&mut self, record: &Record) {
        self.step = record.step();
        self.compare(Some(Item::Record(record.clone())));
    }

    fn event(&mut self, event: &Event) {
        if event.topic() == LoadDrop::TOPIC {
            self.compare(Some(Item::Event(event.clone())));
        }
    }
}
