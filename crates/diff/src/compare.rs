//! Compares two sides: finds and pairs their runs, reads them, and reports the fate of the events of each
//! pair.

use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_numbers::Summary;
use asperity_record::{EventPayload, Rupture};

use crate::column::Column;
use crate::error::CompareError;
use crate::matches::Matches;
use crate::matching;
use crate::policy::{Policy, Spread, WINDOW_S, between_events_s};
use crate::precursors::Precursors;
use crate::progress::Cycles;
use crate::report::{Counts, FORMAT, NumberChange, Report, RunDiff, RunSide, VERSION, Verdict, pair_name};
use crate::run_log::RunLog;
use crate::sides::{self, Logs, PairBy, Paired, Run, Side};
use crate::table::Table;
use crate::tally::{self, Comparison, Draft};
use crate::{claims, progress, provenance, ruptures, side_by_side};

/// How two sides are compared, and which results are kept.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Which differences are ignored, and which are allowed.
    pub policy: Policy,
    /// The policy's file, for the report; `None` for the default.
    pub policy_file: Option<PathBuf>,
    /// How the runs of two folders are paired.
    pub pair_by: PairBy,
    /// How many findings of each class the report keeps of a pair of runs.
    pub keep_findings: usize,
    /// How many matches the report keeps of a pair of runs.
    pub keep_matches: usize,
    /// The run logs of both sides, which the caller has read.
    pub logs: Logs,
    /// The Parquet file to which every match is written, one of the set of files.
    pub matches_file: Option<PathBuf>,
}

/// The result of a comparison.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The report.
    pub report: Report,
    /// The tightest policy under which the new side passes.
    pub draft: Draft,
}

/// Compares two paths: run logs or event tables, folders of them, or outputs of `asperity reproduce`. No
/// file of the set, which the caller publishes, may be an input.
///
/// # Errors
/// If a side has no runs, a table cannot be read or is not in order, or the file of matches
/// cannot be written.
pub fn compare(
    old_path: &Path,
    new_path: &Path,
    settings: &Settings,
    files: &FileSet,
) -> Result<Compared, CompareError> {
    let (old, new) = (Side::find(old_path, &settings.logs)?, Side::find(new_path, &settings.logs)?);
    files.add_inputs(old.files().chain(new.files()))?;
    let Paired { pairs, unpaired } = sides::pair(&old, &new, settings.pair_by);
    let mut draft = Draft::default();
    // A file of matches depends on the columns of all tables.
    let mut is_over_area = false;
    for run in pairs.iter().flat_map(|(old, new)| [old, new]).filter(|_| settings.matches_file.is_some()) {
        is_over_area |= run.events()?.columns.has(Column::FIRST_ACROSS);
    }
    let mut matches = Matches::create(files, settings.matches_file.as_deref(), is_over_area)?;
    let mut runs = Vec::new();
    for (old, new) in &pairs {
        let tables = [old.events()?, new.events()?];
        let tables = tables.each_ref().map(|table| &**table);
        runs.push(compare_runs([old, new], tables, settings, &mut draft, &mut matches)?);
    }
    matches.finish()?;
    let counts: Counts = runs.iter().map(|run| &run.events.counts).sum();
    let not_allowed: u64 = runs.iter().map(|run| run.events.refused()).sum();
    let exceeded = settings.policy.exceeded(&counts);
    let ruptures_pass = settings.policy.allows_ruptures || !runs.iter().any(RunDiff::ruptures_alone_differ);
    let keeps = not_allowed == 0 && exceeded.is_empty() && unpaired.is_empty() && ruptures_pass;
    let claims = match (&old.claims, &new.claims) {
        (Some(old), Some(new)) => claims::changes(old, new)?,
        _ => Vec::new(),
    };
    let report = Report {
        format: FORMAT,
        version: VERSION,
        old: old_path.display().to_string(),
        new: new_path.display().to_string(),
        policy: settings.policy_file.as_ref().map(|path| path.display().to_string()),
        verdict: if keeps { Verdict::WithinPolicy } else { Verdict::Differs },
        counts,
        runs,
        unpaired,
        exceeded,
        claims,
    };
    Ok(Compared { report, draft })
}

