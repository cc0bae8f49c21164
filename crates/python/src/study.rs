//! Studies: many runs of one scenario, on all cores of this process.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileSet, Inputs, create_folder};
use asperity_record::{Cell, Column};
use asperity_study::plan::FILE;
use asperity_study::work::{Made, PATIENCE, Ways, make_runs};
use asperity_study::{Observer, Plan, Results, Study, collect};
use asperity_tables::batch::Batch;
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use serde_json::{Value, json};

use crate::attend::{Callbacks, attend};
use crate::errors::{failed, not_pickled, refused};
use crate::run::bar;
use crate::scenario::Scenario;
use crate::tables::Table;
use crate::values::{assigned, assignments, to_json};

/// Makes the runs of a study that are missing, on all cores, and returns its tables.
///
/// `study` is the file of a study, its folder (docs/sweeps.md), or, with `axes`, a scenario of which all
/// combinations of the values are run. `set` are values for all runs. `out` is the folder of plan and results,
/// where a later call, or `asperity sweep`, continues; without it they are temporary. Runs, ids and tables are
/// those of `asperity sweep`.
#[pyfunction]
#[pyo3(signature = (study, axes = None, *, set = None, keep = None, out = None, jobs = None, progress = None, stop = None))]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of the package")]
pub(crate) fn sweep(
    py: Python<'_>,
    study: &Bound<'_, PyAny>,
    axes: Option<&Bound<'_, PyMapping>>,
    set: Option<&Bound<'_, PyMapping>>,
    keep: Option<&Bound<'_, PyAny>>,
    out: Option<PathBuf>,
    jobs: Option<i64>,
    progress: Option<Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Sweep> {
    let jobs = jobs.map(|jobs| {
        let wanted = usize::try_from(jobs).ok().and_then(NonZeroUsize::new);
        wanted.ok_or_else(|| refused(format!("jobs = {jobs} (accepted: a whole number from 1)")))
    });
    let jobs = jobs.transpose()?;
    let (given, written) = match (study.cast::<Scenario>(), axes) {
        (Ok(scenario), Some(axes)) => {
            let (name, values) = scenario.get().given_as()?;
            (name.into(), Some(text(name, values, axes, set, keep)?))
        }
        (Ok(_), None) => return Err(refused("a scenario alone is no study (accepted: with axes)")),
        (Err(_), Some(axes)) => {
            let name: PathBuf = study.extract()?;
            let written = text(&name, &[], axes, set, keep)?;
            (name, Some(written))
        }
        (Err(_), None) => (study.extract::<PathBuf>()?, None),
    };
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
        let missing: Vec<u64> = results.missing().collect();
        watch.reached((plan.rows.len() - missing.len()) as u64);
        plan.check_code(&folder).map_err(|error| error.to_string())?;
        let stop = || watch.is_stopped();
        let ways = Ways { folder: &folder, patience: PATIENCE, stop: &stop, tell: &|_, _| (), again: false };
        let watch = |_, _: &Made| {
            watch.one_more();
            true
        };
        make_runs(&plan, results, &missing, jobs, ways, &watch).map(|_| stop())
    })?;
    if made.map_err(failed)? {
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
    let table = |(name, columns, batch): &(&str, Vec<Column>, Batch)| Table::of(name, columns, batch);
    let tables = py.detach(|| tables.0.iter().map(table).collect());
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
    values: &[(String, Value)],
    axes: &Bound<'_, PyMapping>,
    set: Option<&Bound<'_, PyMapping>>,
    keep: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    let keep = match keep {
        None => vec!["events".to_owned(), "ruptures".to_owned()],
        Some(keep) => keep.extract::<String>().map(|keep| vec![keep]).or_else(|_| keep.extract())?,
    };
    if let Some(unknown) = keep.iter().find(|keep| !KEPT.contains(&keep.as_str())) {
        return Err(refused(format!("keep = {unknown:?} (accepted: {})", KEPT.join(", "))));
    }
    let set = values.iter().cloned().chain(assignments(set, None)?);
    let set: Vec<String> = set.map(|(key, value)| assigned(&key, &value)).collect();
    let mut axis = Vec::new();
    for pair in axes.items()?.try_iter()? {
        let (key, values): (String, Bound<'_, PyAny>) = pair?.extract()?;
        let values = match to_json(&values, &key)? {
            Value::Array(values) if !values.is_empty() => values,
            value => {
                return Err(refused(format!(
                    "axes: {key} = {value} (accepted: a list of one value or more)"
                )));
            }
        };
        if let Some(value) = values.iter().find(|value| !(value.is_number() || value.is_string())) {
            return Err(refused(format!("axes: {key} has {value} (accepted: numbers or texts)")));
        }
        axis.push(json!({ "key": key, "values": values }));
    }
    let scenario = scenario.to_str().ok_or_else(|| {
        let accepted = "a path in UTF-8, since the plan of a study names it";
        refused(format!("{} (accepted: {accepted})", scenario.display()))
    })?;
    let title = format!("{scenario}: study");
    let study = json!({ "title": title, "scenario": scenario, "keep": keep, "set": set, "axis": axis });
    toml::to_string(&study).map_err(failed)
}

/// What may be kept of runs.
const KEPT: [&str; 5] = ["events", "ruptures", "summary", "log", "log-of-failed"];

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
    fn __reduce__(&self) -> PyResult<()> {
        Err(not_pickled("a study", "its tables, such as its runs, or the path of its folder"))
    }

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

    /// The slip events of all runs, with the values that vary.
    #[getter]
    fn events(&self) -> PyResult<Table> {
        self.table("events")
    }

    /// The ruptures of all runs, with the values that vary.
    #[getter]
    fn ruptures(&self) -> PyResult<Table> {
        self.table("ruptures")
    }

    fn __repr__(&self) -> String {
        self.tables.iter().map(Table::summary).collect::<Vec<_>>().join("\n")
    }
}
