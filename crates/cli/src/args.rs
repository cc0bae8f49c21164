//! The command line.

use std::path::PathBuf;
use std::sync::LazyLock;

use asperity_run::SolverKind;
use clap::{Args, Parser, Subcommand, ValueEnum};

pub(crate) use report::ReportArguments;
pub(crate) use sweep::*;

mod report;
mod sweep;

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
  mkdir -p out
  asperity scenario list
  asperity scenario show default > out/mine.toml
  asperity run out/mine.toml -o out/mine.mcap
  asperity summary out/mine.mcap
  asperity events out/mine.mcap --format csv > out/events.csv
  asperity check out/mine.mcap
  asperity export out/mine.mcap --to csv -o out/tables
  asperity diff out/before.mcap out/after.mcap
  asperity report out/mine.mcap --out out/mine.html
  asperity reduce out/mine.mcap -o out/mine

Exit codes:
  0    done; the logs are whole, or the same
  1    failure; or a replay gave other events, two runs differ
  2    bad input, nothing was written; or a file is not a run log
  3    a log is incomplete
  4    a log is damaged
  5    a log is salvaged with gaps
  6    check: a log is by other code or detectors
  7    a log is of a run that was stopped because it could not go on
  130  interrupted by SIGINT; the log was closed as RUN.mcap.partial
  143  interrupted by SIGTERM, likewise
A second signal stops at once."
)]
pub(crate) struct Arguments {
    /// Print no progress and no notes on stderr; errors are still printed.
    #[arg(short, long, global = true, display_order = 900)]
    pub(crate) quiet: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// List the built-in scenarios, show one in full, or say what a run would be.
    #[command(subcommand)]
    Scenario(ScenarioCommand),
    /// Run a scenario and log it.
    Run(RunArguments),
    /// Say in numbers what runs did: first slip, precursors, recurrence, fronts ...
    Summary(SummaryArguments),
    /// Print the slip events of a run.
    Events(EventsArguments),
    /// Check what run logs are worth: whole, incomplete, damaged ...
    Check(CheckArguments),
    /// Recover what is left of a damaged log.
    Salvage(SalvageArguments),
    /// Compare two runs, or two folders of runs: numbers, ruptures and slip events.
    Diff(DiffArguments),
    /// Put runs, or a whole study, on one page.
    Report(ReportArguments),
    /// Run the detectors again on the records of a log, and compare the events.
    Replay(ReplayArguments),
    /// Write run logs as tables for data frames: Parquet, CSV or NDJSON.
    Export(ExportArguments),
    /// Make tables and figures of one run.
    #[cfg(feature = "analysis")]
    Reduce(ReduceArguments),
    /// Run a pipeline: its runs, tables, figures and claims.
    #[cfg(feature = "analysis")]
    Reproduce(ReproduceArguments),
    /// Compare the fast solver with the plain one in every run of a pipeline.
    #[cfg(feature = "analysis")]
    VerifySolver(VerifySolverArguments),
    /// Vary parameters: many runs from one file, here or on a cluster, as tables.
    #[command(subcommand)]
    Sweep(SweepCommand),
    /// Print the completion script of a shell.
    Completions(CompletionsArguments),
    /// Write the manual pages.
    Man(ManArguments),
}

#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// List the built-in scenarios and what each is for.
    List,
    /// Print a scenario as complete TOML: each key with symbol, meaning and accepted values.
    #[command(after_help = "\
Examples:
  asperity scenario show default
  asperity scenario show default --set parameter_set=as-stated
  asperity scenario show out/mine.toml")]
    Show(ScenarioChoice),
    /// Say what a run would be, without making it: time step, steps, time, length of its log.
    #[command(after_help = "\
Examples:
  asperity scenario validate out/mine.toml
  asperity scenario validate default --set time.step_s=3e-6
  asperity scenario validate out/mine.toml --format json | python3 -m json.tool

Everything that is wrong with a scenario is said as `run` would say it, with the
place and what is accepted, and so are its warnings. The time step is compared
with the longest one that is stable while no block switches; beyond 0.4 of that,
the energy that switches feed into the slider shows in the results.

