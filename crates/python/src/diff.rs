//! Diffs of two runs, or of two folders of runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use asperity_diff::report::{self, Report};
use asperity_diff::run_log::{RunLog, Summarized};
use asperity_diff::sides::{self, PairBy};
use asperity_diff::{Settings, compare, page, policy::Policy, summary};
use asperity_files::{Existing, FileSet, Inputs, at_once};
use asperity_model::scenario::text;
use asperity_numbers::Summarizer;
use asperity_run::{OpenLog, Reading, Verdict};
use pyo3::prelude::*;

use crate::attend::{Callbacks, Watch, attend};
use crate::errors::{failed, refused};
use crate::run::Run;
use crate::source::read_within;
use crate::values::to_python;

/// Compares the events, ruptures and numbers of two runs, logs, or folders of logs (docs/run-logs.md).
#[pyfunction]
#[pyo3(signature = (old, new, *, policy = None, pair = "hash"))]
pub(crate) fn diff(
    py: Python<'_>,
    old: &Bound<'_, PyAny>,
    new: &Bound<'_, PyAny>,
    policy: Option<PathBuf>,
    pair: &str,
) -> PyResult<Diff> {
    let (old, new) = (side(old)?, side(new)?);
    let pair_by = match pair {
        "hash" => PairBy::Hash,
        "name" => PairBy::Name,
        other => return Err(refused(format!("pair = {other:?} (accepted: \"hash\", \"name\")"))),
    };
    let parsed = match &policy {
        None => Policy::default(),
        Some(path) => {
            let text = py
                .detach(|| text::read(path))
                .map_err(|error| refused(format!("{}: {error}", path.display())))?;
            Policy::parse(&path.display().to_string(), &text).map_err(refused)?
        }
    };
    let report = attend(py, &Callbacks::default(), |watch| {
        let mut paths = sides::logs(&old).map_err(failed)?;
        paths.extend(sides::logs(&new).map_err(failed)?);
        let logs = at_once(&paths, None, |path| match watch.is_stopped() {
            true => Err(failed("stopped")),
            false => read_log(path, watch, paths.len() == 2),
        })?;
        let logs: BTreeMap<PathBuf, Arc<RunLog>> =
            paths.iter().cloned().zip(logs.into_iter().map(Arc::new)).collect();
        let settings = Settings {
            policy: parsed,
            policy_file: policy,
            pair_by,
            keep_findings: page::FINDINGS_OF_A_CLASS,
            keep_matches: page::MATCHES_OF_A_RUN,
            matches_file: None,
            logs,
        };
        let files = FileSet::new(Existing::Refuse, Inputs::default());
        compare(&old, &new, &settings, &files).map(|compared| compared.report).map_err(refused)
    })??;
    Ok(Diff(report))
}

/// A path, or the log of a run.
fn side(side: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    match side.cast::<Run>() {
        Ok(run) => run.get().unchanged_log(side.py()).map(Path::to_owned),
        Err(_) => side.extract(),
    }
}

fn read_log(path: &Path, watch: &Watch, is_drawn: bool) -> PyResult<RunLog> {
    let begin = |log: &OpenLog| {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let scenario = log.scenario();
        let summarizer = scenario.map(|scenario| Summarizer::new(&name, log.header(), scenario));
        let drawn = log.scenario().ok().flatten().filter(|_| is_drawn);
        Ok(Summarized::begin(log.header(), log.scenario_toml(), summarizer, drawn))
    };
    let Reading { checked, observer, has_ruptures } = read_within(watch, path, begin, Verdict::holds_all)?;
    Ok(observer.finish(path, has_ruptures, checked.seen.end.as_ref()))
}

/// The differences of two sides; true if they are not within the policy.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Diff(Report);

#[pymethods]
impl Diff {
    /// Whether all differences are within the policy; without one, whether there are none.
    #[getter]
    fn is_within_policy(&self) -> bool {
        self.0.verdict == report::Verdict::WithinPolicy
    }

    /// What `asperity diff --format json` prints.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &serde_json::to_value(&self.0).map_err(failed)?)
    }

    /// The page that `asperity diff --page` writes.
    #[getter]
    fn page(&self, py: Python<'_>) -> String {
        py.detach(|| page::page(&self.0))
    }

    fn __bool__(&self) -> bool {
        !self.is_within_policy()
    }

    fn __repr__(&self) -> String {
        summary::lines(&self.0).iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    }
}
