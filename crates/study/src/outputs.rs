//! What is made of the results of runs over axes: tables, figures, claims and a page, in one pass.

use std::path::{Path, PathBuf};

use asperity_figures::draw::of_study::{Drawer, Origins};
use asperity_figures::{Figure, Kind};
use asperity_files::{Existing, FileSet, Inputs, create_folder};
use asperity_numbers::claims::{ClaimSpec, Measured};
use asperity_record::{Cell, Column};
use asperity_tables::Format;

use crate::collect::{RUNS, RowSink, TablesInProgress, collect};
use crate::error::StudyError;
use crate::file::Keep;
use crate::page::{self, StudyPage, claims_in, tables_in};
use crate::pipeline::{Pipeline, REPORT};
use crate::plan::{FILE, Plan};
use crate::reduction::{Beside, claim_files, write_claims};
use crate::results::Results;
use crate::study::{Grid, Study};
use crate::watch::Watcher;

/// The folder of the figures of a study.
pub(crate) const FIGURES: &str = "figures";
/// The folder of its tables.
pub(crate) const TABLES: &str = "tables";

/// The results of a study, of which outputs are made.
#[derive(Clone, Copy)]
pub struct Outputs<'a> {
    /// Its plan.
    pub plan: &'a Plan,
    /// The results.
    pub results: &'a Results,
    /// The folder of both.
    pub folder: &'a Path,
    /// Whether figures and pages name the code, and figures bear a line with their source.
    pub provenance: bool,
    /// Whoever waits for them.
    pub watcher: &'a dyn Watcher,
}

/// Files, and what they are made of.
struct Target<'a> {
    formats: &'a [Format],
    tables: &'a Path,
    figures: &'a [Figure],
    figures_in: &'a Path,
    /// The page that shows them; None if it stays as it is.
    page: Option<PathBuf>,
}

