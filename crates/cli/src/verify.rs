//! `asperity verify-solver`: the fast solver held against the plain one.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use asperity_detect::detect_all;
use asperity_export::whole::WholeFile;
use asperity_model::{Plan, text};
use asperity_record::{Event, EventPayload, SlipEvent, StepRecord};
use asperity_simulator::equality::{self, Agreement, NearTie, TOLERANCE};
use serde::{Deserialize, Serialize};

use crate::args::VerifySolverArguments;
use crate::at_once::at_once;
use crate::exit::Failure;
use crate::progress::Board;
use crate::reproduce::{Job, read_pipeline};
use crate::{detectors, run};

/// Where known near ties are looked for, if nothing else is said.
const NEAR_TIES: &str = "fixtures/near-ties";

/// A near tie, with all that it takes to prove it again.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Proof {
    /// The run's name in its pipeline.
    run: String,
    /// The run's scenario, complete.
    scenario: String,
    /// Its hash.
    scenario_hash: String,
    /// What was found.
    tie: NearTie,
}

impl Proof {
    fn file_name(&self, parameter_set: &str) -> String {
        format!("{}-{parameter_set}-{}-{}.json", self.run, self.tie.step, self.tie.block)
    }
}

/// How the comparison of one run went.
struct Outcome {
    run: String,
    agreement: Agreement,
    events: usize,
}

