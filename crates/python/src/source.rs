//! A run as the package reads it again: its log, or, without one, its scenario, which gives the same records
//! whenever it is run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use asperity_model::Scenario;
use asperity_record::{Event, Observer, Record, RunEnd, RunHeader};
use asperity_run::{
    Begin, Checked, Nodes, OpenLog, Reading, SolverKind, StatesError, Task, Verdict, read_once, run,
};
use asperity_runlog::{RunReader, Topics};
use pyo3::prelude::*;

use crate::attend::{Callbacks, Watch, attend};
use crate::errors::{failed, of_log, of_run, of_unread};

/// Where the records of a run come from.
#[derive(Clone)]
pub(crate) enum Source {
    /// Its log.
    Log {
        /// The path.
        path: PathBuf,
        /// The last step that was found sound.
        last_step: u64,
    },
    /// Its scenario.
    Scenario { scenario: Box<Scenario>, solver: SolverKind },
}

/// What an observer saw.
pub(crate) struct Seen<O> {
    pub(crate) observer: O,
    pub(crate) has_ruptures: bool,
    pub(crate) end: Option<RunEnd>,
    /// The verdict on the log.
    pub(crate) checked: Option<Checked>,
}

impl Source {
    /// Checks that a log is still that of the run with this header.
    ///
    /// # Errors
    /// If it is not.
    pub(crate) fn must_be_of(&self, py: Python<'_>, header: &RunHeader) -> PyResult<()> {
        let Source::Log { path, .. } = self else { return Ok(()) };
        let reader = py.detach(|| RunReader::open(path, Topics::NONE)).map_err(failed)?;
        match reader.header() == header {
            true => Ok(()),
            false => Err(failed(format!("{}: {ANOTHER}", path.display()))),
        }
    }

    /// All nodes of a slab, a sheet or a body at these times, s.
    ///
    /// # Errors
    /// If they cannot be computed.
    pub(crate) fn nodes(&self, at_s: &[f64]) -> Result<Nodes, StatesError> {
        match self {
            Source::Log { path, last_step } => Nodes::of_log(path, *last_step, at_s),
            Source::Scenario { scenario, solver } => Nodes::of_scenario(scenario, *solver, at_s),
        }
    }

    /// Passes the run to an observer, which `begin` makes.
    pub(crate) fn observe<O: Observer + Send>(
        &self,
        py: Python<'_>,
        header: &RunHeader,
        begin: impl FnOnce(&Arc<Watch>) -> O + Send,
    ) -> PyResult<Seen<O>> {
        match self {
            Source::Log { path, .. } => read(py, path, |watch, log| match log.header() == header {
                true => Ok(begin(watch)),
                false => Err(ANOTHER.to_owned()),
            }),
            Source::Scenario { scenario, solver } => {
                let steps = header.steps;
                let ran = attend(py, &Callbacks::default(), |watch| {
                    let mut observer = begin(watch);
                    let task = Task { solver: *solver, ..Task::new(scenario) };
                    let outcome = run(task, Begin::Anew, &|| watch.is_stopped(), &mut observer);
                    outcome.map(|outcome| (observer, outcome))
                })?;
                let (observer, outcome) = ran.map_err(of_run)?;
                let end = Some(outcome.into_end(steps));
                Ok(Seen { observer, has_ruptures: true, end, checked: None })
            }
        }
    }
}

const ANOTHER: &str = "it is the log of another run now";

/// Reads a log once, for an observer that `begin` makes.
pub(crate) fn read<O: Observer + Send>(
    py: Python<'_>,
    path: &Path,
    begin: impl FnOnce(&Arc<Watch>, &OpenLog) -> Result<O, String> + Send,
) -> PyResult<Seen<O>> {
    let read = attend(py, &Callbacks::default(), |watch| {
        let begin = |log: &OpenLog| begin(watch, log).map(|observer| Stoppable { observer, watch });
        let accept = |checked: &Checked| match checked.verdict {
            Verdict::Damaged => Err(of_log(path, checked)),
            _ => Ok(()),
        };
        let read = read_once(path, begin, accept);
        read.map(|Reading { checked, observer, has_ruptures }| (checked, observer.observer, has_ruptures))
    })?;
    let (checked, observer, has_ruptures) = read.map_err(|unread| of_unread(path, unread))?;
    Ok(Seen { observer, has_ruptures, end: checked.seen.end.clone(), checked: Some(checked) })
}

/// An observer that is done once its work is stopped.
pub(crate) struct Stoppable<'a, O> {
    pub(crate) observer: O,
    pub(crate) watch: &'a Watch,
}

impl<O: Observer> Observer for Stoppable<'_, O> {
    fn record(&mut self, record: &Record) {
        self.observer.record(record);
    }

    fn event(&mut self, event: &Event) {
        self.observer.event(event);
    }

    fn is_done(&self) -> bool {
        self.watch.is_stopped()
    }
}
