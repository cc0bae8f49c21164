//! Computes tables and figures of a pipeline from one run after the other.
//!
//! A run is read once, while it is made or its log is checked, and dropped before the next. Of each there
//! remain its rows in tables of several runs, the numbers of claims, and the points of figures that still
//! wait for other runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use asperity_figures::draw::Gathering;
use asperity_files::{Existing, FileSet, Inputs};
use asperity_model::Scenario;
use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::Summary;
use asperity_numbers::claim::{self, Claim};
use asperity_numbers::claims::{self, Measured};
use asperity_numbers::precursors::PrecursorRules;
use asperity_numbers::run_data::Collector;
use asperity_record::{Cell, Event, Observer, Record, RunEnd, RunHeader};
use asperity_report::{Figure, Limits, PageCollector, Run, Study as Page};
use asperity_tables::table_files::{self, PassingTable};
use asperity_tables::{Table, summaries, tables};

use crate::error::StudyError;
use crate::pipeline::{CLAIMS, CLAIMS_PAGE, Pipeline, REPORT, precursor_table, table_of};
use crate::record;

/// The command that names the record of a reduction.
const COMMAND: &str = "reproduce";

/// A reduction that has begun. [`Reduction::passing`] and [`Reduction::passed`] may be called for
/// several runs at a time.
pub struct Reduction<'a> {
    pipeline: &'a Pipeline,
    out: &'a Path,
    tables: PathBuf,
    files: FileSet,
    figures: Gathering<'a>,
    /// Whether figures and page name the code.
    provenance: bool,
    passed: Mutex<BTreeMap<String, Passed>>,
}

/// Outputs that accompany those of named runs: figures and tables of runs over axes.
#[derive(Debug, Clone, Default)]
pub struct Beside {
    /// The figures, for the page.
    pub figures: Vec<Figure>,
    /// All files.
    pub files: Vec<PathBuf>,
    /// Measured values for claims, by the name or number of the run.
    pub measured: BTreeMap<String, Measured>,
    /// A description of these runs.
    pub headers: Vec<RunHeader>,
}

/// The files of the claims of a pipeline in a folder of tables.
pub fn claim_files(tables: &Path) -> impl Iterator<Item = PathBuf> {
    table_files::paths(tables, CLAIMS).into_iter().chain([tables.join(CLAIMS_PAGE)])
}

/// Judges the claims of a pipeline and writes them into a folder of tables.
///
/// # Errors
/// If a file cannot be written.
pub fn write_claims(
    pipeline: &Pipeline,
    beside: &Beside,
    files: &FileSet,
    tables: &Path,
) -> Result<Vec<Claim>, StudyError> {
    let measured = beside.measured.iter().map(|(name, measured)| (name.as_str(), measured)).collect();
    let judged = claims::judge(&pipeline.claim, &measured);
    let table = Table::of(CLAIMS, &judged, &claim::columns(&judged));
    table_files::write(files, tables, CLAIMS, table)?;
    let headers: Vec<&RunHeader> = beside.headers.iter().collect();
    let page = claims::markdown(&pipeline.title, &pipeline.claim, &judged, &headers);
    files.write(&tables.join(CLAIMS_PAGE), page)?;
    Ok(judged)
}

/// The data kept of a run.
struct Passed {
    /// Its part of the page.
    shown: Run,
    /// One for each table of precursors, by the table's place in the pipeline.
    residuals: BTreeMap<usize, Table>,
    first_global_slip: Option<Table>,
    /// One for each study that the run is in, by the study's place in the pipeline.
    studies: BTreeMap<usize, Vec<Cell>>,
    measured: Measured,
}

/// A run that is going by.
pub struct Passing {
    /// Nodes at the times for which it asks must be given to it before [`Reduction::passed`].
    pub(crate) collector: Collector,
    tables: [PassingTable<'static>; 2],
    page: PageCollector,
}

impl Observer for Passing {
    fn record(&mut self, record: &Record) {
        self.collector.record(record);
        self.page.record(record);
        self.tables.iter_mut().for_each(|table| table.record(record));
    }

