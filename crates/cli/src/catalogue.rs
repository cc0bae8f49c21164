//! `asperity catalogue`: the ruptures of runs as a catalogue of seismology, or their sizes and times with tests.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

use asperity_numbers::catalogue::{Catalogue, Entry};
use asperity_numbers::distributions::{TimeFit, TimeLaw};
use asperity_numbers::goodness::Test;
use asperity_numbers::gutenberg_richter::{FEWEST_MAGNITUDES, GutenbergRichter};
use asperity_numbers::omori::{Aftershocks, FEWEST_AFTERSHOCKS, MAIN_SHOCKS_WITHIN, Omori, Shock};
use asperity_numbers::{radiated_energy_j, radiation_efficiency};
use asperity_record::{Arrival, Cell, Event, EventPayload, Observer, Rupture, counted, printable};
use asperity_run::{Checked, OpenLog};
use asperity_study::Keep;
use asperity_study::plan::FILE;
use asperity_study::results::State;
use asperity_tables::{CsvRows, Spelling, name_of};
use clap::{Args, ValueEnum};

use crate::exit::{self, Code, Failure};
use crate::outputs::TableOut;
use crate::progress::Board;
use crate::quakeml::{self, OfRun, dated, longitude_degrees};
use crate::reading::{self, Reading};
use crate::study::{outcome, read};
use crate::summary::WITHOUT_RUPTURES;
use crate::terminal::Data;
use crate::verdict_exit;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CatalogueFormat {
    /// Comma-separated, one header line, one row for each rupture, numbers in full precision.
    Csv,
    /// QuakeML 1.2: origin, moment magnitude, scalar moment and duration of each rupture.
    Quakeml,
    /// For people: the law of Gutenberg and Richter and the times between ruptures, each with a test.
    Statistics,
}

