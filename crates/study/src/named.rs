//! The runs of a study that have names: each is reduced once, from its log or while it is made, to tables,
//! figures and claims.

use std::cmp::Reverse;
use std::num::NonZeroUsize;
use std::path::Path;
use std::thread;

use asperity_files::{FolderLock, Inputs, at_once, create_folder};
use asperity_numbers::Summary;
use asperity_record::{RunEnd, counted};
use asperity_run::study::{Job, Stored};
use asperity_run::{LeftError, Nodes, RunError, SolverKind, Threads};
use asperity_runlog::WriteError;
use asperity_tables::Format;

use crate::error::StudyError;
use crate::outputs::Outputs;
use crate::pipeline::Pipeline;
use crate::plan::{self, Plan};
use crate::reduction::{Beside, Passing, Reduction};
use crate::results::State;
use crate::runs::FOLDER;
use crate::study::Study;
use crate::watch::Watcher;
use crate::work::{Made, Making};

/// How a study is reproduced: its runs are made, and all of its outputs.
#[derive(Clone, Copy)]
pub struct Reproduction<'a> {
    /// The solver of runs that have names, if not that of their law.
    pub solver: Option<SolverKind>,
    /// Repeats runs that have names, and replaces those of other scenarios.
    pub fresh: bool,
    /// How many runs are made at once; one per core by default.
    pub jobs: Option<NonZeroUsize>,
    /// Whether figures and pages name the code, and figures bear a line with their source.
    pub provenance: bool,
    /// Whoever waits for it.
    pub watcher: &'a dyn Watcher,
}

impl Reproduction<'_> {
    /// Makes the runs of a study that a folder lacks, and all of its outputs there. Returns the summaries of runs that
    /// have names. `file` is that of the study.
    ///
    /// # Errors
    /// If a scenario is refused, the folder is of another study, a run cannot be made, or the caller stops.
    pub fn of(&self, study: &Study, file: &Path, out: &Path) -> Result<Vec<Summary>, StudyError> {
        let jobs = study.jobs().map_err(StudyError::refused(file))?;
        let mut beside = Beside::default();
        if study.grid.is_some() {
            let (plan, _) = Plan::begun(study, file, out, false, self.jobs)?;
            let making = Making { jobs: self.jobs, ..Making::new(out, self.watcher) };
            let results = &making.make_missing(&plan, |run| run <= plan.numbered())?;
            let (provenance, watcher) = (self.provenance, self.watcher);
            let outputs = Outputs { plan: &plan, results, folder: out, provenance, watcher };
            beside = outputs.tables(&[Format::Csv, Format::Parquet], None)?;
        }
        if jobs.is_empty() {
            return Ok(Vec::new());
        }
        let scenarios = study.runs.iter().map(|run| run.scenario.as_str());
        let inputs = inputs(file, scenarios, &jobs);
        self.reduce(&study.pipeline, jobs, out, inputs, beside, true)
    }

    /// Reduces each run in one pass, from its log during the check, or while it is made, if that `may_be`.
    fn reduce(
        &self,
        pipeline: &Pipeline,
        jobs: Vec<Job>,
        out: &Path,
        inputs: Inputs,
        beside: Beside,
        may_be: bool,
    ) -> Result<Vec<Summary>, StudyError> {
        let &Reproduction { solver, fresh, jobs: jobs_at_once, provenance, watcher } = self;
        let runs_folder = out.join(FOLDER);
        create_folder(out)?;
        let _lock = FolderLock::take(out)?;
        for job in &jobs {
            job.check_log_target(&runs_folder, solver, fresh)
                .map_err(|error| StudyError::Refused(format!("--out: {error}")))?;
        }
        let logs = jobs.iter().map(|job| job.log(&runs_folder));
        logs.chain(pipeline.outputs(out)).try_for_each(|path| inputs.check(&path))?;
        create_folder(&runs_folder)?;
        let reduction = Reduction::begin(pipeline, out, inputs, provenance)?;
        let reducing = Reducing { reduction, way: self, runs_folder: &runs_folder };
        let stored = at_once(&jobs, jobs_at_once, |job| match fresh {
            true => Ok(Stored::Nothing),
            false => reducing.of_log(job),
        })?;
        let mut to_make = Vec::new();
        for (job, stored) in jobs.iter().zip(&stored) {
            let Job { name, .. } = job;
            match stored {
                Stored::Whole(_) => continue,
                Stored::Nothing if may_be => {}
                Stored::Unfit(why) if may_be => watcher.note(&format!("{name}: made again: {why}")),
                Stored::Nothing => return Err(StudyError::Failed(format!("run {name}: its log is missing"))),
                Stored::Unfit(why) => {
                    return Err(StudyError::Failed(format!(
                        "run {name}: {why}; remove {}, and asperity sweep run repeats it",
                        job.log(&runs_folder).display()
                    )));
                }
            }
            to_make.push(job);
        }
        let done = stored.len() - to_make.len();
        if done > 0 {
            watcher.note(&format!("{} used again", counted(done as u64, "run")));
        }
        // The longest first, so that no core waits for one at the end.
        to_make.sort_by_cached_key(|job| Reverse(job.cost()));
        // With a run on every core, further threads only cost time.
        let cores =
            jobs_at_once.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
        let threads = if to_make.len() > cores { Threads::One } else { Threads::Several };
        watcher.begin(to_make.len() as u64, to_make.iter().map(|job| job.cost()).sum());
        let made = at_once(&to_make, jobs_at_once, |job| reducing.of_run(job, threads));
        watcher.end();
        made?;
        if watcher.is_stopped() {
            return Err(StudyError::Stopped);
        }
        let summaries = reducing.reduction.finish(beside)?;
        // Claims and figures use slip events.
        let misled = summaries.iter().filter(|summary| summary.events_mislead == Some(true));
        let names: Vec<&str> = misled.map(|summary| summary.run.as_str()).collect();
        if !names.is_empty() {
            watcher.note(&format!(
                "{}: slip events merge several ruptures, or last far longer than fronts take; claims and \
                 figures count slip events, as the thesis does; tables/RUN.ruptures.csv lists the ruptures",
                some_of(&names)
            ));
        }
        Ok(summaries)
    }
}

