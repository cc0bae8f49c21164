//! `asperity reproduce` and `asperity reduce`: runs to tables and figures.

use std::num::NonZeroUsize;
use std::path::Path;
use std::thread;

use asperity_figures::draw as figures;
use asperity_files::{Existing, FileSet, FolderLock, Inputs, is_new_folder};
use asperity_model::analytic::LengthLaw;
use asperity_model::text;
use asperity_numbers::Summary;
use asperity_numbers::precursors::PrecursorRules;
use asperity_numbers::run_data::{Collector, NodeField};
use asperity_record::{Observer, Record, RunEnd, RunHeader};
use asperity_run::study::{Job, Stored};
use asperity_run::{Checked, NodeState, Nodes, SolverKind, Threads, at_once};
use asperity_study::pipeline::Pipeline;
use asperity_study::reduction::{Passing, Progress, Reduction};
use asperity_study::{StudyError, record};
use asperity_tables::load_table::LoadTable;
use asperity_tables::tables::ResidualRow;
use asperity_tables::{TableFileError, summaries, table_file, tables};

use crate::args::{ReduceArguments, ReproduceArguments};
use crate::exit::Failure;
use crate::interrupt;
use crate::outputs::{create_folder, refused};
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::terminal::say;
use crate::verdict_exit;
use crate::{run, scenario, summary};

/// The file beside tables and figures of an incomplete log.
const MISSING: &str = "what-is-missing.txt";

pub(crate) fn reduce_command(arguments: &ReduceArguments, board: &Board) -> Result<(), Failure> {
    let out = &arguments.out;
    let rules = PrecursorRules { min_blocks: arguments.min_blocks, merge_gap_s: arguments.merge_gap_s };
    rules.check().map_err(|error| Failure::BadInput(format!("--merge-gap-s: {error}")))?;
    if !is_new_folder(out).unwrap_or(false) {
        return Err(Failure::BadInput(format!(
            "--out {} exists already and is not empty (accepted: a new or empty folder)",
            out.display()
        )));
    }
    let name = arguments.run.file_stem().map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
    let run = &arguments.run;
    let files = FileSet::new(Existing::Refuse, Inputs::of([run]));
    files.folder(out).map_err(Failure::failed)?;
    let begin = |header: &RunHeader, toml: &str| {
        let wants = figures::OVERVIEW_WANTS | rules.wants();
        let collector = Collector::of_log(&name, header, toml, wants)?;
        let loads = Loads(LoadTable::begin(&files, out, "load", collector.both_ways()));
        Ok((collector, loads))
    };
    let accept = |checked: &Checked| verdict_exit::must_be_sound(run, checked);
    let Reading { checked, observer: (collector, loads), ruptures_from } = reading::once(run, begin, accept)?;
    loads.0.and_then(LoadTable::finish).map_err(|error| not_written(error.into()))?;
    let verdict = checked.verdict;
    let data = collector.finish(ruptures_from, checked.seen.end.as_ref());
    let summary = &data.summary;
    let law = LengthLaw::natural(&data.scenario);
    if !verdict.holds_all() {
        let note = format!(
            "These tables and figures are of what there is of a run. Its log is not whole.\n{}: {checked}\n",
            arguments.run.display()
        );
        files.write(&out.join(MISSING), note).map_err(|error| refused("--out", &error, false))?;
    }
    let write = || {
        if data.ruptures.is_some() {
            let write = |name, mut table| table_file::write(&files, out, name, &mut table);
            write(tables::RUPTURES, tables::ruptures(&data)?)?;
            write(tables::PRECURSOR_RUPTURES, tables::precursor_ruptures(&data, &[(law, rules)])?)?;
        }
        table_file::write(&files, out, "events", &mut tables::events(&data)?)?;
        table_file::write(&files, out, "precursors", &mut tables::precursors(&data, law, &rules)?)?;
        let residuals = ResidualRow::of(&data, law, &rules)?;
        table_file::write(&files, out, "residuals", &mut tables::residual_table(&[residuals])?)?;
        summaries::write_table(&files, &out.join(summaries::TABLE), [summary])?;
        summaries::write_json(&files, &out.join(summaries::JSON), summary)?;
        let of_ruptures = [tables::RUPTURES, tables::PRECURSOR_RUPTURES];
        let tables = of_ruptures.into_iter().filter(|_| data.ruptures.is_some());
        let tables = tables
            .chain(["events", "load", "precursors", "residuals"])
            .flat_map(|name| table_file::paths(out, name));
        let tables = tables.chain([summaries::TABLE, summaries::JSON].map(|name| out.join(name)));
        let figures = figures::overview_files(out);
        record::write(&files, out, "reduce", [(name.as_str(), &data.header)], tables.chain(figures), None)?;
        figures::draw_overview(&data, !arguments.no_provenance, &files, out)?;
        Ok(files.publish()?)
    };
    write().map_err(not_written)?;
    say(out.display())?;
    summary::tell(arguments.run.display(), summary, board);
    verdict_exit::finish(&arguments.run, &checked, board)
}

/// The table of loads of a log that is read, or the first failure to write it.
struct Loads(Result<LoadTable, TableFileError>);

impl Observer for Loads {
    fn record(&mut self, record: &Record) {
        if let (Record::Step(record), Ok(table)) = (record, &mut self.0)
            && let Err(error) = table.push(record)
        {
            self.0 = Err(error);
        }
    }
}

/// Why tables and figures were not written: invalid input, if another folder would do.
fn not_written(error: StudyError) -> Failure {
    match error {
        StudyError::File(error) => refused("--out", &error, false),
        error => Failure::failed(error),
    }
}

