//! The runs of a study that have names: each is reduced once, from its log or while it is made, to tables,
//! figures and claims.

use std::num::NonZeroUsize;
use std::path::Path;
use std::thread;

use asperity_files::{FolderLock, Inputs};
use asperity_numbers::Summary;
use asperity_record::{RunEnd, counted};
use asperity_run::study::{Job, Stored};
use asperity_run::{Nodes, SolverKind, Threads, at_once};
use asperity_study::pipeline::Pipeline;
use asperity_study::reduction::{Beside, Passing, Progress, Reduction};
use asperity_study::runs::FOLDER;
use asperity_study::{Plan, StudyError, plan};

use crate::exit::Failure;
use crate::interrupt;
use crate::outputs::{create_folder, refused};
use crate::progress::Board;
use crate::run;
use crate::study::some_of;
use crate::terminal::say;

/// Why tables and figures were not written: invalid input, if another folder would do.
pub(crate) fn not_written(error: StudyError) -> Failure {
    match error {
        StudyError::File(error) => refused("--out", &error, false),
        error => Failure::failed(error),
    }
}

/// Makes tables, figures and claims of the named runs of a plan, whose logs are all in its folder.
pub(crate) fn of_plan(
    plan: &Plan,
    folder: &Path,
    beside: Beside,
    provenance: bool,
    board: &Board,
) -> Result<(), Failure> {
    let file = folder.join(plan::FILE);
    let refused = |problem: String| Failure::BadInput(format!("{}: {problem}", file.display()));
    let text = plan.common.study_toml.as_deref().unwrap_or_default();
    let pipeline = Pipeline::beside(text, plan.numbered(), &|at| plan.runs_at(at)).map_err(refused)?;
    let names = plan.common.runs.iter().map(|run| &run.name);
    if !pipeline.runs.iter().eq(names) {
        return Err(refused("its runs are not those of its study (accepted: an unedited plan)".to_owned()));
    }
    let jobs = plan.common.runs.iter().map(|run| run.job(&plan.common.files));
    let jobs = jobs.collect::<Result<Vec<Job>, _>>().map_err(refused)?;
    let inputs = inputs([file.as_path()], plan.common.runs.iter().map(|run| run.scenario.as_str()), &jobs);
    let source = Source { pipeline: &pipeline, jobs, out: folder, solver: None, provenance, beside };
    source.reduce(inputs, Missing::Refuse, board)
}

/// The remedy for runs without a usable log.
pub(crate) enum Missing {
    /// Make them, `at_once` on as many threads; `fresh`: all of them.
    Make { fresh: bool, at_once: Option<NonZeroUsize> },
    /// Fail.
    Refuse,
}

/// Named runs, and their outputs.
pub(crate) struct Source<'a> {
    pub(crate) pipeline: &'a Pipeline,
    pub(crate) jobs: Vec<Job>,
    pub(crate) out: &'a Path,
    pub(crate) solver: Option<SolverKind>,
    pub(crate) provenance: bool,
    pub(crate) beside: Beside,
}

impl Source<'_> {
    /// Reduces each run in one pass, from its log during the check, or while it is made.
    pub(crate) fn reduce(self, inputs: Inputs, missing: Missing, board: &Board) -> Result<(), Failure> {
        let Source { pipeline, jobs, out, solver, provenance, beside } = self;
        let (fresh, jobs_at_once) = match missing {
            Missing::Make { fresh, at_once } => (fresh, at_once),
            Missing::Refuse => (false, None),
        };
        let runs_folder = out.join(FOLDER);
        create_folder(out)?;
        let _lock = FolderLock::take(out).map_err(|error| refused("--out", &error, false))?;
        for job in &jobs {
            job.check_log_target(&runs_folder, solver, fresh)
                .map_err(|error| Failure::BadInput(format!("--out: {error}")))?;
        }
        let logs = jobs.iter().map(|job| job.log(&runs_folder));
        for path in logs.chain(pipeline.outputs(out)) {
            inputs.check(&path).map_err(|error| refused("--out", &error, false))?;
        }
        create_folder(&runs_folder)?;
        interrupt::install()?;
        let reduction = Reduction::begin(pipeline, out, inputs, provenance).map_err(not_written)?;
        let reduction = Reducing { reduction, solver, runs_folder: &runs_folder };
        let stored =
            at_once(
                &jobs,
                jobs_at_once,
                |job| {
                    if fresh { Ok(Stored::Nothing) } else { reduction.of_log(job) }
                },
            )?;
        let mut to_make = Vec::new();
        for (job, stored) in jobs.into_iter().zip(&stored) {
            match (stored, &missing) {
                (Stored::Whole(_), _) => continue,
                (Stored::Nothing, Missing::Make { .. }) => {}
                (Stored::Unfit(why), Missing::Make { .. }) => {
                    board.line(&format!("{}: made again: {why}", job.name));
                }
                (Stored::Nothing, Missing::Refuse) => {
                    return Err(Failure::Failed(format!("run {}: its log is missing", job.name)));
                }
                (Stored::Unfit(why), Missing::Refuse) => {
                    return Err(Failure::Failed(format!(
                        "run {}: {why}; remove {}, and asperity sweep run repeats it",
                        job.name,
                        job.log(&runs_folder).display()
                    )));
                }
            }
            to_make.push((job.cost(), job));
        }
        let done = stored.len() - to_make.len();
        if done > 0 {
            board.line(&format!("{} used again", counted(done as u64, "run")));
        }
        // The longest first, so that no core waits for one at the end.
        to_make.sort_by_key(|(cost, _)| std::cmp::Reverse(*cost));
        let overall = board.overall(to_make.iter().map(|(cost, job)| (job.name.clone(), *cost)));
        // With a run on every core, further threads only cost time.
        let cores =
            jobs_at_once.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
        let threads = if to_make.len() > cores { Threads::One } else { Threads::Several };
        at_once(&to_make, jobs_at_once, |(_, job)| {
            reduction.of_run(job, fresh, threads, overall.board())?;
            overall.done(&job.name);
            Ok::<(), Failure>(())
        })?;
        drop(overall);

        if let Some(code) = interrupt::code() {
            return Err(Failure::Said(code));
        }
        let stages = board.stages("reduction");
        let mut tell = |Progress { done, of }: Progress| stages.reached("tables", done, of);
        let summaries = reduction.reduction.finish(beside, &mut tell).map_err(not_written)?;
        drop(stages);
        tell_misleading(&summaries, board);
        print_where_to_look(pipeline, out)
    }
}

