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

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity draw out/mine.mcap
  asperity draw --list
  asperity draw out/mine.mcap --kind lengths,stress -o out/pictures
  asperity draw out/mine.mcap --kind space-time --set which=longest-precursor

Draws figures alone; asperity reduce makes tables as well, and asperity
reproduce figures that compare runs. Of the usual kinds, those that the run has
nothing for are left out, with a note; of kinds that are named, this is an error
and nothing is written. docs/figures.md explains every key.

Exit codes:
  0  done
  1  failure; or the run has not what a figure shows
  2  bad input; a file is not a run log
  3, 5, 7  the log is incomplete, salvaged with gaps or of a run that was
           stopped, and the figures are of what there is
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
    /// Folder for KIND.png, KIND.svg and KIND.pdf; or the file of one figure, ending in one of these
    /// [default: RUN.figures, beside the log].
    #[arg(short, long, value_name = "FOLDER|FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Replace existing figures.
    #[arg(long)]
    pub(crate) force: bool,
    /// Leave the version of the code, and the line that says where a figure comes
    /// from, out of figures: for print, and for comparisons to the byte.
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
