//! Runs: made, resumed, or opened from their logs.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, OnceLock};

use asperity_files::{better_name, is_taken};
use asperity_model::{Scenario as Resolved, ScenarioSource};
use asperity_numbers::curve::NamedCurves;
use asperity_numbers::run_data::Collector;
use asperity_numbers::{Summarizer, Summary, text};
use asperity_record::{Notice, Observer, Record, RunEnd, RunHeader, counted};
use asperity_report::html::markup;
use asperity_run::detectors::Settings;
use asperity_run::{Begin, Detectors as Trackers, LogTo, OpenLog, Reading, SolverKind, Task, Verdict};
use asperity_runlog::{Unfinished, partial_path};
use asperity_tables::run_tables::{Chosen, RunTables};
use pyo3::exceptions::PyFileNotFoundError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use toml::Value;

use crate::attend::{Callbacks, Watch, attend};
use crate::detectors::{self, Detector, Detectors};
use crate::errors::{failed, not_pickled, of_run, of_verdict, refused};
use crate::events::{self, Events};
use crate::field::{self, Field, Nodes};
use crate::figure::Figure;
use crate::scenario::{Scenario, summary_of};
use crate::source::{Source, Stoppable, read};
use crate::tables::Table;
use crate::values::{self, assigned, items};

/// Most rows of a table of records: up to two GB while they become columns.
const MOST_ROWS: usize = 10_000_000;

/// A run: its numbers and events, and on request everything else.
///
/// A run with a log reads it again for what is asked for; one without a log takes the same steps again.
#[pyclass(frozen, extends = Events, module = "asperity")]
pub(crate) struct Run {
    source: Source,
    summary: Summary,
    /// Warnings about the scenario, and what is worth knowing about the run or its log.
    #[pyo3(get)]
    notes: Vec<String>,
    verdict: Option<Verdict>,
    /// The digest of all messages of its log, equal for equal runs; None without a complete log.
    #[pyo3(get)]
    digest: Option<String>,
    /// Tables of records, once asked for.
    records: Mutex<BTreeMap<String, Table>>,
}