pub(crate) fn command(arguments: &VerifySolverArguments, board: &Board) -> Result<(), Failure> {
    let (_, mut jobs) = read_pipeline(&arguments.pipeline, &arguments.set)?;
    if let Some(unknown) = arguments.only.iter().find(|only| jobs.iter().all(|job| job.name != **only)) {
        let known: Vec<&str> = jobs.iter().map(|job| job.name.as_str()).collect();
        return Err(Failure::BadInput(format!(
            "--only {unknown}: no such run (accepted: {})",
            known.join(", ")
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
    board.line(&format!("{} runs, {:e} plain steps", jobs.len(), steps as f64));
    jobs.sort_by_key(|job| std::cmp::Reverse(job.cost()));
    let outcomes = Mutex::new(Vec::new());
    at_once(&jobs, arguments.jobs, |job| {
        let outcome = compare(job, arguments.for_s, board)?;
        outcomes.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(outcome);
        Ok(())
    })?;
    let mut outcomes = outcomes.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    outcomes.sort_by(|a, b| a.run.cmp(&b.run));
    print(&outcomes)?;
    hold_against_known(arguments, &jobs, &outcomes, &known)
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
    let mut records: [Vec<StepRecord>; 2] = [Vec::new(), Vec::new()];
    let mut progress = board.steps(&job.name, plan.steps, plan.grid.time_s(plan.steps));
    let each = |plain: &StepRecord, fast: &StepRecord| {
        records[0].push(plain.clone());
        records[1].push(fast.clone());
    };
    let agreement = equality::compare(&plan, each, |step| progress.reached(step))
        .map_err(|error| Failure::Failed(format!("run {}: {error}", job.name)))?;
    progress.clear();
    let header = run::header(&job.scenario, &plan, "both");
    let [plain, fast] = records.map(|records| detect_all(&mut detectors::all(&header), &records));
    same_events(&plain, &fast, &agreement)
        .map_err(|problem| Failure::Failed(format!("run {}: {problem}", job.name)))?;
    let outcome = Outcome {
        run: job.name.clone(),
        agreement,
        events: plain.iter().filter(|event| event.topic == SlipEvent::TOPIC).count(),
    };
    board.line(&format!(
        "{}: {} switches and {} slip events are equal, {} near ties",
        outcome.run,
        outcome.agreement.switches,
        outcome.events,
        outcome.agreement.near_ties.len()
    ));
    Ok(outcome)
}

/// Whether two runs have the same events: integers and words alike, other numbers
/// within the tolerance of the largest of their kind.
fn same_events(plain: &[Event], fast: &[Event], agreement: &Agreement) -> Result<(), String> {
    if plain.len() != fast.len() {
        return Err(format!("{} events of the plain solver, {} of the fast", plain.len(), fast.len()));
    }
    let mut largest = std::collections::BTreeMap::<(String, String), f64>::new();
    let largest_force_n = agreement
        .deviations
        .iter()
        .find(|deviation| deviation.what == "tangential force")
        .map_or(0.0, |deviation| deviation.largest);
    for event in plain {
        for (key, value) in fields(event) {
            if let Some(value) = value.as_f64().filter(|_| value.is_f64()) {
                let of_kind = if key == "tangential_force_n" { largest_force_n } else { value.abs() };
                let most = largest.entry((event.topic.clone(), key)).or_default();
                *most = most.max(of_kind);
            }
        }
    }
    for (index, (plain, fast)) in plain.iter().zip(fast).enumerate() {
        let (left, right) = (fields(plain), fields(fast));
        let alike = plain.topic == fast.topic
            && left.len() == right.len()
            && left.iter().zip(&right).all(|((key, a), (other, b))| {
                let near = || match (a.as_f64(), b.as_f64(), largest.get(&(plain.topic.clone(), key.clone())))
                {
                    (Some(a), Some(b), Some(largest)) => (a - b).abs() <= TOLERANCE * largest,
                    _ => false,
                };
                key == other && (a == b || near())
            });
        if !alike {
            return Err(format!("event {index}: plain {left:?}, fast {right:?}"));
        }
    }
    Ok(())
}

fn fields(event: &Event) -> Vec<(String, serde_json::Value)> {
    let object: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&event.payload).expect("a payload is a JSON object");
    object.into_iter().collect()
}

/// The proofs in a folder, by file. They say what is known; that it is so is proved
/// again whenever it is met.
fn known_ties(folder: &Path) -> Result<Vec<(PathBuf, Proof)>, Failure> {
    let unreadable = |path: &Path, problem: &dyn std::fmt::Display| {
        Failure::BadInput(format!(
            "near tie {}: {problem} (accepted: a proof of this command)",
            path.display()
        ))
    };
    let entries = fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()
        .map_err(|error| unreadable(folder, &error))?;
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
    let mut out = io::stdout().lock();
    writeln!(out, "run,switches,slip_events,near_ties,largest_deviation,of")?;
    for Outcome { run, agreement, events } in outcomes {
        let most = agreement.deviations.iter().max_by(|a, b| a.share.total_cmp(&b.share));
        let (what, deviation) = most.map_or(("", 0.0), |most| (most.what, most.share));
        let (switches, ties) = (agreement.switches, agreement.near_ties.len());
        writeln!(out, "{run},{switches},{events},{ties},{deviation:.1e},{what}")?;
    }
    Ok(())
}

/// Fails if a near tie is not among the known ones, whose proof is then written, or
/// if a known one was not met.
fn hold_against_known(
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
            .find(|outcome| outcome.run == job.name)
            .map_or(&[][..], |outcome| &outcome.agreement.near_ties);
        let same = |a: &NearTie, b: &NearTie| {
            (a.step, a.block, a.direction, a.plain_switches)
                == (b.step, b.block, b.direction, b.plain_switches)
        };
        let listed = || known.iter().filter(|(_, proof)| proof.scenario_hash == hash);
        for tie in found.iter().filter(|tie| !listed().any(|(_, proof)| same(&proof.tie, tie))) {
            let proof = Proof {
                run: job.name.clone(),
                scenario: job.scenario.to_commented_toml(),
                scenario_hash: hash.clone(),
                tie: tie.clone(),
            };
            let path = arguments.out.join(proof.file_name(job.scenario.parameter_set.word()));
            write_proof(&path, &proof)?;
            problems.push(format!(
                "run {}, step {}, block {}: a near tie that is not listed; its proof is {}",
                job.name,
                tie.step,
                tie.block,
                path.display()
            ));
        }
        for (path, proof) in listed().filter(|(_, proof)| proof.tie.step <= steps) {
            if !found.iter().any(|tie| same(&proof.tie, tie)) {
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

fn write_proof(path: &Path, proof: &Proof) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::Failed(format!("failed to write {}: {error}", path.display()));
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    let mut text = serde_json::to_string(proof).map_err(|error| failed(error.into()))?;
    text.push('\n');
    WholeFile::write(path, text).map_err(failed)
}
