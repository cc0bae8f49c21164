//! The command line.

use std::path::PathBuf;
use std::sync::LazyLock;

use asperity_run::SolverKind;
use clap::{Args, Parser, Subcommand, ValueEnum};

/// What `--version` says: the package's version, and that of the code that shapes a run.
static LONG_VERSION: LazyLock<String> =
    LazyLock::new(|| format!("{}\ncode version {}", env!("CARGO_PKG_VERSION"), asperity_run::CODE_VERSION));

/// Precursors to frictional sliding: simulate, detect, log, reduce, draw.
#[derive(Debug, Parser)]
#[command(
    name = "asperity",
    version,
    long_version = LONG_VERSION.as_str(),
    after_help = "\
Examples:
  asperity scenario list
  asperity scenario show default > mine.toml
  asperity run mine.toml --out mine.mcap
  asperity events mine.mcap --format csv > events.csv
  asperity check mine.mcap
  asperity export mine.mcap --to csv --out mine-tables
  asperity diff before.mcap after.mcap
  asperity reduce mine.mcap --out mine/

Exit codes: 0 success; 1 it could not be done, a replay gave other events, or two runs differ; 2 bad input, nothing written;
130 and 143 interrupted by SIGINT and SIGTERM, the log closed as RUN.mcap.partial. A second signal stops at once."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// List the built-in scenarios, or show one in full.
    #[command(subcommand)]
    Scenario(ScenarioCommand),
    /// Run a scenario and log it.
    Run(RunArguments),
    /// Print the slip events of a run.
    Events(EventsArguments),
    /// Say whether run logs are whole, incomplete or damaged, and up to where they are sound.
    Check(CheckArguments),
    /// Put together what is left of a damaged log.
    Salvage(SalvageArguments),
    /// Say what became of the slip events between two runs, or two folders of runs.
    Diff(DiffArguments),
    /// Send the records of a run through the detectors again and compare.
    Replay(ReplayArguments),
    /// Write what run logs hold as files that data frames read.
    Export(ExportArguments),
    /// Make tables and figures of one run.
    #[cfg(feature = "analysis")]
    Reduce(ReduceArguments),
    /// Run a pipeline: its runs, tables, figures and claims.
    #[cfg(feature = "analysis")]
    Reproduce(ReproduceArguments),
    /// Hold the fast solver against the plain one, run by run of a pipeline.
    #[cfg(feature = "analysis")]
    VerifySolver(VerifySolverArguments),
}

#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// List the built-in scenarios with what each is for.
    List,
    /// Print a scenario as complete TOML: every key with its symbol, meaning and accepted values.
    #[command(after_help = "\
Examples:
  asperity scenario show default
  asperity scenario show default --set parameter_set=as-stated
  asperity scenario show mine.toml")]
    Show(ScenarioChoice),
}

#[derive(Debug, Args)]
pub(crate) struct ScenarioChoice {
    /// Name of a built-in scenario, or path of a TOML file.
    pub(crate) scenario: String,
    /// Override one key; may be given many times, the last one wins.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity run default --out default.mcap
  asperity run mine.toml --out mine.mcap --set time.duration_s=0.5 --set normal_load.tilt=-0.5
  asperity run long.toml --out long.mcap --resume

Until it is whole the log stands at RUN.mcap.partial. About once a second it takes down the solver's whole state, and with
--resume a run that was killed, or ran out of disk, goes on from the last one; it ends with the same records and events as
one that was never interrupted. With --resume, a run that is whole already is left as it is, and one that was never begun is
begun, so that a batch job can be given the same line again and again.")]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// The log to write; must not exist, but for --resume.
    #[arg(long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
    /// Which solver takes the steps; both give the same events.
    #[arg(long, value_enum, default_value = "fast")]
    pub(crate) solver: SolverChoice,
    /// Say on stderr what the run was made of.
    #[arg(long)]
    pub(crate) stats: bool,
    /// Go on with the run that RUN.mcap.partial is of; begin it if there is none.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Least time of work between two states that are taken down to go on from, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    pub(crate) checkpoint_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SolverChoice {
    /// Many steps at once wherever it is certain that no block switches.
    Fast,
    /// Every step, as the equations read.
    Plain,
}

