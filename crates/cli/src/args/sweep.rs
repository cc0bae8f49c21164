//! Arguments of `asperity sweep`.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use asperity_study::emit::USUAL_TASKS;
use asperity_study::verification::Sample;
use asperity_study::work::PATIENCE;
use clap::{Args, Subcommand, ValueEnum};

#[derive(Debug, Subcommand)]
#[command(after_help = "\
Examples:
  asperity sweep go out/tilts.toml -o out/tilts
  asperity sweep log out/tilts 7 -o out/seven.mcap

On a cluster, or in steps:
  asperity sweep plan out/tilts.toml -o out/tilts
  asperity sweep run out/tilts
  asperity sweep status out/tilts
  asperity sweep collect out/tilts

A sweep is a TOML file with a scenario and what varies:

  title = \"Precursors under a tilted load\"
  scenario = \"default\"
  [[axis]]
  key = \"normal_load.tilt\"
  from = -0.8
  to = 0.8
  count = 9

docs/sweeps.md describes sweeps in full.")]
pub(crate) enum SweepCommand {
    /// Make a study in one go: its plan, all runs, tables, figures and page.
    #[command(after_help = "\
Examples:
  asperity sweep go out/tilts.toml -o out/tilts
  asperity sweep go out/tilts.toml -o out/tilts --to csv --jobs 4

Runs sweep plan, sweep run and sweep collect in turn. If called again, it makes
the missing runs, and the tables of all runs. A sweep that was edited since
needs another folder; if only its figures were edited, use asperity sweep draw
--from.

Exit codes:
  0    the tables hold all runs
  1    failure; or runs failed, and the tables say which; or results contradict
       the plan or each other
  2    bad input; or the folder has another plan
  3    some runs were left to another process, which is making them
  130  interrupted by SIGINT; what was done is kept
  143  interrupted by SIGTERM, likewise")]
    Go(SweepGoArguments),
    /// Make the log of one run of a study.
    #[command(after_help = "\
Examples:
  asperity sweep log out/tilts 7 -o out/seven.mcap
  asperity report out/seven.mcap -o out/seven.html

A study keeps tables of its runs, and logs only if keep = [\"log\"] requests
them. The log of run 7 has the run id of the plan, and the records, events and
digest that asperity run gives for its scenario.

Exit codes:
  0    the log is whole
  1    failure
  2    bad input; the run is refused; or the plan is by other code
  130  interrupted by SIGINT; --resume continues from there
  143  interrupted by SIGTERM, likewise")]
    Log(SweepLogArguments),
    /// Write the plan of a sweep or a pipeline: every run with its values and its id.
    #[command(after_help = "\
Examples:
  asperity sweep plan out/tilts.toml -o out/tilts
  asperity sweep plan out/tilts.toml -o out/tilts --skip-refused
  asperity sweep plan pipelines/chapter5.toml -o out/planned")]
    Plan(SweepPlanArguments),
    /// Make the missing runs of a plan, on all cores.
    #[command(after_help = "\
Examples:
  asperity sweep run out/tilts
  asperity sweep run out/tilts --index 3,7-9
  asperity sweep run out/tilts --chunk 2/8 --jobs 4
  asperity sweep run out/tilts --verify 5%

Finished runs are kept: killed at any time and called again, the command makes
the missing runs, and resumes those that had taken more than a minute. A run
that fails is recorded with its reason and does not stop the others. A run whose
process died three times is not tried again.

With --verify, some of the runs that are done are made a second time, to find a
node that computes wrongly: the same ones whenever and wherever the command is
called. Missing runs are not made. Both results are kept. If they differ, their
files are named, which begin with the names of the nodes.

Exit codes:
  0    all requested runs are done; with --verify, their results are equal
  1    failure; or some of them failed, or results contradict the plan or each
       other
  2    bad input; the plan is by other code, or was edited
  3    some were left to another process, which is making them; with --verify,
       some have no second result
  130  interrupted by SIGINT; what was done is kept
  143  interrupted by SIGTERM, likewise")]
    Run(SweepRunArguments),
    /// Print how many runs are done, and which failed or are missing.
    #[command(after_help = "\
Examples:
  asperity sweep status out/tilts
  asperity sweep status out/tilts --tasks 16

Exit codes:
  0  all runs are done
  1  failure; or runs failed, or results contradict the plan or each other
  2  bad input; the plan was edited
  3  runs are missing; or, with --verify, not verified")]
    Status(SweepStatusArguments),
    /// Make the tables of a study (runs, slip events, ruptures) and its figures.
    #[command(after_help = "\
Examples:
  asperity sweep collect out/tilts
  asperity sweep collect out/tilts --to csv -o out/tables

Every table has a column for each key that varies. The figures that the sweep
requests are drawn into `figures`. How and where the runs were made does not
change a byte of the files. Existing files are replaced. If results contradict
the plan or each other, no table is made, and the contradictions are named. For
named runs, as in a pipeline, the files are those of `asperity reproduce`.

Exit codes:
  0  the tables hold all runs
  1  failure; or runs failed, and the tables say which; or results contradict
     the plan or each other
  2  bad input; the plan was edited
  3  runs are missing, and the tables say which")]
    Collect(SweepCollectArguments),
    /// Draw the figures of a study, without making tables.
    #[cfg(feature = "analysis")]
    #[command(after_help = "\
Examples:
  asperity sweep draw out/tilts
  asperity sweep draw out/tilts --from out/tilts.toml

A plan never changes, but its figures may: --from draws the figures of a sweep
that was edited since. docs/figures.md explains their keys. Existing figures are
replaced.

Exit codes:
  0  the figures show all runs
  1  failure; or runs failed
  2  bad input; the sweep varies other keys than the plan
  3  runs are missing")]
    Draw(SweepDrawArguments),
    /// Print a script that makes the runs on a cluster.
    #[command(after_help = "\
Examples:
  asperity sweep emit slurm out/tilts --tasks 16 --cores 4 > out/sweep.slurm
  asperity sweep emit slurm out/tilts --tasks 16 --verify 5% > out/sweep.slurm
  asperity sweep emit list out/tilts --tasks 16 > out/commands.txt
  asperity sweep emit row out/tilts > out/workflow.toml

`bash out/sweep.slurm` submits the missing runs as job arrays, followed by a job
that makes the tables; called again, it submits the runs that are still missing.
Paths that a script cannot contain are refused: those that are not UTF-8 or have
control characters, for Slurm also those with a backslash, for row also those
with braces.

Exit codes:
  0  the script is printed
  1  failure
  2  bad input; a path that the script cannot contain")]
    Emit(SweepEmitArguments),
}

#[derive(Debug, Args)]
pub(crate) struct SweepGoArguments {
    /// The sweep, or a pipeline.
    #[arg(value_name = "SWEEP.toml")]
    pub(crate) sweep: PathBuf,
    /// Folder of the study; new, empty, or from an earlier call.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Record combinations that the scenario refuses, instead of stopping at them.
    #[arg(long)]
    pub(crate) skip_refused: bool,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Stop when more runs than this have failed [default: never].
    #[arg(long, value_name = "N")]
    pub(crate) max_fails: Option<u64>,
    /// The formats of the tables.
    #[arg(long, value_enum, value_name = "FORMAT", value_delimiter = ',', default_value = TABLES)]
    pub(crate) to: Vec<SweepTable>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SweepLogArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The number of the run, as in the tables; or its name, if it has one.
    #[arg(value_name = "RUN")]
    pub(crate) run: String,
    /// The log to write; must not exist, except with --resume.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
    /// Continue the run in RUN.mcap.partial, or start it if there is none.
    #[arg(long)]
    pub(crate) resume: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SweepPlanArguments {
    /// The sweep.
    #[arg(value_name = "SWEEP.toml")]
    pub(crate) sweep: PathBuf,
    /// Folder of the study; must be new or empty.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Record combinations that the scenario refuses, instead of stopping at them.
    #[arg(long)]
    pub(crate) skip_refused: bool,
    /// How many runs to resolve at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

#[derive(Debug, Args)]
pub(crate) struct SweepRunArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// Only these runs, as in 3,7-9.
    #[arg(long, value_name = "RUNS")]
    pub(crate) index: Option<String>,
    /// Only the K-th of N parts.
    #[arg(long, value_name = "K/N")]
    pub(crate) chunk: Option<SweepChunk>,
    /// Make N of the runs that are done a second time, or a share such as 5%, and
    /// compare the results.
    #[arg(long, value_name = "N")]
    pub(crate) verify: Option<Sample>,
    /// All missing runs, which is the default; for scripts.
    #[arg(long, conflicts_with_all = ["index", "chunk", "verify"])]
    pub(crate) missing: bool,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Stop when more runs than this have failed [default: never].
    #[arg(long, value_name = "N")]
    pub(crate) max_fails: Option<u64>,
    /// Make the runs that are named on standard input.
    #[arg(long, hide = true)]
    pub(crate) worker: bool,
    /// Work of a run, in seconds, from which on it keeps its unfinished log.
    #[arg(long, hide = true, value_name = "S", default_value_t = PATIENCE.as_secs_f64())]
    pub(crate) patience_s: f64,
}

#[derive(Debug, Args)]
pub(crate) struct SweepStatusArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// Print which of N parts have missing runs, as arrays for a batch system: a
    /// line per array, with an offset to add to all indices, the indices, and the
    /// numbers of its parts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) tasks: Option<u64>,
    /// All indices are below this, as with MaxArraySize of Slurm.
    #[arg(long, value_name = "N", default_value_t = USUAL_TASKS + 1, requires = "tasks",
          value_parser = clap::value_parser!(u64).range(2..))]
    pub(crate) array_size: u64,
    /// Leave out the runs of the parts in this file, which are under way: lines such
    /// as 3,7-9/12 are parts of twelve.
    #[arg(long, value_name = "FILE", requires = "tasks")]
    pub(crate) under_way: Option<PathBuf>,
    /// Print how many runs of `sweep run --verify N` are verified, and on which
    /// nodes; with --tasks, which parts have others.
    #[arg(long, value_name = "N")]
    pub(crate) verify: Option<Sample>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SweepTable {
    /// Columns with types and units, compressed.
    #[cfg(feature = "analysis")]
    Parquet,
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
}