fn compare_runs(
    sides: [&Run; 2],
    tables: [&Table; 2],
    settings: &Settings,
    draft: &mut Draft,
    matches: &mut Matches,
) -> Result<RunDiff, CompareError> {
    let [old, new] = sides;
    for (run, table) in sides.into_iter().zip(tables) {
        let path = run.path.display();
        matching::check(table).map_err(|problem| CompareError::Input(format!("{path}: {problem}")))?;
    }
    // A table without a time step is assumed to have that of the other.
    let steps_s = [0, 1].map(|side| step_s(sides[side], tables[side]));
    let same_step = steps_s[0].zip(steps_s[1]).is_none_or(|(old, new)| (old - new).abs() < 1e-6 * old);
    let logs = old.log.as_deref().zip(new.log.as_deref()).map(|(old, new)| [old, new]);
    let policy = &settings.policy;
    let comparison = |tables: [&Table; 2]| Comparison {
        columns: matching::comparable(tables[0].columns, tables[1].columns, same_step),
        window_s: policy.window_s.unwrap_or_else(|| match logs {
            Some(logs) if !same_step => between_events_s([0, 1].map(|side| spread(logs[side], tables[side]))),
            _ => WINDOW_S,
        }),
        cycles: None,
        policy,
        until_s: sides.map(|run| run.side().duration_s),
        keep_findings: settings.keep_findings,
        keep_matches: settings.keep_matches,
    };
    let (mut run, mut cycles) = (RunDiff::default(), None);
    if let Some(logs) = logs {
        (run, cycles) = compare_logs(sides, logs, comparison, policy)?;
        let spreads = [0, 1].map(|side| spread(logs[side], tables[side]));
        cycles.iter_mut().for_each(|cycles| cycles.window = cycles.window_of(spreads));
    }
    let name = pair_name(&old.name, &new.name);
    let comparison = Comparison { cycles: cycles.as_ref(), ..comparison(tables) };
    let mut growing = Precursors::of(old).zip(Precursors::of(new)).map(|(old, new)| [old, new]);
    let events = tally::compare(comparison, tables, draft, |matched| {
        if let Some([old, new]) = &mut growing {
            old.watch(&matched.group.old);
            new.watch(&matched.group.new);
        }
        matches.push(&name, &matched)
    })?;
    run.old = RunSide { events: events.old_rows, ..old.side() };
    run.new = RunSide { events: events.new_rows, ..new.side() };
    (run.events, run.precursors) = (events, growing.map(Precursors::changes));
    draft.ruptures |= run.ruptures_alone_differ();
    Ok(run)
}

/// What two logs have beside their slip events; and the cycles by which ruptures are paired, if not in time.
fn compare_logs<'a>(
    sides: [&Run; 2],
    logs: [&'a RunLog; 2],
    comparison: impl Fn([&Table; 2]) -> Comparison<'a>,
    policy: &Policy,
) -> Result<(RunDiff, Option<Cycles>), CompareError> {
    let mut found = RunDiff { summary: summaries(logs)?, ..RunDiff::default() };
    (found.set_differently, found.provenance) = provenance::between(logs.map(|log| &log.provenance))
        .map_err(|error| {
            let [old, new] = sides.map(|run| run.path.display());
            CompareError::Input(format!("{old}, {new}: scenario.toml: {error}"))
        })?;
    let tables = match logs.map(|log| log.ruptures.as_ref()) {
        [Some(old), Some(new)] => [old, new],
        [old, _] => {
            let path = sides[usize::from(old.is_some())].path.display();
            let topic = Rupture::TOPIC;
            found.no_ruptures = Some(format!("{path} has none (accepted: a log with the topic {topic})"));
            return Ok((found, None));
        }
    };
    let headers = logs.map(|log| &log.provenance.header);
    let may_differ = headers.iter().any(|header| header.sensors.is_some())
        || found.set_differently.iter().any(|setting| setting.shapes_motion);
    let may_use_cycles = policy.window_s.is_none() && may_differ;
    let comparison = comparison(tables);
    let in_time = match ruptures::compare(comparison, tables) {
        Ok(ruptures) => ruptures,
        Err(why) => {
            found.no_ruptures = Some(why);
            return Ok((found, None));
        }
    };
    let spreads = [0, 1].map(|side| spread(logs[side], tables[side]));
    let cycles = may_use_cycles
        .then(|| progress::between(&in_time, logs.map(|log| &log.global_s[..]), spreads))
        .flatten();
    let matches_in_time = in_time.matches_in_time;
    let mut ruptures = in_time;
    if let Some(cycles) = &cycles {
        let by_cycles = ruptures::compare(Comparison { cycles: Some(cycles), ..comparison }, tables);
        ruptures = by_cycles.unwrap_or(ruptures);
        ruptures.matches_in_time = matches_in_time;
    }
    // Where the drive pulls both ways, F_T is a difference, and the ratio is meaningless.
    let none = |number: &NumberChange| number.old.is_null() || number.new.is_null();
    if !found.summary.iter().any(|number| number.key == "largest_ft_fn" && none(number)) {
        ruptures.reached = ruptures::reached(tables, headers);
    }
    found.side_by_side = side_by_side::of(logs, tables, &found.set_differently, &ruptures);
    found.ruptures = Some(ruptures);
    Ok((found, cycles))
}

/// The time span of the events of a log, and their number.
fn spread(log: &RunLog, events: &Table) -> Spread {
    Spread { events: events.len() as u64, duration_s: log.provenance.duration_s() }
}

/// The numbers of two summaries, key by key.
fn summaries(logs: [&RunLog; 2]) -> Result<Vec<NumberChange>, CompareError> {
    let [old, new] = logs.map(|log| log.summary.as_ref().map_err(|why| CompareError::Input(why.clone())));
    let both = Summary::KEYS.iter().zip(old?.values().into_iter().zip(new?.values()));
    let numbers = both.map(|(key, (old, new))| NumberChange::between(&key.column.name, &old, &new));
    // The name of the file is no number of the run.
    Ok(numbers.filter(|number| number.key != "run").collect())
}

/// The time step that a table counts in, s: from the run's header, else from its first event.
fn step_s(run: &Run, table: &Table) -> Option<f64> {
    if let Some(header) = run.header() {
        return Some(header.time_step_s);
    }
    let first = table.rows().next()?;
    let step = first.value(Column::ONSET_STEP);
    (step > 0.0).then(|| first.onset_s() / step)
}
