//! The page of a parameter study.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

use asperity_figures::Place;
use asperity_files::{FileError, FileSet, ShortLines};
use asperity_numbers::claim::{self, Claim};
use asperity_record::{Cell, Column};
use asperity_report::{
    Entry, Figure, Link, ReadFile, Shown as FigureShown, Sweep, UNNAMED, encoded, files_of_picture, picture,
};
use asperity_study::results::Counts;
use asperity_study::{Keep, Observer, Plan, RUNS, collect, segment};

use crate::exit::Failure;
use crate::outputs::refused;
use crate::progress::Board;
use crate::relative_link::relative_link;
use crate::report::ReportArguments;
use crate::study;

/// The results shown for each run, beside the keys that vary.
const NUMBERS: [&str; 8] = [
    "precursor_count",
    "longest_precursor_ratio",
    "global_rupture_count",
    "first_global_rupture_onset_s",
    "first_global_rupture_ft_fn",
    "front_speed_over_wave_speed_ratio",
    "recurrence_steady_s",
    "reason",
];

/// The rows shown from the table of runs.
pub(crate) struct Rows {
    keys: Vec<String>,
    shown: Vec<usize>,
    columns: Vec<(String, Option<&'static str>)>,
    rows: Vec<Vec<Cell>>,
    count: u64,
}

impl Rows {
    /// For a study: its axes, and its phase maps.
    pub(crate) fn of(plan: &Plan) -> Rows {
        let keys =
            plan.common.keys.iter().cloned().chain(maps(&plan.common.figures).map(|[.., value]| value));
        Rows { keys: keys.collect(), shown: Vec::new(), columns: Vec::new(), rows: Vec::new(), count: 0 }
    }
}

impl Observer for Rows {
    fn begin(&mut self, table: &'static str, columns: &[Column]) {
        if table != RUNS {
            return;
        }
        let is_shown = |name: &str| {
            ["run", "status"].contains(&name)
                || self.keys.iter().any(|key| key == name)
                || NUMBERS.contains(&name)
        };
        self.shown = (0..columns.len()).filter(|&n| is_shown(&columns[n].name)).collect();
        self.columns = self.shown.iter().map(|&n| (columns[n].name.to_string(), columns[n].unit)).collect();
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) {
        if table != RUNS {
            return;
        }
        self.count += 1;
        if self.rows.len() < Sweep::ROWS {
            self.rows.push(self.shown.iter().map(|&n| cells[n]).collect());
        }
    }
}

/// The columns that phase maps show: across, upwards and in colour.
fn maps(figures: &[asperity_figures::Figure]) -> impl Iterator<Item = [String; 3]> {
    let is_map =
        |figure: &&asperity_figures::Figure| matches!(figure.kind, asperity_figures::Kind::PhaseMap { .. });
    figures.iter().filter(is_map).filter_map(|figure| {
        let colour = figure.colour.as_ref()?;
        Some([&figure.x, &figure.y, colour].map(|quantity| quantity.column.clone()))
    })
}

/// Parts of a study's page besides its runs.
pub(crate) struct Shown<'a> {
    /// Its figures.
    pub(crate) figures: &'a [asperity_figures::Figure],
    /// Its claims.
    pub(crate) claims: Vec<Claim>,
    /// The links to its tables.
    pub(crate) links: Vec<Link>,
    /// The relative link from the page to the folder of the study.
    pub(crate) way: &'a str,
    /// Whether it names the code version of the runs.
    pub(crate) provenance: bool,
}

