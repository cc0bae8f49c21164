//! The TOML that says what to run, reduce and draw; and the reducing and drawing.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use asperity_files::{Existing, FileSet, Inputs, create_folder};
use asperity_model::analytic::LengthLaw;
use asperity_record::bounds::check_toml;
use asperity_stream::at_once;
use asperity_summary::Summary;
use polars::prelude::DataFrame;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::claims::{self, Claim};
use crate::error::AnalysisError;
use crate::figures::Figures;
use crate::precursors::PrecursorRules;
use crate::run_data::RunData;
use crate::runs::{Ensemble, RunSpec, SpellOut};
use crate::study::Study;
use crate::{record, summaries, table_file, tables};

/// A pipeline, as written.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pipeline {
    /// What it reproduces, for headings.
    pub title: String,
    /// The runs, those of ensembles included.
    #[serde(default)]
    pub run: Vec<RunSpec>,
    /// Runs that differ in one key.
    #[serde(default)]
    pub ensemble: Vec<Ensemble>,
    /// Runs whose first global slips are set side by side in a table.
    #[serde(default)]
    pub first_global_slips: Vec<String>,
    /// The precursor tables, one per run and length law.
    #[serde(default)]
    pub precursors: Vec<PrecursorSpec>,
    /// The tables of numbers against a parameter.
    #[serde(default)]
    pub study: Vec<Study>,
    /// The figures, by kind.
    #[serde(default)]
    pub figure: Figures,
    /// The claims.
    #[serde(default)]
    pub claim: Vec<Claim>,
}

/// A run whose precursors are compared with a length law.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrecursorSpec {
    /// The run.
    pub run: String,
    /// The law.
    pub law: LengthLaw,
    /// Which events to merge and drop; by default none.
    #[serde(default)]
    pub rules: PrecursorRules,
}

impl PrecursorSpec {
    /// The name of its table.
    fn table(&self) -> String {
        table_of(&self.run, &format!("precursors-{}", self.law.file_word()))
    }
}

/// The name of a table of one run.
fn table_of(run: &str, what: &str) -> String {
    format!("{run}.{what}")
}

/// The name of a table of several.
fn study_table(study: &Study) -> String {
    format!("study-{}", study.name)
}

/// What the record of a reduction is called after.
const COMMAND: &str = "reproduce";

/// The names of the tables that there is one of.
const RESIDUALS: &str = "residuals";
const FIRST_GLOBAL_SLIPS: &str = "first-global-slips";
const CLAIMS: &str = "claims";
/// The same claims as a page.
const CLAIMS_PAGE: &str = "claims.md";

/// What a reduction is busy with, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Reading the runs, and writing the tables of each.
    Runs,
    /// Writing the tables of several runs, and the claims.
    Tables,
    /// Drawing the figures.
    Figures,
}

/// How far a reduction has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What it is busy with.
    pub stage: Stage,
    /// How many runs, tables or figures of this stage are done.
    pub done: usize,
    /// How many there are.
    pub of: usize,
}

/// Who is told how far a reduction has come: by whichever thread has done something, one at a
/// time.
type Watcher<'a> = &'a mut (dyn FnMut(Progress) + Send);

/// Counts what is done in a stage.
struct Counter<'a> {
    stage: Stage,
    of: usize,
    told: Mutex<(usize, Watcher<'a>)>,
}

