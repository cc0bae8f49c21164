//! `asperity sweep collect` and `asperity sweep draw`: makes the tables and figures of a study in
//! one pass over its results.

use std::path::{Path, PathBuf};

use asperity_figures::Figure;
#[cfg(feature = "analysis")]
use asperity_figures::draw::of_study::{Drawer, Origins, ScenarioOf};
use asperity_files::{Existing, FileSet, Inputs};
use asperity_record::{Cell, Column};
#[cfg(feature = "analysis")]
use asperity_run::CODE_VERSION;
use asperity_study::plan::FILE;
use asperity_study::results::Counts;
#[cfg(feature = "analysis")]
use asperity_study::{Keep, Sweep};
use asperity_study::{Observer, Plan, RUNS, Results, collect};
use asperity_tables::Csv;
use asperity_tables::format::Format;
#[cfg(feature = "analysis")]
use asperity_tables::parquet_tables::Parquet;

#[cfg(feature = "analysis")]
use crate::args::SweepDrawArguments;
use crate::args::{SweepCollectArguments, SweepTable};
use crate::exit::Failure;
use crate::outputs::create_folder;
use crate::progress::{Board, Stages};
use crate::report;
use crate::study::{in_words, outcome, read_for_tables};
use crate::study_page::{self, Rows, Shown};
use crate::terminal::say;

/// The folder of the figures of a study.
const FIGURES: &str = "figures";

pub(crate) fn tables(arguments: &SweepCollectArguments, board: &Board) -> Result<(), Failure> {
    let SweepCollectArguments { folder, to, out, no_provenance } = arguments;
    let (plan, results) = read_for_tables(folder)?;
    let tables = out.clone().unwrap_or_else(|| folder.join("tables"));
    create_folder(&tables)?;
    let formats: Vec<&dyn Format> = to.iter().map(|table| format(*table)).collect();
    let study = Study { plan: &plan, inputs: Inputs::of([folder.join(FILE)]), board };
    let own = out.as_ref().unwrap_or(folder);
    let figures = Figures {
        all: &plan.common.figures,
        folder: own.join(FIGURES),
        page: Some(own.join(report::PAGE)),
        provenance: !no_provenance,
    };
    let counts = study.make(&results, &tables, &formats, &figures)?;
    board.line(&in_words(&plan, counts));
    outcome(counts)
}

#[cfg(feature = "analysis")]
pub(crate) fn figures(arguments: &SweepDrawArguments, board: &Board) -> Result<(), Failure> {
    let SweepDrawArguments { folder, from, out, no_provenance } = arguments;
    let (plan, results) = read_for_tables(folder)?;
    let mut inputs = vec![folder.join(FILE)];
    let all = match from {
        None => plan.common.figures.clone(),
        Some(path) => {
            inputs.push(path.clone());
            figures_of(path, &plan)?
        }
    };
    let asks = from.clone().unwrap_or_else(|| folder.join(FILE));
    if all.is_empty() {
        return Err(Failure::BadInput(format!(
            "{} asks for no figures (accepted: [[figure.phase-map]], [[figure.family]], [[figure.lengths]] in a sweep, by \
             --from)",
            asks.display()
        )));
    }
    let study = Study { plan: &plan, inputs: Inputs::of(&inputs), board };
    let to = out.clone().unwrap_or_else(|| folder.join(FIGURES));
    // The page shows the study's own tables and figures only.
    let page = out.is_none().then(|| folder.join(report::PAGE));
    let figures = Figures { all: &all, folder: to, page, provenance: !no_provenance };
    let counts = study.make(&results, folder, &[], &figures)?;
    board.line(&in_words(&plan, counts));
    outcome(counts)
}

/// The figures in the present version of the sweep's file.
#[cfg(feature = "analysis")]
fn figures_of(path: &Path, plan: &Plan) -> Result<Vec<Figure>, Failure> {
    let sweep = Sweep::read(path).map_err(Failure::bad_input)?;
    let keys = &plan.common.keys;
    if sweep.keys() != *keys {
        return Err(Failure::BadInput(format!(
            "--from {}: it varies {} (accepted: a sweep that varies what the plan does, {})",
            path.display(),
            sweep.keys().join(", "),
            keys.join(", ")
        )));
    }
    let lengths = |figure: &&Figure| matches!(figure.kind, asperity_figures::Kind::Lengths { .. });
    match sweep.figures.iter().find(lengths) {
        Some(figure) if !plan.common.keep.contains(&Keep::Ruptures) => Err(Failure::BadInput(format!(
            "--from {}: figure.lengths {:?}: the study has kept no ruptures (accepted: figures of other kinds)",
            path.display(),
            figure.file
        ))),
        _ => Ok(sweep.figures),
    }
}

fn format(table: SweepTable) -> &'static dyn Format {
    match table {
        #[cfg(feature = "analysis")]
        SweepTable::Parquet => &Parquet,
        SweepTable::Csv => &Csv,
    }
}