/// The inputs of a study: its file, and those of its scenarios.
pub(crate) fn inputs<'a>(
    files: impl IntoIterator<Item = &'a Path>,
    scenarios: impl Iterator<Item = &'a str>,
    jobs: &[Job],
) -> Inputs {
    let mut inputs = Inputs::of(files);
    inputs.add(scenarios.map(Path::new).filter(|path| path.is_file()));
    let named = jobs.iter().flat_map(|job| job.scenario.files()).map(Path::new);
    inputs.add(named.filter(|path| path.is_file()));
    inputs
}

/// A reduction that receives each run once, record by record.
struct Reducing<'a> {
    reduction: Reduction<'a>,
    solver: Option<SolverKind>,
    runs_folder: &'a Path,
}

impl Reducing<'_> {
    /// Reduces a run from its log during the check, if the log is usable.
    fn of_log(&self, job: &Job) -> Result<Stored, Failure> {
        if !job.log(self.runs_folder).exists() {
            return Ok(Stored::Nothing);
        }
        let mut passing = self.passing(job)?;
        let stored = job.stored(self.runs_folder, self.solver, &mut passing);
        match &stored {
            Stored::Whole(end) => self.passed(job, passing, end)?,
            Stored::Nothing | Stored::Unfit(_) => self.reduction.discard(passing),
        }
        Ok(stored)
    }

    /// Makes a run and reduces it meanwhile.
    fn of_run(&self, job: &Job, fresh: bool, threads: Threads, board: &Board) -> Result<(), Failure> {
        let mut both = (board.run(&job.name, job.steps(), job.scenario.time.duration_s), self.passing(job)?);
        let outcome =
            job.make(self.runs_folder, self.solver, fresh, threads, &interrupt::has_come, &mut both);
        let (progress, passing) = both;
        let outcome = outcome.map_err(|error| run::failure(error, board, &format!("run {}", job.name)))?;
        match outcome.end.filter(|_| outcome.has_run) {
            Some(end) => self.passed(job, passing, &end)?,
            // The log only lacked its name, so no records passed.
            None => {
                self.reduction.discard(passing);
                if let Stored::Unfit(why) = self.of_log(job)? {
                    return Err(Failure::Failed(format!("run {}: {why}", job.name)));
                }
            }
        }
        progress.end(outcome.has_run);
        Ok(())
    }

    fn passing(&self, job: &Job) -> Result<Passing, Failure> {
        let passing = self.reduction.passing(&job.name, job.header(self.solver), job.scenario.clone());
        passing.map_err(not_written)
    }

    fn passed(&self, job: &Job, mut passing: Passing, end: &RunEnd) -> Result<(), Failure> {
        let at_s = passing.nodes_at_s();
        if !at_s.is_empty() {
            let told = |error| Failure::failed(format!("run {}: {error}", job.name));
            let mut nodes = Nodes::of_log(&job.log(self.runs_folder), u64::MAX, &at_s).map_err(told)?;
            while let Some(state) = nodes.next_state().map_err(told)? {
                passing.nodes(state);
            }
        }
        self.reduction.passed(passing, end).map_err(not_written)
    }
}

/// Reports the runs whose raw slip events are misleading, since their claims and figures use these.
fn tell_misleading(summaries: &[Summary], board: &Board) {
    let misled = summaries.iter().filter(|summary| summary.raw_events_mislead == Some(true));
    let names: Vec<&str> = misled.map(|summary| summary.run.as_str()).collect();
    if !names.is_empty() {
        board.line(&format!(
            "{}: slip events merge several ruptures, or last far longer than fronts take; claims and \
             figures count slip events, as the thesis does; tables/RUN.ruptures.csv lists the ruptures",
            some_of(&names)
        ));
    }
}

fn print_where_to_look(pipeline: &Pipeline, out: &Path) -> Result<(), Failure> {
    say(&pipeline.title)?;
    say(format_args!("  figures  {}", out.join("figures").display()))?;
    say(format_args!("  tables   {}", out.join("tables").display()))?;
    if !pipeline.claim.is_empty() {
        say(format_args!("  claims   {}", out.join("tables").join("claims.md").display()))?;
    }
    say(format_args!("  runs     {}", out.join(FOLDER).display()))?;
    Ok(())
}
