//! A log that has been opened: its header and scenario are known, and no record has been read. It is read once: checked,
//! while its sound part passes to an observer.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use asperity_model::{Plan, Scenario, ScenarioErrors, ScenarioSource};
use asperity_record::{Event, EventPayload, Observer, RunHeader, Rupture};
use asperity_runlog::{RunReader, Topics};

use crate::check::{Checked, Seen};
use crate::self_check::{self, SelfCheckProblem};
use crate::verdict::Verdict;

/// An open log, whose scenario is resolved once for all that need it.
pub struct OpenLog {
    pub(crate) reader: RunReader,
    /// None if the log has lost it.
    pub(crate) scenario: Option<Result<Scenario, ScenarioErrors>>,
    /// The topics that alone are read, by the index; none for all, which are checked.
    pub(crate) skims: &'static [&'static str],
}

impl OpenLog {
    /// Opens a log.
    ///
    /// # Errors
    /// The verdict, if it has no header that can be read.
    pub fn open(log: &Path) -> Result<OpenLog, Box<Checked>> {
        OpenLog::to_skim(log, &[])
    }

    /// Opens a log of which [`OpenLog::check`] is to pass on the records and events of these topics alone, as
    /// [`RunReader::skim`] finds them, and to verify nothing; of all, verified, if there are none.
    ///
    /// # Errors
    /// As [`OpenLog::open`].
    pub fn to_skim(log: &Path, skims: &'static [&'static str]) -> Result<OpenLog, Box<Checked>> {
        let topics = if skims.is_empty() { Topics::ALL } else { Topics::NONE };
        let mut reader = RunReader::open(log, topics)
            .map_err(|error| Box::new(Checked::new(Seen::default(), None, Some(error.into()))))?;
        if skims.is_empty() {
            reader.read_ahead();
        }
        let toml = reader.scenario_toml();
        // That of a recording is no scenario.
        let scenario = (!toml.is_empty() && reader.header().sensors.is_none())
            .then(|| Scenario::resolve(&ScenarioSource::logged("scenario.toml", toml)));
        Ok(OpenLog { reader, scenario, skims })
    }

    /// The header of the run.
    pub fn header(&self) -> &RunHeader {
        self.reader.header()
    }

    /// The resolved scenario, as TOML; empty if the log has lost it.
    pub fn scenario_toml(&self) -> &str {
        self.reader.scenario_toml()
    }

    /// The scenario; none if the log has lost it.
    ///
    /// # Errors
    /// In words, if it cannot be understood.
    pub fn scenario(&self) -> Result<Option<&Scenario>, String> {
        self.scenario.as_ref().map(Result::as_ref).transpose().map_err(ToString::to_string)
    }

    /// The scenario, for what cannot do without.
    ///
    /// # Errors
    /// In words, if the log has lost it, or it cannot be understood.
    pub fn needed_scenario(&self) -> Result<&Scenario, String> {
        self.scenario()?.ok_or_else(|| "it has no attachment `scenario.toml`".to_owned())
    }

    /// The scenario, for what shows the run: of a recording, which has none, [`Scenario::of_recording`].
    ///
    /// # Errors
    /// As [`OpenLog::needed_scenario`].
    pub fn shown_scenario(&self) -> Result<Cow<'_, Scenario>, String> {
        match self.header().sensors {
            Some(_) => Ok(Cow::Owned(Scenario::of_recording(self.header(), self.scenario_toml()))),
            None => self.needed_scenario().map(Cow::Borrowed),
        }
    }

    /// Checks the scenario against the header, and returns its plan. By other code it may have meant something else, and
    /// is refused only if it names a file whose values it lacks.
    ///
    /// # Errors
    /// If it is invalid or of another run.
    pub(crate) fn self_check(&mut self, is_ours: bool) -> Result<Option<Plan>, SelfCheckProblem> {
        match self.scenario.take() {
            Some(Err(errors)) if is_ours || errors.lack_values() => Err(SelfCheckProblem::scenario(&errors)),
            Some(Ok(scenario)) if is_ours => {
                let plan = Plan::new(&scenario);
                self_check::agree(self.header(), self.scenario_toml(), &scenario, &plan)?;
                Ok(Some(plan))
            }
            _ => Ok(None),
        }
    }

    /// The topics of events that the log announces, with their JSON schemas, empty where there is none.
    pub fn event_schemas(&self) -> BTreeMap<&str, &str> {
        self.reader.event_schemas()
    }

    /// Checks the log as [`check`](crate::check()) does, and passes the records and events that it finds sound to an
    /// observer.
    pub fn check(self, observer: &mut dyn Observer) -> Checked {
        self.judge(false, observer, None)
    }

    /// Checks the log as [`OpenLog::check`] does and, if it is of this code version, repeats its run, as
    /// [`check_again`](crate::check_again) does.
    pub fn check_again(self, observer: &mut dyn Observer) -> Checked {
        self.judge(true, observer, None)
    }

    /// Checks the log, and repeats its run if so asked. `found` receives the events that the registered detectors find in
    /// the records, each after the record that completed it.
    pub(crate) fn judge(
        mut self,
        again: bool,
        observer: &mut dyn Observer,
        found: Option<&mut dyn FnMut(Event)>,
    ) -> Checked {
        let mut seen = Seen::default();
        let problem = seen.read(&mut self, again, observer, found).err();
        Checked::new(seen, Some(self.reader.header().clone()), problem)
    }
}

/// A log that has been read.
#[derive(Debug)]
pub struct Reading<O> {
    /// The verdict on it.
    pub checked: Checked,
    /// The observer.
    pub observer: O,
    /// Whether the log has a topic for ruptures. A log by other detectors may lack it.
    pub has_ruptures: bool,
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

/// Reads a log, opened by [`OpenLog::to_skim`]. `begin` creates the observer once it is open, or returns an error;
/// `accept` may refuse verdicts.
///
/// # Errors
/// If it is not a run log, cannot be read, is not accepted, or cannot be observed.
pub fn read_once<O: Observer, E>(
    log: &Path,
    skims: &'static [&'static str],
    begin: impl FnOnce(&OpenLog) -> Result<O, String>,
    accept: impl FnOnce(&Checked) -> Result<(), E>,
) -> Result<Reading<O>, Unread<E>> {
    let (checked, observer) = match OpenLog::to_skim(log, skims) {
        Ok(log) => {
            let mut observer = begin(&log);
            let checked = match &mut observer {
                Ok(observer) => log.check(observer),
                Err(_) => log.check(&mut ()),
            };
            (checked, observer)
        }
        Err(checked) => {
            let problem = checked.problem.as_ref().map_or_else(String::new, ToString::to_string);
            (*checked, Err(problem))
        }
    };
    if checked.verdict.tells_nothing() {
        return Err(Unread::NoRunLog(Box::new(checked)));
    }
    accept(&checked).map_err(Unread::Refused)?;
    let observer = observer.map_err(|problem| Unread::Unobserved { verdict: checked.verdict, problem })?;
    let has_ruptures = checked.seen.topics.iter().any(|topic| topic == Rupture::TOPIC);
    Ok(Reading { checked, observer, has_ruptures })
}
