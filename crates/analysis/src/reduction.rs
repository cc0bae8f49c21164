//! Tables and figures of a pipeline, made of one run after the other.
//!
//! A run is seen once, live or out of its log, and dropped before the next: of each there stay the
//! rows that tables of several runs have, what claims measure, and the points of figures that still
//! wait for other runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use asperity_files::{Existing, FileSet, Inputs, create_folder};
use asperity_model::Scenario;
use asperity_model::analytic::LengthLaw;
use asperity_record::{Event, Record, RunHeader};
use asperity_runlog::{LogItem, RunReader};
use asperity_summary::Summary;
use polars::prelude::DataFrame;

use crate::claims::{self, Measured};
use crate::error::AnalysisError;
use crate::figures::Gathering;
use crate::load_table::LoadTable;
use crate::pipeline::{CLAIMS, CLAIMS_PAGE, FIRST_GLOBAL_SLIPS, Pipeline, RESIDUALS, study_table, table_of};
use crate::precursors::PrecursorRules;
use crate::run_data::Collector;
use crate::study::StudyRow;
use crate::tables::{FirstGlobalSlip, ResidualRow};
use crate::wants::Wants;
use crate::{record, summaries, table_file, tables};

/// What the record of a reduction is called after.
const COMMAND: &str = "reproduce";

/// How many of the tables of several runs, and the claims, are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// So many.
    pub done: usize,
    /// How many there are.
    pub of: usize,
}

/// A reduction that has begun. [`Reduction::passing`] and [`Reduction::passed`] may be called for
/// several runs at a time.
pub struct Reduction<'a> {
    pipeline: &'a Pipeline,
    out: &'a Path,
    tables: PathBuf,
    files: FileSet,
    figures: Gathering<'a>,
    passed: Mutex<BTreeMap<String, Passed>>,
}

/// What stays of a run.
struct Passed {
    header: RunHeader,
    summary: Summary,
    residuals: Vec<ResidualRow>,
    first_global_slip: Option<FirstGlobalSlip>,
    /// One for each study that the run is in, by the study's place in the pipeline.
    studies: BTreeMap<usize, StudyRow>,
    measured: Measured,
}

/// A run that is going by.
pub struct Passing {
    collector: Collector,
    loads: LoadTable,
}

impl Passing {
    /// A record or an event out of its log.
    ///
    /// # Errors
    /// If an event cannot be read, or a table cannot be written.
    pub fn item(&mut self, item: &LogItem) -> Result<(), AnalysisError> {
        match item {
            LogItem::Record(record) => self.record(record),
            LogItem::Event(event) => self.event(event),
        }
    }

    /// A record of it.
    ///
    /// # Errors
    /// If a table cannot be written.
    pub fn record(&mut self, record: &Record) -> Result<(), AnalysisError> {
        self.collector.record(record);
        match record {
            Record::Step(record) => self.loads.push(record),
            Record::Fields(_) | Record::Window(_) => Ok(()),
        }
    }

    /// An event of it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn event(&mut self, event: &Event) -> Result<(), AnalysisError> {
        self.collector.event(event)
    }

    /// Its scenario.
    pub fn scenario(&self) -> &Scenario {
        self.collector.scenario()
    }
}

