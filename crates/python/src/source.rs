//! A run as the package reads it again: its log, or, without one, its scenario, which gives the same records
//! whenever it is run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use asperity_model::Scenario;
use asperity_record::{Event, Observer, Record, RunEnd, RunHeader};
use asperity_run::{
    Begin, Checked, Field, NodeState, Nodes, OpenLog, Quantity, Reading, SolverKind, Span, StatesError, Task,
    Verdict, read_once, run,
};
use asperity_runlog::{RunReader, Topics};
use pyo3::prelude::*;

use crate::attend::{Callbacks, Watch, attend};
use crate::errors::{failed, of_log, of_run, of_states, of_unread};

/// Where the records of a run come from.
pub(crate) struct Source {
    /// The name of its scenario, or of its log.
    pub(crate) name: String,
    pub(crate) header: RunHeader,
    /// None for a log that has lost it.
    pub(crate) scenario: Option<Scenario>,
    /// Its log, and the last step that was found sound.
    pub(crate) log: Option<(PathBuf, u64)>,
}

impl Source {
    /// Its scenario.
    ///
    /// # Errors
    /// If its log has lost it.
    pub(crate) fn scenario(&self) -> PyResult<&Scenario> {
        self.scenario.as_ref().ok_or_else(|| failed(format!("{} has lost its scenario", self.name)))
    }

    /// What makes its records again, if it has no log.
    fn made_by(&self) -> (&Scenario, SolverKind) {
        let scenario = self.scenario.as_ref().expect("a run without a log is of a scenario");
        (scenario, SolverKind::named(&self.header.solver).unwrap_or_default())
    }

    /// Checks that its log is still that of the run.
    ///
    /// # Errors
    /// If it is not.
    pub(crate) fn must_be_unchanged(&self, py: Python<'_>) -> PyResult<()> {
        let Some((path, _)) = &self.log else { return Ok(()) };
        let reader = py.detach(|| RunReader::open(path, Topics::NONE)).map_err(failed)?;
        match *reader.header() == self.header {
            true => Ok(()),
            false => Err(failed(format!("{}: {ANOTHER}", path.display()))),
        }
    }

    /// All nodes of a slab, a sheet or a body at these times, s.
    ///
    /// # Errors
    /// If they cannot be computed.
    pub(crate) fn nodes(&self, py: Python<'_>, at_s: &[f64]) -> PyResult<Vec<NodeState>> {
        let found = attend(py, &Callbacks::default(), |watch| {
            let mut nodes = match &self.log {
                Some((path, last_step)) => Nodes::of_log(path, *last_step, at_s)?,
                None => Nodes::of_scenario(self.made_by().0, self.made_by().1, at_s)?,
            };
            let mut next = || nodes.next_state_unless(&|| watch.is_stopped()).transpose();
            std::iter::from_fn(&mut next).collect::<Result<_, StatesError>>()
        })?;
        found.map_err(of_states)
    }

    /// A quantity of all contacts over a range of steps.
    ///
    /// # Errors
    /// If it cannot be computed.
    pub(crate) fn field(&self, py: Python<'_>, quantity: Quantity, span: Span) -> PyResult<Field> {
        let field = attend(py, &Callbacks::default(), |watch| {
            let stop = || watch.is_stopped();
            match &self.log {
                Some((path, last_step)) => Field::of_log(path, *last_step, quantity, span, &stop),
                None => Field::of_scenario(self.made_by().0, self.made_by().1, quantity, span, &stop),
            }
        })?;
        field.map_err(of_states)
    }

    /// Passes the run to an observer, which `begin` makes. Returns whether ruptures were looked for and the end, if known.
    pub(crate) fn observe<O: Observer + Send>(
        &self,
        py: Python<'_>,
        begin: impl FnOnce(&Arc<Watch>) -> O + Send,
    ) -> PyResult<(O, bool, Option<RunEnd>)> {
        if let Some((path, _)) = &self.log {
            let read = read(py, path, |watch, log| match *log.header() == self.header {
                true => Ok(begin(watch)),
                false => Err(ANOTHER.to_owned()),
            })?;
            return Ok((read.observer, read.has_ruptures, read.checked.seen.end));
        }
        let (scenario, solver) = self.made_by();
        let ran = attend(py, &Callbacks::default(), |watch| {
            let mut observer = begin(watch);
            let task = Task { solver, ..Task::new(scenario) };
            let outcome = run(task, Begin::Anew, &|| watch.is_stopped(), &mut observer);
            outcome.map(|outcome| (observer, true, Some(outcome.into_end(self.header.steps))))
        })?;
        ran.map_err(of_run)
    }
}

const ANOTHER: &str = "it is the log of another run now";

/// Reads a log once, unless it is damaged, for an observer that `begin` makes.
pub(crate) fn read<O: Observer + Send>(
    py: Python<'_>,
    path: &Path,
    begin: impl FnOnce(&Arc<Watch>, &OpenLog) -> Result<O, String> + Send,
) -> PyResult<Reading<O>> {
    attend(py, &Callbacks::default(), |watch| {
        read_within(watch, path, |log| begin(watch, log), |verdict| verdict != Verdict::Damaged)
    })?
}

/// Reads a log once, as part of other work, if its verdict is fit for that.
pub(crate) fn read_within<O: Observer>(
    watch: &Watch,
    path: &Path,
    begin: impl FnOnce(&OpenLog) -> Result<O, String>,
    is_fit: impl Fn(Verdict) -> bool,
) -> PyResult<Reading<O>> {
    let begin = |log: &OpenLog| begin(log).map(|observer| Stoppable { observer, watch });
    let accept = |checked: &Checked| match is_fit(checked.verdict) {
        true => Ok(()),
        false => Err(of_log(path, checked)),
    };
    let Reading { checked, observer, has_ruptures } =
        read_once(path, &[], begin, accept).map_err(|unread| of_unread(path, unread))?;
    Ok(Reading { checked, observer: observer.observer, has_ruptures })
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
