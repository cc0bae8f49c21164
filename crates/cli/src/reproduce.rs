//! `asperity reproduce` and `asperity reduce`: runs to tables and figures.

use std::fs;
use std::path::Path;

use asperity_analysis::pipeline::{Pipeline, Progress, Stage};
use asperity_analysis::precursors::PrecursorRules;
use asperity_analysis::run_data::RunData;
use asperity_analysis::{figures, table_file, tables};
use asperity_model::analytic::LengthLaw;
use asperity_model::text;
use asperity_run::study::Job;
use asperity_run::{RunError, SolverKind, at_once};

use crate::args::{ReduceArguments, ReproduceArguments};
use crate::exit::Failure;
use crate::interrupt;
use crate::progress::Board;
use crate::terminal::say;
use crate::{run, scenario};

pub(crate) fn reduce_command(arguments: &ReduceArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    let rules = PrecursorRules { min_blocks: arguments.min_blocks, merge_gap_s: arguments.merge_gap_s };
    rules.check().map_err(|error| Failure::BadInput(format!("--merge-gap-s: {error}")))?;
    if fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) || out.is_file() {
        return Err(Failure::BadInput(format!(
            "--out {} exists already and is not empty (accepted: a new or empty folder)",
            out.display()
        )));
    }
    let name = arguments.run.file_stem().map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
    let data = RunData::read(&name, &arguments.run).map_err(Failure::failed)?;
    create_folder(out)?;
    let law = LengthLaw::natural(&data.scenario);
    let write = || {
        table_file::write(out, "events", &mut tables::events(&data)?)?;
        table_file::write(out, "load", &mut tables::load_curve(&data)?)?;
        table_file::write(out, "precursors", &mut tables::precursors(&data, law, &rules)?)?;
        table_file::write(out, "residuals", &mut tables::residual_table(&[(&data, law, rules)])?)?;
        figures::draw_overview(data, out)
    };
    write().map_err(Failure::failed)?;
    say(out.display())?;
    Ok(())
}

/// Reads a pipeline, and resolves its runs with overrides.
pub(crate) fn read_pipeline(file: &Path, set: &[String]) -> Result<(Pipeline, Vec<Job>), Failure> {
    let path = file.display();
    let text = text::read(file)
        .map_err(|error| Failure::BadInput(format!("pipeline {path}: {error} (accepted: a TOML file)")))?;
    let pipeline = Pipeline::parse(&text).map_err(|error| Failure::BadInput(format!("{path}: {error}")))?;
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
    let (pipeline, jobs) = read_pipeline(&arguments.pipeline, &arguments.set)?;
    let runs_folder = arguments.out.join("runs");
    for job in &jobs {
        job.check_place(&runs_folder)
            .map_err(|error| Failure::BadInput(format!("--out: {}", RunError::Foreign(error))))?;
    }
    create_folder(&runs_folder)?;
    interrupt::install()?;
    let solver = SolverKind::from(arguments.solver);
    let (done, mut missing): (Vec<Job>, Vec<Job>) =
        jobs.into_iter().partition(|job| !arguments.fresh && job.is_done(&runs_folder, solver));
    if !done.is_empty() {
        board.line(&format!("{} runs are there already", done.len()));
    }
    // The longest first, so that no core waits for one at the end.
    missing.sort_by_key(|job| std::cmp::Reverse(job.cost()));
    let overall = board.overall(missing.iter().map(|job| (job.name.clone(), job.cost())));
    at_once(&missing, arguments.jobs, |job| {
        make_run(job, &runs_folder, solver, arguments.fresh, overall.board())?;
        overall.done(&job.name);
        Ok::<(), Failure>(())
    })?;
    drop(overall);

    if let Some(code) = interrupt::code() {
        return Err(Failure::Said(code));
    }
    board.line("reducing and drawing");
    let stages = board.stages("reduction");
    let mut tell = |Progress { stage, done, of }: Progress| {
        let stage = match stage {
            Stage::Runs => "runs read",
            Stage::Tables => "tables",
            Stage::Figures => "figures",
        };
        stages.reached(stage, done, of);
    };
    pipeline.reduce(&runs_folder, &arguments.out, &mut tell).map_err(Failure::failed)?;
    drop(stages);
    print_where_to_look(&pipeline, &arguments.out)?;
    Ok(())
}

fn make_run(job: &Job, folder: &Path, solver: SolverKind, fresh: bool, board: &Board) -> Result<(), Failure> {
    let mut progress = board.run(&job.name, job.steps(), job.scenario.time.duration_s);
    let outcome = job.make(folder, solver, fresh, &interrupt::has_come, &mut progress);
    let outcome = outcome.map_err(|error| run::failure(error, board, &format!("run {}", job.name)))?;
    progress.end(outcome.has_run);
    Ok(())
}

fn create_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::Failed(format!("failed to create {}: {error}", folder.display())))
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
