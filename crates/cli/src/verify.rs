//! `asperity verify-solver`: compares the solvers of each run's law, or the adaptive one at two tolerances.

use std::fs::DirEntry;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_model::{Plan, among, text};
use asperity_record::counted;
use asperity_run::at_once;
use asperity_run::study::Job;
use asperity_run::verify::{Proof, Verified, VerifyError, verify};
use clap::Args;

use crate::exit::Failure;
use crate::outputs::{create_folder, refused};
use crate::progress::Board;
use crate::sweep_plan::read_study;
use crate::terminal;

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
steps apart. In each such near tie the plain solver must have the block within
rounding of its switch, and the folder of --near-ties must list it.

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
    pub(crate) jobs: Option<NonZeroUsize>,
}

/// Default folder of known near ties.
const NEAR_TIES: &str = "fixtures/near-ties";

/// The outcome of comparing one run, by its name.
type Outcome = (String, Verified);

pub(crate) fn command(arguments: &VerifySolverArguments, board: &Board) -> Result<(), Failure> {
    let file = &arguments.pipeline;
    let jobs = read_study(file, &arguments.set, board)?.jobs();
    let mut jobs = jobs.map_err(|problem| Failure::BadInput(format!("{}: {problem}", file.display())))?;
    if let Some(unknown) = arguments.only.iter().find(|only| jobs.iter().all(|job| job.name != **only)) {
        let known: Vec<&str> = jobs.iter().map(|job| job.name.as_str()).collect();
        return Err(Failure::BadInput(format!(
            "--only {unknown}: no such run{}",
            among(unknown, &known, "the [[run]] of the pipeline")
        )));
    }
    if !arguments.only.is_empty() {
        jobs.retain(|job| arguments.only.contains(&job.name));
    }
    let steps = jobs.iter().map(|job| Ok(plan(job, arguments.for_s)?.steps)).sum::<Result<u64, Failure>>()?;
    let known = match &arguments.near_ties {
        Some(folder) => known_ties(folder)?,
        None if Path::new(NEAR_TIES).is_dir() => known_ties(Path::new(NEAR_TIES))?,
        None => Vec::new(),
    };
    board.line(&format!("{}, {:e} plain steps", counted(jobs.len() as u64, "run"), steps as f64));
    jobs.sort_by_cached_key(|job| std::cmp::Reverse(job.cost()));
    let mut outcomes = at_once(&jobs, arguments.jobs, |job| compare(job, arguments.for_s, board))?;
    outcomes.sort_by(|a, b| a.0.cmp(&b.0));
    print(&outcomes)?;
    compare_with_known(arguments, &jobs, &outcomes, &known)
}

/// The plan of a run, or of its beginning.
fn plan(job: &Job, for_s: Option<f64>) -> Result<Plan, Failure> {
    let mut plan = Plan::new(&job.scenario);
    if let Some(seconds) = for_s {
        let steps = plan.grid.whole_steps(seconds).filter(|&steps| steps > 0).ok_or_else(|| {
            Failure::BadInput(format!(
                "--for-s {seconds} is not a whole number of steps of {} s (accepted: a positive multiple)",
                plan.grid.step_s()
            ))
        })?;
        plan.steps = plan.steps.min(steps);
    }
    Ok(plan)
}

fn compare(job: &Job, for_s: Option<f64>, board: &Board) -> Result<Outcome, Failure> {
    let plan = plan(job, for_s)?;
    let mut progress = board.steps(&job.name, plan.steps, plan.grid.time_s(plan.steps));
    let verified = verify(&plan, |step| progress.advance(step));
    progress.clear();
    let verified = verified.map_err(|error| {
        let said = format!("run {}: {error}", job.name);
        match error {
            VerifyError::TooAccurate { .. } => Failure::BadInput(said),
            _ => Failure::Failed(said),
        }
    })?;
    board.line(&format!(
        "{}: {} switches and {} slip events are equal, {} near ties",
        job.name,
        verified.agreement.switches,
        verified.slip_events,
        verified.agreement.near_ties.len()
    ));
    Ok((job.name.clone(), verified))
}