/// The page of a study; `read` reads figures.
pub(crate) fn page(
    plan: &Plan,
    counts: Counts,
    rows: Rows,
    shown: Shown<'_>,
    read: &ReadFile<'_, FileError>,
) -> Result<Sweep, FileError> {
    let varied = plan.common.keys.iter().enumerate().map(|(n, key)| {
        let mut values: Vec<String> = Vec::new();
        let mut known = BTreeSet::new();
        for row in &plan.rows {
            let value = row.values[n].to_string();
            if known.insert(value.clone()) {
                values.push(value);
            }
        }
        let words = match values.as_slice() {
            few if few.len() <= 10 => few.join(", "),
            [first, .., last] => format!("{} values, {first} to {last}", values.len()),
            _ => String::new(),
        };
        (key.clone(), words)
    });
    let figures = shown.figures.iter().map(|figure| {
        let FigureShown { file, title, caption, runs } = self::shown(plan, figure);
        let picture = picture(&file, read)?;
        Ok(Figure { picture, path: format!("{}{file}", shown.way), title, caption, runs })
    });
    let figures = figures.collect::<Result<_, FileError>>()?;
    let accepted = plan.rows.iter().find(|row| row.refused.is_none());
    Ok(Sweep {
        title: plan.common.title.clone(),
        scenario: accepted.and_then(|row| plan.resolve(row).ok()),
        varied: varied.collect(),
        state: study::in_words(plan, counts),
        columns: rows.columns,
        rows: rows.rows,
        row_count: rows.count,
        figures,
        maps: maps(shown.figures).collect(),
        folder: match shown.way.trim_end_matches('/') {
            "" => ".".to_owned(),
            // An encoded way has characters that mean something else to a shell.
            way if way.contains('%') => UNNAMED.to_owned(),
            way => way.to_owned(),
        },
        logs: plan.common.keep.contains(&Keep::Log).then(|| format!("{}logs/", shown.way)),
        claims: shown.claims,
        links: shown.links,
        code_version: shown.provenance.then(|| plan.common.code_version.clone()),
    })
}

/// A figure of the tables of runs over axes, as a page shows it.
pub(crate) fn shown(plan: &Plan, figure: &asperity_figures::Figure) -> FigureShown {
    let label = |quantity: &asperity_figures::Quantity| quantity.label.clone();
    let mut caption = format!("{} against {}", label(&figure.y), label(&figure.x));
    if let Some(colour) = &figure.colour {
        caption += &format!("; colour: {}", label(colour));
    }
    if let asperity_figures::Kind::PhaseMap { statistic, .. } = figure.kind
        && let Some(words) = statistic.of_runs_per_cell(runs_per_cell(plan, figure).into_iter())
    {
        caption += &format!("; {words}");
    }
    if let Some(facet) = &figure.facet {
        caption += &format!("; a panel for each {}", label(facet));
    }
    FigureShown {
        file: format!("figures/{}", figure.file),
        title: figure.title.clone(),
        caption: caption + ".",
        runs: Vec::new(),
    }
}

/// How many runs of a plan are in each cell of a phase map.
fn runs_per_cell(plan: &Plan, figure: &asperity_figures::Figure) -> Vec<usize> {
    let place = |column: &str| plan.common.keys.iter().position(|key| key == column);
    let of_cell = [Some(&figure.x), Some(&figure.y), figure.facet.as_ref()].into_iter().flatten();
    let of_cell: Vec<usize> = of_cell.filter_map(|quantity| place(&quantity.column)).collect();
    let at: Vec<_> = figure.at.iter().filter_map(|(key, wanted)| Some((place(key)?, wanted))).collect();
    let mut counts: BTreeMap<Vec<String>, usize> = BTreeMap::new();
    // Runs that have names have no values.
    for row in plan.rows.iter().filter(|row| !row.values.is_empty()) {
        let value = |n: usize| row.values[n].to_string();
        if at.iter().all(|(n, wanted)| Place::read(&value(*n)) == **wanted) {
            *counts.entry(of_cell.iter().map(|&n| value(n)).collect()).or_default() += 1;
        }
    }
    counts.into_values().collect()
}

