//! The command line.

use std::sync::LazyLock;

use clap::{Parser, Subcommand};

use crate::catalogue::CatalogueArguments;
use crate::check::CheckArguments;
use crate::completions::CompletionsArguments;
use crate::diff::DiffArguments;
use crate::draw::DrawArguments;
use crate::events::EventsArguments;
use crate::explain::ExplainArguments;
use crate::export::ExportArguments;
use crate::man::ManArguments;
use crate::note::NoteArguments;
use crate::recording::RecordingCommand;
use crate::refine::RefineArguments;
use crate::replay::ReplayArguments;
use crate::report::ReportArguments;
use crate::reproduce::{ReduceArguments, ReproduceArguments};
use crate::run::{ResumeArguments, RunArguments};
use crate::salvage::SalvageArguments;
use crate::scenario::ScenarioCommand;
use crate::summary::SummaryArguments;
use crate::sweep::SweepCommand;

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
  asperity draw out/mine.mcap --kind space-time -o out/map.png
  asperity reduce out/mine.mcap -o out/mine

Exit codes:
  0    success; all of every log or study; or nothing differs
  1    failure; or a run was stopped, a replay gave other events, two runs
       differ, or runs of a study failed
  2    bad input, nothing was written; or a file is not a run log
  3    a log or a study is incomplete; results are of what it contains
  4    a log is damaged; results are of what precedes the damage, or none
  5    a log is salvaged with gaps; results are of what it contains
  6    check: a log is by other code or detectors
  7    the run of a log was stopped because it could not continue
  130  interrupted by SIGINT; the log was closed as RUN.mcap.partial, and of a
       study what was done is kept
  143  interrupted by SIGTERM, likewise
The code for several logs is that of the worst: 4, 2, 5, 7, 3, 1, 6, 0.
A second signal ends the command at once."
)]
pub(crate) struct Arguments {
    /// Print no progress and no notes on stderr; errors are still printed.
    #[arg(short, long, global = true, display_order = 900)]
    pub(crate) quiet: bool,
    /// Print the licences of the software that this command contains, and exit.
    #[arg(long)]
    pub(crate) notices: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// List the built-in scenarios, print one in full, or preview a run.
    #[command(subcommand)]
    Scenario(ScenarioCommand),
    /// Run a scenario and log it.
    Run(RunArguments),
    /// Continue an unfinished run, from its log alone.
    Resume(ResumeArguments),
    /// Print key numbers of runs: first slip, precursors, recurrence, fronts ...
    Summary(SummaryArguments),
    /// Print the slip events of a run.
    Events(EventsArguments),
    /// Print the ruptures of runs as a catalogue of earthquakes (CSV, QuakeML), or its statistics.
    Catalogue(CatalogueArguments),
    /// Read the recording of a laboratory into a log, as that of a run.
    #[command(subcommand)]
    Recording(RecordingCommand),
    /// Verify run logs: whole, incomplete, damaged ...
    Check(CheckArguments),
    /// Note author, lab or comment in a finished log, or print its note.
    Note(NoteArguments),
    /// Recover the sound records of a damaged log.
    Salvage(SalvageArguments),
    /// Compare two runs, or two folders of runs: numbers, ruptures and slip events.
    Diff(DiffArguments),
    /// Write one page that shows runs or a whole study.
    Report(ReportArguments),
    /// Run the detectors again on the records of a log, and compare the events.
    Replay(ReplayArguments),
    /// Write run logs as tables for data frames (Parquet, CSV, NDJSON), or all nodes as images (VTK).
    Export(ExportArguments),
    /// Draw figures of one run.
    Draw(DrawArguments),
    /// Make tables and figures of one run.
    Reduce(ReduceArguments),
    /// Run a pipeline: make its runs, tables and figures, and judge its claims.
    Reproduce(ReproduceArguments),
    /// Make a scenario on other meshes and with other steps, and say what each of its numbers is worth.
    Refine(RefineArguments),
    /// Vary parameters: make many runs from one file, here or on a cluster, and tabulate them.
    #[command(subcommand)]
    Sweep(SweepCommand),
    /// Explain the keys of scenarios, by section: accepted values, default and meaning.
    #[command(after_help = "Examples:\n  asperity keys slider.blocks\n  asperity keys friction")]
    Keys(ExplainArguments),
    /// Explain the columns of tables, by file or topic: type, unit and meaning.
    #[command(after_help = "Examples:\n  asperity columns ruptures\n  asperity columns onset_s")]
    Columns(ExplainArguments),
    /// Explain the numbers of runs: unit, meaning, and what each is worth.
    #[command(after_help = "Examples:\n  asperity numbers front_speed\n  asperity numbers Magnitudes")]
    Numbers(ExplainArguments),
    /// Explain the kinds of figures and the tables of pipelines: keys, and an example.
    #[command(after_help = "Examples:\n  asperity figures space-time\n  asperity figures claim")]
    Figures(ExplainArguments),
    /// Print the completion script for a shell.
    Completions(CompletionsArguments),
    /// Write the manual pages.
    Man(ManArguments),
}
