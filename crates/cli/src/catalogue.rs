//! `asperity catalogue`: the ruptures of runs as a catalogue of seismology, or their sizes and times with tests.

use std::io::Write;
use std::path::Path;

use asperity_numbers::catalogue::{Catalogue, Entry, FEWEST_MAGNITUDES, GutenbergRichter};
use asperity_numbers::distributions::{TimeFit, TimeLaw};
use asperity_numbers::goodness::Test;
use asperity_record::{Cell, RunHeader, counted};
use asperity_tables::{CsvRows, Spelling};

use crate::args::{CatalogueArguments, CatalogueFormat};
use crate::exit::{self, Code, Failure};
use crate::progress::Board;
use crate::quakeml::{self, OfRun, dated, longitude_degrees};
use crate::reading::{self, Reading};
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
    for (number, run) in (1..).zip(&arguments.runs) {
        let verdict = of_log(run, number).and_then(|(of_run, others, checked)| {
            if others > 0 {
                board.line(&format!(
                    "{}: {} left out, which still slid at its end or have no moment",
                    run.display(),
                    counted(others as u64, "rupture")
                ));
            }
            runs.push(of_run);
            verdict_exit::finish(run, &checked, board)
        });
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
                for run in &runs {
                    statistics(run, arguments.completeness).iter().try_for_each(terminal::say)?;
                }
            }
        }
    }
    Code::worst(codes).said()
}

/// The ruptures of the sound part of a log, how many others there are, and its verdict.
fn of_log(run: &Path, number: usize) -> Result<(OfRun, usize, asperity_run::Checked), Failure> {
    let mut id = format!("run-{number}");
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
    let name = run.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok((OfRun { name, id, entries }, others, checked))
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

/// The law of Gutenberg and Richter of a run, and the times between its ruptures.
fn statistics(run: &OfRun, completeness: Option<f64>) -> Vec<String> {
    let of_sizes = |entry: &Entry| entry.magnitude().map(|magnitude| (magnitude, entry.rupture.onset_s));
    let all: Vec<(f64, f64)> = run.entries.iter().filter_map(of_sizes).collect();
    let magnitudes: Vec<f64> = all.iter().map(|(magnitude, _)| *magnitude).collect();
    let mut lines = vec![format!("{}: {}", run.name, counted(all.len() as u64, "rupture"))];
    let fit = match completeness {
        Some(completeness) => GutenbergRichter::above(&magnitudes, completeness),
        None => GutenbergRichter::complete(&magnitudes),
    };
    lines.push(match &fit {
        Some(fit) if fit.test.rejects() => format!(
            "  sizes: no law of Gutenberg and Richter above {:.3}, n = {} ({})",
            fit.completeness,
            fit.count,
            fit.test.words()
        ),
        Some(fit) => format!(
            "  sizes: b = {:.3} ± {:.3} above {:.3}, n = {} ({})",
            fit.b.value,
            fit.b.error,
            fit.completeness,
            fit.count,
            fit.test.words()
        ),
        None => format!(
            "  sizes: no completeness above which {FEWEST_MAGNITUDES} magnitudes or more follow the law of Gutenberg \
             and Richter"
        ),
    });
    let least = fit.as_ref().map_or(f64::NEG_INFINITY, |fit| fit.completeness);
    let onsets: Vec<f64> =
        all.iter().filter(|(magnitude, _)| *magnitude > least).map(|(_, onset_s)| *onset_s).collect();
    let times: Vec<f64> =
        onsets.windows(2).map(|pair| pair[1] - pair[0]).filter(|time_s| *time_s > 0.0).collect();
    lines.push(match TimeFit::of(&times, TimeLaw::Exponential) {
        Some(fit @ TimeFit::Exponential { mean_s }) => {
            let test = Test::of_times(&fit, &times, TimeLaw::Exponential);
            let (mean_s, error_s) = (mean_s.value, mean_s.error);
            if test.rejects() {
                format!("  times between them: mean {mean_s:.4} s, not exponential ({})", test.words())
            } else {
                format!("  times between them: exponential, {mean_s:.4} ± {error_s:.4} s ({})", test.words())
            }
        }
        _ => "  times between them: fewer than five, or all equal".to_owned(),
    });
    lines
}