/// Parses a finite number.
fn finite(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|number| number.is_finite()).ok_or_else(|| "accepted: a finite number".to_owned())
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity catalogue out/mine.mcap -o out/mine.csv
  asperity catalogue out/chapter5/runs/*.mcap --format quakeml > out/all.xml
  asperity catalogue out/mine.mcap --format statistics
  asperity catalogue out/precursors --format statistics
  asperity catalogue out/mine.mcap --quick --format statistics

Each rupture that has ended is an earthquake. Its magnitude is the moment
magnitude, (2/3) (log10 M_0 - 9.1). Simulated time 0 is the beginning of 1970,
and the slider lies on the equator, eastwards from longitude 0. docs/outputs.md
explains the columns and the tests.")]
pub(crate) struct CatalogueArguments {
    /// Run logs, and folders of studies, whose runs keep ruptures.
    #[arg(value_name = "RUN.mcap|STUDY", required = true)]
    pub(crate) paths: Vec<PathBuf>,
    /// How to print it.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: CatalogueFormat,
    /// The magnitude above which statistics are made [default: the one above which the law of Gutenberg and
    /// Richter fits best].
    #[arg(long, value_name = "MAGNITUDE", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) completeness: Option<f64>,
    /// Read only what is needed, found by the index of the file, and verify
    /// nothing: for a look at a long log.
    #[arg(long)]
    pub(crate) quick: bool,
    #[command(flatten)]
    pub(crate) to: TableOut,
}

/// The columns of the table: name, and cell of an entry.
type CatalogueColumn = (&'static str, fn(&Entry) -> Cell);

/// Those after `path`, `run`, `time` and what catalogues of earthquakes have.
const COLUMNS: [CatalogueColumn; 20] = [
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
    ("strength_drop_pa", |entry| number(entry.strength_drop_pa)),
    ("slip_weighted_strength_drop_pa", |entry| number(entry.slip_weighted_strength_drop_pa)),
    ("slip_skewness", |entry| number(entry.slip_skewness)),
    ("radiated_energy_j", |entry| number(radiated_energy_j(&entry.rupture))),
    ("radiation_efficiency", |entry| number(radiation_efficiency(&entry.rupture))),
    ("reached_every_block", |entry| Cell::Flag(entry.rupture.reached_every_block)),
    ("overlapping", |entry| Cell::Flag(entry.rupture.overlapping)),
];

/// The names that catalogues of earthquakes have, as SeismoStats reads them.
const EARTHQUAKE_COLUMNS: [&str; 8] =
    ["path", "run", "time", "longitude", "latitude", "depth", "magnitude", "magnitude_type"];

fn number(value: Option<f64>) -> Cell {
    value.map_or(Cell::Empty, Cell::Number)
}

/// Prints the catalogue, then the verdicts on the logs and studies.
pub(crate) fn command(arguments: &CatalogueArguments, board: &Board) -> Result<(), Failure> {
    let CatalogueArguments { paths, format, completeness, quick, to } = arguments;
    if completeness.is_some() && *format != CatalogueFormat::Statistics {
        return Err(Failure::BadInput(
            "--completeness has no meaning here (accepted: with --format statistics)".to_owned(),
        ));
    }
    let files = to.files(paths.iter().filter(|path| path.is_file()))?;
    let mut sources = Vec::new();
    let mut codes = Vec::new();
    for path in paths {
        let number = sources.len() + 1;
        let read = if path.join(FILE).exists() { of_study } else { of_log };
        match read(path, number, *quick, board) {
            Ok((source, outcome)) => {
                sources.push(source);
                codes.push(exit::reported(outcome));
            }
            Err(failure) => codes.push(exit::reported(Err(failure))),
        }
    }
    if !sources.is_empty() {
        let mut out = to.begin(&files)?;
        match format {
            CatalogueFormat::Csv => csv(&sources, out)?,
            CatalogueFormat::Quakeml => quakeml::write(out, sources.iter().flat_map(|source| &source.runs))?,
            CatalogueFormat::Statistics => {
                let mut lines = sources.iter().flat_map(|source| statistics(source, *completeness));
                lines.try_for_each(|line| writeln!(out, "{}", printable(&line)))?;
                out.flush()?;
            }
        }
        to.publish(files)?;
        // Rows of the table have an empty magnitude.
        if *format != CatalogueFormat::Csv {
            for Source { path, runs, .. } in &sources {
                let entries = || runs.iter().flat_map(|run| &run.entries);
                let is_told = |entry: &&Entry| *format == CatalogueFormat::Quakeml && entry.depth_m.is_some();
                let without =
                    entries().filter(|entry| entry.magnitude().is_none() && !is_told(entry)).count();
                let why = match entries().any(|entry| entry.depth_m.is_some()) {
                    true => "whose moments per metre of strike have no magnitude",
                    false => "whose moment is 0, so that they have no magnitude",
                };
                note_left_out(path, without, why, board);
            }
        }
    }
    Code::worst(codes).said()
}

/// A log or a study, with its path.
struct Source {
    path: String,
    is_study: bool,
    runs: Vec<OfRun>,
}

/// What was read, and how it ended.
type Read = (Source, Result<(), Failure>);

/// A part of the names of events that no other run of the catalogue has. Run ids are hashes, unless a log is forged.
fn name_of_events(source: usize, run: u64, id: &str) -> String {
    let is_hash = !id.is_empty() && id.bytes().all(|byte| byte.is_ascii_hexdigit());
    format!("{source}/{run}/{}", if is_hash { id } else { "unknown" })
}

/// Notes how many ruptures are not in the catalogue, and why.
fn note_left_out(path: impl Display, count: usize, why: &str, board: &Board) {
    if count > 0 {
        board.line(&format!("{path}: {} left out, {why}", counted(count as u64, "rupture")));
    }
}

/// Why ruptures have no moment.
const STILL_SLID: &str = "which still slid at the end";

/// Reads the sound part of a log.
fn read_log(
    run: &Path,
    named: (usize, u64),
    quick: bool,
    board: &Board,
) -> Result<(OfRun, Checked), Failure> {
    let mut id = String::new();
    let begin = |log: &OpenLog| {
        id.clone_from(&log.header().run_id);
        let scenario = if log.header().sensors.is_some() { None } else { Some(log.needed_scenario()?) };
        Ok(Catalogue::new(log.header(), scenario))
    };
    let skims: &[_] = if quick { &[Rupture::TOPIC, Arrival::TOPIC] } else { &[] };
    let Reading { checked, observer, has_ruptures } = reading::once(run, skims, begin, |_| Ok(()))?;
    let (entries, others) = observer.finish();
    note_left_out(run.display(), others, STILL_SLID, board);
    if !has_ruptures {
        board.line(&format!("{}: {WITHOUT_RUPTURES}", run.display()));
    }
    Ok((OfRun { name: name_of(run), events: name_of_events(named.0, named.1, &id), entries }, checked))
}

/// The ruptures of the sound part of a log; the outcome is its verdict.
fn of_log(run: &Path, number: usize, quick: bool, board: &Board) -> Result<Read, Failure> {
    let (of_run, checked) = read_log(run, (number, 1), quick, board)?;
    let source = Source { path: run.display().to_string(), is_study: false, runs: vec![of_run] };
    Ok((source, verdict_exit::finish(run, &checked, board)))
}

/// The ruptures of all runs of a study that have results or logs; the outcome is that of the study.
fn of_study(folder: &Path, number: usize, quick: bool, board: &Board) -> Result<Read, Failure> {
    let (plan, results) = read(folder)?;
    results.check()?;
    if !plan.common.keep.contains(&Keep::Ruptures) {
        return Err(Failure::BadInput(format!(
            "{}: its runs keep no ruptures (accepted: a study with \"ruptures\" in keep)",
            folder.display()
        )));
    }
    let failed = |problem: String| Failure::Failed(format!("{}: {problem}", folder.display()));
    let mut left_out = 0;
    let mut runs = Vec::new();
    for row in &plan.rows {
        match results.state(row.run) {
            State::Done(_) => {
                let (scenario, header) =
                    plan.scenario(row).map_err(|problem| failed(format!("run {}: {problem}", row.run)))?;
                let mut catalogue = Catalogue::new(&header, Some(&scenario));
                let made = results.outcome(&plan, row.run)?.and_then(Result::ok);
                let ruptures = made.into_iter().flat_map(|made| made.ruptures);
                ruptures.for_each(|rupture| catalogue.event(&Event::new(rupture)));
                let (entries, others) = catalogue.finish();
                left_out += others;
                let events = name_of_events(number, row.run, row.id.as_deref().unwrap_or_default());
                runs.push(OfRun { name: row.run.to_string(), events, entries });
            }
            State::Logged => {
                let named = plan.named(row.run).expect("only runs with names have logs as results");
                let (of_run, checked) = read_log(&named.log(folder), (number, row.run), quick, board)?;
                verdict_exit::finish(&named.log(folder), &checked, board)?;
                runs.push(of_run);
            }
            _ => {}
        }
    }
    note_left_out(folder.display(), left_out, STILL_SLID, board);
    board.line(&format!("{}: {}", folder.display(), results.in_words()));
    Ok((Source { path: folder.display().to_string(), is_study: true, runs }, outcome(&results, |_| true)))
}

fn csv(sources: &[Source], out: Data) -> Result<(), Failure> {
    let names = EARTHQUAKE_COLUMNS.into_iter().chain(COLUMNS.iter().map(|(name, _)| *name));
    let mut rows = CsvRows::headed(out, names, Spelling::Scientific)?;
    for source in sources {
        for (run, entry) in
            source.runs.iter().flat_map(|run| run.entries.iter().map(move |entry| (run, entry)))
        {
            let (longitude, magnitude) = (longitude_degrees(entry.x_m), number(entry.magnitude()));
            let of_run = [source.path.clone(), run.name.clone(), dated(entry)?];
            let depth_km = entry.depth_m.unwrap_or(0.0) / 1e3;
            let of_place = [longitude.to_string(), "0".to_owned(), depth_km.to_string()];
            let kind = if entry.depth_m.is_some() { "" } else { "Mw" };
            let of_size = [magnitude.to_string(), kind.to_owned()];
            let others = COLUMNS.iter().map(|(_, cell)| cell(entry).to_string());
            rows.push_texts(of_run.into_iter().chain(of_place).chain(of_size).chain(others))?;
        }
    }
    Ok(rows.finish()?.flush()?)
}

/// The law of Gutenberg and Richter of a log or of all runs of a study, and of a log the times between its ruptures.
fn statistics(source: &Source, completeness: Option<f64>) -> Vec<String> {
    let entries = source.runs.iter().flat_map(|run| &run.entries);
    let shock = |entry: &Entry| {
        let Rupture { onset_s, end_s, .. } = entry.rupture;
        Some(Shock { magnitude: entry.magnitude()?, onset_s, end_s: end_s? })
    };
    let all: Vec<Shock> = entries.filter_map(shock).collect();
    let magnitudes: Vec<f64> = all.iter().map(|shock| shock.magnitude).collect();
    let of_runs = match source.is_study {
        true => format!(" of {}", counted(source.runs.len() as u64, "run")),
        false => String::new(),
    };
    let mut lines = vec![format!("{}: {}{of_runs}", source.path, counted(all.len() as u64, "rupture"))];
    let fit = match completeness {
        Some(completeness) => GutenbergRichter::above(&magnitudes, completeness),
        None => GutenbergRichter::complete(&magnitudes),
    };
    let too_few = || {
        let above = completeness.map_or(String::new(), |least| format!(" above {least}"));
        let fewest = FEWEST_MAGNITUDES + usize::from(completeness.is_none());
        format!("fewer than {fewest}{above}, or all are equal")
    };
    lines.push(format!("  sizes: {}", fit.as_ref().map_or_else(too_few, GutenbergRichter::words)));
    if !source.is_study {
        let found = fit.as_ref().filter(|fit| fit.b.is_ok()).map(|fit| fit.completeness);
        let least = found.or(completeness).unwrap_or(f64::NEG_INFINITY);
        let counted: Vec<Shock> = all.into_iter().filter(|shock| shock.magnitude > least).collect();
        let onsets: Vec<f64> = counted.iter().map(|shock| shock.onset_s).collect();
        lines.push(format!("  times between them: {}", times_between(&onsets)));
        lines.push(format!("  after large ones: {}", aftershocks(&counted)));
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

/// Whether the rate after main shocks falls as Omori says, in words.
fn aftershocks(shocks: &[Shock]) -> String {
    let Some(stack) = Aftershocks::stacked(shocks) else {
        return format!(
            "fewer than two within magnitude {MAIN_SHOCKS_WITHIN} of the largest, or they overlap"
        );
    };
    let count = stack.times_s.len();
    let found = format!(
        "{} within {:.4} s of {}",
        counted(count as u64, "rupture"),
        stack.window_s,
        counted(stack.main_shocks as u64, "main shock")
    );
    let constant = stack.constant();
    let law = if count < FEWEST_AFTERSHOCKS {
        format!("fewer than {FEWEST_AFTERSHOCKS}")
    } else if !constant.rejects() {
        format!("a constant rate is not rejected ({})", constant.words())
    } else {
        match stack.omori() {
            Some(Omori { p, c_s, k, test }) if !test.rejects() => format!(
                "law of Omori, p = {:.3} ± {:.3}, c = {:.3e} ± {:.1e} s, K = {k:.4} s^(p−1) ({})",
                p.value,
                p.error,
                c_s.value,
                c_s.error,
                test.words()
            ),
            Some(Omori { test, .. }) => format!("no law of Omori ({})", test.words()),
            None => format!(
                "no law of Omori, the rate does not fall as a power of time (constant: {})",
                constant.words()
            ),
        }
    };
    format!("{found}: {law}")
}