/// The links to tables, by their paths.
pub(crate) fn links(page: &Path, tables: impl IntoIterator<Item = PathBuf>) -> Vec<Link> {
    let link = |path: PathBuf| {
        let words = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let of = path.parent().unwrap_or(Path::new(""));
        Link { path: format!("{}{}", relative_link(page, of), encoded(words.as_bytes())), words }
    };
    let mut links: Vec<Link> = tables.into_iter().map(link).collect();
    links.sort();
    links
}

/// Formats the page of a study from its folder, with the existing tables and figures.
pub(crate) fn of_folder(
    folder: &Path,
    arguments: &ReportArguments,
    files: &FileSet,
    board: &Board,
) -> Result<String, Failure> {
    let (plan, results) = study::read_for_tables(folder)?;
    let tables = tables_in(folder)?;
    files.add_inputs(inputs(folder, &plan)?).map_err(|error| refused("--out", &error, true))?;
    let mut rows = Rows::of(&plan);
    let (counts, _) = collect(&plan, &results, files, folder, &[], &mut rows).map_err(Failure::failed)?;
    board.line(&study::in_words(&plan, counts));
    let read = |file: &str| asperity_files::read_if_there(&folder.join(file));
    let shown = Shown {
        figures: &plan.common.figures,
        claims: claims_in(folder)?,
        links: links(&arguments.out, tables),
        way: &relative_link(&arguments.out, folder),
        provenance: !arguments.no_provenance,
    };
    Ok(page(&plan, counts, rows, shown, &read).map_err(Failure::failed)?.html())
}

/// The files of a study that a page uses or links to: plan, results, tables and pictures.
fn inputs(folder: &Path, plan: &Plan) -> Result<Vec<PathBuf>, Failure> {
    let mut inputs = segment::all(folder).map_err(|error| study::unreadable(folder, &error))?;
    inputs.push(folder.join(asperity_study::plan::FILE));
    inputs.extend(tables_in(folder)?);
    let pictures = plan.common.figures.iter().flat_map(|figure| files_of_picture(&figure.file));
    inputs.extend(pictures.map(|file| folder.join("figures").join(file)));
    Ok(inputs)
}

/// The entry of the study among several.
pub(crate) fn entry(
    folder: &Path,
    way: &str,
    report: Option<String>,
    files: &FileSet,
) -> Result<Entry, Failure> {
    let (plan, _) = study::read(folder)?;
    files.add_inputs(inputs(folder, &plan)?).map_err(|error| refused("--out", &error, true))?;
    let there =
        plan.common.figures.iter().filter(|figure| folder.join("figures").join(&figure.file).is_file());
    let figures = there.map(|figure| {
        let FigureShown { file, title, caption, .. } = shown(&plan, figure);
        [format!("{way}{file}"), title, caption]
    });
    Ok(Entry {
        title: plan.common.title.clone(),
        report,
        runs: plan.rows.len() as u64,
        claims: claims_in(folder)?,
        figures: figures.collect(),
    })
}

/// The table of claims in the folder of a study.
pub(crate) const CLAIMS: &str = "tables/claims.csv";

/// The claims of a study in its folder; none if it has none.
pub(crate) fn claims_in(folder: &Path) -> Result<Vec<Claim>, Failure> {
    let table = folder.join(CLAIMS);
    if !table.is_file() {
        return Ok(Vec::new());
    }
    let bad = |error: claim::ReadError| {
        Failure::BadInput(format!("{}: {error} (accepted: the table of a study)", table.display()))
    };
    let file = asperity_files::open(&table).map_err(|error| bad(csv::Error::from(error).into()))?;
    claim::read(ShortLines::of(file)).map_err(bad)
}

/// The tables in the folder of a study.
pub(crate) fn tables_in(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let tables = folder.join("tables");
    if !tables.is_dir() {
        return Ok(Vec::new());
    }
    let entries = asperity_files::entries(&tables).map_err(|error| study::unreadable(&tables, &error))?;
    let is_one = |path: &PathBuf| path.extension().is_some_and(|end| end == "csv" || end == "parquet");
    Ok(entries.iter().map(DirEntry::path).filter(is_one).collect())
}
