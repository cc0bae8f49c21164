//! Studies: many runs of one scenario, on all cores of this process.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileSet, Inputs, create_folder};
use asperity_record::{Cell, Column};
use asperity_study::plan::FILE;
use asperity_study::work::{Made, make_missing};
use asperity_study::{Observer, Plan, Results, Study, collect};
use asperity_tables::batch::Batch;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::attend::{Callbacks, attend};
use crate::errors::{failed, refused};
use crate::run::bar;
use crate::tables::Table;
use crate::values::{assignments, to_json};

/// Makes the runs of a study that are missing, on all cores, and returns its tables.
///
/// `study` is the file of a study, its folder (docs/sweeps.md), or, with `axes`, a scenario of which all
/// combinations of the values are run. `set` are values for all runs. `out` is the folder of plan and results,
/// where a later call, or `asperity sweep`, continues; without it they are temporary. Runs, ids and tables are
/// those of `asperity sweep`.
#[pyfunction]
#[pyo3(signature = (study, axes = None, *, set = None, keep = vec!["events".into(), "ruptures".into()], out = None, jobs = None, progress = None, stop = None))]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of the package")]
pub(crate) fn sweep(
    py: Python<'_>,
    study: &Bound<'_, PyAny>,
    axes: Option<&Bound<'_, PyDict>>,
    set: Option<&Bound<'_, PyDict>>,
    keep: Vec<String>,
    out: Option<PathBuf>,
    jobs: Option<NonZeroUsize>,
    progress: Option<Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Sweep> {
    let given: PathBuf = study.extract()?;
    let written = axes.map(|axes| text(&given, axes, set, &keep)).transpose()?;
    // A folder of a study that has been planned.
    let is_folder = written.is_none() && given.join(FILE).exists();
    let mut temporary = None;
    let folder = match out {
        _ if is_folder => given.clone(),
        Some(out) => out,
        None => {
            let created = py.import("tempfile")?.getattr("TemporaryDirectory")?.call0()?;
            let name = created.getattr("name")?.extract()?;
            temporary = Some(created.unbind());
            name
        }
    };
    let plan = attend(py, &Callbacks::default(), |_| match is_folder {
        true => Plan::read(&folder).map_err(refused),
        false => planned(&given, written.as_deref(), &folder, jobs),
    })??;
    let callbacks = Callbacks { progress: bar(py, progress, "sweep")?, stop, total: plan.rows.len() as u64 };
    let made = attend(py, &callbacks, |watch| {
        let results = Results::read(&folder, &plan).map_err(|error| error.to_string())?;
        let missing = results.missing().count() as u64;
        watch.reached(plan.rows.len() as u64 - missing);
        make_missing(&plan, &folder, jobs, &|| watch.is_stopped(), &|_, _: &Made| watch.one_more())
    })?;
    if !made.map_err(failed)? {
        let folder = folder.display();
        return Err(crate::errors::error(
            "Interrupted",
            format!("stopped; {folder} contains the runs so far"),
        ));
    }
    let mut tables = Tables(Vec::new());
    attend(py, &Callbacks::default(), |_| {
        let results = Results::read(&folder, &plan).map_err(failed)?;
        let files = FileSet::new(Existing::Refuse, Inputs::default());
        collect(&plan, &results, &files, &folder, &[], &mut tables).map(drop).map_err(failed)
    })??;
    let tables = tables.0.iter().map(|(name, columns, batch)| Table::of(name, columns, batch)).collect();
    Ok(Sweep { folder, tables, temporary })
}

/// The plan of a study in a folder: that which is there, if it is of this study, or a new one.
fn planned(given: &Path, written: Option<&str>, folder: &Path, jobs: Option<NonZeroUsize>) -> PyResult<Plan> {
    let study = match written {
        Some(text) => Study::parse(text, Path::new(".")).map_err(refused)?,
        None => Study::read(given).map_err(refused)?,
    };
    let plan = Plan::of(&study, false, jobs).map_err(refused)?;
    if !folder.join(FILE).exists() {
        create_folder(folder).map_err(failed)?;
        plan.write(folder, Inputs::of([given])).map_err(failed)?;
    } else if Plan::read(folder).map_err(refused)?.hash != plan.hash {
        let folder = folder.display();
        return Err(refused(format!(
            "out = {folder}: it has the plan of another study, or by other code (accepted: another folder)"
        )));
    }
    Ok(plan)
}

/// A study as TOML: a scenario over axes.
fn text(
    scenario: &Path,
    axes: &Bound<'_, PyDict>,
    set: Option<&Bound<'_, PyDict>>,
    keep: &[String],
) -> PyResult<String> {
    let mut study = toml::Table::new();
    let scenario = scenario.display().to_string();
    study.insert("title".into(), format!("{scenario}: study").into());
    study.insert("scenario".into(), scenario.into());
    study.insert("keep".into(), keep.to_vec().into());
    let set = assignments(set, None)?;
    let set: Vec<String> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
    study.insert("set".into(), set.into());
    let mut axis = Vec::new();
    for (key, values) in axes {
        let values = match to_json(&values)? {
            Value::Array(values) => values,
            value => vec![value],
        };
        let values = toml::Value::try_from(values).map_err(refused)?;
        let key = toml::Value::from(key.extract::<String>()?);
        axis.push(toml::Value::Table(
            [("key".to_owned(), key), ("values".to_owned(), values)].into_iter().collect(),
        ));
    }
    study.insert("axis".into(), axis.into());
    toml::to_string(&study).map_err(failed)
}

/// Keeps the tables of a study in memory.
struct Tables(Vec<(&'static str, Vec<Column>, Batch)>);

impl Observer for Tables {
    fn begin(&mut self, table: &'static str, columns: &[Column]) {
        self.0.push((table, columns.to_vec(), Batch::new(columns)));
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) {
        if let Some((.., batch)) = self.0.iter_mut().find(|(name, ..)| *name == table) {
            batch.push(cells);
        }
    }
}

/// The tables of a study.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Sweep {
    folder: PathBuf,
    tables: Vec<Table>,
    /// The folder's object in Python, which removes the folder with the study.
    temporary: Option<Py<PyAny>>,
}

impl Sweep {
    fn table(&self, name: &str) -> PyResult<Table> {
        let found = self.tables.iter().find(|table| table.is_called(name)).cloned();
        found.ok_or_else(|| refused(format!("the study keeps no {name} (accepted: keep=[{name:?}])")))
    }
}

#[pymethods]
impl Sweep {
    /// The folder of plan and results; None if it is temporary.
    #[getter]
    fn folder(&self) -> Option<&Path> {
        self.temporary.is_none().then_some(&self.folder)
    }

    /// A row for each run: the values that vary, how it ended, its numbers.
    #[getter]
    fn runs(&self) -> PyResult<Table> {
        self.table("runs")
    }

    #[getter]
    fn events(&self) -> PyResult<Table> {
        self.table("events")
    }

    #[getter]
    fn ruptures(&self) -> PyResult<Table> {
        self.table("ruptures")
    }

    fn __repr__(&self) -> String {
        self.tables.iter().map(Table::summary).collect::<Vec<_>>().join("\n")
    }
}
