//! `asperity catalogue`: the ruptures of runs as a catalogue of seismology, or their sizes and times with tests.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use asperity_files::{Existing, FileSet, Inputs};
use asperity_numbers::catalogue::{Catalogue, Entry, FEWEST_MAGNITUDES, GutenbergRichter};
use asperity_numbers::distributions::{TimeFit, TimeLaw};
use asperity_numbers::goodness::Test;
use asperity_record::{Cell, Column, Event, EventKind, Observer, RunHeader, Rupture, counted};
use asperity_study::collect;
use asperity_study::given::Given;
use asperity_tables::{CsvRows, Spelling};

use serde_json::{Map, Value, json};

use crate::args::{CatalogueArguments, CatalogueFormat};
use crate::exit::{self, Code, Failure};
use crate::progress::Board;
use crate::quakeml::{self, OfRun, dated, longitude_degrees};
use crate::reading::{self, Reading};
use crate::study::{in_words, outcome, read_for_tables};
use crate::terminal;
use crate::verdict_exit;

/// The columns of the table: name, and cell of an entry.
type CatalogueColumn = (&'static str, fn(&Entry) -> Cell);

/// Those after `run`, `time` and what catalogues of earthquakes have.
const COLUMNS: [CatalogueColumn; 16] = [
    ("rupture", |entry| Cell::Step(entry.rupture.rupture)),
    ("onset_s", |entry| Cell::Number(entry.rupture.onset_s)),
    ("duration_s", |entry| number(entry.duration_s())),
    ("x_m", |entry| Cell::Number(entry.x_m)),
    ("length_m", |entry| Cell::Number(entry.length_m)),
    ("contacts", |entry| Cell::Count(entry.rupture.slipped())),
    ("moment_n_m", |entry| Cell::Number(entry.moment_n_m)),
    ("potency_m2", |entry| number(entry.rupture.potency_m2)),
    ("potency_m3", |entry| number(entry.rupture.potency_m3)),
    ("mean_slip_m", |entry| number(entry.rupture.mean_slip_m)),
    ("largest_slip_m", |entry| number(entry.rupture.largest_slip_m)),
    ("stress_drop_pa", |entry| number(entry.stress_drop_pa)),
    ("slip_weighted_stress_drop_pa", |entry| number(entry.slip_weighted_stress_drop_pa)),
    ("slip_skewness", |entry| number(entry.slip_skewness)),
    ("reached_every_block", |entry| Cell::Flag(entry.rupture.reached_every_block)),
    ("overlapping", |entry| Cell::Flag(entry.rupture.overlapping)),
];

/// The names that catalogues of earthquakes have, as SeismoStats reads them.
const EARTHQUAKE_COLUMNS: [&str; 7] =
    ["run", "time", "longitude", "latitude", "depth", "magnitude", "magnitude_type"];

fn number(value: Option<f64>) -> Cell {
    value.map_or(Cell::Empty, Cell::Number)
}

/// Prints the catalogue, then the verdicts on the logs.
pub(crate) fn command(arguments: &CatalogueArguments, board: &Board) -> Result<(), Failure> {
    let mut runs = Vec::new();
    let mut codes = Vec::new();
    for (given, path) in (1..).zip(&arguments.runs) {
        let verdict = match Given::of(path) {
            Given::Study => of_study(path, given, board, &mut runs),
            _ => of_log(path, given, board, &mut runs),
        };
        if let Err(failure) = verdict {
            exit::report(&failure);
            codes.push(failure.code());
        }
    }
    if !runs.is_empty() {
        match arguments.format {
            CatalogueFormat::Csv => csv(&runs)?,
            CatalogueFormat::Quakeml => {
                let mut out = terminal::data();
                out.write_all(quakeml::document(&runs)?.as_bytes())?;
                out.flush()?;
            }
            CatalogueFormat::Statistics => {
                for given in runs.chunk_by(|a, b| a.given == b.given) {
                    statistics(given, arguments.completeness).iter().try_for_each(terminal::say)?;
                }
            }
        }
    }
    Code::worst(codes).said()
}

/// Notes how many ruptures are not in the catalogue.
fn note_others(path: &Path, others: usize, board: &Board) {
    if others > 0 {
        let others = counted(others as u64, "rupture");
        board.line(&format!(
            "{}: {others} left out, which still slid at the end or have no moment",
            path.display()
        ));
    }
}

/// Adds the ruptures of the sound part of a log; the outcome is its verdict.
fn of_log(run: &Path, given: usize, board: &Board, runs: &mut Vec<OfRun>) -> Result<(), Failure> {
    let mut id = format!("run-{given}");
    let begin = |header: &RunHeader, toml: &str| {
        // Logs of the first versions have none.
        if !header.run_id.is_empty() {
            id.clone_from(&header.run_id);
        }
        let scenario = reading::scenario(run, toml)?;
        let scenario =
            scenario.ok_or("it has no attachment `scenario.toml`, which has the width of the slider")?;
        Ok(Catalogue::new(header, &scenario))
    };
    let Reading { checked, observer, .. } = reading::once(run, begin, |_| Ok(()))?;
    let (entries, others) = observer.finish();
    note_others(run, others, board);
    let name = run.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    runs.push(OfRun { given, study: None, name, id, entries });
    verdict_exit::finish(run, &checked, board)
}

/// Adds the ruptures of all runs of a study that have results; the outcome is that of the study.
fn of_study(folder: &Path, given: usize, board: &Board, runs: &mut Vec<OfRun>) -> Result<(), Failure> {
    let (plan, results) = read_for_tables(folder)?;
    let kind = EventKind::of::<Rupture>().with(plan.parts());
    let of_rupture = kind.columns.len();
    let mut of_runs = Rows { table: kind.table, of_rupture, columns: Vec::new(), runs: BTreeMap::new() };
    let files = FileSet::new(Existing::Refuse, Inputs::default());
    collect(&plan, &results, &files, folder, &[], &mut of_runs).map_err(Failure::failed)?;
    if of_runs.columns.is_empty() {
        return Err(Failure::BadInput(format!(
            "{}: its runs keep no ruptures (accepted: a study with \"ruptures\" in keep)",
            folder.display()
        )));
    }
    let mut left_out = 0;
    for row in &plan.rows {
        let Some(rows) = of_runs.runs.remove(&row.run) else { continue };
        let failed =
            |problem: String| Failure::Failed(format!("{}: run {}: {problem}", folder.display(), row.run));
        let (scenario, header) = plan.scenario(row).map_err(failed)?;
        let mut catalogue = Catalogue::new(&header, &scenario);
        for payload in rows {
            let rupture: Rupture =
                serde_json::from_value(payload.into()).map_err(|error| failed(error.to_string()))?;
            catalogue.event(&Event::new(rupture));
        }
        let (entries, others) = catalogue.finish();
        left_out += others;
        let study = Some(folder.display().to_string());
        runs.push(OfRun { given, study, name: row.run.to_string(), id: header.run_id, entries });
    }
    note_others(folder, left_out, board);
    let counts = results.counts();
    board.line(&format!("{}: {}", folder.display(), in_words(&plan, counts)));
    outcome(counts)
}

/// The ruptures of a study, by run.
struct Rows {
    table: &'static str,
    /// How many of the last columns are those of a rupture.
    of_rupture: usize,
    columns: Vec<Column>,
    runs: BTreeMap<u64, Vec<Map<String, Value>>>,
}

impl asperity_study::Observer for Rows {
    fn begin(&mut self, table: &'static str, columns: &[Column]) {
        if table == self.table {
            self.columns = columns.to_vec();
        }
    }

    fn row(&mut self, table: &'static str, cells: &[Cell]) {
        let Some(Cell::Step(run)) = cells.first().filter(|_| table == self.table) else { return };
        // Behind the keys of the run, which may be named like columns of a rupture.
        let named = self.columns.iter().zip(cells).skip(self.columns.len() - self.of_rupture);
        let payload = named.map(|(column, cell)| (column.name.to_string(), json!(cell))).collect();
        self.runs.entry(*run).or_default().push(payload);
    }
}

fn csv(runs: &[OfRun]) -> Result<(), Failure> {
    let names = EARTHQUAKE_COLUMNS.into_iter().chain(COLUMNS.iter().map(|(name, _)| *name));
    let mut rows = CsvRows::headed(terminal::data(), names, Spelling::Scientific)?;
    for (run, entry) in runs.iter().flat_map(|run| run.entries.iter().map(move |entry| (run, entry))) {
        let time = dated(entry)?;
        let (longitude, magnitude) = (longitude_degrees(entry.x_m), number(entry.magnitude()));
        let of_earthquakes = [run.name.clone(), time, longitude.to_string(), "0".to_owned(), "0".to_owned()];
        let of_size = [magnitude.to_string(), "Mw".to_owned()];
        let others = COLUMNS.iter().map(|(_, cell)| cell(entry).to_string());
        rows.push_texts(of_earthquakes.into_iter().chain(of_size).chain(others))?;
    }
    Ok(rows.finish()?.flush()?)
}

/// The law of Gutenberg and Richter of a log or of all runs of a study, and of a log the times between its ruptures.
fn statistics(runs: &[OfRun], completeness: Option<f64>) -> Vec<String> {
    let entries = runs.iter().flat_map(|run| &run.entries);
    let all: Vec<(f64, f64)> =
        entries.filter_map(|entry| Some((entry.magnitude()?, entry.rupture.onset_s))).collect();
    let magnitudes: Vec<f64> = all.iter().map(|(magnitude, _)| *magnitude).collect();
    let of_runs = match runs {
        [_] => String::new(),
        _ => format!(" of {}", counted(runs.len() as u64, "run")),
    };
    let mut lines = vec![format!("{}: {}{of_runs}", runs[0].of(), counted(all.len() as u64, "rupture"))];
    let fit = match completeness {
        Some(completeness) => GutenbergRichter::above(&magnitudes, completeness),
        None => GutenbergRichter::complete(&magnitudes),
    };
    lines.push(match &fit {
        Some(fit) => {
            let above = format!("above {:.3}, n = {} ({})", fit.completeness, fit.count, fit.test.words());
            if fit.test.rejects() {
                format!("  sizes: no law of Gutenberg and Richter {above}")
            } else {
                format!("  sizes: b = {:.3} ± {:.3} {above}", fit.b.value, fit.b.error)
            }
        }
        None => {
            let least = completeness.map(|completeness| format!("fewer than {FEWEST_MAGNITUDES} above {completeness}"));
            let no_law = || {
                format!("no completeness above which {FEWEST_MAGNITUDES} or more follow the law of Gutenberg and Richter")
            };
            format!("  sizes: {}", least.unwrap_or_else(no_law))
        }
    });
    if let [_] = runs {
        let least = fit.as_ref().map(|fit| fit.completeness).or(completeness).unwrap_or(f64::NEG_INFINITY);
        let counted = all.iter().filter(|(magnitude, _)| *magnitude > least);
        let onsets: Vec<f64> = counted.map(|(_, onset_s)| *onset_s).collect();
        lines.push(format!("  times between them: {}", times_between(&onsets)));
    }
    lines
}

/// Whether times between onsets are exponential, in words.
fn times_between(onsets_s: &[f64]) -> String {
    // Ruptures that begin in the same step are one.
    let all_s = onsets_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|time_s| *time_s > 0.0);
    let times_s: Vec<f64> = all_s.collect();
    let Some(fit @ TimeFit::Exponential { mean_s }) = TimeFit::of(&times_s, TimeLaw::Exponential) else {
        return "fewer than five, or all equal".to_owned();
    };
    let test = Test::of_times(&fit, &times_s, TimeLaw::Exponential);
    if test.rejects() {
        format!("mean {:.4} s, not exponential ({})", mean_s.value, test.words())
    } else {
        format!("exponential, {:.4} ± {:.4} s ({})", mean_s.value, mean_s.error, test.words())
    }
}
