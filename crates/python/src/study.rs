//! Studies: many runs of one scenario, on all cores of this process.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use asperity_numbers::{Summary, text};
use asperity_record::{Cell, Column};
use asperity_study::plan::FILE;
use asperity_study::refine::{make, study_of, table};
use asperity_study::work::{Made, Making};
use asperity_study::{Outputs, Plan, Reproduction, Results, RowSink, Study, StudyError, Watcher, collect};
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use serde_json::{Value, json};

use crate::attend::{Callbacks, Watch, attend};
use crate::errors::{error as error_of, failed, not_pickled, refused};
use crate::scenario::{Scenario, summary_of};
use crate::tables::Table;
use crate::values::{self, DEEPEST, assignments, items, to_json};

/// Makes the runs of a study that are missing, on all cores, and returns its tables.
///
/// `study` is the file of a study, its folder (docs/studies.md), or, with `axes`, a scenario of which all
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
    let jobs = at_once(jobs)?;
    let (given, values) = match study.cast::<Scenario>() {
        Ok(_) if axes.is_none() => {
            return Err(refused("a scenario alone is no study (accepted: with axes)"));
        }
        Ok(scenario) => scenario.get().given_as()?.clone(),
        Err(_) => (study.extract()?, Vec::new()),
    };
    let written = axes.map(|axes| of_axes(&given, &values, axes, set, keep)).transpose()?;
    // A folder of a study that has been planned.
    let is_folder = written.is_none() && given.join(FILE).exists();
    let (folder, temporary) = folder_of(py, if is_folder { Some(given.clone()) } else { out })?;
    let plan = attend(py, &Callbacks::default(), |_| match is_folder {
        true => Plan::read(&folder),
        false => {
            let study = parsed(&given, written.as_deref())?;
            Plan::begun(&study, &given, &folder, false, jobs).map(|(plan, _)| plan)
        }
    })?;
    let plan = plan.map_err(|error| of_study(error, &folder))?;
    let callbacks = Callbacks::new(py, "sweep", progress, stop, plan.rows.len() as u64)?;
    let made = attend(py, &callbacks, |watch| {
        plan.check_code(&folder)?;
        let results = Results::read(&folder, &plan)?;
        let missing: Vec<u64> = results.missing().collect();
        watch.done.store((plan.rows.len() - missing.len()) as u64, Ordering::Relaxed);
        let results = Making { jobs, ..Making::new(&folder, &**watch) }.make(&plan, results, &missing)?;
        let mut tables = Tables(Vec::new());
        collect(&plan, &results, &mut tables)?;
        Ok((results, tables.0.iter().map(Table::of).collect()))
    })?;
    let (results, tables) = made.map_err(|error| of_study(error, &folder))?;
    Ok(Sweep { plan, results, folder, tables, temporary })
}

/// Makes the runs of a scenario's refinement that are missing, on all cores, and returns the table of what each number is
/// worth (docs/findings.md): its values on each mesh, its changes, and its class as found and as stated.
///
/// `scenario` is a scenario, its name or its file; `set` are other values. `out` is the folder of runs, table, figure and
/// page, where a later call, or `asperity refine`, continues; without it they are temporary.
#[pyfunction]
#[pyo3(signature = (scenario, out = None, *, set = None, jobs = None, progress = None, stop = None))]
pub(crate) fn refine(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    out: Option<PathBuf>,
    set: Option<&Bound<'_, PyMapping>>,
    jobs: Option<i64>,
    progress: Option<Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Table> {
    let jobs = at_once(jobs)?;
    let scenario = Scenario::new(py, Some(scenario), set, None)?.resolved;
    let (study, _) = study_of(&scenario).map_err(refused)?;
    // A temporary folder stays until the table is made.
    let (folder, _temporary) = folder_of(py, out)?;
    let callbacks = Callbacks::new(py, "refine", progress, stop, study.count())?;
    let made = attend(py, &callbacks, |watch| {
        make(&study, Path::new(&scenario.name), &Making { jobs, ..Making::new(&folder, &**watch) })
    })?;
    let (refined, _) = made.map_err(|error| of_study(error, &folder))?;
    Ok(Table::of(&table(&refined)))
}

/// A folder, or else a temporary one and its object in Python, which removes it.
fn folder_of(py: Python<'_>, given: Option<PathBuf>) -> PyResult<(PathBuf, Option<Py<PyAny>>)> {
    if let Some(folder) = given {
        return Ok((folder, None));
    }
    let created = py.import("tempfile")?.getattr("TemporaryDirectory")?.call0()?;
    Ok((created.getattr("name")?.extract()?, Some(created.unbind())))
}

/// Makes the runs of a pipeline that a folder lacks, and all of its tables, figures and claims, and their page there.
///
/// `pipeline` is the file of a pipeline or of any other study (docs/studies.md), or its text. `set` are values for all
/// runs that have names, and `solver` is theirs. `fresh` repeats them, and replaces those of other scenarios. Returns the
/// numbers of these runs by their names. Files are those of `asperity reproduce`.
#[pyfunction]
#[pyo3(signature = (pipeline, out, *, set = None, solver = None, fresh = false, jobs = None, progress = None, stop = None))]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of the package")]
pub(crate) fn reproduce<'py>(
    py: Python<'py>,
    pipeline: PathBuf,
    out: PathBuf,
    set: Option<&Bound<'py, PyMapping>>,
    solver: Option<&str>,
    fresh: bool,
    jobs: Option<i64>,
    progress: Option<Bound<'py, PyAny>>,
    stop: Option<Bound<'py, PyAny>>,
) -> PyResult<BTreeMap<String, Bound<'py, PyAny>>> {
    let (jobs, solver) = (at_once(jobs)?, values::solver(solver)?);
    let written = pipeline.to_str().filter(|text| text.contains('\n')).map(str::to_owned);
    let file = if written.is_some() { PathBuf::from("pipeline") } else { pipeline };
    let mut study = parsed(&file, written.as_deref()).map_err(|error| of_study(error, &out))?;
    study.set(&assignments(set, None)?);
    let total = study.count() + study.runs.len() as u64;
    let callbacks = Callbacks::new(py, "reproduce", progress, stop, total)?;
    let made = attend(py, &callbacks, |watch| {
        Reproduction { solver, fresh, jobs, provenance: true, watcher: &**watch }.of(&study, &file, &out)
    })?;
    let summaries = made.map_err(|error| of_study(error, &out))?;
    let numbers =
        |summary: &Summary| Ok((summary.run.clone(), summary_of(py, summary, &text::of_one(summary, None))?));
    summaries.iter().map(numbers).collect()
}