impl From<SolverChoice> for SolverKind {
    fn from(choice: SolverChoice) -> SolverKind {
        match choice {
            SolverChoice::Fast => SolverKind::Fast,
            SolverChoice::Plain => SolverKind::Plain,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableFormat {
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
    /// One array of objects.
    Json,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity events run.mcap --format csv
  asperity events run.mcap --format json | python3 -m json.tool
  asperity events out/chapter5/tables/default.events.parquet

As a filter for `git diff` of run logs and Parquet tables:
  git config diff.asperity.textconv 'asperity events'")]
pub(crate) struct EventsArguments {
    /// The run log, or any of the Parquet tables, which is printed as CSV.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// How to print the table.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: TableFormat,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity check run.mcap
  asperity check out/chapter5/runs/*.mcap

Reads every byte: the file's structure and checksums, every message against its schema, the order of steps and their times,
that all numbers are finite, that switches fit the blocks' states, that the events are those which the step records give, and
that counts and digest are what the log's end says. Exit codes: 0 all whole; 1 some incomplete, but sound up to where they
end; 2 some damaged, or no run logs.")]
pub(crate) struct CheckArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DiffFormat {
    /// What matters most, on one screen.
    Text,
    /// Everything; the field `format` is "asperity-diff", `version` counts up when a field changes.
    Json,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PairBy {
    /// The hash of the resolved scenario; the file's name where one of the two has none.
    Hash,
    /// The file's name, also between scenarios that differ.
    Name,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity diff before.mcap after.mcap
  asperity diff out/before out/after                        two outputs of asperity reproduce
  asperity diff reference.csv run.mcap --policy policy.toml
  asperity diff before.mcap after.mcap --draft-policy policy.toml
  asperity diff coarse/runs fine/runs --pair name
  asperity diff before.mcap after.mcap --page diff.html
  asperity diff before.mcap after.mcap --format json | python3 -m json.tool

Events are matched by when and where they slid, never by row: one event more or less moves no blame to those behind it.
Each is identical, within-tolerance, shifted (same blocks, another time), changed, split, merged, missing, extra, or open
(the end of a run cut it short). Tables need the columns onset_s, end_s, first_block and last_block; what one side lacks
is not compared. The number of an event is not compared, and its steps only where the seconds agree.

A policy (TOML) says what passes:
  window_s = 1e-3                  how far from an onset its counterpart is looked for
  max_shift_s = 1e-6               no pair may be shifted farther
  [columns.onset_s]
  absolute = 1e-9                  in the column's unit; relative = ... as well, the larger counts
  [allow]
  shifted = true                   any number of them
  split = 2                        at most two in all

Exit codes: 0 nothing differs but what the policy allows; 1 something does, or a run has no counterpart; 2 the sides cannot
be compared.")]
pub(crate) struct DiffArguments {
    /// The old side: a run log, an event table (.csv, .parquet), a folder of either, or an output of asperity reproduce.
    #[arg(value_name = "OLD")]
    pub(crate) old: PathBuf,
    /// The new side.
    #[arg(value_name = "NEW")]
    pub(crate) new: PathBuf,
    /// Which differences are none, and which are allowed [default: every difference counts].
    #[arg(long, value_name = "POLICY.toml")]
    pub(crate) policy: Option<PathBuf>,
    /// Write the tightest policy under which this diff passes; must not exist.
    #[arg(long, value_name = "POLICY.toml")]
    pub(crate) draft_policy: Option<PathBuf>,
    /// What to print.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: DiffFormat,
    /// By what the runs of two folders are paired.
    #[arg(long, value_enum, default_value = "hash")]
    pub(crate) pair: PairBy,
    /// Write a page with both timelines, every event in them and those that differ marked.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) page: Option<PathBuf>,
    /// Write one row per match, identical ones too.
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "FILE.parquet")]
    pub(crate) matches: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity salvage damaged.mcap --out salvaged.mcap
  asperity check salvaged.mcap

Keeps every record that something vouches for, before and behind the damage: chunks and attachments by their checksums, the
header by the scenario, each message by its schema, each step by having all its switches. Says what was lost: bytes, messages
of each topic, steps. The new log has the status `salvaged`, so no command takes it for whole. An unfinished log of a run is
better gone on with (asperity run --resume), and a run whose scenario is known better made again.")]
pub(crate) struct SalvageArguments {
    /// The damaged log.
    #[arg(value_name = "DAMAGED.mcap")]
    pub(crate) run: PathBuf,
    /// The log to write; must not exist.
    #[arg(long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity replay run.mcap
  asperity replay run.mcap --format csv > replayed.csv
  asperity replay out/chapter5/runs/*.mcap --out replayed
  asperity replay run.mcap --detectors settings.toml --out merged

A settings file says what is to differ from a live run; all of it may be left out:
  detectors = [\"onset\", \"extent\", \"global\"]   # which of them
  merge_gap_s = 1e-4                          # events no farther apart are one
  min_blocks = 2                              # events of fewer distinct blocks are left out
With other settings the events are other ones, and nothing is compared. --out writes NAME.onsets.csv, NAME.events.csv and
NAME.global-slips.csv for each run, and replay.json with the settings and what was replayed.")]
pub(crate) struct ReplayArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Print the slip events of the replay instead of the verdict; of one run.
    #[arg(long, value_enum)]
    pub(crate) format: Option<TableFormat>,
    /// Folder to write tables of each run's events to; must not exist or be empty.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Which detectors look, and by which rules [default: those of a live run].
    #[arg(long, value_name = "SETTINGS.toml")]
    pub(crate) detectors: Option<PathBuf>,
    /// How many runs are replayed at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// Columns with types and units, compressed.
    #[cfg(feature = "analysis")]
    Parquet,
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
    /// One JSON object per row and line.
    Ndjson,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity export run.mcap --to parquet --out tables
  asperity export run.mcap --to csv --topic /step --topic /events/slip --out tables
  asperity export run.mcap --to ndjson --topic /fields --from-s 0.5 --to-s 0.6 --out tables
  asperity export out/chapter5/runs/*.mcap --to parquet --out tables

One file per topic, NAME.step.parquet for /step of NAME.mcap, and NAME.export.json, which holds the run's header and scenario,
the columns with their units, and how many rows each file has. Tables are long: states of all blocks (/fields, /window) have
one row per block. The whole log is read and checked, whatever is asked of it; one that is incomplete or damaged is
exported as far as it is sound, and the exit code is 1.")]
pub(crate) struct ExportArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// The format of the files.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) to: ExportFormat,
    /// Folder to write the files to.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Only this topic; may be given many times [default: all].
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Vec<String>,
    /// Only what happened at this time or later; events count by their onset.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) from_s: Option<f64>,
    /// Only what happened before this time.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) to_s: Option<f64>,
    /// Replace files that are there already.
    #[arg(long)]
    pub(crate) replace: bool,
    /// How many runs are exported at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[cfg(feature = "analysis")]
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reduce run.mcap --out run/
  asperity reduce run.mcap --out merged/ --merge-gap-s 1e-4 --min-blocks 2")]
pub(crate) struct ReduceArguments {
    /// The run log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// Folder for tables and figures; must not exist or be empty.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Precursor table: fewest distinct blocks of an event that counts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) min_blocks: u32,
    /// Precursor table: take events no farther apart than this for one; 0 for none.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub(crate) merge_gap_s: f64,
}

#[cfg(feature = "analysis")]
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reproduce pipelines/chapter5.toml --out out/chapter5
  asperity reproduce pipelines/chapter5.toml --out out/chapter5-as-stated --set parameter_set=as-stated")]
pub(crate) struct ReproduceArguments {
    /// The pipeline.
    #[arg(value_name = "PIPELINE.toml")]
    pub(crate) pipeline: PathBuf,
    /// Folder for runs, tables and figures. Runs found there are used again when
    /// their scenario and the code are the same.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Override one key in every run of the pipeline.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Make every run anew.
    #[arg(long)]
    pub(crate) fresh: bool,
    /// Which solver takes the steps; both give the same events.
    #[arg(long, value_enum, default_value = "fast")]
    pub(crate) solver: SolverChoice,
    /// How many runs go on at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[cfg(feature = "analysis")]
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity verify-solver pipelines/chapter5.toml
  asperity verify-solver pipelines/chapter5.toml --set parameter_set=as-stated
  asperity verify-solver pipelines/chapter5.toml --only default --for-s 0.1

The plain solver takes every step: count on 15 seconds of one core for each second that a run of 100 blocks simulates in
steps of 1e-8 s. Equal means: every switch in the same step, every event with the same integers, every number within
1e-9 of the largest of its kind. Where a block comes closer to its switch than rounding reaches, the solvers may see it
some steps apart; that is proved by computing the step without rounding, and must be listed in --near-ties.")]
pub(crate) struct VerifySolverArguments {
    /// The pipeline.
    #[arg(value_name = "PIPELINE.toml")]
    pub(crate) pipeline: PathBuf,
    /// Override one key in every run of the pipeline.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Only this run; may be given many times.
    #[arg(long, value_name = "RUN")]
    pub(crate) only: Vec<String>,
    /// Only the first so many seconds of each run.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) for_s: Option<f64>,
    /// Folder of the near ties that are known [default: fixtures/near-ties, if it is there].
    #[arg(long, value_name = "FOLDER")]
    pub(crate) near_ties: Option<PathBuf>,
    /// Folder to write proofs of those that are not listed to.
    #[arg(long, value_name = "FOLDER", default_value = "out/near-ties")]
    pub(crate) out: PathBuf,
    /// How many runs go on at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}