/// A study and what to make of it.
struct Study<'a> {
    plan: &'a Plan,
    inputs: Inputs,
    board: &'a Board,
}

/// The figures to draw, and their folder.
struct Figures<'a> {
    all: &'a [Figure],
    folder: PathBuf,
    /// The page that shows them; None if it stays as it is.
    page: Option<PathBuf>,
    /// Whether they state the code version in a line at their foot.
    provenance: bool,
}

impl Study<'_> {
    /// Makes everything, or nothing if something fails, and lists the files.
    fn make(
        self,
        results: &Results,
        tables: &Path,
        formats: &[&dyn Format],
        figures: &Figures<'_>,
    ) -> Result<Counts, Failure> {
        let files = FileSet::new(Existing::Replace, self.inputs);
        let mut passing = Passing {
            stages: self.board.stages("tables"),
            done: 0,
            of: self.plan.rows.len(),
            rows: Rows::of(&self.plan.common.keys),
            #[cfg(feature = "analysis")]
            drawer: Drawer::new(figures.all),
        };
        let (counts, mut paths) =
            collect(self.plan, results, &files, tables, formats, &mut passing).map_err(Failure::failed)?;
        if !figures.all.is_empty() {
            #[cfg(feature = "analysis")]
            {
                create_folder(&figures.folder)?;
                // Ids of plans by other code versions differ, and cannot verify the scenarios.
                let is_own = self.plan.common.code_version == CODE_VERSION;
                let scenario_of = |run: u64| {
                    let row = &self.plan.rows[run as usize - 1];
                    if !is_own {
                        return self.plan.common.resolve(&row.values);
                    }
                    self.plan.scenario(row).map(|(scenario, _)| scenario)
                };
                let origins = origins(self.plan, &scenario_of);
                let drawn =
                    passing.drawer.draw(&scenario_of, &origins, figures.provenance, &files, &figures.folder);
                paths.extend(drawn.map_err(Failure::failed)?);
            }
            #[cfg(not(feature = "analysis"))]
            self.board.line(&format!(
                "{} is left as it is: this program was built without figures",
                figures.folder.display()
            ));
        }
        let rows = passing.finish();
        if let Some(path) = &figures.page {
            write_page(path, self.plan, counts, rows, &paths, &files, figures)?;
            paths.push(path.clone());
        }
        files.publish().map_err(Failure::failed)?;
        paths.sort();
        paths.into_iter().try_for_each(|path| say(path.display()))?;
        Ok(counts)
    }
}

/// Writes the page about the files to be published.
fn write_page(
    page: &Path,
    plan: &Plan,
    counts: Counts,
    rows: Rows,
    written: &[PathBuf],
    files: &FileSet,
    figures: &Figures<'_>,
) -> Result<(), Failure> {
    let mut tables: Vec<PathBuf> =
        written.iter().filter(|path| !path.starts_with(&figures.folder)).cloned().collect();
    if tables.is_empty() {
        // Only figures are redrawn; the page links to the existing tables.
        tables = study_page::tables_in(page.parent().unwrap_or(Path::new("")));
    }
    let read = |file: &str| {
        let path = figures.folder.join(file.strip_prefix("figures/")?);
        // The existing file, if it is not redrawn.
        asperity_files::read(&files.begun(&path).unwrap_or(path)).ok()
    };
    let shown = Shown {
        figures: figures.all,
        links: study_page::links(page, tables),
        way: "",
        provenance: figures.provenance,
    };
    let html = study_page::page(plan, counts, rows, shown, &read).html();
    files.write(page, html).map_err(Failure::failed)
}

/// The origin of the tables: the first run stands for all, except for what varies.
#[cfg(feature = "analysis")]
fn origins(plan: &Plan, scenario_of: ScenarioOf<'_>) -> Origins {
    let accepted = plan.rows.iter().find(|row| row.refused.is_none());
    let Some(scenario) = accepted.and_then(|row| scenario_of(row.run).ok()) else {
        return Origins::default();
    };
    let set = scenario.parameter_set.word();
    Origins::of(&scenario.name, set, scenario.time.step_s, &plan.common.code_version)
        .varying(plan.common.keys.iter().cloned())
}

/// Observes the rows of the tables.
struct Passing {
    stages: Stages,
    done: usize,
    of: usize,
    rows: Rows,
    #[cfg(feature = "analysis")]
    drawer: Drawer,
}

impl Passing {
    /// The rows for the page.
    fn finish(self) -> Rows {
        self.rows
    }
}

impl Observer for Passing {
    fn begin(&mut self, table: &'static str, columns: &[Column]) {
        #[cfg(feature = "analysis")]
        self.drawer.begin(table, columns);
        self.rows.begin(table, columns);
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) {
        #[cfg(feature = "analysis")]
        self.drawer.row(table, cells);
        self.rows.row(table, cells);
        if table == RUNS {
            self.done += 1;
            self.stages.reached("runs", self.done, self.of);
        }
    }
}