/// Reads a pipeline, and resolves its runs with overrides.
pub(crate) fn read_pipeline(
    file: &Path,
    set: &[String],
    board: &Board,
) -> Result<(Pipeline, Vec<Job>), Failure> {
    let path = file.display();
    let text = text::read(file)
        .map_err(|error| Failure::BadInput(format!("pipeline {path}: {error} (accepted: a TOML file)")))?;
    let pipeline = Pipeline::parse(&text).map_err(|error| Failure::BadInput(format!("{path}: {error}")))?;
    pipeline.notes.iter().for_each(|note| board.line(&format!("note: {path}: {note}")));
    let jobs = pipeline
        .run
        .iter()
        .map(|spec| {
            let set: Vec<String> = spec.set.iter().chain(set).cloned().collect();
            let scenario = scenario::resolve(&spec.scenario, &set)
                .map_err(|error| Failure::BadInput(format!("{path}: run {}: {error}", spec.name)))?;
            Ok(Job { name: spec.name.clone(), scenario })
        })
        .collect::<Result<_, Failure>>()?;
    Ok((pipeline, jobs))
}

pub(crate) fn command(arguments: &ReproduceArguments, board: &Board) -> Result<(), Failure> {
    let (pipeline, jobs) = read_pipeline(&arguments.pipeline, &arguments.set, board)?;
    let runs_folder = arguments.out.join("runs");
    let solver = SolverKind::from(arguments.solver);
    let inputs = inputs(arguments, &pipeline, &jobs);
    create_folder(&arguments.out)?;
    let _lock = FolderLock::take(&arguments.out).map_err(|error| refused("--out", &error, false))?;
    for job in &jobs {
        job.check_log_target(&runs_folder, solver, arguments.fresh)
            .map_err(|error| Failure::BadInput(format!("--out: {error}")))?;
    }
    let logs = jobs.iter().map(|job| job.log(&runs_folder));
    for path in logs.chain(pipeline.outputs(&arguments.out)) {
        inputs.check(&path).map_err(|error| refused("--out", &error, false))?;
    }
    create_folder(&runs_folder)?;
    interrupt::install()?;
    // Runs are reduced in one pass: from their logs during the check, or while they are made.
    let provenance = !arguments.no_provenance;
    let reduction = Reduction::begin(&pipeline, &arguments.out, inputs, provenance).map_err(not_written)?;
    let reduction = Reducing { reduction, solver, runs_folder: &runs_folder };
    let stored = at_once(&jobs, arguments.jobs, |job| {
        if arguments.fresh { Ok(Stored::Nothing) } else { reduction.of_log(job) }
    })?;
    let mut missing = Vec::new();
    for (job, stored) in jobs.into_iter().zip(&stored) {
        match stored {
            Stored::Whole(_) => continue,
            Stored::Nothing => {}
            Stored::Unfit(why) => board.line(&format!("{}: made again: {why}", job.name)),
        }
        missing.push(job);
    }
    let done = stored.len() - missing.len();
    if done > 0 {
        board.line(&format!("{done} runs are there already"));
    }
    // The longest first, so that no core waits for one at the end.
    missing.sort_by_key(|job| std::cmp::Reverse(job.cost()));
    let overall = board.overall(missing.iter().map(|job| (job.name.clone(), job.cost())));
    // With a run on every core, further threads only cost time.
    let cores = arguments.jobs.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    let threads = if missing.len() > cores { Threads::One } else { Threads::Several };
    at_once(&missing, arguments.jobs, |job| {
        reduction.of_run(job, arguments.fresh, threads, overall.board())?;
        overall.done(&job.name);
        Ok::<(), Failure>(())
    })?;
    drop(overall);

    if let Some(code) = interrupt::code() {
        return Err(Failure::Said(code));
    }
    let stages = board.stages("reduction");
    let mut tell = |Progress { done, of }: Progress| stages.reached("tables", done, of);
    let summaries = reduction.reduction.finish(&mut tell).map_err(not_written)?;
    drop(stages);
    tell_misleading(&summaries, board);
    print_where_to_look(&pipeline, &arguments.out)?;
    Ok(())
}

/// The inputs of a pipeline: its own file, and those of its scenarios.
fn inputs(arguments: &ReproduceArguments, pipeline: &Pipeline, jobs: &[Job]) -> Inputs {
    let mut inputs = Inputs::of([&arguments.pipeline]);
    inputs.add(pipeline.run.iter().map(|run| Path::new(&run.scenario)).filter(|path| path.is_file()));
    let profiles = jobs.iter().map(|job| Path::new(&job.scenario.initial_shear.profile_csv));
    inputs.add(profiles.filter(|path| path.is_file()));
    inputs
}

/// A reduction that receives each run once, record by record.
struct Reducing<'a> {
    reduction: Reduction<'a>,
    solver: SolverKind,
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
        if !passing.nodes_at_s().is_empty() {
            let told = |error| Failure::failed(format!("run {}: {error}", job.name));
            let mut nodes =
                Nodes::of_log(&job.log(self.runs_folder), u64::MAX, passing.nodes_at_s()).map_err(told)?;
            while let Some(NodeState { step, time_s, displacement_m, .. }) =
                nodes.next_state().map_err(told)?
            {
                passing.nodes(NodeField { step, time_s, displacement_m });
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
            "raw slip events, which claims and figures are made of, mislead in {}: see tables/summary.csv",
            names.join(", ")
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
    say(format_args!("  runs     {}", out.join("runs").display()))?;
    Ok(())
}
