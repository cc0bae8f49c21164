//! `asperity sweep collect` and `asperity sweep draw`: makes the tables and figures of a study in
//! one pass over its results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_figures::Figure;
use asperity_figures::draw::files_of;
use asperity_figures::draw::of_study::{Drawer, Origins, ScenarioOf};
use asperity_files::{Existing, FileSet, Inputs};
use asperity_numbers::claim::Claim;
use asperity_numbers::claims::{ClaimSpec, Measured};
use asperity_record::{Cell, Column};
use asperity_record::{EventKind, RunHeader, Rupture, SlipEvent};
use asperity_study::pipeline::Pipeline;
use asperity_study::plan::FILE;
use asperity_study::reduction::{Beside, Claimed, claim_files, write_claims};
use asperity_study::results::{Counts, State};
use asperity_study::{Grid, Keep, Study as StudyFile};
use asperity_study::{Observer, Plan, RUNS, Results, collect};
use asperity_tables::Csv;
use asperity_tables::format::Format;
use asperity_tables::parquet_tables::Parquet;
use clap::{Args, ValueEnum};

use crate::exit::Failure;
use crate::given::{self, Taken};
use crate::named_runs::{self, not_written};
use crate::outputs::{A_FOLDER, create_folder, fits};
use crate::progress::{Board, Stages};
use crate::report;
use crate::study::{in_words, outcome, read_for_tables, some_of};
use crate::study_page::{self, Rows, Shown};
use crate::terminal::say;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SweepTable {
    /// Columns with types and units, compressed.
    Parquet,
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
}

pub(crate) const USUAL_FORMAT: &str = "parquet";

#[derive(Debug, Args)]
pub(crate) struct SweepCollectArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The formats of the tables.
    #[arg(long, value_enum, value_name = "FORMAT", value_delimiter = ',', default_value = USUAL_FORMAT)]
    pub(crate) to: Vec<SweepTable>,
    /// Folder for the tables, and for a folder of figures [default: tables and
    /// figures, in the folder of the study].
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SweepDrawArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The sweep whose figures are drawn [default: as it was planned].
    #[arg(long, value_name = "SWEEP.toml")]
    pub(crate) from: Option<PathBuf>,
    /// Folder for the figures [default: figures, in the folder of the study].
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

/// The folder of the figures of a study.
const FIGURES: &str = "figures";
/// The folder of its tables.
const TABLES: &str = "tables";

pub(crate) fn tables(arguments: &SweepCollectArguments, board: &Board) -> Result<(), Failure> {
    let SweepCollectArguments { folder, to, out, no_provenance } = arguments;
    out.as_ref().map_or(Ok(()), |out| fits("--out", out, "", A_FOLDER))?;
    let (plan, results) = read_for_tables(folder)?;
    let has_names = !plan.common.runs.is_empty();
    if has_names && out.is_some() {
        return Err(Failure::BadInput(
            "--out: the study has runs with names (accepted: no --out, since their outputs are written \
             beside their logs)"
                .to_owned(),
        ));
    }
    let provenance = !no_provenance;
    let mut beside = Beside::default();
    if plan.numbered() > 0 {
        let formats: Vec<&dyn Format> = to.iter().map(|table| format(*table)).collect();
        let tables = out.clone().unwrap_or_else(|| folder.join(TABLES));
        let own = out.as_ref().unwrap_or(folder);
        let study = Study { plan: &plan, inputs: Inputs::of([folder.join(FILE)]), board };
        let made = study.tables_and_figures(&results, &tables, &formats, own, provenance)?;
        made.paths.iter().try_for_each(|path| say(path.display()))?;
        {
            beside = self::beside(&plan, folder, made.claimed)?;
        }
    }
    let counts = results.counts();
    board.line(&in_words(&plan, counts));
    if has_names {
        let missing: Vec<&str> = (plan.numbered() + 1..)
            .zip(&plan.common.runs)
            .filter(|(run, _)| results.state(*run) != State::Logged)
            .map(|(_, named)| named.name.as_str())
            .collect();
        if !missing.is_empty() {
            board.line(&format!("no tables, figures and claims without {}", some_of(&missing)));
        } else {
            named_runs::of_plan(&plan, folder, beside, provenance, board)?;
        }
    }
    outcome(counts)
}

/// Makes tables and figures of the runs of a plan over axes, in its folder, and reports the files.
pub(crate) fn of_grid(
    plan: &Plan,
    folder: &Path,
    provenance: bool,
    board: &Board,
) -> Result<Beside, Failure> {
    let (_, results) = read_for_tables(folder)?;
    let study = Study { plan, inputs: Inputs::of([folder.join(FILE)]), board };
    let tables = folder.join(TABLES);
    let made = study.tables_and_figures(&results, &tables, &[&Csv, &Parquet], folder, provenance)?;
    beside(plan, folder, made.claimed)
}