/// Runs a scenario, with the steps of the `asperity` command, to the bit.
///
/// `overrides` are values by dotted key, as of a `Scenario`. `log` is the path of a new run log (MCAP).
/// `solver="plain"` takes every step; `"fast"` finds the same events some hundred times faster (docs/model.md).
/// `"adaptive"` solves rate-and-state friction alone, and is the default there; `"fast"` is that of other laws.
/// `progress` is True for a bar, or is called with the steps done and in all. `detectors` are objects with
/// `observe(record)`, see `Detector`; their tables are in `Run.found`.
///
/// `stop` is called about twenty times per second; once it returns true, the run ends and `Interrupted` is
/// raised. Ctrl-C raises `KeyboardInterrupt`, and a callback or detector may raise what it likes. The log then
/// stays as `LOG.partial`, from which `resume` continues, or as LOG if it was whole by then.
///
/// Raises `ScenarioError` for a scenario that is not accepted, `Refused` for other values, `Error` for a run
/// that cannot continue or a log that cannot be written.
#[pyfunction]
#[pyo3(signature = (scenario = None, overrides = None, *, log = None, solver = None, progress = None, detectors = None, stop = None))]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of the package")]
pub(crate) fn run(
    py: Python<'_>,
    scenario: Option<&Bound<'_, PyAny>>,
    overrides: Option<&Bound<'_, PyMapping>>,
    log: Option<PathBuf>,
    solver: Option<&str>,
    progress: Option<Bound<'_, PyAny>>,
    detectors: Option<&Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Py<Run>> {
    let scenario = Scenario::new(py, scenario, overrides, None)?.resolved;
    let solver = Task::new(&scenario).solved_by(values::solver(solver)?).solver;
    let log = log.map(absolute).transpose()?;
    let mut begin = Begin::Anew;
    if let Some(log) = &log {
        if is_taken(log) {
            return Err(refused(format!("log = {} exists already (accepted: a new path)", log.display())));
        }
        if let Some(better) = better_name(log, "mcap") {
            let (log, better) = (log.display(), better.display());
            return Err(refused(format!("log = {log}: the output is a run log (accepted: {better})")));
        }
        match left(py, log)? {
            None => {}
            // Asks again once it has locked it.
            Some(None) => begin = Begin::GoOn,
            Some(Some(_)) => {
                let (log, partial) = (log.display(), partial_path(log));
                return Err(refused(format!(
                    "log = {log}: {} contains an unfinished run (accepted: asperity.resume, or another path)",
                    partial.display()
                )));
            }
        }
    }
    let detectors = detectors::given(detectors)?;
    make(py, scenario, solver, log, begin, detectors, progress, stop)
}

/// The unfinished run of a log, if there is one: its header and scenario, unless it was cut before them.
fn left(py: Python<'_>, log: &Path) -> PyResult<Option<Option<(RunHeader, String)>>> {
    py.detach(|| Unfinished::of(log).map_err(failed)?.map(|left| left.begun().map_err(failed)).transpose())
}

/// Continues the unfinished run of a log, which then equals that of an unbroken run. Opens a whole log.
#[pyfunction]
#[pyo3(signature = (log, *, progress = None, detectors = None, stop = None))]
pub(crate) fn resume(
    py: Python<'_>,
    log: PathBuf,
    progress: Option<Bound<'_, PyAny>>,
    detectors: Option<&Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Py<Run>> {
    let is_partial = log.extension().is_some_and(|ending| ending == "partial");
    let log = absolute(if is_partial { log.with_extension("") } else { log })?;
    let detectors = detectors::given(detectors)?;
    let Some(begun) = left(py, &log)? else {
        let run = open_with(py, log, detectors)?;
        let verdict = run.get().verdict;
        return match verdict.is_some_and(Verdict::holds_all) {
            true => Ok(run),
            false => Err(of_verdict(
                verdict,
                format!(
                    "{}: it has no end, and only a log with the ending .partial resumes",
                    run.get().name()
                ),
            )),
        };
    };
    let partial = partial_path(&log);
    let ends_early = || {
        let (partial, log) = (partial.display(), log.display());
        refused(format!(
            "{partial}: it ends before its scenario (accepted: asperity.run(SCENARIO, log=\"{log}\"), which begins \
             it again)"
        ))
    };
    let (header, toml) = begun.ok_or_else(ends_early)?;
    let solver = SolverKind::named(&header.solver).unwrap_or_default();
    let source = ScenarioSource::logged(format!("{}: scenario.toml", partial.display()), &toml);
    let scenario = py.detach(|| Resolved::resolve(&source)).map_err(failed)?;
    make(py, scenario, solver, Some(log), Begin::GoOn, detectors, progress, stop)
}

/// Opens a run log, and checks every byte of it meanwhile.
///
/// Incomplete logs are opened up to where they are sound, see `Run.notes`; damaged ones raise `LogError`.
#[pyfunction]
pub(crate) fn open(py: Python<'_>, log: PathBuf) -> PyResult<Py<Run>> {
    open_with(py, absolute(log)?, Vec::new())
}

/// A path that stays where it is when the folder changes.
pub(crate) fn absolute(path: PathBuf) -> PyResult<PathBuf> {
    Ok(std::path::absolute(path)?)
}

/// Opens a run log, whose records detectors observe meanwhile.
pub(crate) fn open_with(py: Python<'_>, log: PathBuf, detectors: Vec<Detector>) -> PyResult<Py<Run>> {
    if !log.exists() {
        let partial = partial_path(&log);
        let hint = if partial.exists() {
            format!("; {} is an unfinished run", partial.display())
        } else {
            String::new()
        };
        return Err(PyFileNotFoundError::new_err(format!("{}: no such file{hint}", log.display())));
    }
    let name = log.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let begun = OnceLock::new();
    let read = read(py, &log, |watch, log| {
        let (header, scenario) = (log.header(), log.scenario()?);
        let numbers = Summarizer::new(&name, header, scenario);
        let tables = events::begin(&log.event_schemas(), header.parts());
        let shown = header.sensors.as_ref().and_then(|_| log.shown_scenario().ok());
        begun.get_or_init(|| (header.clone(), shown.map(Cow::into_owned).or_else(|| scenario.cloned())));
        Ok((numbers, (tables, Detectors { detectors, watch: Arc::clone(watch) })))
    })?;
    let (header, scenario) = begun.into_inner().expect("what is observed has begun");
    let Reading { observer: (summarizer, (tables, detectors)), has_ruptures, checked } = read;
    let mut events = Events::of(py, tables, detectors)?;
    // Events that the program of the log did not look for are not none.
    let is_there = |topic: &String| checked.seen.topics.contains(topic);
    events.tables.retain(|topic, _| is_there(topic) || has_ruptures && !topic.starts_with('/'));
    let is_noted = checked.verdict != Verdict::Whole || checked.has_note();
    let notes = is_noted.then(|| checked.to_string()).into_iter().collect();
    let summary = summarizer.finish(has_ruptures, checked.seen.end.as_ref());
    let source = Source { name, header, scenario, log: Some((log, checked.seen.last_step)) };
    observed(py, source, events, summary, checked.seen.end, notes, Some(checked.verdict))
}

/// The run that has been observed.
fn observed(
    py: Python<'_>,
    source: Source,
    events: Events,
    summary: Summary,
    end: Option<RunEnd>,
    notes: Vec<String>,
    verdict: Option<Verdict>,
) -> PyResult<Py<Run>> {
    let digest = end.filter(|_| source.log.is_some()).map(|end| end.digest);
    let run = Run { source, summary, notes, verdict, digest, records: Mutex::default() };
    Py::new(py, PyClassInitializer::from(events).add_subclass(run))
}

#[expect(clippy::too_many_arguments, reason = "what the two functions of the package have in common")]
fn make(
    py: Python<'_>,
    scenario: Resolved,
    solver: SolverKind,
    log: Option<PathBuf>,
    begin: Begin,
    detectors: Vec<Detector>,
    progress: Option<Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Py<Run>> {
    let header = py.detach(|| Task { solver, ..Task::new(&scenario) }.header());
    let name = scenario.name.clone();
    let callbacks = Callbacks::new(py, &name, progress, stop, header.steps)?;
    let made = attend(py, &callbacks, |watch| {
        let task = Task { solver, log: log.as_deref().map(LogTo::new), ..Task::new(&scenario) };
        let numbers = Summarizer::new(&name, &header, Some(&scenario));
        let tables = events::begin(&BTreeMap::new(), header.parts());
        let detectors = Detectors { detectors, watch: Arc::clone(watch) };
        let notes = Notes { watch: Arc::clone(watch), notes: Vec::new() };
        let mut observers = ((numbers, notes), (tables, detectors));
        let outcome = asperity_run::run(task, begin, &|| watch.is_stopped(), &mut observers);
        outcome.map(|outcome| (outcome, observers))
    })?;
    let (outcome, ((summarizer, Notes { notes, .. }), (tables, detectors))) = made.map_err(of_run)?;
    if let (Some(log), false) = (&log, outcome.has_run) {
        // It only lacked its name, and nobody has observed it.
        return open_with(py, log.clone(), detectors.detectors);
    }
    let events = Events::of(py, tables, detectors)?;
    let end = outcome.into_end(header.steps);
    let verdict = log.is_some().then_some(Verdict::Whole);
    let log = log.map(|path| (path, end.last_step));
    let source = Source { name, header, scenario: Some(scenario), log };
    observed(py, source, events, summarizer.finish(true, Some(&end)), Some(end), notes, verdict)
}

/// Reports the steps of a run, and keeps what is worth knowing about it.
struct Notes {
    watch: Arc<Watch>,
    notes: Vec<String>,
}

impl Observer for Notes {
    fn reached(&mut self, step: u64) {
        self.watch.done.store(step, Ordering::Relaxed);
    }

    fn notice(&mut self, notice: Notice<'_>) {
        self.notes.push(notice.to_string());
    }
}

/// Keeps a table in memory, and ends the work if that is too large.
struct Bounded {
    tables: RunTables,
    watch: Arc<Watch>,
}

impl Observer for Bounded {
    fn record(&mut self, record: &Record) {
        self.tables.record(record);
        if let Some(table) = self.tables.tables().iter().find(|table| table.rows() > MOST_ROWS) {
            self.watch.raise(refused(format!(
                "{} has more than {MOST_ROWS} rows, too many for memory (accepted: asperity export, or part of them \
                 by field)",
                table.name
            )));
        }
    }
}

/// Sends the records of a run through detectors with other rules.
struct Anew {
    trackers: Trackers,
    tables: RunTables,
}

impl Observer for Anew {
    fn record(&mut self, record: &Record) {
        self.trackers.observe(record, &mut |event| self.tables.event(&event));
    }
}

impl Run {
    /// The table of a topic of records.
    fn records(&self, py: Python<'_>, topic: &str) -> PyResult<Table> {
        let known = || self.records.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(table) = known().get(topic) {
            return Ok(table.clone());
        }
        let chosen = Chosen { topics: vec![topic.to_owned()], ..Chosen::default() };
        let parts = self.source.header.parts();
        let tables = RunTables::new(parts, &BTreeMap::new(), &[], chosen).map_err(refused)?;
        let bounded = |watch: &Arc<Watch>| Bounded { tables, watch: Arc::clone(watch) };
        let (mut bounded, ..) = self.source.observe(py, bounded)?;
        let table = py.detach(|| bounded.tables.tables().first().map(Table::of));
        let table = table.ok_or_else(|| failed(format!("no table of {topic}")))?;
        known().insert(topic.to_owned(), table.clone());
        Ok(table)
    }

    /// Its numbers, under headings.
    fn text(&self) -> String {
        let as_coded = self.source.scenario.as_ref().and_then(Resolved::as_coded_in_words);
        text::of_one(&self.summary, as_coded.as_deref())
    }

    /// The path of its log, if that is still there and of this run.
    pub(crate) fn unchanged_log(&self, py: Python<'_>) -> PyResult<&Path> {
        self.source.must_be_unchanged(py)?;
        self.log().ok_or_else(|| {
            refused(format!("{} has no log (accepted: asperity.run(..., log=\"run.mcap\"))", self.name()))
        })
    }
}

#[pymethods]
impl Run {
    /// The name of its scenario, or of its log.
    #[getter]
    fn name(&self) -> &str {
        &self.source.name
    }

    /// Its scenario. Raises `Error` if the log has lost it, or is that of a recording.
    #[getter]
    fn scenario(&self) -> PyResult<Scenario> {
        if self.source.header.sensors.is_some() {
            return Err(failed(format!("{} is a recording, which has no scenario", self.name())));
        }
        self.source.scenario().cloned().map(Scenario::resolved)
    }

    /// The path of its log, None without one.
    #[getter]
    fn log(&self) -> Option<&Path> {
        self.source.log.as_ref().map(|(path, _)| path.as_path())
    }

    /// The hash of scenario, solver and code that distinguishes it.
    #[getter]
    fn run_id(&self) -> &str {
        &self.source.header.run_id
    }

    /// The version of the code that made it.
    #[getter]
    fn code_version(&self) -> &str {
        &self.source.header.code_version
    }

    /// The verdict on its log, None without one.
    #[getter]
    fn verdict(&self) -> Option<&'static str> {
        self.verdict.map(Verdict::word)
    }

    /// The numbers of the run, as `asperity summary` prints them (docs/outputs.md).
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        summary_of(py, &self.summary, &self.text())
    }

    /// Step records: F_T, F_N, sliding blocks, energies.
    #[getter]
    fn loads(&self, py: Python<'_>) -> PyResult<Table> {
        self.records(py, "/step")
    }

    /// Every change between stick and slip, with the state of the block.
    #[getter]
    fn switches(&self, py: Python<'_>) -> PyResult<Table> {
        self.records(py, "/switch")
    }

    /// Recorded states of all blocks, a row for each block and time.
    #[getter]
    fn states(&self, py: Python<'_>) -> PyResult<Table> {
        self.records(py, "/fields")
    }

    /// The table of a topic of the log, such as `/window`.
    fn table(slf: &Bound<'_, Self>, topic: &str) -> PyResult<Table> {
        match topic.starts_with("/events/") {
            true => slf.as_super().get().table(topic),
            false => slf.get().records(slf.py(), topic),
        }
    }

    /// Sends its records through the detectors again, with other rules (docs/rules.md) and further detectors.
    #[pyo3(signature = (detectors = None, *, link_time_ratio = None, merge_gap_s = None, min_blocks = None))]
    fn detect(
        &self,
        py: Python<'_>,
        detectors: Option<&Bound<'_, PyAny>>,
        link_time_ratio: Option<f64>,
        merge_gap_s: Option<f64>,
        min_blocks: Option<i64>,
    ) -> PyResult<Events> {
        let given = [
            ("link_time_ratio", link_time_ratio.map(Value::from)),
            ("merge_gap_s", merge_gap_s.map(Value::from)),
            ("min_blocks", min_blocks.map(Value::from)),
        ];
        let given = given.into_iter().filter_map(|(key, value)| Some(format!("{key} = {}\n", value?)));
        let given: String = given.collect();
        let settings = Settings::parse(&given).map_err(|(_, problem)| refused(problem))?;
        let Source { header, scenario, .. } = &self.source;
        self.source.must_be_unchanged(py)?;
        let detectors = detectors::given(detectors)?;
        let (observers, ..) = self.source.observe(py, |watch| {
            let trackers = settings.start(header, scenario.as_ref());
            let tables = events::begin(&BTreeMap::new(), header.parts());
            (Anew { trackers, tables }, Detectors { detectors, watch: Arc::clone(watch) })
        })?;
        let (Anew { mut trackers, mut tables }, detectors) = observers;
        trackers.finish(&mut |event| tables.event(&event));
        Events::of(py, tables, detectors)
    }

    /// Checks its log; with `again` repeats the run as well, and compares all records.
    #[pyo3(signature = (*, again = false))]
    fn check<'py>(&self, py: Python<'py>, again: bool) -> PyResult<Bound<'py, PyAny>> {
        let log = self.unchanged_log(py)?;
        let checked = attend(py, &Callbacks::default(), |watch| {
            let mut observer = Stoppable { observer: (), watch };
            OpenLog::open(log).map_or_else(
                |checked| *checked,
                |log| if again { log.check_again(&mut observer) } else { log.check(&mut observer) },
            )
        })?;
        let verdict = (checked.verdict.word(), checked.verdict.holds_all(), checked.to_string());
        py.import("asperity.numbers")?.getattr("Verdict")?.call1(verdict)
    }

    /// A quantity of all contacts, over a rupture (by its number) or from one time to another, s.
    ///
    /// `every` is the time between samples, s: by default that in which a wave crosses a block for ruptures,
    /// and a thousandth of `t`. What the log did not record is computed by the steps of the run, once more
    /// from the last checkpoint; needs a log of this code version.
    #[pyo3(signature = (quantity = "displacement", *, rupture = None, t = None, every = None))]
    fn field(
        slf: &Bound<'_, Self>,
        quantity: &str,
        rupture: Option<i64>,
        t: Option<Vec<f64>>,
        every: Option<f64>,
    ) -> PyResult<Field> {
        let source = &slf.get().source;
        source.must_be_unchanged(slf.py())?;
        let ruptures = rupture.map(|_| slf.as_super().get().ruptures()).transpose()?;
        let span = field::span(&source.header, rupture.zip(ruptures), t.as_deref(), every)?;
        field::field(slf.py(), source, quantity, span)
    }

    /// All nodes of a slab, a sheet or a body at a time, s.
    fn nodes(&self, py: Python<'_>, t: f64) -> PyResult<Nodes> {
        self.source.must_be_unchanged(py)?;
        field::nodes(py, &self.source, t)
    }

    /// Curves of it by name, a row for each point (docs/gallery.md).
    #[pyo3(signature = (name, /, **keys))]
    fn curve(&self, py: Python<'_>, name: &str, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Table> {
        let named = NamedCurves::find(name).map_err(refused)?;
        let keys = keys.map_or_else(|| Ok(Vec::new()), |keys| items(keys.as_mapping()))?;
        let set = keys.iter().map(|(key, value)| assigned(key, value)).collect::<PyResult<Vec<_>>>()?;
        let keys = named.keys_of(&set).map_err(refused)?;
        let Source { name, header, .. } = &self.source;
        let collector =
            Collector::new(name, header.clone(), self.source.scenario()?.clone(), named.required_data(&keys));
        let (collector, has_ruptures, end) = self.source.observe(py, |_| collector)?;
        let data = py.detach(|| collector.finish(has_ruptures, end.as_ref()));
        let curves = named.of(&data, &keys).map_err(failed)?;
        Ok(Table::of(&asperity_tables::curves::table(named, &curves)))
    }

    /// Draws a figure of it; `asperity.figures()` lists the kinds, the command `asperity figures` their keys.
    #[pyo3(signature = (kind = "overview", /, **keys))]
    fn draw(&self, py: Python<'_>, kind: &str, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Figure> {
        Figure::draw(py, kind, keys, &self.source)
    }

    fn __repr__(&self) -> String {
        let log = self.log().map_or_else(String::new, |path| format!(", log {}", path.display()));
        let events = counted(self.summary.event_count, "slip event");
        let precursors = counted(self.summary.precursor_count.unwrap_or_default(), "precursor");
        format!("Run({:?}: {events}, {precursors}{log})", self.name())
    }

    fn _repr_html_(&self) -> String {
        let words: Vec<String> = self.text().lines().map(markup::text).collect();
        let (name, words) = (markup::text(self.name()), words.join("\n"));
        format!("<details open><summary>{name}</summary><pre>{words}</pre></details>")
    }

    fn __reduce__(&self) -> PyResult<()> {
        let accepted =
            "its tables and numbers, such as run.ruptures and run.summary, or run.log for asperity.open";
        Err(not_pickled("a run", accepted))
    }
}