/// Makes tables, figures and claims of the named runs of a study, whose logs are all in its folder.
///
/// # Errors
/// If one is missing or damaged, or a file cannot be written.
pub fn reduce(outputs: Outputs<'_>, beside: Beside) -> Result<Vec<Summary>, StudyError> {
    let Outputs { plan, results, folder, provenance, watcher } = outputs;
    let named = (plan.numbered() + 1..).zip(&plan.common.runs);
    let missing = named.filter(|(run, _)| results.state(*run) != State::Logged);
    let missing: Vec<&str> = missing.map(|(_, named)| named.name.as_str()).collect();
    if !missing.is_empty() {
        watcher.note(&format!("no tables, figures and claims without {}", some_of(&missing)));
        return Ok(Vec::new());
    }
    let file = folder.join(plan::FILE);
    let refused = StudyError::refused(&file);
    let pipeline = Pipeline::of_plan(plan, folder)?;
    let names = plan.common.runs.iter().map(|run| &run.name);
    let pipeline = pipeline.filter(|pipeline| pipeline.runs.iter().eq(names)).ok_or_else(|| {
        refused("its runs are not those of its study (accepted: an unedited plan)".to_owned())
    })?;
    let jobs = plan.common.runs.iter().map(|run| run.job(&plan.common.files));
    let jobs = jobs.collect::<Result<Vec<Job>, _>>().map_err(refused)?;
    let inputs = inputs(&file, plan.common.runs.iter().map(|run| run.scenario.as_str()), &jobs);
    let way = Reproduction { solver: None, fresh: false, jobs: None, provenance, watcher };
    way.reduce(&pipeline, jobs, folder, inputs, beside, false)
}

