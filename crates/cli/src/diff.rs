//! `asperity diff`: compares the events of two runs, or of all runs in two folders. Exits with 0 if the
//! policy is kept, 1 if not, 2 if there is nothing to compare or an input cannot be read.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use asperity_diff::policy::Policy;
use asperity_diff::report::{Report, Verdict};
use asperity_diff::run_log::{RunLog, Summarized};
use asperity_diff::sides::{self, Logs};
use asperity_diff::{CompareError, Compared, Settings, compare, page, summary as screen};
use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_model::scenario::text;
use asperity_run::{Checked, OpenLog};
use clap::{Args, ValueEnum};

use crate::exit::{self, Code, Failure};
use crate::given::{self, Taken};
use crate::outputs::{fits, refused};
use crate::reading::{self, Reading};
use crate::{summary, terminal, verdict_exit};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DiffFormat {
    /// The main differences, on one screen.
    Text,
    /// All differences; the field `version` increases when the layout changes.
    Json,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PairBy {
    /// By the hash of the resolved scenario, or by file name where one side has no hash.
    Hash,
    /// By file name, even if the scenarios differ.
    Name,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity diff out/before.mcap out/after.mcap
  asperity diff out/before out/after    # two outputs of asperity reproduce
  asperity diff reference.csv out/mine.mcap --policy policy.toml
  asperity diff out/before.mcap out/after.mcap --draft-policy out/policy.toml
  asperity diff out/coarse/runs out/fine/runs --pair name
  asperity diff out/before.mcap out/after.mcap --page out/diff.html
  asperity diff out/before out/after --format json | python3 -m json.tool

For run logs, the settings that differ, the numbers of both summaries and the
pairs of ruptures come first, then the slip events. Of two parameter sets the
distributions of ruptures come before all pairs. A counterpart is searched
for within 1 ms of an onset, or, between runs with different time steps, within
the mean time between events. Where the times of two parameter sets do not
match, ruptures and events are paired by their cycle between slips of the whole
slider, and by their place in the cycle.

Events are matched by when and where they slid, never by row: an extra or
missing event does not make later rows look different. Each event is identical,
within-tolerance, shifted (same blocks, another time), changed, split, merged,
missing, extra, or open (cut short by the end of a run). Tables need the
columns onset_s, end_s, first_block and last_block; a column that one side lacks
is not compared. Numbers of events are never compared, and steps only where
their times in seconds are equal.

A policy (TOML) defines which differences pass:
  window_s = 1e-3         # how far from an onset to search for its counterpart
  max_shift_s = 1e-6      # no pair may be shifted farther than this
  [columns.onset_s]
  absolute = 1e-9         # in the column's unit
  relative = 1e-12        # of the larger value; the larger tolerance applies
  [allow]
  shifted = true          # any number of them
  split = 2               # at most two in all
  ruptures = true         # may differ where no slip event does")]
pub(crate) struct DiffArguments {
    /// The old side: a run log, an event table (.csv), a folder of either, or an
    /// output of asperity reproduce.
    #[arg(value_name = "OLD")]
    pub(crate) old: PathBuf,
    /// The new side.
    #[arg(value_name = "NEW")]
    pub(crate) new: PathBuf,
    /// Which differences count, and how many are allowed [default: all count, none allowed].
    #[arg(long, value_name = "POLICY.toml")]
    pub(crate) policy: Option<PathBuf>,
    /// Write the tightest policy under which this diff passes.
    #[arg(long, value_name = "POLICY.toml")]
    pub(crate) draft_policy: Option<PathBuf>,
    /// What to print.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: DiffFormat,
    /// How the runs of two folders are paired.
    #[arg(long, value_enum, default_value = "hash")]
    pub(crate) pair: PairBy,
    /// Write a page with settings, numbers, figures of two parameter sets, and timelines of ruptures and
    /// events, with differences marked.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) page: Option<PathBuf>,
    /// Write one row per match, including identical events.
    #[arg(long, value_name = "FILE.parquet")]
    pub(crate) matches: Option<PathBuf>,
    /// Replace existing output files; OLD and NEW are never replaced.
    #[arg(long)]
    pub(crate) force: bool,
}

pub(crate) fn command(arguments: &DiffArguments) -> Result<(), Failure> {
    let files = outputs(arguments)?;
    let mut settings = settings(arguments)?;
    let told = |error: FileError| refused("", &error, true);
    settings.logs = read_logs(arguments)?;
    let Compared { report, draft } =
        compare(&arguments.old, &arguments.new, &settings, &files).map_err(as_failure)?;
    if let Some(path) = &arguments.draft_policy {
        let text = format!(
            "# The tightest policy under which {} passes against {}.\n{}",
            report.new,
            report.old,
            draft.policy(settings.policy.window_s).to_toml()
        );
        files.write(path, text).map_err(told)?;
    }
    if let Some(path) = &arguments.page {
        files.write(path, page::page(&report)).map_err(told)?;
    }
    files.publish().map_err(told)?;
    print(&report, arguments.format)?;
    match report.verdict {
        Verdict::WithinPolicy => Ok(()),
        Verdict::Differs => Err(Failure::Said(Code::Failed)),
    }
}

/// Reads and checks every run log on either side, each once. All must be complete; other code
/// versions are accepted, since comparing them is the purpose.
fn read_logs(arguments: &DiffArguments) -> Result<Logs, Failure> {
    let mut paths = Vec::new();
    for side in [&arguments.old, &arguments.new] {
        given::check(side, Taken::Side)?;
        paths.extend(sides::logs(side).map_err(as_failure)?);
    }
    // Figures are those of two logs.
    let is_drawn = arguments.page.is_some() && paths.len() == 2;
    let read = exit::each_of(&paths, None, |path| read_log(path, is_drawn))?;
    let mut logs = Logs::new();
    let mut codes = Vec::new();
    for (path, read) in paths.into_iter().zip(read) {
        match read {
            Ok(log) => drop(logs.insert(path, Arc::new(log))),
            Err(code) => codes.push(code),
        }
    }
    Code::worst(codes).said()?;
    Ok(logs)
}

/// Checks a log, and collects the data for a diff in the same pass.
fn read_log(path: &Path, is_drawn: bool) -> Result<RunLog, Failure> {
    let begin = |log: &OpenLog| {
        let drawn = log.shown_scenario().ok().filter(|_| is_drawn);
        Ok(Summarized::begin(log.header(), log.scenario_toml(), summary::begin(path, log), drawn.as_deref()))
    };
    let accept = |checked: &Checked| verdict_exit::must_hold_all(path, checked);
    let Reading { checked, observer, has_ruptures } = reading::once(path, &[], begin, accept)?;
    Ok(observer.finish(path, has_ruptures, checked.seen.end.as_ref()))
}

/// Reserves the outputs, each with the ending of its format, which must not overwrite inputs.
fn outputs(arguments: &DiffArguments) -> Result<FileSet, Failure> {
    let existing = if arguments.force { Existing::Replace } else { Existing::Refuse };
    let inputs = [Some(&arguments.old), Some(&arguments.new), arguments.policy.as_ref()];
    let files = FileSet::new(existing, Inputs::of(inputs.into_iter().flatten()));
    for (option, path, ending, what) in [
        ("--page", &arguments.page, "html", "a page"),
        ("--draft-policy", &arguments.draft_policy, "toml", "a policy"),
        ("--matches", &arguments.matches, "parquet", "a Parquet table"),
    ] {
        path.as_ref().map_or(Ok(()), |path| fits(option, path, ending, what))?;
        files.reserve(path.clone()).map_err(|error| refused(option, &error, true))?;
    }
    Ok(files)
}

fn settings(arguments: &DiffArguments) -> Result<Settings, Failure> {
    let (keep_findings, keep_matches) = match arguments.format {
        DiffFormat::Json => (usize::MAX, usize::MAX),
        DiffFormat::Text if arguments.page.is_some() => (page::FINDINGS_OF_A_CLASS, page::MATCHES_OF_A_RUN),
        DiffFormat::Text => (screen::KEPT_OF_A_CLASS, 0),
    };
    Ok(Settings {
        policy: read_policy(arguments)?,
        policy_file: arguments.policy.clone(),
        pair_by: match arguments.pair {
            PairBy::Hash => sides::PairBy::Hash,
            PairBy::Name => sides::PairBy::Name,
        },
        keep_findings,
        keep_matches,
        matches_file: arguments.matches.clone(),
        logs: Logs::new(),
    })
}

fn read_policy(arguments: &DiffArguments) -> Result<Policy, Failure> {
    let Some(path) = &arguments.policy else { return Ok(Policy::default()) };
    let text = text::read(path).map_err(|error| {
        Failure::BadInput(format!("policy {}: {error} (accepted: a TOML file)", path.display()))
    })?;
    Policy::parse(&path.display().to_string(), &text).map_err(Failure::bad_input)
}

fn as_failure(error: CompareError) -> Failure {
    match error {
        CompareError::File(error) => refused("", &error, true),
        error @ CompareError::Matches(_) => Failure::failed(error),
        error => Failure::bad_input(error),
    }
}

fn print(report: &Report, format: DiffFormat) -> Result<(), Failure> {
    match format {
        DiffFormat::Text => {
            for line in screen::lines(report) {
                terminal::say(line)?;
            }
        }
        DiffFormat::Json => {
            let mut out = io::BufWriter::new(terminal::data());
            serde_json::to_writer_pretty(&mut out, report).map_err(|error| Failure::Output(error.into()))?;
            writeln!(out)?;
            out.flush()?;
        }
    }
    Ok(())
}