/// A study of a file, or of a text.
fn parsed(file: &Path, text: Option<&str>) -> Result<Study, StudyError> {
    match text {
        Some(text) => Study::parse(text, Path::new(".")).map_err(StudyError::Refused),
        None => Study::read(file),
    }
}

/// A number of runs at once.
fn at_once(jobs: Option<i64>) -> PyResult<Option<NonZeroUsize>> {
    let positive = |jobs: i64| {
        let wanted = usize::try_from(jobs).ok().and_then(NonZeroUsize::new);
        wanted.ok_or_else(|| refused(format!("jobs = {jobs} (accepted: a whole number from 1)")))
    };
    jobs.map(positive).transpose()
}

/// The exception for a study in a folder.
fn of_study(error: StudyError, folder: &Path) -> PyErr {
    match error {
        StudyError::Refused(problem) => refused(problem),
        StudyError::Stopped => {
            error_of("Interrupted", format!("stopped; {} contains the runs so far", folder.display()))
        }
        error => failed(error),
    }
}

impl Watcher for Watch {
    fn is_stopped(&self) -> bool {
        Watch::is_stopped(self)
    }

    fn over(&self, _: &Made) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}

/// A study as TOML: a scenario over axes.
fn of_axes(
    scenario: &Path,
    values: &[String],
    axes: &Bound<'_, PyMapping>,
    set: Option<&Bound<'_, PyMapping>>,
    keep: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    let several = |keep: &Bound<'_, PyAny>| -> PyResult<Vec<String>> {
        keep.extract().map(|keep| vec![keep]).or_else(|_| keep.extract())
    };
    let keep = keep.map_or_else(|| Ok(vec!["events".to_owned(), "ruptures".to_owned()]), several)?;
    let set = [values, &assignments(set, None)?].concat();
    let mut axis = Vec::new();
    for (key, values) in items(axes)? {
        let values = match to_json(&values, &key, DEEPEST)? {
            Value::Array(values) if !values.is_empty() => values,
            value => {
                return Err(refused(format!(
                    "axes: {key} = {value} (accepted: a list of one value or more)"
                )));
            }
        };
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

/// Keeps the tables of a study in memory.
struct Tables(Vec<asperity_tables::Table>);

impl RowSink for Tables {
    fn begin(&mut self, table: &'static str, columns: &[Column]) -> Result<(), StudyError> {
        self.0.push(asperity_tables::Table::new(table, columns.to_vec()));
        Ok(())
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) -> Result<(), StudyError> {
        if let Some(found) = self.0.iter_mut().find(|found| found.name == table) {
            found.push(cells.iter().cloned());
        }
        Ok(())
    }
}

/// The tables of a study.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Sweep {
    plan: Plan,
    results: Results,
    folder: PathBuf,
    tables: Vec<Table>,
    /// The folder's object in Python, which removes the folder with the study.
    temporary: Option<Py<PyAny>>,
}

impl Sweep {
    fn table(&self, name: &str) -> PyResult<Table> {
        let found = self.tables.iter().find(|table| table.name == name).cloned();
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

    /// Draws the figures that the study asks for, or another file of it, into its folder or another one, as `asperity
    /// sweep draw` does, and returns the files.
    #[pyo3(signature = (figures = None, *, out = None))]
    fn draw(&self, py: Python<'_>, figures: Option<PathBuf>, out: Option<PathBuf>) -> PyResult<Vec<PathBuf>> {
        let Sweep { plan, results, folder, .. } = self;
        let drawn = attend(py, &Callbacks::default(), |watch| {
            Outputs { plan, results, folder, provenance: true, watcher: &**watch }
                .figures(figures.as_deref(), out.as_deref())
        })?;
        drawn.map_err(|error| of_study(error, folder))
    }

    fn __repr__(&self) -> String {
        self.tables.iter().map(Table::summary).collect::<Vec<_>>().join("\n")
    }
}