/// The inputs of a study: its file, and those of its scenarios.
fn inputs<'a>(file: &Path, scenarios: impl Iterator<Item = &'a str>, jobs: &'a [Job]) -> Inputs {
    let mut inputs = Inputs::of([file]);
    let named = jobs.iter().flat_map(|job| job.scenario.files()).map(Path::new);
    inputs.add(scenarios.map(Path::new).chain(named).filter(|path| path.is_file()));
    inputs
}

/// A reduction that receives each run once, record by record.
struct Reducing<'a> {
    reduction: Reduction<'a>,
    way: &'a Reproduction<'a>,
    runs_folder: &'a Path,
}

impl Reducing<'_> {
    /// Reduces a run from its log during the check, if the log is usable.
    fn of_log(&self, job: &Job) -> Result<Stored, StudyError> {
        if !job.log(self.runs_folder).exists() {
            return Ok(Stored::Nothing);
        }
        let mut passing = self.passing(job);
        let stored = job.stored(self.runs_folder, self.way.solver, &mut passing);
        match &stored {
            Stored::Whole(end) => self.passed(job, passing, end)?,
            Stored::Nothing | Stored::Unfit(_) => self.reduction.discard(passing),
        }
        Ok(stored)
    }

    /// Makes a run and reduces it meanwhile.
    fn of_run(&self, job: &Job, threads: Threads) -> Result<(), StudyError> {
        let &Reproduction { solver, fresh, watcher, .. } = self.way;
        let mut watched = watcher.run(job);
        let mut both = (&mut *watched, self.passing(job));
        let stop = || watcher.is_stopped();
        let outcome = job.make(self.runs_folder, solver, fresh, threads, &stop, &mut both);
        let passing = both.1;
        let outcome = outcome.map_err(|error| unmade(error, job, watcher))?;
        match outcome.end.filter(|_| outcome.has_run) {
            Some(end) => self.passed(job, passing, &end)?,
            // The log only lacked its name, so no records passed.
            None => {
                self.reduction.discard(passing);
                if let Stored::Unfit(why) = self.of_log(job)? {
                    return Err(StudyError::Failed(format!("run {}: {why}", job.name)));
                }
            }
        }
        watcher.over(&Made::Done);
        Ok(())
    }

    fn passing(&self, job: &Job) -> Passing {
        self.reduction.passing(&job.name, job.header(self.way.solver), job.scenario.clone())
    }

    fn passed(&self, job: &Job, mut passing: Passing, end: &RunEnd) -> Result<(), StudyError> {
        let at_s = passing.collector.nodes_at_s();
        if !at_s.is_empty() {
            let told = |error| StudyError::Failed(format!("run {}: {error}", job.name));
            for state in Nodes::of_log(&job.log(self.runs_folder), u64::MAX, &at_s).map_err(told)? {
                passing.collector.nodes(state.map_err(told)?);
            }
        }
        self.reduction.passed(passing, end)
    }
}

/// Why a run is not made.
fn unmade(error: RunError, job: &Job, watcher: &dyn Watcher) -> StudyError {
    let told = format!("run {}: {error}", job.name);
    match error {
        RunError::Stopped { .. } => {
            watcher.note(&format!("{told}; called again, the command continues from there"));
            StudyError::Stopped
        }
        RunError::Left(LeftError::OtherRun(_)) | RunError::Write(WriteError::Foreign(_)) => {
            StudyError::Refused(told)
        }
        RunError::LogTarget(error) => StudyError::Refused(error),
        RunError::Solver { .. } => StudyError::Refused(format!("--solver: {error}")),
        RunError::Write(WriteError::File(error)) => StudyError::File(error),
        _ => StudyError::Failed(told),
    }
}

/// Most names of runs in a line.
const MOST_NAMED: usize = 5;

/// Lists names; for a long list, the first ones and the number of the others.
fn some_of(names: &[&str]) -> String {
    match names.len().saturating_sub(MOST_NAMED) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names[..MOST_NAMED].join(", ")),
    }
}
