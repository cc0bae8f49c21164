//! The page of runs over axes.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

use asperity_figures::{Figure, Kind, Quantity, place as place_of};
use asperity_files::{FileError, FileSet, ShortLines};
use asperity_numbers::claim::{self, Claim};
use asperity_record::{Cell, Column};
use asperity_report::{
    Entry, Figure as ShownFigure, Link, ReadFile, Sweep, UNNAMED, encoded, files_of_picture, picture,
};

use crate::axis::spelled;
use crate::collect::{RUNS, RowSink, collect};
use crate::error::StudyError;
use crate::file::Keep;
use crate::outputs::{FIGURES, TABLES};
use crate::plan::{self, Plan};
use crate::relative_link::relative_link;
use crate::results::Results;
use crate::segment;
use crate::staging::LOGS;

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

/// A page in progress, which receives its rows from the table of runs.
pub(crate) struct StudyPage<'a> {
    plan: &'a Plan,
    figures: &'a [Figure],
    /// The relative link from the page to the folder of the study.
    way: String,
    /// Whether it names the code version of the runs.
    provenance: bool,
    shown: Vec<usize>,
    columns: Vec<(String, Option<&'static str>)>,
    rows: Vec<Vec<Cell>>,
}

impl<'a> StudyPage<'a> {
    pub(crate) fn of(plan: &'a Plan, figures: &'a [Figure], way: String, provenance: bool) -> StudyPage<'a> {
        StudyPage { plan, figures, way, provenance, shown: Vec::new(), columns: Vec::new(), rows: Vec::new() }
    }
}

impl RowSink for StudyPage<'_> {
    fn begin(&mut self, table: &'static str, columns: &[Column]) -> Result<(), StudyError> {
        if table == RUNS {
            // Its axes, and what its phase maps show.
            let common = &self.plan.common;
            let keys: Vec<String> =
                common.keys.iter().cloned().chain(maps(&common.figures).map(|[.., value]| value)).collect();
            let is_shown = |name: &str| {
                ["run", "status"].contains(&name)
                    || keys.iter().any(|key| key == name)
                    || NUMBERS.contains(&name)
            };
            self.shown = (0..columns.len()).filter(|&n| is_shown(&columns[n].name)).collect();
            self.columns =
                self.shown.iter().map(|&n| (columns[n].name.to_string(), columns[n].unit)).collect();
        }
        Ok(())
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) -> Result<(), StudyError> {
        if table == RUNS && self.rows.len() < Sweep::ROWS {
            self.rows.push(self.shown.iter().map(|&n| cells[n].clone()).collect());
        }
        Ok(())
    }
}