impl<'a> Counter<'a> {
    fn begin(stage: Stage, of: usize, watcher: Watcher<'a>) -> Counter<'a> {
        watcher(Progress { stage, done: 0, of });
        Counter { stage, of, told: Mutex::new((0, watcher)) }
    }

    fn one_more(&self) {
        let mut told = self.told.lock().expect("whoever is told does not panic");
        let (done, watcher) = &mut *told;
        *done += 1;
        watcher(Progress { stage: self.stage, done: *done, of: self.of });
    }
}

impl Pipeline {
    /// Parses a pipeline and checks that it speaks of no run that it does not have.
    ///
    /// # Errors
    /// In words, with line and column where the TOML is at fault.
    pub fn parse(text: &str) -> Result<Pipeline, String> {
        check_toml(text).map_err(|too_long| too_long.to_string())?;
        let mut pipeline: Pipeline = toml::from_str(text).map_err(|error| error.to_string())?;
        pipeline.spell_out_ensembles()?;
        if pipeline.run.is_empty() {
            return Err("there are no runs (accepted: [[run]] or [[ensemble]])".to_owned());
        }
        let mut names = std::collections::BTreeSet::new();
        for run in &pipeline.run {
            if !names.insert(run.name.as_str()) {
                return Err(format!("two runs are called {}", run.name));
            }
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if run.name.is_empty() || !run.name.chars().all(plain) {
                return Err(format!(
                    "run name {:?} is no file name (accepted: letters, digits, - and _)",
                    run.name
                ));
            }
        }
        let spoken_of = pipeline
            .precursors
            .iter()
            .map(|spec| spec.run.as_str())
            .chain(pipeline.first_global_slips.iter().map(String::as_str))
            .chain(pipeline.claim.iter().flat_map(Claim::runs))
            .chain(pipeline.study.iter().flat_map(|study| study.runs.iter().map(String::as_str)))
            .chain(pipeline.figure.runs());
        for run in spoken_of {
            if !names.contains(run) {
                let known: Vec<&str> = names.into_iter().collect();
                return Err(format!("there is no run {run} (accepted: {})", known.join(", ")));
            }
        }
        // Files that it names are written into the folder that it is given, and nowhere else.
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        for (what, name) in (pipeline.study.iter().map(|study| ("study name", study.name.as_str())))
            .chain(pipeline.figure.files().map(|file| ("figure file", file)))
        {
            if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
                return Err(format!(
                    "{what} {name:?} is no file name (accepted: letters, digits, -, _ and dots inside)"
                ));
            }
        }
        // None takes the place of another.
        let tables = pipeline.tables();
        let tables = tables.iter().map(|table| ("table", table.as_str()));
        let mut written = std::collections::BTreeSet::new();
        for file in tables.chain(pipeline.figure.files().map(|file| ("figure file", file))) {
            if !written.insert(file) {
                let (what, name) = file;
                return Err(format!("{what} {name:?} would be written twice (accepted: different names)"));
            }
        }
        for spec in &pipeline.precursors {
            spec.rules.check().map_err(|error| format!("precursors of {}: {error}", spec.run))?;
        }
        for claim in &pipeline.claim {
            claim.check().map_err(|error| format!("claim about {}: {error}", claim.about))?;
        }
        Ok(pipeline)
    }

    /// Puts the runs of ensembles beside the others, and wherever an ensemble is named.
    fn spell_out_ensembles(&mut self) -> Result<(), String> {
        let mut spell_out = SpellOut::new(&self.ensemble)?;
        spell_out.add_runs(&mut self.run)?;
        let mut lists = (self.claim.iter_mut().flat_map(Claim::lists_mut))
            .chain(self.study.iter_mut().map(|study| &mut study.runs))
            .chain(self.figure.lists_mut())
            .chain([&mut self.first_global_slips]);
        lists.try_for_each(|names| spell_out.replace_in(names))
    }

    /// The laws with which the precursors of a run are compared.
    fn laws_of(&self, run: &RunSpec) -> impl Iterator<Item = (LengthLaw, PrecursorRules)> {
        let of_run = self.precursors.iter().filter(|spec| spec.run == run.name);
        of_run.map(|spec| (spec.law, spec.rules))
    }

    /// The names of its tables, without their endings.
    fn tables(&self) -> Vec<String> {
        let of_runs = self.run.iter().flat_map(|run| {
            let precursors = self.laws_of(run).next().map(|_| tables::PRECURSOR_RUPTURES);
            let names = [Some(tables::RUPTURES), precursors, Some("events"), Some("load")];
            names.into_iter().flatten().map(|what| table_of(&run.name, what))
        });
        let singles = [
            (!self.precursors.is_empty(), RESIDUALS),
            (!self.first_global_slips.is_empty(), FIRST_GLOBAL_SLIPS),
            (!self.claim.is_empty(), CLAIMS),
        ];
        of_runs
            .chain(self.precursors.iter().map(PrecursorSpec::table))
            .chain(self.study.iter().map(study_table))
            .chain(singles.into_iter().filter(|(there, _)| *there).map(|(_, name)| name.to_owned()))
            .collect()
    }

    /// All files that [`Pipeline::reduce`] writes into a folder, but for the record of them.
    pub fn outputs(&self, out: &Path) -> Vec<PathBuf> {
        let (tables, figures) = (out.join("tables"), out.join("figures"));
        let mut outputs: Vec<PathBuf> =
            self.tables().iter().flat_map(|name| table_file::paths(&tables, name)).collect();
        outputs.extend((!self.claim.is_empty()).then(|| tables.join(CLAIMS_PAGE)));
        outputs.push(tables.join(summaries::TABLE));
        outputs.extend(self.run.iter().map(|run| tables.join(table_of(&run.name, summaries::JSON))));
        outputs.extend(self.figure.files().map(|file| figures.join(file)));
        outputs
    }

