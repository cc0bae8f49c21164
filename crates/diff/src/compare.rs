//! Compares two sides: finds and pairs their runs, reads them, and reports the fate of the events of each
//! pair.

use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_record::{Rupture, SlipEvent};
use serde_json::Value;

use crate::column::{Column, Columns};
use crate::error::CompareError;
use crate::matches::Matches;
use crate::matching::{self, MatchError};
use crate::policy::{Policy, Spread, WINDOW_S, between_events_s};
use crate::precursors::Precursors;
use crate::progress::Cycles;
use crate::report::{
    Counts, FORMAT, NumberChange, Report, RunDiff, RunSide, RuptureDiff, VERSION, Verdict, pair_name,
};
use crate::row::Row;
use crate::run_log::RunLog;
use crate::ruptures::{self, Sorted};
use crate::sides::{self, Logs, PairBy, Paired, Run, Side};
use crate::table::{self, Events, Table, TableError};
use crate::tally::{self, Comparison, Draft};
use crate::{claims, progress, provenance};

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
    /// Run logs that the caller has read, with their summaries. Others are read here, and have none.
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
    let matches_file = settings.matches_file.as_deref();
    // Tables are opened for their columns only if a file depends on these.
    let mut is_over_area = false;
    for run in pairs.iter().flat_map(|(old, new)| [old, new]).filter(|_| matches_file.is_some()) {
        is_over_area |= open(run)?.columns.has(Column::FirstAcross);
    }
    let mut matches = Matches::create(files, matches_file, is_over_area)?;
    let mut runs = Vec::new();
    for (old, new) in &pairs {
        runs.push(compare_runs(old, new, settings, &mut draft, &mut matches)?);
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
    old: &Run,
    new: &Run,
    settings: &Settings,
    draft: &mut Draft,
    matches: &mut Matches,
) -> Result<RunDiff, CompareError> {
    let (old_table, new_table) = (open(old)?, open(new)?);
    let (old_events, old_step_s) = step_s(old, old_table.columns, old_table.events);
    let (new_events, new_step_s) = step_s(new, new_table.columns, new_table.events);
    // A table without a time step is assumed to have that of the other.
    let same_step = old_step_s.zip(new_step_s).is_none_or(|(old, new)| (old - new).abs() < 1e-6 * old);
    let logs = old.log.as_deref().zip(new.log.as_deref());
    if let Some((of_old, of_new)) = logs {
        for (run, log) in [(old, of_old), (new, of_new)] {
            if let Some(problem) = &log.problem {
                return Err(CompareError::Log { path: run.path.clone(), problem: problem.clone() });
            }
        }
    }
    let policy = &settings.policy;
    let comparison = |columns: [Columns; 2], spread: fn(&RunLog) -> Spread| Comparison {
        columns: matching::comparable(columns[0], columns[1], same_step),
        window_s: policy.window_s.unwrap_or_else(|| match logs {
            Some((old, new)) if !same_step => between_events_s(spread(old), spread(new)),
            _ => WINDOW_S,
        }),
        cycles: None,
        policy,
        old_until_s: old.side().duration_s,
        new_until_s: new.side().duration_s,
        keep_findings: settings.keep_findings,
        keep_matches: settings.keep_matches,
    };
    let scenario = |error| CompareError::Scenario {
        old: old.path.clone(),
        new: new.path.clone(),
        error: Box::new(error),
    };
    let mut set_differently = Vec::new();
    let mut ruptures = None;
    let mut cycles = None;
    if let Some((of_old, of_new)) = logs {
        set_differently = provenance::settings(&of_old.provenance, &of_new.provenance).map_err(scenario)?;
        let other_motion = set_differently.iter().any(|setting| setting.shapes_motion);
        let columns =
            [of_old, of_new].map(|log| Rupture::COLUMNS.and(Columns::of(log.provenance.header.parts())));
        let compared = compare_ruptures(
            [(old, of_old), (new, of_new)],
            comparison(columns, RunLog::spread_of_ruptures),
            other_motion && policy.window_s.is_none(),
        );
        ruptures = Some(compared.map(|(ruptures, found)| {
            cycles = found.map(|found| {
                found.with_window_of([of_old.spread_of_slip_events(), of_new.spread_of_slip_events()])
            });
            ruptures
        }));
    }
    let of_events = comparison([old_table.columns, new_table.columns], RunLog::spread_of_slip_events);
    let of_events = Comparison { cycles: cycles.as_ref(), ..of_events };
    let name = pair_name(&old.name, &new.name);
    let mut precursors = Precursors::of(old, new);
    let [old_events, new_events] = [old_events, new_events].map(|events| events.map(|event| Ok(event?)));
    let compared = tally::compare(of_events, old_events, new_events, draft, |matched| {
        precursors.watch(&matched);
        matches.push(&name, &matched)
    });
    let events = compared.map_err(|error| match error {
        MatchError::Source(error) => error,
        MatchError::Order { side, .. } | MatchError::AtOnce { side, .. } => {
            let path = if side == "old" { &old.path } else { &new.path };
            CompareError::Order { path: path.clone(), problem: error.to_string() }
        }
    })?;
    let (ruptures, no_ruptures) = match ruptures.transpose() {
        Ok(ruptures) => (ruptures, None),
        Err(why) => (None, Some(why)),
    };
    let run = RunDiff {
        set_differently,
        old: RunSide { events: events.old_rows, ..old.side() },
        new: RunSide { events: events.new_rows, ..new.side() },
        summary: logs.map_or_else(Vec::new, |(old, new)| summaries(old, new)),
        ruptures,
        no_ruptures,
        provenance: match logs {
            Some((old, new)) => provenance::changes(&old.provenance, &new.provenance).map_err(scenario)?,
            None => Vec::new(),
        },
        events,
        precursors: precursors.changes(),
    };
    if run.ruptures_alone_differ() {
        draft.allow_ruptures();
    }
    Ok(run)
}

