//! Raises the exceptions of the package, which `asperity/errors.py` defines.

use std::fmt::Display;
use std::path::Path;

use asperity_model::{ResolveError, ScenarioErrors};
use asperity_run::{Checked, RunError, StatesError, Unread, Verdict};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// An exception of the package, by the name of its class.
pub(crate) fn error(class: &str, message: impl Display) -> PyErr {
    with(class, message, |_| Ok(()))
}

/// An exception whose attributes `fill` sets.
fn with(class: &str, message: impl Display, fill: impl FnOnce(&Bound<'_, PyDict>) -> PyResult<()>) -> PyErr {
    Python::attach(|py| {
        let make = || {
            let attributes = PyDict::new(py);
            fill(&attributes)?;
            let class = py.import("asperity.errors")?.getattr(class)?;
            let error = class.call((message.to_string(),), Some(&attributes))?;
            Ok(PyErr::from_value(error))
        };
        make().unwrap_or_else(|error| error)
    })
}

/// What the package raises where the command says what is accepted of an argument.
pub(crate) fn refused(message: impl Display) -> PyErr {
    error("Refused", message)
}

/// For something that failed although it was asked for rightly.
pub(crate) fn failed(message: impl Display) -> PyErr {
    error("Error", message)
}

/// For what pickle is not to copy.
pub(crate) fn not_pickled(what: &str, accepted: &str) -> PyErr {
    PyTypeError::new_err(format!("{what} is not pickled (accepted: {accepted})"))
}

/// For a log, with the verdict on it.
pub(crate) fn of_log(log: &Path, checked: &Checked) -> PyErr {
    of_verdict(Some(checked.verdict), format!("{}: {checked}", log.display()))
}

pub(crate) fn of_verdict(verdict: Option<Verdict>, message: String) -> PyErr {
    with("LogError", message, |set| set.set_item("verdict", verdict.map_or("none", Verdict::word)))
}

/// For a log that is not read.
pub(crate) fn of_unread(log: &Path, unread: Unread<PyErr>) -> PyErr {
    match unread {
        Unread::NoRunLog(checked) => of_log(log, &checked),
        Unread::Refused(error) => error,
        Unread::Unobserved { verdict, problem } => {
            let message = format!("{}: {problem}", log.display());
            if verdict.holds_all() { failed(message) } else { of_verdict(Some(verdict), message) }
        }
    }
}

/// For an invalid scenario, with every fault in it.
pub(crate) fn of_scenario(error: ResolveError) -> PyErr {
    match error {
        ResolveError::Scenario(errors) => of_faults(&errors),
        other => with("ScenarioError", other, |_| Ok(())),
    }
}

pub(crate) fn of_faults(errors: &ScenarioErrors) -> PyErr {
    with("ScenarioError", errors, |set| {
        let fault = |py, error: &asperity_model::source::ScenarioError| -> PyResult<Py<PyDict>> {
            let fault = PyDict::new(py);
            fault.set_item("place", &error.place)?;
            fault.set_item("key", &error.key)?;
            fault.set_item("problem", &error.problem)?;
            fault.set_item("accepted", &error.accepted)?;
            Ok(fault.unbind())
        };
        let faults: Vec<_> = errors.0.iter().map(|error| fault(set.py(), error)).collect::<PyResult<_>>()?;
        set.set_item("faults", faults)
    })
}

/// For a run that did not finish.
pub(crate) fn of_run(error: RunError) -> PyErr {
    match &error {
        RunError::Stopped { log } => {
            let log = log.clone();
            with("Interrupted", error, |set| set.set_item("log", log))
        }
        RunError::LogTarget(_) | RunError::Solver { .. } | RunError::Left(_) | RunError::Topic(_) => {
            refused(error)
        }
        _ => failed(error),
    }
}

/// For states that cannot be computed.
pub(crate) fn of_states(error: StatesError) -> PyErr {
    match error {
        StatesError::Log(_) | StatesError::Stopped(_) => failed(error),
        error => refused(error),
    }
}