    fn event(&mut self, event: &Event) {
        self.collector.event(event);
        self.page.event(event);
        self.tables.iter_mut().for_each(|table| table.event(event));
    }
}

impl<'a> Reduction<'a> {
    /// Begins `tables/`, `figures/` and their record `reproduce.json` in `out`. They replace existing ones:
    /// all of them, or none if something fails. No input, such as `inputs`, is overwritten. `provenance` is
    /// whether figures name the code in a line at their foot.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(
        pipeline: &'a Pipeline,
        out: &'a Path,
        inputs: Inputs,
        provenance: bool,
    ) -> Result<Reduction<'a>, StudyError> {
        let (tables, figures) = (out.join("tables"), out.join("figures"));
        let files = FileSet::new(Existing::Replace, inputs);
        files.folder(&tables)?;
        files.folder(&figures)?;
        files.reserve(pipeline.outputs(out))?;
        files.reserve([record::path(out, COMMAND)])?;
        let figures = Gathering::begin(&pipeline.figure, figures, provenance);
        Ok(Reduction { pipeline, out, tables, files, figures, provenance, passed: Mutex::default() })
    }

    /// A run is about to go by, while it is made or out of its log.
    pub fn passing(&self, run: &str, header: RunHeader, scenario: Scenario) -> Passing {
        let (contacts, steps, parts) = (header.contacts(), header.steps, header.parts());
        let collector = Collector::new(run, header, scenario, self.pipeline.required_data(run));
        let [loads, events] = ["load", tables::EVENTS].map(|what| table_of(run, what));
        let loads = PassingTable::loads((&self.files, &self.tables, &loads), collector.both_ways());
        let tables = [loads, PassingTable::events((&self.files, &self.tables, &events), parts)];
        let limits = Limits::of_runs(self.pipeline.runs.len());
        let page = PageCollector::new(steps, contacts, limits);
        Passing { collector, tables, page }
    }

    /// Discards a run that turned out to be another one, without a trace.
    pub fn discard(&self, passing: Passing) {
        passing.tables.into_iter().for_each(|table| table.discard(&self.files));
    }

    /// Completes a run of this program: writes its tables, and draws the figures whose last run it was.
    ///
    /// # Errors
    /// If a file cannot be written, or the run lacks requested data.
    pub fn passed(&self, passing: Passing, end: &RunEnd) -> Result<(), StudyError> {
        let Passing { collector, tables, page } = passing;
        tables.into_iter().try_for_each(PassingTable::finish)?;
        let run = collector.finish(true, Some(end));
        let write = |table: Table| {
            table_files::write(&self.files, &self.tables, &table_of(&run.name, &table.name), table)
        };
        let json = self.tables.join(table_of(&run.name, summaries::JSON));
        summaries::write_json(&self.files, &json, &run.summary)?;
        let name = table_of(&run.name, tables::RUPTURES);
        let mut ruptures = PassingTable::ruptures((&self.files, &self.tables, &name), &run);
        run.ruptures.iter().flatten().for_each(|rupture| ruptures.event(&Event::new(rupture.clone())));
        ruptures.finish()?;
        let laws: Vec<(LengthLaw, PrecursorRules)> = self.pipeline.laws_of(&run.name).collect();
        if !laws.is_empty() {
            write(tables::precursor_ruptures(&run, &laws))?;
        }
        if self.pipeline.slow_slip.contains(&run.name) {
            write(tables::slow_slip(&run)?)?;
        }
        let mut residuals = BTreeMap::new();
        for (index, spec) in self.pipeline.precursors.iter().enumerate() {
            if spec.run == run.name {
                let table = tables::precursors(&run, spec.law, &spec.rules)?;
                table_files::write(&self.files, &self.tables, &precursor_table(spec), table)?;
                residuals.insert(index, tables::residuals(&run, spec.law, &spec.rules)?);
            }
        }
        let studies = self.pipeline.study.iter().enumerate();
        let studies = studies.filter(|(_, study)| study.runs.contains(&run.name));
        let stays = Passed {
            residuals,
            first_global_slip: (self.pipeline.first_global_slips.contains(&run.name))
                .then(|| tables::first_global_slip(&run))
                .transpose()?,
            studies: studies
                .map(|(index, study)| Ok((index, study.row(&run)?)))
                .collect::<Result<_, StudyError>>()?,
            measured: Measured::of(&self.pipeline.claim, &run),
            shown: Run {
                name: run.name.clone(),
                header: run.header.clone(),
                scenario: run.scenario.clone(),
                summary: run.summary.clone(),
                collected: page.finish(),
                noise: Vec::new(),
                lacks: None,
                note: BTreeMap::new(),
                links: Vec::new(),
            },
        };
        self.figures.run(&run, &self.files)?;
        self.passed.lock().expect("whoever adds a run does not panic").insert(run.name.clone(), stays);
        Ok(())
    }

    /// Writes the tables of several runs, and the claims, after the last run, and publishes all
    /// files. `beside` is shown on the page as well. Returns the summaries,
    /// in the order of the runs.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(self, mut beside: Beside) -> Result<Vec<Summary>, StudyError> {
        let Reduction { pipeline, out, tables: folder, files, provenance, figures, passed, .. } = self;
        let mut runs = passed.into_inner().expect("whoever adds a run does not panic");
        let write = |table: Table| table_files::write(&files, &folder, &table.name.clone(), table);
        let in_order = pipeline.runs.iter().map(|name| &runs[name].shown.summary);
        summaries::write_table(&files, &folder.join(summaries::TABLE), in_order)?;
        let specs = pipeline.precursors.iter().enumerate();
        let residuals = specs.filter_map(|(index, spec)| runs[&spec.run].residuals.get(&index));
        let slips = pipeline.first_global_slips.iter();
        let slips = slips.filter_map(|run| runs[run].first_global_slip.as_ref());
        for table in [Table::joined(residuals), Table::joined(slips)].into_iter().flatten() {
            write(table)?;
        }
        for (index, study) in pipeline.study.iter().enumerate() {
            let mut table = study.table();
            let rows = study.runs.iter().filter_map(|run| runs[run].studies.get(&index));
            rows.for_each(|row| table.push(row.iter().cloned()));
            write(table)?;
        }
        let mut judged = Vec::new();
        if !pipeline.claim.is_empty() {
            beside.measured.extend(runs.iter().map(|(name, run)| (name.clone(), run.measured.clone())));
            beside.headers.extend(runs.values().map(|run| run.shown.header.clone()));
            judged = write_claims(pipeline, &beside, &files, &folder)?;
        }
        let mut contents = pipeline.contents(&figures.captions());
        contents.figures.extend(beside.figures);
        let written = || pipeline.outputs(out).into_iter().chain(beside.files.iter().cloned());
        let headers = pipeline.runs.iter().map(|name| (name.as_str(), &runs[name].shown.header));
        record::write(&files, out, COMMAND, headers, written(), Some(&contents))?;
        let shown = pipeline.runs.iter().filter_map(|name| Some(runs.remove(name)?.shown));
        let from_folder = |path: PathBuf| path.strip_prefix(out).unwrap_or(&path).display().to_string();
        let written: Vec<String> = written().map(from_folder).collect();
        let read = |file: &str| {
            let path = out.join(file);
            asperity_files::read_if_there(&files.begun(&path).unwrap_or(path))
        };
        let page = Page::of(&contents, &written, shown.collect(), judged, &read, provenance)?;
        files.write(&out.join(REPORT), page.html())?;
        files.publish()?;
        Ok(page.runs.into_iter().map(|run| run.summary).collect())
    }
}