/// The ruptures of two logs, paired in time or, if that is allowed, by the cycles that are returned; or
/// why they are not compared.
fn compare_ruptures(
    sides: [(&Run, &RunLog); 2],
    comparison: Comparison<'_>,
    may_use_cycles: bool,
) -> Result<(RuptureDiff, Option<Cycles>), String> {
    let [old, new] = sides.map(|(run, log)| log.ruptures(&run.path));
    let sorted = [Sorted::new(old?), Sorted::new(new?)];
    let mut ruptures = ruptures::compare(comparison, &sorted)?;
    let durations_s = sides.map(|(_, log)| log.provenance.duration_s());
    let cycles = may_use_cycles
        .then(|| progress::between(&ruptures, [&sorted[0].0, &sorted[1].0], durations_s))
        .flatten();
    if let Some(cycles) = &cycles {
        let matches_in_time = ruptures.matches_in_time;
        let comparison = Comparison { cycles: Some(cycles), ..comparison };
        ruptures = RuptureDiff { matches_in_time, ..ruptures::compare(comparison, &sorted)? };
    }
    let blocks = sides.map(|(run, _)| run.header().map_or(1, |header| header.contacts().columns()));
    // Where the drive pulls both ways, F_T is a difference, and the ratio is meaningless.
    let has_ratio = |log: &RunLog| !log.summary.contains(&("largest_ft_fn".to_owned(), Value::Null));
    if sides.iter().all(|(_, log)| has_ratio(log)) {
        ruptures.reached = ruptures::reached(&sorted, blocks);
    }
    Ok((ruptures, cycles))
}

/// The slip events of a run: those that its log has kept, else read one at a time.
fn open(run: &Run) -> Result<Table<'_>, TableError> {
    match run.log.as_ref().and_then(|log| Some((log, log.slip_events()?))) {
        Some((log, events)) => Ok(Table {
            columns: Columns::of(log.provenance.header.parts()),
            events: Box::new(events.iter().cloned().map(Ok)),
        }),
        None => table::open(&run.path),
    }
}

/// The numbers of two summaries, key by key, in the order of the old one.
fn summaries(old: &RunLog, new: &RunLog) -> Vec<NumberChange> {
    let numbers = old.summary.iter().filter_map(|(key, old)| {
        let (_, new) = new.summary.iter().find(|(other, _)| other == key)?;
        Some(NumberChange::between(key, old, new))
    });
    numbers.collect()
}

/// The time step that a table counts in, s: from the run's header, else from its first event.
fn step_s<'a>(run: &Run, columns: Columns, events: Events<'a>) -> (Events<'a>, Option<f64>) {
    if let Some(header) = run.header() {
        return (events, Some(header.time_step_s));
    }
    if !columns.has(Column::OnsetStep) {
        return (events, None);
    }
    let mut events = events.peekable();
    let of = |event: &SlipEvent| (event.onset_step > 0).then(|| event.onset_s / event.onset_step as f64);
    let step_s = events.peek().and_then(|event| event.as_ref().ok().and_then(of));
    (Box::new(events), step_s)
}
