//! Two sides of a diff: what stands at a path, which runs belong together, their event tables
//! read from run logs, CSV and Parquet, and what became of the events
//! ([`asperity_diff`], which reads no files).
//!
//! ```
//! use asperity_compare::{Settings, compare};
//! use asperity_diff::report::Class;
//! use asperity_files::{Existing, FileSet, Inputs};
//!
//! # let folder = tempfile::tempdir()?;
//! # let [before, after] = ["before.csv", "after.csv"].map(|name| folder.path().join(name));
//! std::fs::write(&before, "onset_s,end_s,first_block,last_block\n0.1,0.2,1,5\n0.4,0.5,1,9\n")?;
//! std::fs::write(&after, "onset_s,end_s,first_block,last_block\n0.1,0.2,1,5\n")?;
//!
//! // Nothing is written here: no file of matches is asked for.
//! let files = FileSet::new(Existing::Refuse, Inputs::default());
//! let report = compare(&before, &after, &Settings::default(), &files)?.report;
//! assert_eq!(report.counts.of(Class::Identical), 1);
//! assert_eq!(report.counts.of(Class::Missing), 1);
//! for line in asperity_diff::summary::lines(&report) {
//!     println!("{line}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In reading order:
//!
//! - [`sides`]: the runs of each side, and which of them belong together.
//! - `physics`: what two run logs say of ruptures.
//! - [`table`]: the slip events of a run, one at a time.
//! - `precursors`: what a change of events does to the precursor table.
//! - `claims`: which claims changed between two outputs of a pipeline.
//! - `matches`: every match as a row of a Parquet file.
//!
//! Parquet and the precursor table need the feature `analysis`.

mod claims;
mod error;
mod lines;
#[cfg(feature = "analysis")]
mod matches;
mod physics;
#[cfg(feature = "analysis")]
mod precursors;
pub mod sides;
pub mod table;
#[cfg(not(feature = "analysis"))]
mod without_analysis;

use std::path::{Path, PathBuf};

use asperity_diff::column::{Column, Columns};
use asperity_diff::matching::{self, MatchError};
use asperity_diff::policy::{Policy, WINDOW_S, between_events_s};
use asperity_diff::provenance;
use asperity_diff::report::{Counts, FORMAT, Report, RunDiff, VERSION, Verdict, pair_name};
use asperity_diff::rupture;
use asperity_diff::tally::{self, Comparison, Draft};
use asperity_files::FileSet;
use asperity_record::SlipEvent;

pub use claims::ClaimsError;
pub use error::CompareError;
#[cfg(feature = "analysis")]
use matches::Matches;
use physics::Physics;
pub use physics::{Tell, Told};
#[cfg(feature = "analysis")]
use precursors::Precursors;
use sides::{PairBy, Paired, Run, Side};
use table::Events;
#[cfg(not(feature = "analysis"))]
use without_analysis::{Matches, Precursors};

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
    /// Tells of a run log what it takes more than its events to know; without it, summaries are
    /// not compared, nor ruptures of logs from before there were any.
    pub tell: Option<Tell>,
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

/// Compares what stands at two paths: run logs or event tables, folders of them, or outputs of
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
    let (old, new) = (Side::find(old_path)?, Side::find(new_path)?);
    files.add_inputs(old.files().chain(new.files()))?;
    let Paired { pairs, unpaired } = sides::pair(&old, &new, settings.pair_by);
    let mut draft = Draft::default();
    let mut matches = Matches::create(files, settings.matches_file.as_deref())?;
    let mut runs = Vec::new();
    for (old, new) in &pairs {
        runs.push(compare_runs(old, new, settings, &mut draft, &mut matches)?);
    }
    matches.finish()?;
    let mut counts = Counts::default();
    let mut not_allowed = 0;
    for run in &runs {
        counts.add(&run.counts);
        not_allowed += run.not_allowed.total();
    }
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
    let (old_table, new_table) = (table::open(&old.path)?, table::open(&new.path)?);
    let (old_events, old_step_s) = step_s(old, old_table.columns, old_table.events);
    let (new_events, new_step_s) = step_s(new, new_table.columns, new_table.events);
    // Where a table does not tell its step, its steps are taken for the other's.
    let same_step = old_step_s.zip(new_step_s).is_none_or(|(old, new)| (old - new).abs() < 1e-6 * old);
    let physics = match (&old.provenance, &new.provenance) {
        (Some(of_old), Some(of_new)) => {
            let read = |run: &Run, header| Physics::read(&run.path, header, settings.tell);
            Some((read(old, &of_old.header)?, read(new, &of_new.header)?))
        }
        _ => None,
    };
    let policy = &settings.policy;
    let window_s = |events: fn(&Physics) -> u64| {
        policy.window_s.unwrap_or_else(|| match &physics {
            Some((old, new)) if !same_step => between_events_s(old.spread(events), new.spread(events)),
            _ => WINDOW_S,
        })
    };
    let comparison = Comparison {
        columns: matching::comparable(old_table.columns, new_table.columns, same_step),
        window_s: window_s(|physics| physics.slip_events),
        policy,
        old: old.side(),
        new: new.side(),
        keep_findings: settings.keep_findings,
        keep_matches: settings.keep_matches,
    };
    let of_ruptures = Comparison {
        columns: matching::comparable(rupture::columns(), rupture::columns(), same_step),
        window_s: window_s(Physics::ruptures),
        ..comparison.clone()
    };
    let name = pair_name(&old.name, &new.name);
    let mut precursors = Precursors::of(old, new);
    let [old_events, new_events] = [old_events, new_events].map(|events| events.map(|event| Ok(event?)));
    let compared = tally::compare(comparison, old_events, new_events, draft, |matched| {
        precursors.watch(matched);
        matches.push(&name, matched)
    });
    let mut run = compared.map_err(|error| match error {
        MatchError::Source(error) => error,
        MatchError::Order { side, .. } | MatchError::AtOnce { side, .. } => {
            let path = if side == "old" { &old.path } else { &new.path };
            CompareError::Order { path: path.clone(), problem: error.to_string() }
        }
    })?;
    run.precursors = precursors.changes();
    if let Some((old, new)) = physics {
        run.summary = physics::compare_summaries(&old, &new);
        match physics::compare_ruptures(of_ruptures, old, new) {
            Ok(ruptures) => run.ruptures = Some(ruptures),
            Err(why) => run.no_ruptures = Some(why),
        }
        if run.ruptures_alone_differ() {
            draft.allow_ruptures();
        }
    }
    if let (Some(old_run), Some(new_run)) = (&old.provenance, &new.provenance) {
        run.provenance = provenance::changes(old_run, new_run).map_err(|error| CompareError::Scenario {
            old: old.path.clone(),
            new: new.path.clone(),
            error: Box::new(error),
        })?;
    }
    Ok(run)
}

/// The time step that a table counts in, s: from the run's header, else from its first event.
fn step_s(run: &Run, columns: Columns, events: Events) -> (Events, Option<f64>) {
    if let Some(provenance) = &run.provenance {
        return (events, Some(provenance.header.time_step_s));
    }
    if !columns.has(Column::OnsetStep) {
        return (events, None);
    }
    let mut events = events.peekable();
    let of = |event: &SlipEvent| (event.onset_step > 0).then(|| event.onset_s / event.onset_step as f64);
    let step_s = events.peek().and_then(|event| event.as_ref().ok().and_then(of));
    (Box::new(events), step_s)
}