The bound on the log holds whatever the numbers are; compressed, a log has a
third of it or less. What depends on events is given for each of them. How long
the plain solver takes is tried on this machine for a quarter of a second, and
said on stderr; with --quiet it is not tried, and the same scenario gives the
same words. The fast solver, the default, takes less wherever few blocks switch.

Exit codes:
  0  the scenario is valid, with warnings or without
  1  failure
  2  it is not")]
    Validate(ValidateArguments),
}

#[derive(Debug, Args)]
pub(crate) struct ValidateArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// How to print it.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: ForecastFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ForecastFormat {
    /// For people.
    Text,
    /// An object, with the estimate of the plain solver's time unless --quiet is given.
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct ScenarioChoice {
    /// Name of a built-in scenario, path of a TOML file, or a run log, for its scenario.
    pub(crate) scenario: PathBuf,
    /// Override one key. May be repeated; the last one wins.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity run default -o out/default.mcap
  asperity run out/mine.toml -o out/mine.mcap --set normal_load.tilt=-0.5
  asperity run out/long.toml -o out/long.mcap --resume

During the run its log is called RUN.mcap.partial. About once a second a
checkpoint, the complete state of the solver, is written to it. If the run is
killed or the disk is full, --resume continues from the last checkpoint and ends
with the same records and events as an uninterrupted run. With --resume, a
finished run is left as it is, and one that was never begun is started, so a
batch job can repeat the same command line.

A run is stopped, with exit code 1, where its time step does more work than
30 % of what is put in, or a number overflows; its log holds what there is and
says why. Time steps above 0.4 dt_max are warned of (docs/model.md).")]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// The log to write; must not exist, except with --resume.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
    /// The solver to use; both give the same events.
    #[arg(long, value_enum, default_value = "fast")]
    pub(crate) solver: SolverChoice,
    /// Print statistics of the solver on stderr, even with --quiet.
    #[arg(long)]
    pub(crate) stats: bool,
    /// Continue the run in RUN.mcap.partial, or start it if there is none.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Shortest wall-clock time between two checkpoints, in seconds. Below 1 s, they take up to
    /// 16 MB, and from then on 0.1 MB per second.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    pub(crate) checkpoint_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SolverChoice {
    /// Many steps at once wherever it is certain that no block switches.
    Fast,
    /// One step at a time, as in the equations.
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

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SummaryFormat {
    /// For people, six digits: all numbers of one run, the first of several.
    Text,
    /// Comma-separated, one header line, one row for each run, numbers in full precision.
    Csv,
    /// An object; an array of them if several runs are named.
    Json,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity summary out/mine.mcap
  asperity summary out/chapter5/runs/*.mcap
  asperity summary out/chapter5/runs/*.mcap --format csv > out/summary.csv
  asperity summary out/mine.mcap --format json | python3 -m json.tool
  asperity summary --schema > out/summary.schema.json

Events are ruptures here: sets of detachments that a front joins, whatever
slides elsewhere at the same time. Numbers of raw slip events say so. A
precursor is a rupture from block 1 that reaches farther than any before, up
to the first that reaches every block, which is not counted. Ruptures that the
log of an older version does not have are found in its step records. SI units
throughout; docs/outputs.md explains every key, and so does the schema.

Exit codes, that of the worst of several logs:
  0  all of every run is in the summary
  1  failure
  2  a file is not a run log
  3, 4, 5, 7  a log is incomplete, damaged, salvaged with gaps or of a run that
              was stopped, and its summary is of the part that is sound; see
              asperity check")]
pub(crate) struct SummaryArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required_unless_present = "schema")]
    pub(crate) runs: Vec<PathBuf>,
    /// How to print it.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: SummaryFormat,
    /// Print the JSON schema of a summary: each key with its meaning and unit.
    #[arg(long, conflicts_with_all = ["runs", "format"])]
    pub(crate) schema: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity events out/mine.mcap --format csv
  asperity events out/mine.mcap --format json | python3 -m json.tool
  asperity events out/chapter5/tables/default.events.parquet

As a filter for `git diff` of run logs and Parquet tables:
  git config diff.asperity.textconv 'asperity events'

Exit codes:
  0  all events of the run were printed
  1  failure
  2  the file is not a run log
  3, 4, 5, 7  the log is incomplete, damaged, salvaged with gaps or of a run
              that was stopped, and its events were printed as far as it is
              sound; see asperity check")]
pub(crate) struct EventsArguments {
    /// The run log, or any of the Parquet tables, which are printed as CSV.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// How to print the table.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: TableFormat,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity check out/mine.mcap
  asperity check out/chapter5/runs/*.mcap
  asperity check out/doubted.mcap --again

Reads every byte and checks the structure and checksums of the file, every
message against its schema, and the order of steps and their times; that all
numbers are finite, that switches fit the state of their blocks, that the
events follow from the step records, and that counts and digests are those
stated at the end of the log.

Header and topics of a log of this very program must be those that its own
scenario derives. Whether its records are the physics of that scenario is not
compared: somebody who makes all checksums right can change any of them, and
--again finds it. It makes the run again and compares every record, which takes
as long as the run.

Exit codes, that of the worst of several logs; this is their order:
  0  whole: all of its run, by this program with its detectors
  6  by other code or detectors: all of its run, made by another version of the
     program, or with detectors more or fewer
  3  incomplete: sound up to where it ends
  7  stopped: all there is of a run that could not go on, and why; mostly its
     time step was too long
  5  salvaged with gaps: what asperity salvage left of a damaged one
  2  not a run log
  4  damaged")]
pub(crate) struct CheckArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Make the runs of this very program again, and compare every record.
    #[arg(long)]
    pub(crate) again: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DiffFormat {
    /// What matters most, on one screen.
    Text,
    /// Everything; the field `version` is raised when the layout changes.
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

Of run logs, what was set differently, the numbers of both summaries and what
became of the ruptures come first, then the slip events. Between runs of
different time steps a counterpart is looked for as far as events lie apart,
else within 1 ms. Where the times of two parameter sets do not match, ruptures
and events pair by cycles between slips of the whole slider, and by their place
in the cycle.

Events are matched by when and where they slid, never by row: an extra or
missing event does not make later rows look different. Each event is identical,
within-tolerance, shifted (same blocks, another time), changed, split, merged,
missing, extra, or open (cut short by the end of a run). Tables need the
columns onset_s, end_s, first_block and last_block; a column that one side lacks
is not compared. Neither is the number of an event; its steps are compared only
where their times in seconds are equal.

A policy (TOML) says what passes:
  window_s = 1e-3         # how far from an onset to look for its counterpart
  max_shift_s = 1e-6      # no pair may be shifted farther than this
  [columns.onset_s]
  absolute = 1e-9         # in the column's unit
  relative = 1e-12        # of the larger value; the larger tolerance applies
  [allow]
  shifted = true          # any number of them
  split = 2               # at most two in all
  ruptures = true         # may differ where no slip event does

Exit codes:
  0  nothing differs except what the policy allows
  1  something differs, or a run has no counterpart
  2  the two sides cannot be compared
  3, 4, 5, 7  a log is incomplete, damaged, salvaged with gaps or of a run that
              was stopped (asperity check)")]
pub(crate) struct DiffArguments {
    /// The old side: a run log, an event table (.csv, .parquet), a folder of either, or an
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
    /// Write a page with settings and numbers, and timelines of ruptures and events; what differs is marked.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) page: Option<PathBuf>,
    /// Write one row per match, including identical events.
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "FILE.parquet")]
    pub(crate) matches: Option<PathBuf>,
    /// Replace such files if they exist; never OLD or NEW.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity salvage damaged.mcap -o out/salvaged.mcap
  asperity check out/salvaged.mcap

Keeps every record, before and after the damage, that an independent checksum
or schema confirms: chunks and attachments by their checksums, the header by
the scenario, each message by its schema, each step by having all its switches.
Prints what was lost: bytes, messages of each topic, steps. The new log is
salvaged with gaps, and no command mistakes it for a whole one. To finish an
unfinished run, use asperity run --resume. If the scenario of a damaged log is
known, it is better to repeat the run.

Exit codes:
  0  salvaged, or there is nothing to salvage: it holds all there is of its run
  1  failure
  2  it is not a run log, or the output exists
  3, 4  it is incomplete or damaged, and nothing can be made of it")]
pub(crate) struct SalvageArguments {
    /// The damaged log.
    #[arg(value_name = "DAMAGED.mcap")]
    pub(crate) run: PathBuf,
    /// The log to write; must not exist.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity replay out/mine.mcap
  asperity replay out/mine.mcap --format csv > out/replayed.csv
  asperity replay out/chapter5/runs/*.mcap -o out/replayed
  asperity replay out/mine.mcap --detectors settings.toml -o out/merged

A settings file says what differs from a live run; every line is optional:
  detectors = [\"onset\", \"extent\"]  # which detectors to run
  merge_gap_s = 1e-4               # events no farther apart count as one
  min_blocks = 2                   # leave out events of fewer distinct blocks
  link_time_ratio = 30             # link ruptures by this many sqrt(m/k)
Other settings give other events, so nothing is compared then. --out writes
NAME.onsets.csv, NAME.events.csv, NAME.global-slips.csv, NAME.ruptures.csv and
NAME.arrivals.csv for each run, and replay.json with the settings and the logs
that were replayed.

Exit codes:
  0  all events are the same as logged, or nothing was compared
  1  other events, or a failure
  2  bad input; a file is not a run log
  3, 4, 5, 7  a log is incomplete, damaged, salvaged with gaps or of a run that
              was stopped, and was left out; see asperity check")]
pub(crate) struct ReplayArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Print the slip events instead of the verdict; for a single run.
    #[arg(long, value_enum)]
    pub(crate) format: Option<TableFormat>,
    /// Folder for tables of each run's events; must be new or empty.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Which detectors to run, with which settings [default: those of a live run].
    #[arg(long, value_name = "SETTINGS.toml")]
    pub(crate) detectors: Option<PathBuf>,
    /// How many runs to replay at once [default: one per core].
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
    /// One JSON object per line and row.
    Ndjson,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity export out/mine.mcap --to parquet -o out/tables
  asperity export out/mine.mcap --to csv --topic /step -o out/tables
  asperity export out/mine.mcap --to ndjson --from-s 0.5 --to-s 0.6 -o out/part
  asperity export out/chapter5/runs/*.mcap --to parquet -o out/tables
  asperity export out/slab.mcap --to csv --nodes-at-s 0.2 -o out/nodes

Writes one file per topic (NAME.step.parquet for /step of NAME.mcap), and
NAME.FORMAT.export.json with the header and scenario of the run, the columns
with their units, and the number of rows of each file. Tables are long: states
of all blocks (/fields, /window) have one row per block. The whole log is read
and checked, whichever part is exported. The nodes of a slab are in no log: they
follow from it by the steps of the program that made it, which are taken again.

Exit codes:
  0  all of every log is exported
  1  failure
  2  bad input; a file is not a run log
  3  a log is incomplete, and exported up to its end
  4  a log is damaged, and exported up to the damage
  5  a log is salvaged with gaps, and exported around them
  7  a log is of a run that was stopped, and exported up to there")]
pub(crate) struct ExportArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// The format of the files.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) to: ExportFormat,
    /// Folder for the files.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Only this topic. May be repeated [default: all].
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Vec<String>,
    /// Only what happened at this time or later; events count by their onset.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) from_s: Option<f64>,
    /// Only what happened before this time.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) to_s: Option<f64>,
    /// All nodes of a slab at this time as well, in NAME.nodes. May be repeated.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) nodes_at_s: Vec<f64>,
    /// Replace existing files.
    #[arg(long, alias = "replace")]
    pub(crate) force: bool,
    /// How many runs to export at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[cfg(feature = "analysis")]
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reduce out/mine.mcap -o out/mine
  asperity reduce out/mine.mcap -o out/sifted --merge-gap-s 1e-4 --min-blocks 2

Exit codes:
  0  done
  1  failure
  2  bad input; a file is not a run log
  3, 5, 7  the log is incomplete, salvaged with gaps or of a run that was
           stopped: tables and figures are of what there is, and
           what-is-missing.txt says so
  4  the log is damaged; nothing was written")]
pub(crate) struct ReduceArguments {
    /// The run log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// Folder for tables and figures; must be new or empty.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Precursor tables: leave out ruptures and events of fewer distinct blocks.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) min_blocks: u32,
    /// Precursor table of slip events: count those no farther apart than this as one; 0 merges
    /// none.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub(crate) merge_gap_s: f64,
    /// Leave the version of the code, and the line that says where a figure comes
    /// from, out of figures: for comparisons to the byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[cfg(feature = "analysis")]
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reproduce pipelines/chapter5.toml -o out/chapter5
  asperity reproduce pipelines/chapter5.toml -o out/chapter5-as-stated \\
    --set parameter_set=as-stated

Runs already in the folder are reused if their logs are whole (see asperity
check: made by this very program with its detectors). Those that are not are
made again, and a line says why; those of another scenario or solver only with
--fresh, which repeats all. Tables, figures and report.html, the page of all of
it, are replaced together; reproduce.json says what they were made of. One
process at a time writes into the folder.")]
pub(crate) struct ReproduceArguments {
    /// The pipeline; or any file of a study, with runs over axes as well.
    #[arg(value_name = "PIPELINE.toml")]
    pub(crate) pipeline: PathBuf,
    /// Folder for runs, tables and figures.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Override one key in every run of the pipeline.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Repeat runs that are already in the folder, and replace those of other scenarios.
    #[arg(long)]
    pub(crate) fresh: bool,
    /// The solver to use; both give the same events.
    #[arg(long, value_enum, default_value = "fast")]
    pub(crate) solver: SolverChoice,
    /// Leave the version of the code, and the line that says where a figure comes
    /// from, out of figures: for comparisons to the byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// How many runs to make, and to reduce, at once [default: one per core].
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

The plain solver takes every step: allow 15 seconds on one core for each second
that a run of 100 blocks simulates in steps of 1e-8 s. Equal means: every
switch in the same step, every event with the same integers, every number within
1e-9 of the largest of its kind. Where a block comes so close to switching that
rounding decides, the solvers may see the switch some steps apart. Each such
near tie is proved by computing the step without rounding, and must be listed in
the folder of --near-ties.")]
pub(crate) struct VerifySolverArguments {
    /// The pipeline.
    #[arg(value_name = "PIPELINE.toml")]
    pub(crate) pipeline: PathBuf,
    /// Override one key in every run of the pipeline.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Only this run. May be repeated.
    #[arg(long, value_name = "RUN")]
    pub(crate) only: Vec<String>,
    /// Only the first SECONDS of each run, in simulated time.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) for_s: Option<f64>,
    /// Folder of the known near ties [default: fixtures/near-ties, if it exists].
    #[arg(long, value_name = "FOLDER")]
    pub(crate) near_ties: Option<PathBuf>,
    /// Folder for the proofs of near ties that are not listed.
    #[arg(short, long, value_name = "FOLDER", default_value = "out/near-ties")]
    pub(crate) out: PathBuf,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  source <(asperity completions bash)       # a line for ~/.bashrc
  asperity completions fish > ~/.config/fish/completions/asperity.fish
  asperity completions zsh > ~/.zfunc/_asperity

For zsh, the folder must be in $fpath before compinit runs.")]
pub(crate) struct CompletionsArguments {
    /// The shell.
    #[arg(value_name = "SHELL")]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity man -o ~/.local/share/man/man1
  man asperity-run

One page for the command and one for each subcommand.")]
pub(crate) struct ManArguments {
    /// Folder for the pages.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Replace existing pages.
    #[arg(long)]
    pub(crate) force: bool,
}