/// Reads the proofs in a folder, by file. They list the known near ties; each is proved again when it
/// occurs.
fn known_ties(folder: &Path) -> Result<Vec<(PathBuf, Proof)>, Failure> {
    let unreadable = |path: &Path, problem: &dyn std::fmt::Display| {
        Failure::BadInput(format!(
            "near tie {}: {problem} (accepted: a proof of this command)",
            path.display()
        ))
    };
    let entries = asperity_files::entries(folder).map_err(|error| unreadable(folder, &error))?;
    let mut paths: Vec<PathBuf> = entries.iter().map(DirEntry::path).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let text = text::read(&path).map_err(|error| unreadable(&path, &error))?;
            let proof = serde_json::from_str(&text).map_err(|error| unreadable(&path, &error))?;
            Ok((path, proof))
        })
        .collect()
}

fn print(outcomes: &[Outcome]) -> Result<(), Failure> {
    let mut out = terminal::data();
    writeln!(out, "run,switches,slip_events,near_ties,largest_deviation,of")?;
    for (run, Verified { agreement, slip_events }) in outcomes {
        let most = agreement.deviations.iter().max_by(|a, b| a.share.total_cmp(&b.share));
        let (what, deviation) = most.map_or(("", 0.0), |most| (most.what, most.share));
        let (switches, ties) = (agreement.switches, agreement.near_ties.len());
        writeln!(out, "{run},{switches},{slip_events},{ties},{deviation:.1e},{what}")?;
    }
    Ok(())
}

/// Fails if a near tie is unknown, after writing its proof, or if a known one did not occur.
fn compare_with_known(
    arguments: &VerifySolverArguments,
    jobs: &[Job],
    outcomes: &[Outcome],
    known: &[(PathBuf, Proof)],
) -> Result<(), Failure> {
    let mut problems = Vec::new();
    for job in jobs {
        let hash = job.scenario.hash();
        let steps = plan(job, arguments.for_s)?.steps;
        let found = outcomes
            .iter()
            .find(|(run, _)| *run == job.name)
            .map_or(&[][..], |(_, verified)| &verified.agreement.near_ties);
        let listed = || known.iter().filter(|(_, proof)| proof.scenario_hash == hash);
        for tie in found.iter().filter(|tie| !listed().any(|(_, proof)| proof.is_of(tie))) {
            let proof = Proof::of(&job.name, &job.scenario, tie);
            let path = arguments.out.join(proof.file_name(job.scenario.parameter_set.word()));
            write_proof(arguments, &path, &proof)?;
            problems.push(format!(
                "run {}, step {}, block {}: a near tie that is not listed; its proof is {}",
                job.name,
                tie.step,
                tie.block,
                path.display()
            ));
        }
        for (path, proof) in listed().filter(|(_, proof)| proof.tie.step <= steps) {
            if !found.iter().any(|tie| proof.is_of(tie)) {
                problems.push(format!("{}: the solvers agree there now", path.display()));
            }
        }
    }
    if problems.is_empty() {
        return Ok(());
    }
    Err(Failure::Failed(format!(
        "near ties differ from those listed in {}:\n  {}",
        arguments.near_ties.as_deref().unwrap_or(Path::new(NEAR_TIES)).display(),
        problems.join("\n  ")
    )))
}

/// Writes a proof, unless an earlier call wrote that of the same near tie.
fn write_proof(arguments: &VerifySolverArguments, path: &Path, proof: &Proof) -> Result<(), Failure> {
    create_folder(&arguments.out)?;
    let mut content = serde_json::to_string(proof)
        .map_err(|error| Failure::failed(FileError::Io { path: path.to_owned(), error: error.into() }))?;
    content.push('\n');
    let there = text::read(path).ok().and_then(|text| serde_json::from_str::<Proof>(&text).ok());
    let existing = match there {
        Some(there) if there.is_of(&proof.tie) => Existing::Replace,
        _ => Existing::Refuse,
    };
    FileSet::write_one(path, content, existing, Inputs::of([&arguments.pipeline]))
        .map_err(|error| refused("--out", &error, false))
}