impl StudyPage<'_> {
    /// Formats the page at a path, with links to tables; `read` reads figures.
    pub(crate) fn html(
        self,
        page: &Path,
        results: &Results,
        claims: Vec<Claim>,
        tables: Vec<PathBuf>,
        read: &ReadFile<'_, FileError>,
    ) -> Result<String, StudyError> {
        let StudyPage { plan, figures, way, provenance, columns, rows, .. } = self;
        let varied = plan.common.keys.iter().enumerate().map(|(n, key)| {
            let mut values: Vec<String> = Vec::new();
            let mut known = BTreeSet::new();
            for row in &plan.rows {
                let value = spelled(&row.values[n]);
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
        let beside = page.parent().unwrap_or(Path::new("")).join(&way).join(LOGS);
        // The first rows are those of the first runs.
        let pages = (1..=rows.len() as u64).filter(|run| beside.join(format!("{run}.html")).is_file());
        let pages = pages.map(|run| (run, format!("{way}{LOGS}/{run}.html"))).collect();
        let accepted = plan.rows.iter().find(|row| row.refused.is_none());
        let sweep = Sweep {
            title: plan.common.title.clone(),
            scenario: accepted.and_then(|row| plan.resolve(row).ok()),
            varied: varied.collect(),
            state: results.in_words(),
            columns,
            rows,
            row_count: plan.numbered(),
            figures: figures
                .iter()
                .map(|figure| {
                    let mut shown = shown(plan, figure);
                    shown.picture = picture(&shown.file, read)?;
                    shown.file.insert_str(0, &way);
                    Ok(shown)
                })
                .collect::<Result<_, FileError>>()?,
            maps: maps(figures).collect(),
            folder: match way.trim_end_matches('/') {
                "" => ".".to_owned(),
                // An encoded way has characters that mean something else to a shell.
                way if way.contains('%') => UNNAMED.to_owned(),
                way => way.to_owned(),
            },
            logs: plan.common.keep.contains(&Keep::Log).then(|| format!("{way}{LOGS}/")),
            pages,
            claims,
            links: links(page, tables),
            code_version: provenance.then(|| plan.common.code_version.clone()),
        };
        Ok(sweep.html())
    }
}

/// The columns that phase maps show: across, upwards and in colour.
fn maps(figures: &[Figure]) -> impl Iterator<Item = [String; 3]> {
    let is_map = |figure: &&Figure| matches!(figure.kind, Kind::PhaseMap { .. });
    figures.iter().filter(is_map).filter_map(|figure| {
        let colour = figure.colour.as_ref()?;
        Some([&figure.x, &figure.y, colour].map(|quantity| quantity.column.clone()))
    })
}

/// A figure of the tables of runs over axes, as a page shows it.
pub(crate) fn shown(plan: &Plan, figure: &Figure) -> ShownFigure {
    let label = |quantity: &Quantity| quantity.label.clone();
    let mut caption = format!("{} against {}", label(&figure.y), label(&figure.x));
    if let Some(colour) = &figure.colour {
        caption += &format!("; colour: {}", label(colour));
    }
    if let Kind::PhaseMap { statistic, .. } = figure.kind
        && let Some(words) = statistic.of_runs_per_cell(runs_per_cell(plan, figure).into_iter())
    {
        caption += &format!("; {words}");
    }
    if let Some(facet) = &figure.facet {
        caption += &format!("; a panel for each {}", label(facet));
    }
    ShownFigure {
        file: format!("figures/{}", figure.file),
        title: figure.title.clone(),
        caption: caption + ".",
        ..ShownFigure::default()
    }
}

/// How many runs of a plan are in each cell of a phase map.
fn runs_per_cell(plan: &Plan, figure: &Figure) -> Vec<usize> {
    let place = |column: &str| plan.common.keys.iter().position(|key| key == column);
    let of_cell = [Some(&figure.x), Some(&figure.y), figure.facet.as_ref()].into_iter().flatten();
    let of_cell: Vec<usize> = of_cell.filter_map(|quantity| place(&quantity.column)).collect();
    let at: Vec<_> = figure.at.iter().filter_map(|(key, wanted)| Some((place(key)?, wanted))).collect();
    let mut counts: BTreeMap<Vec<String>, usize> = BTreeMap::new();
    // Runs that have names have no values.
    for row in plan.rows.iter().filter(|row| !row.values.is_empty()) {
        if at.iter().all(|(n, wanted)| place_of(&row.values[*n]).as_ref() == Some(*wanted)) {
            *counts.entry(of_cell.iter().map(|&n| row.values[n].to_string()).collect()).or_default() += 1;
        }
    }
    counts.into_values().collect()
}

/// The links to tables, by their paths.
fn links(page: &Path, tables: Vec<PathBuf>) -> Vec<Link> {
    let link = |path: PathBuf| {
        let words = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let of = path.parent().unwrap_or(Path::new(""));
        Link { path: format!("{}{}", relative_link(page, of), encoded(words.as_bytes())), words }
    };
    let mut links: Vec<Link> = tables.into_iter().map(link).collect();
    links.sort();
    links
}

/// Formats the page of a study from its folder, with the existing tables and figures, at a path among the files of a set.
///
/// # Errors
/// If results contradict the plan or each other, or a file cannot be read, or would be overwritten.
pub fn of_folder(
    folder: &Path,
    (plan, results): (&Plan, &Results),
    page: &Path,
    files: &FileSet,
    provenance: bool,
) -> Result<String, StudyError> {
    files.add_inputs(inputs(folder, plan)?)?;
    let mut made = StudyPage::of(plan, &plan.common.figures, relative_link(page, folder), provenance);
    collect(plan, results, &mut made)?;
    let read = |file: &str| asperity_files::read_if_there(&folder.join(file));
    made.html(page, results, claims_in(folder)?, tables_in(folder)?, &read)
}

/// The files of a study that a page uses or links to: plan, results, tables and pictures.
fn inputs(folder: &Path, plan: &Plan) -> Result<Vec<PathBuf>, StudyError> {
    let mut inputs = segment::all(folder).map_err(StudyError::at(folder))?;
    inputs.push(folder.join(plan::FILE));
    inputs.extend(tables_in(folder)?);
    let pictures = plan.common.figures.iter().flat_map(|figure| files_of_picture(&figure.file));
    inputs.extend(pictures.map(|file| folder.join(FIGURES).join(file)));
    Ok(inputs)
}

/// The entry of a study among several, on a page that is a file of a set; `way` leads from it to the folder of the study,
/// and `report` to the page of its own.
///
/// # Errors
/// If a file cannot be read, or would be overwritten.
pub fn entry(
    folder: &Path,
    plan: &Plan,
    way: &str,
    report: Option<String>,
    files: &FileSet,
) -> Result<Entry, StudyError> {
    files.add_inputs(inputs(folder, plan)?)?;
    let there = plan.common.figures.iter().filter(|figure| folder.join(FIGURES).join(&figure.file).is_file());
    let figures = there.map(|figure| {
        let mut shown = shown(plan, figure);
        shown.file.insert_str(0, way);
        shown
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
pub const CLAIMS: &str = "tables/claims.csv";

/// The claims of a study in its folder; none if it has none.
///
/// # Errors
/// If the table is none of claims.
pub fn claims_in(folder: &Path) -> Result<Vec<Claim>, StudyError> {
    let table = folder.join(CLAIMS);
    if !table.is_file() {
        return Ok(Vec::new());
    }
    let bad = |error: String| {
        StudyError::Refused(format!("{}: {error} (accepted: the table of a study)", table.display()))
    };
    let file = asperity_files::open(&table).map_err(|error| bad(error.to_string()))?;
    claim::read(ShortLines::of(file)).map_err(bad)
}

/// The tables in the folder of a study.
pub(crate) fn tables_in(folder: &Path) -> Result<Vec<PathBuf>, StudyError> {
    let tables = folder.join(TABLES);
    if !tables.is_dir() {
        return Ok(Vec::new());
    }
    let entries = asperity_files::entries(&tables).map_err(StudyError::at(&tables))?;
    let is_one = |path: &PathBuf| path.extension().is_some_and(|end| end == "csv" || end == "parquet");
    Ok(entries.iter().map(DirEntry::path).filter(is_one).collect())
}