impl<'a> Reduction<'a> {
    /// Begins `tables/`, `figures/` and `reproduce.json`, which says what they are, in `out`, in place
    /// of those that are there: all, or none if something fails. None of them is written over what was
    /// read, `inputs` among it. `provenance` is whether figures name the code and bear a line at their
    /// foot.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(
        pipeline: &'a Pipeline,
        out: &'a Path,
        inputs: Inputs,
        provenance: bool,
    ) -> Result<Reduction<'a>, AnalysisError> {
        let (tables, figures) = (out.join("tables"), out.join("figures"));
        create_folder(&tables)?;
        create_folder(&figures)?;
        let files = FileSet::new(Existing::Replace, inputs);
        files.reserve(pipeline.outputs(out))?;
        files.reserve([record::path(out, COMMAND)])?;
        let figures = Gathering::begin(&pipeline.figure, figures, provenance);
        Ok(Reduction { pipeline, out, tables, files, figures, passed: Mutex::default() })
    }

    /// What it reads of a run.
    pub fn wants(&self, run: &str) -> Wants {
        self.pipeline.wants(run)
    }

    /// A run is about to go by.
    ///
    /// # Errors
    /// If a table cannot be written.
    pub fn passing(
        &self,
        run: &str,
        header: RunHeader,
        scenario: Scenario,
    ) -> Result<Passing, AnalysisError> {
        self.begun(Collector::new(run, header, scenario, self.wants(run)))
    }

    /// A run is about to go by, out of its log.
    ///
    /// # Errors
    /// If its scenario cannot be understood, or a table cannot be written.
    pub fn passing_log(&self, run: &str, path: &Path, reader: &RunReader) -> Result<Passing, AnalysisError> {
        self.begun(Collector::of_log(run, path, reader, self.wants(run))?)
    }

    fn begun(&self, collector: Collector) -> Result<Passing, AnalysisError> {
        let name = table_of(collector.name(), "load");
        let loads = LoadTable::begin(&self.files, &self.tables, &name, collector.both_ways())?;
        Ok(Passing { collector, loads })
    }

    /// A run has gone by, and this is its summary: writes its tables, and draws the figures that it was
    /// the last run of.
    ///
    /// # Errors
    /// If a file cannot be written, or a run has not what is to be shown of it.
    pub fn passed(
        &self,
        passing: Passing,
        has_ruptures: bool,
        summary: Summary,
    ) -> Result<(), AnalysisError> {
        let Passing { collector, loads } = passing;
        loads.finish()?;
        let run = collector.finish(has_ruptures);
        let write = |what: &str, mut table: DataFrame| {
            table_file::write(&self.files, &self.tables, &table_of(&run.name, what), &mut table)
        };
        let json = self.tables.join(table_of(&run.name, summaries::JSON));
        summaries::write_json(&self.files, &json, &summary)?;
        write(tables::RUPTURES, tables::ruptures(&run, &summary)?)?;
        let compared = || self.pipeline.precursors.iter().filter(|spec| spec.run == run.name);
        let laws: Vec<(LengthLaw, PrecursorRules)> = compared().map(|spec| (spec.law, spec.rules)).collect();
        if !laws.is_empty() {
            write(tables::PRECURSOR_RUPTURES, tables::precursor_ruptures(&run, &summary, &laws)?)?;
        }
        write("events", tables::events(&run)?)?;
        for spec in compared() {
            let mut table = tables::precursors(&run, spec.law, &spec.rules)?;
            table_file::write(&self.files, &self.tables, &spec.table(), &mut table)?;
        }
        let studies = self.pipeline.study.iter().enumerate();
        let studies = studies.filter(|(_, study)| study.runs.contains(&run.name));
        let stays = Passed {
            summary,
            residuals: laws.iter().map(|(law, rules)| ResidualRow::of(&run, *law, rules)).collect(),
            first_global_slip: (self.pipeline.first_global_slips.contains(&run.name))
                .then(|| FirstGlobalSlip::of(&run)),
            studies: studies
                .map(|(index, study)| Ok((index, study.row(&run)?)))
                .collect::<Result<_, AnalysisError>>()?,
            measured: Measured::of(&self.pipeline.claim, &run),
            header: run.header.clone(),
        };
        self.figures.run(&run, &self.files)?;
        self.passed.lock().expect("whoever adds a run does not panic").insert(run.name, stays);
        Ok(())
    }

    /// Writes the tables of several runs, and the claims, once all runs have gone by; and gives all
    /// files their names. `watcher` is told of every table. Gives back the summaries, in the order of
    /// the runs.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(self, watcher: &mut dyn FnMut(Progress)) -> Result<Vec<Summary>, AnalysisError> {
        let Reduction { pipeline, out, tables: folder, files, passed, .. } = self;
        let mut runs = passed.into_inner().expect("whoever adds a run does not panic");
        let singles = [
            true,
            !pipeline.precursors.is_empty(),
            !pipeline.first_global_slips.is_empty(),
            !pipeline.claim.is_empty(),
        ];
        let of = pipeline.study.len() + singles.into_iter().filter(|&there| there).count();
        let mut done = 0;
        let mut one_more = |more: usize| {
            done += more;
            watcher(Progress { done, of });
        };
        one_more(0);
        let write = |name: &str, mut table: DataFrame| table_file::write(&files, &folder, name, &mut table);
        let in_order = pipeline.run.iter().map(|spec| &runs[&spec.name].summary);
        summaries::write_table(&files, &folder.join(summaries::TABLE), in_order)?;
        one_more(1);
        if !pipeline.precursors.is_empty() {
            // Those of a run stand in the order in which the pipeline has them.
            let mut left: BTreeMap<&str, _> =
                runs.iter().map(|(name, run)| (name.as_str(), run.residuals.iter())).collect();
            let next = |run: &str| left.get_mut(run).and_then(Iterator::next).cloned();
            let rows: Vec<ResidualRow> =
                pipeline.precursors.iter().map(|spec| spec.run.as_str()).filter_map(next).collect();
            write(RESIDUALS, tables::residual_table(&rows)?)?;
            one_more(1);
        }
        if !pipeline.first_global_slips.is_empty() {
            let of_runs = pipeline.first_global_slips.iter();
            let rows: Vec<_> = of_runs.filter_map(|run| runs[run].first_global_slip.as_ref()).collect();
            write(FIRST_GLOBAL_SLIPS, tables::first_global_slips(&rows)?)?;
            one_more(1);
        }
        for (index, study) in pipeline.study.iter().enumerate() {
            let rows: Vec<_> = study.runs.iter().filter_map(|run| runs[run].studies.get(&index)).collect();
            write(&study_table(study), study.table(&rows)?)?;
            one_more(1);
        }
        if !pipeline.claim.is_empty() {
            let measured = runs.iter().map(|(name, run)| (name.as_str(), &run.measured)).collect();
            let outcomes = claims::judge(&pipeline.claim, &measured);
            write(CLAIMS, claims::table(&outcomes)?)?;
            let headers: Vec<&RunHeader> = runs.values().map(|run| &run.header).collect();
            files.write(&folder.join(CLAIMS_PAGE), claims::markdown(&pipeline.title, &outcomes, &headers))?;
            one_more(1);
        }
        let headers = runs.iter().map(|(name, run)| (name.as_str(), &run.header));
        record::write(&files, out, COMMAND, headers, pipeline.outputs(out))?;
        files.publish()?;
        let names = pipeline.run.iter().map(|spec| &spec.name);
        Ok(names.filter_map(|name| Some(runs.remove(name)?.summary)).collect())
    }
}
