//! Compares two sides: finds and pairs their runs, reads them, and puts what became of the events
//! of each pair into one report.

use std::convert::Infallible;
use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_numbers::RupturesFrom;
use asperity_record::{Rupture, SlipEvent};

use crate::column::{Column, Columns};
use crate::error::CompareError;
#[cfg(feature = "analysis")]
use crate::matches::Matches;
use crate::matching::{self, MatchError};
use crate::policy::{Policy, Spread, WINDOW_S, between_events_s};
#[cfg(feature = "analysis")]
use crate::precursors::Precursors;
use crate::report::{
    Counts, FORMAT, NumberChange, Report, RunDiff, RunSide, RuptureDiff, VERSION, Verdict, pair_name,
};
use crate::row::Row;
use crate::run_log::RunLog;
use crate::sides::{self, Logs, PairBy, Paired, Run, Side};
use crate::table::{self, Events, Table, TableError};
use crate::tally::{self, Comparison, Draft};
#[cfg(not(feature = "analysis"))]
use crate::without_analysis::{Matches, Precursors};
use crate::{claims, provenance};

/// How two sides are compared, and what is kept of it.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Which differences are none, and which are allowed.
    pub policy: Policy,
    /// The policy's file, for the report; `None` for the default.
    pub policy_file: Option<PathBuf>,
    /// By what the runs of two folders are paired.
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

/// What a comparison gives.
#[derive(Debug, Clone)]
pub struct Compared {
    /// What was found.
    pub report: Report,
    /// The tightest policy under which the new side passes.
    pub draft: Draft,
}

/// Compares two paths: run logs or event tables, folders of them, or outputs of
/// `asperity reproduce`. No file of the set, which is published by whoever made it, may be one that
/// is read.
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
    let mut matches = Matches::create(files, settings.matches_file.as_deref())?;
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
    // Where a table does not tell its step, its steps are taken for the other's.
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
        policy,
        old_until_s: old.side().duration_s,
        new_until_s: new.side().duration_s,
        keep_findings: settings.keep_findings,
        keep_matches: settings.keep_matches,
    };
    let of_events = comparison([old_table.columns, new_table.columns], RunLog::spread_of_slip_events);
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
    let mut run = RunDiff {
        old: RunSide { events: events.old_rows, ..old.side() },
        new: RunSide { events: events.new_rows, ..new.side() },
        summary: Vec::new(),
        ruptures: None,
        no_ruptures: None,
        provenance: Vec::new(),
        events,
        precursors: precursors.changes(),
    };
    let Some((of_old, of_new)) = logs else { return Ok(run) };
    run.summary = summaries(of_old, of_new);
    let of_ruptures = comparison([Rupture::COLUMNS; 2], RunLog::spread_of_ruptures);
    let ruptures = of_old.ruptures(&old.path).and_then(|old| Ok((old, of_new.ruptures(&new.path)?)));
    match ruptures.and_then(|(old, new)| compare_ruptures(of_ruptures, old, new)) {
        Ok(ruptures) => {
            let is_anew = |log: &RunLog| log.ruptures_from == RupturesFrom::Steps;
            let found_anew = is_anew(of_old) || is_anew(of_new);
            run.ruptures = Some(RuptureDiff { found_anew, ..ruptures });
        }
        Err(why) => run.no_ruptures = Some(why),
    }
    if run.ruptures_alone_differ() {
        draft.allow_ruptures();
    }
    let changes = provenance::changes(&of_old.provenance, &of_new.provenance);
    run.provenance = changes.map_err(|error| CompareError::Scenario {
        old: old.path.clone(),
        new: new.path.clone(),
        error: Box::new(error),
    })?;
    Ok(run)
}

