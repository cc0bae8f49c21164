//! `asperity sweep`: parameter studies.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use asperity_model::scenario::text;
use asperity_study::emit::{Array, Job, USUAL_TASKS, UnderWay, Word, arrays};
use asperity_study::results::{parse_ranges, ranges};
use asperity_study::segment::this_node;
use asperity_study::verification::{Sample, Verification, number_in_parts};
use asperity_study::work::{Making, PATIENCE};
use asperity_study::{Outputs, Plan, staging};
use clap::{Args, Subcommand, ValueEnum};

use crate::collect::SweepDrawArguments;
use crate::collect::{self, SweepCollectArguments, SweepTable, USUAL_FORMAT};
use crate::exit::{Code, Failure};
use crate::interrupt;
use crate::progress::Board;
use crate::study::{outcome, read, read_plan, tell_faults};
use crate::sweep_log::{self, SweepLogArguments};
use crate::sweep_plan::{self, SweepPlanArguments};
use crate::terminal::{self, say};

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

docs/studies.md describes studies in full.")]
pub(crate) enum SweepCommand {
    /// Make a study in one go: its plan, all runs, tables, figures and page.
    #[command(after_help = "\
Examples:
  asperity sweep go out/tilts.toml -o out/tilts
  asperity sweep go out/tilts.toml -o out/tilts --to csv --jobs 4

Runs sweep plan, sweep run and sweep collect in turn. If called again, it makes
the missing runs, and the tables of all runs. A sweep that was edited since
needs another folder; if only its figures were edited, use asperity sweep draw
--from.")]
    Go(SweepGoArguments),
    /// Make the log of one run of a study.
    #[command(after_help = "\
Examples:
  asperity sweep log out/tilts 7 -o out/seven.mcap
  asperity report out/seven.mcap -o out/seven.html

A study keeps tables of its runs, and logs only if keep = [\"log\"] requests
them. The log of run 7 has the run id of the plan, and the records, events and
digest that asperity run gives for its scenario.")]
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
that fails is recorded with its reason and does not stop the others.

With --verify, some of the runs that are done are made a second time, to find a
node that computes wrongly: the same ones whenever and wherever the command is
called. Missing runs are not made. Both results are kept. If they differ, their
files are named, which begin with the names of the nodes.")]
    Run(SweepRunArguments),
    /// Print how many runs are done, and which failed or are missing.
    #[command(after_help = "\
Examples:
  asperity sweep status out/tilts
  asperity sweep status out/tilts --tasks 16")]
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
named runs, as in a pipeline, the files are those of `asperity reproduce`.")]
    Collect(SweepCollectArguments),
    /// Draw the figures of a study, without making tables.
    #[command(after_help = "\
Examples:
  asperity sweep draw out/tilts
  asperity sweep draw out/tilts --from out/tilts.toml

A plan never changes, but its figures may: --from draws the figures of a sweep
that was edited since. asperity figures explains their keys. Existing figures
are replaced.")]
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
with braces.")]
    Emit(SweepEmitArguments),
}

#[derive(Debug, Args)]
pub(crate) struct SweepGoArguments {
    #[command(flatten)]
    pub(crate) plan: SweepPlanArguments,
    /// Stop when more runs than this have failed [default: never].
    #[arg(long, value_name = "N")]
    pub(crate) max_fails: Option<u64>,
    /// The formats of the tables.
    #[arg(long, value_enum, value_name = "FORMAT", value_delimiter = ',', default_value = USUAL_FORMAT)]
    pub(crate) to: Vec<SweepTable>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
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

pub(crate) fn command(command: &SweepCommand, board: &Board) -> Result<(), Failure> {
    match command {
        SweepCommand::Go(arguments) => go(arguments, board),
        SweepCommand::Log(arguments) => sweep_log::command(arguments, board),
        SweepCommand::Plan(arguments) => sweep_plan::command(arguments, board),
        SweepCommand::Run(arguments) => run(arguments, board),
        SweepCommand::Status(arguments) => status(arguments),
        SweepCommand::Collect(arguments) => collect::tables(arguments, board),
        SweepCommand::Draw(arguments) => collect::figures(arguments, board),
        SweepCommand::Emit(arguments) => emit(arguments),
    }
}

fn status(arguments: &SweepStatusArguments) -> Result<(), Failure> {
    let SweepStatusArguments { folder, tasks, array_size, under_way, verify } = arguments;
    let (plan, results) = read(folder)?;
    let verification = match verify {
        Some(sample) => Some(Verification::of(&sampled(*sample, &plan)?, &results, None)),
        None => None,
    };
    if let Some(tasks) = *tasks {
        let (lacking, number): (Vec<u64>, fn(u64, u64) -> u64) = match &verification {
            Some(Verification { due, missing, .. }) => {
                (due.iter().chain(missing).copied().collect(), number_in_parts)
            }
            None => (results.missing().collect(), |run, _| run),
        };
        let under_way = match under_way {
            Some(path) => text::read(path)
                .map_err(|error| error.to_string())
                .and_then(|text| UnderWay::read(&text, plan.rows.len() as u64))
                .map_err(|error| Failure::BadInput(format!("--under-way {}: {error}", path.display())))?,
            None => UnderWay::default(),
        };
        let lacking = lacking.into_iter().filter(|run| !under_way.has(|parts| number(*run, parts)));
        let numbers = lacking.map(|run| number(run, tasks));
        for Array { offset, tasks, parts } in arrays(numbers, tasks, *array_size) {
            say(format_args!("{offset} {tasks} {parts}"))?;
        }
        results.check()?;
        return outcome(&results, |_| true);
    }
    say(results.in_words())?;
    for name in ["failed", "refused", "contradicted", "missing"] {
        let runs = ranges(results.runs(name));
        if !runs.is_empty() {
            say(format_args!("{name}: {runs}"))?;
        }
    }
    let begun =
        staging::begun(folder).map_err(|error| Failure::Failed(format!("{}: {error}", folder.display())))?;
    let begun = begun.into_iter().filter(|(run, _)| results.is_missing(*run));
    let (runs, bytes): (Vec<u64>, Vec<u64>) = begun.unzip();
    if !runs.is_empty() {
        let (runs, bytes) = (ranges(runs), bytes.iter().sum::<u64>());
        say(format_args!("begun: {runs}, with {:.1} MB in {}", bytes as f64 / 1e6, staging::FOLDER))?;
    }
    for (path, bytes) in &results.torn {
        say(format_args!("{}: its last {bytes} bytes are an incomplete result", path.display()))?;
    }
    for path in &results.foreign {
        say(format_args!("{}: not a segment of this plan, left alone", path.display()))?;
    }
    verification.iter().flat_map(Verification::lines).try_for_each(say)?;
    tell_faults(&results)?;
    outcome(&results, |_| true)?;
    verification.as_ref().map_or(Ok(()), outcome_of_verification)
}

/// Plans a study, makes its missing runs, and its tables and figures.
fn go(arguments: &SweepGoArguments, board: &Board) -> Result<(), Failure> {
    let SweepGoArguments { plan: arguments, max_fails, to, no_provenance } = arguments;
    let folder = &arguments.out;
    let plan = sweep_plan::begun(arguments, board)?;
    interrupt::install()?;
    let making = Making { jobs: arguments.jobs, max_fails: *max_fails, ..Making::new(folder, board) };
    let results = &making.make_missing(&plan, |_| true)?;
    let provenance = !no_provenance;
    collect::make(&Outputs { plan: &plan, results, folder, provenance, watcher: board }, to, None, board)
}

fn run(arguments: &SweepRunArguments, board: &Board) -> Result<(), Failure> {
    let SweepRunArguments { folder, index, chunk, verify, jobs, max_fails, patience_s, .. } = arguments;
    let (plan, results) = read(folder)?;
    plan.check_code(folder)?;
    let chosen: Option<BTreeSet<u64>> = match index {
        None => None,
        Some(text) => {
            let runs = parse_ranges(text, plan.rows.len() as u64);
            Some(runs.map_err(|error| Failure::BadInput(format!("--index {error}")))?.into_iter().collect())
        }
    };
    let is_chosen = |run: &u64| {
        chosen.as_ref().is_none_or(|chosen| chosen.contains(run))
            && chunk.is_none_or(|SweepChunk { part, of }| {
                let number = if verify.is_some() { number_in_parts(*run, of) } else { *run };
                number % of == part % of
            })
    };
    let patience = Duration::try_from_secs_f64(*patience_s)
        .map_err(|error| Failure::BadInput(format!("--patience-s {patience_s}: {error}")))?;
    let (jobs, max_fails, again) = (*jobs, *max_fails, verify.is_some());
    let making = Making { jobs, max_fails, patience, again, ..Making::new(folder, board) };
    interrupt::install()?;
    if let Some(sample) = verify {
        let mut chosen = sampled(*sample, &plan)?;
        chosen.retain(is_chosen);
        let here = this_node();
        let due = Verification::of(&chosen, &results, Some(&here)).due;
        let results = making.make(&plan, results, &due)?;
        let verification = Verification::of(&chosen, &results, Some(&here));
        verification.lines().iter().try_for_each(say)?;
        tell_faults(&results)?;
        return outcome_of_verification(&verification);
    }
    let missing: Vec<u64> = results.missing().filter(is_chosen).collect();
    let results = making.make(&plan, results, &missing)?;
    board.line(&results.in_words());
    results.check()?;
    outcome(&results, is_chosen)
}

/// The exit code of a verification that has found no fault.
fn outcome_of_verification(verification: &Verification) -> Result<(), Failure> {
    if verification.is_incomplete() { Code::Incomplete.said() } else { Ok(()) }
}

/// The runs that are verified.
fn sampled(sample: Sample, plan: &Plan) -> Result<BTreeSet<u64>, Failure> {
    sample.of(plan).map_err(|error| Failure::BadInput(format!("--verify {error}")))
}

fn emit(arguments: &SweepEmitArguments) -> Result<(), Failure> {
    let SweepEmitArguments { engine, folder, tasks, cores, time, at_once, verify } = arguments;
    let plan = read_plan(folder)?;
    let most = plan.rows.len() as u64;
    let tasks = tasks.unwrap_or(most.min(USUAL_TASKS));
    if !(1..=most).contains(&tasks) {
        return Err(Failure::BadInput(format!("--tasks {tasks} (accepted: 1 to {most})")));
    }
    if let Some(sample) = verify {
        sampled(*sample, &plan)?;
        if *engine != SweepEngine::Slurm {
            return Err(Failure::BadInput(format!("--verify {sample} (accepted: with slurm)")));
        }
    }
    if let Some(most) = at_once.filter(|_| *engine != SweepEngine::Slurm) {
        return Err(Failure::BadInput(format!("--at-once {most} (accepted: with slurm)")));
    }
    let program = std::env::current_exe().map_err(Failure::failed)?;
    let folder = std::path::absolute(folder).map_err(Failure::failed)?;
    let word = |what: &str, text: &OsStr| Word::of(what, text).map_err(Failure::BadInput);
    let job = Job {
        program: word("the program", program.as_os_str())?,
        folder: word("the folder", folder.as_os_str())?,
        tasks,
        cores: cores.get() as u64,
        time: word("--time", time.as_ref())?,
        at_once: at_once.map(|most| most.get() as u64),
        verify: *verify,
    };
    let text = match engine {
        SweepEngine::Slurm => job.slurm().map_err(Failure::BadInput)?,
        SweepEngine::List => job.list(),
        SweepEngine::Row => job.row().map_err(Failure::BadInput)?,
    };
    let mut out = terminal::data();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
