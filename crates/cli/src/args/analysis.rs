//! Arguments of commands that make tables and figures of runs, and of pipelines.

use std::path::PathBuf;

use clap::Args;

use super::SolverChoice;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reduce out/mine.mcap -o out/mine
  asperity reduce out/mine.mcap -o out/sifted --merge-gap-s 1e-4 --min-blocks 2

Exit codes:
  0  done
  1  failure
  2  bad input; a file is not a run log
  3, 5, 7  the log is incomplete, salvaged with gaps, or its run was stopped:
           tables and figures show what the log contains, and
           what-is-missing.txt gives the reason
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
    /// Precursor table of slip events: merge events that are no farther apart than this; 0 merges
    /// none.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub(crate) merge_gap_s: f64,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity draw out/mine.mcap
  asperity draw --list
  asperity draw out/mine.mcap --kind lengths,stress -o out/pictures
  asperity draw out/mine.mcap --kind space-time --set which=longest-precursor

Draws only figures; asperity reduce also makes tables, and asperity reproduce
draws figures that compare runs. Without --kind, a kind for which the run has no
data is left out, with a note; if --kind names such a kind, the command fails
and writes nothing. docs/figures.md explains every key.

Exit codes:
  0  done
  1  failure; or the run lacks the data that a figure shows
  2  bad input; a file is not a run log
  3, 5, 7  the log is incomplete, salvaged with gaps, or its run was stopped:
           figures show what the log contains
  4  the log is damaged; nothing was written")]
pub(crate) struct DrawArguments {
    /// The run log.
    #[arg(value_name = "RUN.mcap", required_unless_present = "list")]
    pub(crate) run: Option<PathBuf>,
    /// The kinds of figures [default: overview, lengths, space-time, front-profile,
    /// stress-sequence].
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(crate) kind: Vec<String>,
    /// Set a key of the figure; needs a single --kind. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder for KIND.png, KIND.svg and KIND.pdf; or a single file with one of these endings
    /// [default: RUN.figures, beside the log].
    #[arg(short, long, value_name = "FOLDER|FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Replace existing figures.
    #[arg(long)]
    pub(crate) force: bool,
    /// Draw figures without the code version and without the line that names
    /// their source: for print, and for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// List the kinds: what each shows, and the keys for --set.
    #[arg(long, conflicts_with_all = ["run", "kind", "set", "out", "force", "no_provenance"])]
    pub(crate) list: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reproduce pipelines/chapter5.toml -o out/chapter5
  asperity reproduce pipelines/chapter5.toml -o out/chapter5-as-stated \\
    --set parameter_set=as-stated

Runs already in the folder are reused if asperity check finds their logs whole:
complete, and made by this version of the program with its detectors. Other runs
are repeated, and a line gives the reason. A run of another scenario or solver
is replaced only with --fresh, which repeats all runs. Tables, figures and the
page report.html are replaced together; reproduce.json records their sources.
Only one process at a time can write to the folder.")]
pub(crate) struct ReproduceArguments {
    /// The pipeline; or any other file of a study, even with runs over axes.
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
    /// The solver to use for every run; fast and plain give the same events. Default: that of the run's law.
    #[arg(long, value_enum)]
    pub(crate) solver: Option<SolverChoice>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// How many runs to make, and to reduce, at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity verify-solver pipelines/chapter5.toml
  asperity verify-solver pipelines/chapter5.toml --set parameter_set=as-stated
  asperity verify-solver pipelines/chapter5.toml --only default --for-s 0.1

The plain solver computes every step: allow 15 seconds on one core for each
simulated second of a run of 100 blocks in steps of 1e-8 s. Two runs are equal
if every switch happens in the same step, every event has the same integers, and
every number agrees within 1e-9 of the largest of its kind. Where a block comes
so close to switching that rounding decides, the solvers may see the switch some
steps apart. Each such near tie is proved by computing the step without
rounding, and must be listed in the folder of --near-ties.

A run by rate-and-state friction is compared with itself at a hundredth of
time.tolerance, which must be 1e-10 or above (docs/rate-and-state.md).")]
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