impl Outputs<'_> {
    /// Makes the tables in these formats, and the figures and claims that the study asks for, in its folder, or with the
    /// tables in another one; and, unless it has runs with names, whose page shows them, the page. All are replaced,
    /// or none if something fails. Returns what outputs of named runs need of them.
    ///
    /// # Errors
    /// If results contradict the plan or each other, or a file cannot be written.
    pub fn tables(&self, formats: &[Format], out: Option<&Path>) -> Result<Beside, StudyError> {
        let own = out.unwrap_or(self.folder);
        let tables = out.map_or_else(|| self.folder.join(TABLES), Path::to_owned);
        create_folder(&tables)?;
        let figures = &self.plan.common.figures;
        let target = Target {
            formats,
            tables: &tables,
            figures,
            figures_in: &own.join(FIGURES),
            page: self.plan.common.runs.is_empty().then(|| own.join(REPORT)),
        };
        let beside = self.make(Inputs::of([self.folder.join(FILE)]), &target)?;
        let figures = figures.iter().map(|figure| page::shown(self.plan, figure)).collect();
        Ok(Beside { figures, ..beside })
    }

    /// Draws the figures of the plan, or those of another file of the study, into its folder or another one. Returns the
    /// files.
    ///
    /// # Errors
    /// If there are none, or of other runs; if results contradict each other, or a file cannot be written.
    pub fn figures(&self, from: Option<&Path>, out: Option<&Path>) -> Result<Vec<PathBuf>, StudyError> {
        let plan = self.folder.join(FILE);
        let all = match from {
            None => self.plan.common.figures.clone(),
            Some(path) => self.figures_of(path)?,
        };
        if all.is_empty() {
            return Err(StudyError::Refused(format!(
                "{} asks for no figures (accepted: [[figure.family]] in a sweep, by --from)",
                from.unwrap_or(&plan).display()
            )));
        }
        let target = Target {
            formats: &[],
            tables: self.folder,
            figures: &all,
            figures_in: &out.map_or_else(|| self.folder.join(FIGURES), Path::to_owned),
            // The page shows the study's own tables and figures only.
            page: out.is_none().then(|| self.folder.join(REPORT)),
        };
        Ok(self.make(Inputs::of([plan.as_path()].into_iter().chain(from)), &target)?.files)
    }

    /// The figures in the present version of the study's file.
    fn figures_of(&self, path: &Path) -> Result<Vec<Figure>, StudyError> {
        let study = Study::read(path)?;
        let refused = |problem: String| StudyError::Refused(format!("--from {}: {problem}", path.display()));
        let keys = &self.plan.common.keys;
        let varied = study.grid.as_ref().map(Grid::keys).unwrap_or_default();
        if varied != *keys {
            let (varied, keys) = (varied.join(", "), keys.join(", "));
            return Err(refused(format!(
                "it varies {varied} (accepted: a study that varies the keys of the plan, {keys})"
            )));
        }
        let lengths = |figure: &&Figure| matches!(figure.kind, Kind::Lengths { .. });
        match study.figures.iter().find(lengths) {
            Some(Figure { file, .. }) if !self.plan.common.keep.contains(&Keep::Ruptures) => {
                Err(refused(format!(
                    "figure.family {file:?}: the study has kept no ruptures (accepted: figures of other kinds)"
                )))
            }
            _ => Ok(study.figures),
        }
    }

    /// Makes all outputs, or none if something fails.
    fn make(&self, inputs: Inputs, target: &Target<'_>) -> Result<Beside, StudyError> {
        let &Outputs { plan, results, provenance, watcher, .. } = self;
        let files = FileSet::new(Existing::Replace, inputs);
        let Target { formats, tables, figures, figures_in, page } = target;
        let mut passing = Passing {
            tables: TablesInProgress { files: &files, folder: tables, formats, tables: Vec::new() },
            page: StudyPage::of(plan, figures, String::new(), provenance),
            drawer: Drawer::new(figures),
            watcher,
            done: 0,
            of: plan.numbered() as usize,
        };
        collect(plan, results, &mut passing)?;
        let Passing { tables: written, page: study_page, drawer, .. } = passing;
        let mut written = written.finish(plan)?;
        let mut drawn = Vec::new();
        if !figures.is_empty() {
            create_folder(figures_in)?;
            let scenario_of = |run: u64| {
                let row = &plan.rows[run as usize - 1];
                plan.scenario(row).map(|(scenario, _)| scenario)
            };
            // The first run represents all, except for the axes.
            let accepted = plan.rows.iter().find(|row| row.refused.is_none());
            let origins = accepted.and_then(|row| scenario_of(row.run).ok()).map(|scenario| {
                let (set, step_s) = (scenario.parameter_set.word(), scenario.time.step_s);
                Origins::of(&scenario.name, set, step_s, &plan.common.code_version)
                    .varying(plan.common.keys.iter().cloned())
            });
            drawn =
                drawer.draw(&scenario_of, &origins.unwrap_or_default(), provenance, &files, figures_in)?;
        }
        let pipeline = Pipeline::of_plan(plan, self.folder)?.filter(|pipeline| !pipeline.claim.is_empty());
        let mut beside =
            pipeline.as_ref().map_or(Ok(Beside::default()), |pipeline| self.claimed(pipeline))?;
        let judged = match (&pipeline, page) {
            (Some(pipeline), Some(_)) if !formats.is_empty() => {
                written.extend(claim_files(tables));
                write_claims(pipeline, &beside, &files, tables)?
            }
            // Runs with names have claims of their own, and figures alone do not change any.
            (_, Some(page)) => claims_in(page.parent().unwrap_or(Path::new("")))?,
            _ => Vec::new(),
        };
        if let Some(page) = page {
            // Where only figures are redrawn, the page links to the existing tables.
            let tables = match formats.is_empty() {
                true => tables_in(page.parent().unwrap_or(Path::new("")))?,
                false => written.clone(),
            };
            let read = |file: &str| {
                let path = figures_in.join(file.strip_prefix("figures/").unwrap_or(file));
                // The existing file, if it is not redrawn.
                asperity_files::read_if_there(&files.begun(&path).unwrap_or(path))
            };
            files.write(page, study_page.html(page, results, judged, tables, &read)?)?;
            written.push(page.clone());
        }
        files.publish()?;
        written.extend(drawn);
        written.sort();
        beside.files = written;
        Ok(beside)
    }

    /// Measures claims by the summaries of the runs that they name.
    fn claimed(&self, pipeline: &Pipeline) -> Result<Beside, StudyError> {
        let mut beside = Beside::default();
        let plan = self.plan;
        for run in pipeline.claim.iter().flat_map(ClaimSpec::runs).filter_map(|run| run.parse::<u64>().ok()) {
            let row = run.checked_sub(1).and_then(|index| plan.rows.get(index as usize));
            // Runs that the scenario refuses have no id, and no results to measure.
            let Some(row) = row.filter(|row| row.run <= plan.numbered() && row.id.is_some()) else {
                continue;
            };
            let name = run.to_string();
            if beside.measured.contains_key(&name) {
                continue;
            }
            let refused = StudyError::refused(&self.folder.join(FILE));
            let (_, header) =
                plan.scenario(row).map_err(|problem| refused(format!("run {run}: {problem}")))?;
            let made = self.results.outcome(plan, run)?.and_then(Result::ok);
            let summary = made.as_ref().map(|made| &made.summary);
            let measured = Measured::of_summary(&pipeline.claim, &name, summary);
            beside.measured.insert(name, measured);
            beside.headers.push(header);
        }
        Ok(beside)
    }
}

/// Passes the rows of the tables on to what is made of them.
struct Passing<'a> {
    tables: TablesInProgress<'a>,
    page: StudyPage<'a>,
    drawer: Drawer,
    watcher: &'a dyn Watcher,
    done: usize,
    of: usize,
}

impl RowSink for Passing<'_> {
    fn begin(&mut self, table: &'static str, columns: &[Column]) -> Result<(), StudyError> {
        self.drawer.begin(table, columns);
        self.page.begin(table, columns)?;
        self.tables.begin(table, columns)
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) -> Result<(), StudyError> {
        self.drawer.row(table, cells);
        self.page.row(table, cells)?;
        if table == RUNS {
            self.done += 1;
            self.watcher.reached("runs", self.done, self.of);
        }
        self.tables.row(table, cells)
    }
}