/// The tables and figures of runs over axes, which accompany the outputs of named runs.
fn beside(plan: &Plan, folder: &Path, claimed: Claimed) -> Result<Beside, Failure> {
    let of_grid = [RUNS, EventKind::of::<SlipEvent>().table, EventKind::of::<Rupture>().table];
    let is_of_grid =
        |path: &PathBuf| path.file_stem().is_some_and(|stem| of_grid.iter().any(|name| stem == *name));
    let mut files = study_page::tables_in(folder)?;
    files.retain(is_of_grid);
    files.sort();
    let figures = &plan.common.figures;
    files.extend(figures.iter().flat_map(|figure| files_of(&folder.join(FIGURES).join(&figure.file))));
    let figures = figures.iter().map(|figure| study_page::shown(plan, figure)).collect();
    Ok(Beside { figures, files, claimed })
}

pub(crate) fn figures(arguments: &SweepDrawArguments, board: &Board) -> Result<(), Failure> {
    let SweepDrawArguments { folder, from, out, no_provenance } = arguments;
    out.as_ref().map_or(Ok(()), |out| fits("--out", out, "", A_FOLDER))?;
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
    let made = study.make(&results, folder, &[], &figures)?;
    made.paths.iter().try_for_each(|path| say(path.display()))?;
    let counts = results.counts();
    board.line(&in_words(&plan, counts));
    outcome(counts)
}

/// The figures in the present version of the sweep's file.
fn figures_of(path: &Path, plan: &Plan) -> Result<Vec<Figure>, Failure> {
    given::check(path, Taken::Runs)?;
    let study = StudyFile::read(path).map_err(Failure::bad_input)?;
    let keys = &plan.common.keys;
    let varied = study.grid.as_ref().map(Grid::keys).unwrap_or_default();
    if varied != *keys {
        return Err(Failure::BadInput(format!(
            "--from {}: it varies {} (accepted: a study that varies the keys of the plan, {})",
            path.display(),
            varied.join(", "),
            keys.join(", ")
        )));
    }
    let lengths = |figure: &&Figure| matches!(figure.kind, asperity_figures::Kind::Lengths { .. });
    match study.figures.iter().find(lengths) {
        Some(figure) if !plan.common.keep.contains(&Keep::Ruptures) => Err(Failure::BadInput(format!(
            "--from {}: figure.lengths {:?}: the study has kept no ruptures (accepted: figures of other kinds)",
            path.display(),
            figure.file
        ))),
        _ => Ok(study.figures),
    }
}

fn format(table: SweepTable) -> &'static dyn Format {
    match table {
        SweepTable::Parquet => &Parquet,
        SweepTable::Csv => &Csv,
    }
}

/// A study and its requested outputs.
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
    /// Makes the tables and figures that the study asks for; and, unless it has runs with names, which have
    /// one of their own, the page. Returns the files.
    fn tables_and_figures(
        self,
        results: &Results,
        tables: &Path,
        formats: &[&dyn Format],
        own: &Path,
        provenance: bool,
    ) -> Result<Made, Failure> {
        create_folder(tables)?;
        let page = self.plan.common.runs.is_empty().then(|| own.join(report::PAGE));
        let all = &self.plan.common.figures;
        let figures = Figures { all, folder: own.join(FIGURES), page, provenance };
        self.make(results, tables, formats, &figures)
    }

    /// Makes all outputs, or none if something fails. Returns the files.
    fn make(
        self,
        results: &Results,
        tables: &Path,
        formats: &[&dyn Format],
        figures: &Figures<'_>,
    ) -> Result<Made, Failure> {
        let files = FileSet::new(Existing::Replace, self.inputs);
        let mut passing = Passing {
            stages: self.board.stages("tables"),
            done: 0,
            of: self.plan.numbered() as usize,
            rows: Rows::of(self.plan),
            claims: Claims::of(self.plan)?,
            drawer: Drawer::new(figures.all),
        };
        let (counts, mut paths) =
            collect(self.plan, results, &files, tables, formats, &mut passing).map_err(Failure::failed)?;
        if !figures.all.is_empty() {
            {
                create_folder(&figures.folder)?;
                let scenario_of = |run: u64| {
                    let row = &self.plan.rows[run as usize - 1];
                    self.plan.scenario_of_results(row).map(|(scenario, _)| scenario)
                };
                let origins = origins(self.plan, &scenario_of);
                let drawn =
                    passing.drawer.draw(&scenario_of, &origins, figures.provenance, &files, &figures.folder);
                paths.extend(drawn.map_err(Failure::failed)?);
            }
        }
        let Claims { pipeline, claimed, .. } = passing.claims;
        let judged = match (&pipeline, &figures.page) {
            (Some(pipeline), Some(_)) if !formats.is_empty() => {
                paths.extend(claim_files(tables));
                write_claims(pipeline, &claimed, &files, tables).map_err(not_written)?
            }
            // Runs with names have claims of their own, and figures alone do not change any.
            (_, Some(page)) => study_page::claims_in(page.parent().unwrap_or(Path::new("")))?,
            _ => Vec::new(),
        };
        let rows = passing.rows;
        if let Some(path) = &figures.page {
            write_page(path, self.plan, counts, (rows, judged), &paths, &files, figures)?;
            paths.push(path.clone());
        }
        files.publish().map_err(Failure::failed)?;
        paths.sort();
        Ok(Made { paths, claimed })
    }
}