#[cfg(feature = "analysis")]
const TABLES: &str = "parquet";
#[cfg(not(feature = "analysis"))]
const TABLES: &str = "csv";

#[derive(Debug, Args)]
pub(crate) struct SweepCollectArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The formats of the tables.
    #[arg(long, value_enum, value_name = "FORMAT", value_delimiter = ',', default_value = TABLES)]
    pub(crate) to: Vec<SweepTable>,
    /// Folder for the tables, and for a folder of figures [default: tables and
    /// figures, in the folder of the study].
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[cfg(feature = "analysis")]
#[derive(Debug, Args)]
pub(crate) struct SweepDrawArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The sweep whose figures are drawn [default: as it was planned].
    #[arg(long, value_name = "SWEEP.toml")]
    pub(crate) from: Option<PathBuf>,
    /// Folder for the figures [default: figures, in the folder of the study].
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SweepEngine {
    /// Job arrays for Slurm, followed by a job that makes the tables.
    Slurm,
    /// One command per line, for GNU parallel, HyperQueue and the like.
    List,
    /// A workflow for row.
    Row,
}

#[derive(Debug, Args)]
pub(crate) struct SweepEmitArguments {
    /// What the script is for.
    pub(crate) engine: SweepEngine,
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// Number of parts to divide the runs into [default: one per run, 1000 at most].
    #[arg(long, value_name = "N")]
    pub(crate) tasks: Option<u64>,
    /// Cores per task.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) cores: NonZeroUsize,
    /// Time limit of a task, in the notation of Slurm.
    #[arg(long, value_name = "TIME", default_value = "01:00:00")]
    pub(crate) time: String,
    /// Most tasks of an array that run at once; for slurm.
    #[arg(long, value_name = "N")]
    pub(crate) at_once: Option<NonZeroUsize>,
    /// Verify N of the runs, or a share such as 5%, before the tables are made; for
    /// slurm.
    #[arg(long, value_name = "N")]
    pub(crate) verify: Option<Sample>,
}

/// One of several parts, `K/N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SweepChunk {
    /// Which, from 1.
    pub(crate) part: u64,
    /// How many there are.
    pub(crate) of: u64,
}

impl FromStr for SweepChunk {
    type Err = String;

    fn from_str(text: &str) -> Result<SweepChunk, String> {
        let parts = text.split_once('/').map(|(part, of)| (part.parse(), of.parse()));
        match parts {
            Some((Ok(part), Ok(of))) if 1 <= part && part <= of => Ok(SweepChunk { part, of }),
            _ => Err("accepted: K/N with K from 1 to N, as in 2/8".to_owned()),
        }
    }
}