    /// Reads the runs, and writes `tables/`, `figures/` and last `reproduce.json`, which says what
    /// they are, into `out`, in place of those that are there: all, or none if something fails. None of
    /// them is written over what was read, `inputs` among it. `summaries` are those of the runs, in
    /// their order. `watcher` is told of every stage as it begins and of everything that is
    /// done in it.
    ///
    /// # Errors
    /// If a log cannot be read, a figure lacks its data, or a file cannot be written.
    pub fn reduce(
        &self,
        runs_folder: &Path,
        out: &Path,
        mut inputs: Inputs,
        summaries: &[Summary],
        watcher: &mut (dyn FnMut(Progress) + Send),
    ) -> Result<(), AnalysisError> {
        let (table_folder, figure_folder) = (out.join("tables"), out.join("figures"));
        create_folder(&table_folder)?;
        create_folder(&figure_folder)?;
        let log = |spec: &RunSpec| runs_folder.join(format!("{}.mcap", spec.name));
        inputs.add(self.run.iter().map(log));
        let files = FileSet::new(Existing::Replace, inputs);
        files.reserve(self.outputs(out))?;
        files.reserve([record::path(out, COMMAND)])?;
        summaries::write_table(&files, &table_folder.join(summaries::TABLE), summaries)?;
        for summary in summaries {
            let file = table_of(&summary.run, summaries::JSON);
            summaries::write_json(&files, &table_folder.join(file), summary)?;
        }
        let counter = Counter::begin(Stage::Runs, self.run.len(), watcher);
        let specs: Vec<(&RunSpec, &Summary)> = self.run.iter().zip(summaries).collect();
        let runs = at_once(&specs, None, |(spec, summary)| {
            let run = RunData::read(&spec.name, &log(spec))?;
            let write = |what: &str, mut table: DataFrame| {
                table_file::write(&files, &table_folder, &table_of(&run.name, what), &mut table)
            };
            write(tables::RUPTURES, tables::ruptures(&run, summary)?)?;
            let laws: Vec<(LengthLaw, PrecursorRules)> = self.laws_of(spec).collect();
            if !laws.is_empty() {
                write(tables::PRECURSOR_RUPTURES, tables::precursor_ruptures(&run, summary, &laws)?)?;
            }
            write("events", tables::events(&run)?)?;
            write("load", tables::load_curve(&run)?)?;
            counter.one_more();
            Ok::<_, AnalysisError>((spec.name.clone(), run))
        })?;
        let runs = BTreeMap::from_iter(runs);
        self.write_tables(&runs, &files, &table_folder, watcher)?;
        let counter = Counter::begin(Stage::Figures, self.figure.files().count(), watcher);
        self.figure.draw(&runs, &files, &figure_folder, &|| counter.one_more())?;
        record::write(&files, out, COMMAND, runs.values(), self.outputs(out))?;
        Ok(files.publish()?)
    }

    /// Writes the tables of several runs, and the claims.
    fn write_tables(
        &self,
        runs: &BTreeMap<String, RunData>,
        files: &FileSet,
        folder: &Path,
        watcher: Watcher<'_>,
    ) -> Result<(), AnalysisError> {
        let singles =
            [!self.precursors.is_empty(), !self.first_global_slips.is_empty(), !self.claim.is_empty()];
        let of =
            self.precursors.len() + self.study.len() + singles.into_iter().filter(|&there| there).count();
        let counter = Counter::begin(Stage::Tables, of, watcher);
        let write = |name: &str, mut table: DataFrame| {
            table_file::write(files, folder, name, &mut table)?;
            counter.one_more();
            Ok::<_, AnalysisError>(())
        };
        let mut compared: Vec<(&RunData, LengthLaw, PrecursorRules)> = Vec::new();
        for spec in &self.precursors {
            let PrecursorSpec { run, law, rules } = spec;
            let run = &runs[run];
            write(&spec.table(), tables::precursors(run, *law, rules)?)?;
            compared.push((run, *law, *rules));
        }
        if !compared.is_empty() {
            write(RESIDUALS, tables::residual_table(&compared)?)?;
        }
        if !self.first_global_slips.is_empty() {
            let all: Vec<&RunData> = self.first_global_slips.iter().map(|run| &runs[run]).collect();
            write(FIRST_GLOBAL_SLIPS, tables::first_global_slips(&all)?)?;
        }
        for study in &self.study {
            write(&study_table(study), study.table(runs)?)?;
        }
        if !self.claim.is_empty() {
            let outcomes = claims::judge(&self.claim, runs);
            write(CLAIMS, claims::table(&outcomes)?)?;
            let page = claims::markdown(&self.title, &outcomes, runs);
            files.write(&folder.join(CLAIMS_PAGE), page)?;
        }
        Ok(())
    }
}