/// Writes the page about the files to be published.
fn write_page(
    page: &Path,
    plan: &Plan,
    counts: Counts,
    (rows, claims): (Rows, Vec<Claim>),
    written: &[PathBuf],
    files: &FileSet,
    figures: &Figures<'_>,
) -> Result<(), Failure> {
    let mut tables: Vec<PathBuf> =
        written.iter().filter(|path| !path.starts_with(&figures.folder)).cloned().collect();
    if tables.is_empty() {
        // Only figures are redrawn; the page links to the existing tables.
        tables = study_page::tables_in(page.parent().unwrap_or(Path::new("")))?;
    }
    let read = |file: &str| {
        let path = figures.folder.join(file.strip_prefix("figures/").unwrap_or(file));
        // The existing file, if it is not redrawn.
        asperity_files::read_if_there(&files.begun(&path).unwrap_or(path))
    };
    let shown = Shown {
        figures: figures.all,
        claims,
        links: study_page::links(page, tables),
        way: "",
        provenance: figures.provenance,
    };
    let shown = study_page::page(plan, counts, rows, shown, &read).map_err(Failure::failed)?;
    files.write(page, shown.html()).map_err(Failure::failed)
}

/// The origin of the tables: the first run represents all, except for the axes.
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
    claims: Claims,
    drawer: Drawer,
}

/// The outputs of runs over axes.
struct Made {
    paths: Vec<PathBuf>,
    claimed: Claimed,
}

/// Measures claims in the rows of the table of runs.
struct Claims {
    pipeline: Option<Pipeline>,
    /// The headers of the runs that claims name, by their numbers.
    headers: BTreeMap<u64, RunHeader>,
    columns: Vec<String>,
    claimed: Claimed,
}

impl Claims {
    /// Of the study of a plan; none where it makes no claims.
    fn of(plan: &Plan) -> Result<Claims, Failure> {
        let pipeline = plan.common.study_toml.as_deref().map(|text| {
            let pipeline = Pipeline::beside(text, plan.numbered(), &|at| plan.runs_at(at));
            pipeline.map_err(|problem| Failure::BadInput(format!("{FILE}: {problem}")))
        });
        let pipeline = pipeline.transpose()?.filter(|pipeline| !pipeline.claim.is_empty());
        let mut headers = BTreeMap::new();
        let claims = pipeline.iter().flat_map(|pipeline| &pipeline.claim);
        for run in claims.flat_map(ClaimSpec::runs).filter_map(|run| run.parse::<u64>().ok()) {
            let row = run.checked_sub(1).and_then(|index| plan.rows.get(index as usize));
            // Runs that the scenario refuses have no id, and no results to measure.
            if let Some(row) = row.filter(|row| row.run <= plan.numbered() && row.id.is_some()) {
                let scenario = plan.scenario_of_results(row);
                let (_, header) =
                    scenario.map_err(|problem| Failure::BadInput(format!("{FILE}: run {run}: {problem}")))?;
                headers.insert(run, header);
            }
        }
        Ok(Claims { pipeline, headers, columns: Vec::new(), claimed: Claimed::default() })
    }

    fn row(&mut self, cells: &[Cell]) {
        let (Some(pipeline), Some(Cell::Step(run))) = (&self.pipeline, cells.first()) else { return };
        let Some(header) = self.headers.remove(run) else { return };
        let number = |name: &str| {
            let place = self.columns.iter().position(|column| column == name)?;
            match cells[place] {
                Cell::Number(value) => Some(value),
                Cell::Count(count) => Some(f64::from(count)),
                Cell::Step(step) => Some(step as f64),
                Cell::Flag(flag) => Some(f64::from(u8::from(flag))),
                _ => None,
            }
        };
        let run = run.to_string();
        let measured = Measured::of_summary(&pipeline.claim, &run, &number);
        self.claimed.measured.insert(run, measured);
        self.claimed.headers.push(header);
    }
}

impl Observer for Passing {
    fn begin(&mut self, table: &'static str, columns: &[Column]) {
        {
            self.drawer.begin(table, columns);
            if table == RUNS {
                self.claims.columns = columns.iter().map(|column| column.name.to_string()).collect();
            }
        }
        self.rows.begin(table, columns);
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) {
        self.drawer.row(table, cells);
        self.rows.row(table, cells);
        if table == RUNS {
            self.claims.row(cells);
            self.done += 1;
            self.stages.reached("runs", self.done, self.of);
        }
    }
}
