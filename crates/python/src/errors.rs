//! Raises the exceptions of the package, which `asperity/errors.py` defines.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use asperity_model::scenario::source::ScenarioError;
use asperity_model::{ResolveError, ScenarioErrors};
use asperity_run::{Checked, RunError, StatesError, Unread, Verdict};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

/// An exception of the package, by the name of its class.
pub(crate) fn error(class: &str, message: impl Display) -> PyErr {
    with(class, message, [("", ""); 0])
}

/// An exception with these attributes.
fn with(class: &str, message: impl Display, attributes: impl for<'py> IntoPyDict<'py>) -> PyErr {
    Python::attach(|py| {
        let make = || {
            let attributes = attributes.into_py_dict(py)?;
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
    with("LogError", message, [("verdict", verdict.map_or("none", Verdict::word))])
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
pub(crate) fn of_scenario(refused: ResolveError) -> PyErr {
    match refused {
        ResolveError::Scenario(errors) => of_faults(&errors),
        other => error("ScenarioError", other),
    }
}

pub(crate) fn of_faults(errors: &ScenarioErrors) -> PyErr {
    let fault = |ScenarioError { place, key, problem, accepted }: &ScenarioError| {
        let problem = Some(problem.clone());
        let values = [place.clone(), key.clone(), problem, accepted.clone()];
        BTreeMap::from_iter(["place", "key", "problem", "accepted"].into_iter().zip(values))
    };
    with("ScenarioError", errors, [("faults", errors.0.iter().map(fault).collect::<Vec<_>>())])
}

/// For a run that did not finish.
pub(crate) fn of_run(error: RunError) -> PyErr {
    match &error {
        RunError::Stopped { log } => with("Interrupted", &error, [("log", log.clone())]),
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
