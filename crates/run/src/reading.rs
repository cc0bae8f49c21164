//! Reads a log once: checks it, and meanwhile passes its sound part to an observer.

use std::path::Path;

use asperity_model::{Scenario, ScenarioSource};
use asperity_record::{Event, EventPayload, Observer, Record, RunHeader, Rupture, RupturesFrom};

use crate::check::{Checked, check_seen};
use crate::verdict::Verdict;

/// A log that has been read.
#[derive(Debug)]
pub struct Reading<O> {
    /// The verdict on it.
    pub checked: Checked,
    /// The observer.
    pub observer: O,
    /// Where the ruptures that it observed are from.
    pub ruptures_from: RupturesFrom,
}

/// A log that is not read.
#[derive(Debug, thiserror::Error)]
pub enum Unread<E> {
    /// It is not a run log, or could not be read.
    #[error("{0}")]
    NoRunLog(Box<Checked>),
    /// The caller refuses its verdict.
    #[error("{0}")]
    Refused(E),
    /// Nothing observes it.
    #[error("{problem}")]
    Unobserved {
        /// The verdict on it.
        verdict: Verdict,
        /// Why.
        problem: String,
    },
}

/// Reads a log. `begin` creates the observer from its header and scenario, or returns an error; `accept`
/// may refuse verdicts. Ruptures that a complete log of an older version lacks are passed at its end.
///
/// # Errors
/// If it is not a run log, cannot be read, is not accepted, or cannot be observed.
pub fn read_once<O: Observer, E>(
    log: &Path,
    begin: impl FnOnce(&RunHeader, &str) -> Result<O, String>,
    accept: impl FnOnce(&Checked) -> Result<(), E>,
) -> Result<Reading<O>, Unread<E>> {
    let mut passing = Passing { begin: Some(begin), observer: None, ruptures: Vec::new() };
    let checked = check_seen(log, &mut passing);
    let Passing { observer, ruptures, .. } = passing;
    if checked.verdict.tells_nothing() {
        return Err(Unread::NoRunLog(Box::new(checked)));
    }
    accept(&checked).map_err(Unread::Refused)?;
    let observer = observer.unwrap_or_else(|| {
        Err(checked.problem.as_ref().map_or_else(String::new, |problem| problem.to_string()))
    });
    let unobserved = |problem| Unread::Unobserved { verdict: checked.verdict, problem };
    let mut observer = observer.map_err(unobserved)?;
    let ruptures_from = if checked.seen.topics.iter().any(|topic| topic == Rupture::TOPIC) {
        RupturesFrom::Log
    } else if checked.verdict.holds_all() {
        ruptures.iter().for_each(|rupture| observer.event(rupture));
        RupturesFrom::Steps
    } else {
        RupturesFrom::None
    };
    Ok(Reading { checked, observer, ruptures_from })
}

/// The scenario of a log; none if it has lost it.
///
/// # Errors
/// In words, if it cannot be understood.
pub fn scenario_of(log: &Path, toml: &str) -> Result<Option<Scenario>, String> {
    if toml.is_empty() {
        return Ok(None);
    }
    let source = ScenarioSource::logged(format!("{}: scenario.toml", log.display()), toml);
    Scenario::resolve(&source).map(Some).map_err(|errors| errors.to_string())
}

/// Passes a log to an observer that is made when its header is known.
struct Passing<Begin, O> {
    begin: Option<Begin>,
    observer: Option<Result<O, String>>,
    /// Those that the log lacks.
    ruptures: Vec<Event>,
}

impl<O: Observer, Begin: FnOnce(&RunHeader, &str) -> Result<O, String>> Observer for Passing<Begin, O> {
    fn begins(&mut self, header: &RunHeader, scenario_toml: &str) {
        self.observer = self.begin.take().map(|begin| begin(header, scenario_toml));
    }

    fn record(&mut self, record: &Record) {
        if let Some(Ok(observer)) = &mut self.observer {
            observer.record(record);
        }
    }

    fn event(&mut self, event: &Event) {
        if let Some(Ok(observer)) = &mut self.observer {
            observer.event(event);
        }
    }

    fn lacking(&mut self, event: &Event) {
        if event.topic() == Rupture::TOPIC {
            self.ruptures.push(event.clone());
        }
    }

    fn is_done(&self) -> bool {
        matches!(&self.observer, Some(Ok(observer)) if observer.is_done())
    }
}