/// The slip events of a run: those that its log has kept, else read one at a time.
fn open(run: &Run) -> Result<Table<'_>, TableError> {
    match run.log.as_ref().and_then(|log| log.slip_events()) {
        Some(events) => Ok(Table { columns: Columns::ALL, events: Box::new(events.iter().cloned().map(Ok)) }),
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

/// Compares ruptures in the order of their onsets, or returns why that is impossible. A log has them
/// in the order in which they became certain.
fn compare_ruptures(
    comparison: Comparison<'_>,
    old: &[Rupture],
    new: &[Rupture],
) -> Result<RuptureDiff, String> {
    let [old, new] = [old, new].map(|ruptures| {
        let mut ruptures = ruptures.to_vec();
        ruptures.sort_by_key(|rupture| (rupture.onset_step, rupture.first_block));
        ruptures.into_iter().map(Ok::<_, Infallible>)
    });
    // There are few ruptures, so all findings are kept, to list the largest first. Drafted
    // tolerances are of slip events only.
    let comparison = Comparison { keep_findings: usize::MAX, ..comparison };
    let mut table = tally::compare(comparison, old, new, &mut Draft::default(), |_| Ok(()))
        .map_err(|error| format!("they cannot be told apart: {error}"))?;
    (table.columns_left_out, table.not_allowed) = (None, None);
    Ok(RuptureDiff { found_anew: false, old: table.old_rows, new: table.new_rows, table })
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

#[cfg(test)]
mod tests {
    use asperity_record::Rupture;

    use super::compare_ruptures;
    use crate::column::Column;
    use crate::policy::Policy;
    use crate::report::{Class, Extent};
    use crate::row::Row;
    use crate::tally::Comparison;

    /// With nothing but when and where; the rest is null.
    fn rupture(number: u64, onset_step: u64, blocks: [u32; 2], end_step: Option<u64>) -> Rupture {
        let time_s = |step: u64| step as f64 / 1e7;
        let rupture = serde_json::json!({
            "rupture": number,
            "onset_s": time_s(onset_step),
            "end_s": end_step.map(time_s),
            "first_block": blocks[0],
            "last_block": blocks[1],
            "nucleation_block": blocks[0],
            "reached_every_block": false,
            "ft_fn_onset": 0.25,
            "ft_fn_arrival": 0.25,
            "ft_fn_end": end_step.map(|_| 0.125),
            "onset_step": onset_step,
            "arrival_s": time_s(onset_step),
            "end_step": end_step,
            "detachments": 1,
            "overlapping": false,
            "open": end_step.is_none(),
        });
        serde_json::from_value(rupture).unwrap()
    }

    #[test]
    fn ruptures_are_matched_by_onset_and_extent_whatever_order_they_became_certain_in() {
        // A long one that began first became certain last.
        let old = [
            rupture(0, 3_000_000, [1, 7], Some(3_010_000)),
            rupture(1, 5_000_000, [40, 60], Some(5_010_000)),
            rupture(2, 1_000_000, [1, 30], Some(6_000_000)),
        ];
        let new = [
            rupture(0, 1_000_000, [1, 30], Some(6_000_000)),
            rupture(1, 3_000_400, [1, 7], Some(3_010_400)),
            rupture(2, 7_000_000, [1, 2], None),
        ];
        let comparison = Comparison {
            columns: Rupture::COLUMNS,
            window_s: 1e-3,
            policy: &Policy::default(),
            old_until_s: None,
            new_until_s: None,
            keep_findings: 9,
            keep_matches: 9,
        };
        let found = compare_ruptures(comparison, &old, &new).unwrap();
        let number = |events: &[Extent]| events.first().map(|event| event.event);
        let matches = found.table.matches.iter();
        let matches: Vec<_> = matches.map(|one| (one.class, number(&one.old), number(&one.new))).collect();
        assert_eq!(
            matches,
            [
                (Class::Identical, Some(2), Some(0)),
                (Class::Shifted, Some(0), Some(1)),
                (Class::Missing, Some(1), None),
                (Class::Extra, None, Some(2)),
            ]
        );
        let columns = &found.table.columns;
        assert!(!columns.contains(&Column::MaxSliding) && columns.contains(&Column::FtFnOnset));
    }
}
