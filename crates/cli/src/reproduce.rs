//! `asperity reproduce` and `asperity reduce`: runs to tables and figures.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use asperity_analysis::load_table::LoadTable;
use asperity_analysis::pipeline::Pipeline;
use asperity_analysis::precursors::PrecursorRules;
use asperity_analysis::reduction::{Progress, Reduction};
use asperity_analysis::run_data::RunData;
use asperity_analysis::tables::ResidualRow;
use asperity_analysis::{AnalysisError, figures, record, summaries, table_file, tables};
use asperity_files::{Existing, FileSet, FolderLock, Inputs, is_new_folder};
use asperity_model::analytic::LengthLaw;
use asperity_model::text;
use asperity_record::{EventPayload, Record, Rupture};
use asperity_run::study::{Job, Stored};
use asperity_run::{SolverKind, Verdict, at_once};
use asperity_runlog::{LogError, LogItem, RunReader};
use asperity_summary::{RupturesFrom, Summarizer, Summary};

use crate::args::{ReduceArguments, ReproduceArguments};
use crate::exit::Failure;
use crate::interrupt;
use crate::judge;
use crate::outputs::{create_folder, refused};
use crate::progress::Board;
use crate::terminal::say;
use crate::{run, ruptures, scenario, summary};

/// Stands beside the tables and figures of a log that does not hold all of its run.
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
    let checked = judge::readable(&arguments.run)?;
    let verdict = checked.verdict;
    if verdict == Verdict::Damaged {
        return Err(Failure::Log(
            verdict,
            format!("{}: {checked} (accepted: what asperity salvage makes of it)", arguments.run.display()),
        ));
    }
    let wants = figures::OVERVIEW_WANTS | rules.wants();
    let mut data = RunData::read_part(&name, &arguments.run, wants).map_err(|error| {
        if verdict.holds_all() { Failure::failed(error) } else { Failure::Log(verdict, error.to_string()) }
    })?;
    if data.ruptures.is_none() && verdict.holds_all() {
        data.ruptures = Some(ruptures::found_in_steps(&arguments.run)?);
    }
    create_folder(out)?;
    let law = LengthLaw::natural(&data.scenario);
    let files = FileSet::new(Existing::Refuse, Inputs::of([&arguments.run]));
    let both_ways = data.plan.drive.pulls_both_ways();
    let mut loads = LoadTable::begin(&files, out, "load", both_ways).map_err(not_written)?;
    let mut written = Ok(());
    let summary = summary::of_log_seen(&arguments.run, &checked, &mut |record| {
        if written.is_ok() {
            written = loads.push(record);
        }
    })?;
    written.and_then(|()| loads.finish()).map_err(not_written)?;
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
            write(tables::RUPTURES, tables::ruptures(&data, &summary)?)?;
            write(tables::PRECURSOR_RUPTURES, tables::precursor_ruptures(&data, &summary, &[(law, rules)])?)?;
        }
        table_file::write(&files, out, "events", &mut tables::events(&data)?)?;
        table_file::write(&files, out, "precursors", &mut tables::precursors(&data, law, &rules)?)?;
        let residuals = ResidualRow::of(&data, law, &rules);
        table_file::write(&files, out, "residuals", &mut tables::residual_table(&[residuals])?)?;
        summaries::write_table(&files, &out.join(summaries::TABLE), [&summary])?;
        summaries::write_json(&files, &out.join(summaries::JSON), &summary)?;
        let of_ruptures = [tables::RUPTURES, tables::PRECURSOR_RUPTURES];
        let tables = of_ruptures.into_iter().filter(|_| data.ruptures.is_some());
        let tables = tables
            .chain(["events", "load", "precursors", "residuals"])
            .flat_map(|name| table_file::paths(out, name));
        let tables = tables.chain([summaries::TABLE, summaries::JSON].map(|name| out.join(name)));
        let figures = figures::overview_files(out);
        record::write(&files, out, "reduce", [(name.as_str(), &data.header)], tables.chain(figures))?;
        figures::draw_overview(&data, !arguments.no_provenance, &files, out)?;
        Ok(files.publish()?)
    };
    write().map_err(not_written)?;
    say(out.display())?;
    summary::tell(arguments.run.display(), &summary, board);
    judge::tell(&arguments.run, &checked, board)
}

/// Why tables and figures were not written: bad input, if another folder would do.
fn not_written(error: AnalysisError) -> Failure {
    match error {
        AnalysisError::File(error) => refused("--out", &error, false),
        error => Failure::failed(error),
    }
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
    let solver = SolverKind::from(arguments.solver);
    let inputs = inputs(arguments, &pipeline, &jobs);
    create_folder(&arguments.out)?;
    let _lock = FolderLock::take(&arguments.out).map_err(|error| refused("--out", &error, false))?;
    for job in &jobs {
        job.check_place(&runs_folder, solver, arguments.fresh)
            .map_err(|error| Failure::BadInput(format!("--out: {error}")))?;
    }
    let logs = jobs.iter().map(|job| job.log(&runs_folder));
    for path in logs.chain(pipeline.outputs(&arguments.out)) {
        inputs.check(&path).map_err(|error| refused("--out", &error, false))?;
    }
    create_folder(&runs_folder)?;
    interrupt::install()?;
    let stored = at_once(&jobs, arguments.jobs, |job| {
        Ok::<_, Failure>(if arguments.fresh { Stored::Nothing } else { job.stored(&runs_folder, solver) })
    })?;
    let mut missing = Vec::new();
    for (job, stored) in jobs.into_iter().zip(&stored) {
        match stored {
            Stored::Whole => continue,
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
    let provenance = !arguments.no_provenance;
    let reduction = Reduction::begin(&pipeline, &arguments.out, inputs, provenance).map_err(not_written)?;
    let stages = board.stages("reduction");
    let done = AtomicUsize::new(0);
    let runs = pipeline.run.len();
    stages.reached("runs", 0, runs);
    at_once(&pipeline.run, arguments.jobs, |spec| {
        let log = runs_folder.join(format!("{}.mcap", spec.name));
        reduce_log(&reduction, &spec.name, &log)?;
        stages.reached("runs", done.fetch_add(1, Ordering::Relaxed) + 1, runs);
        Ok::<(), Failure>(())
    })?;
    let mut tell = |Progress { done, of }: Progress| stages.reached("tables", done, of);
    let summaries = reduction.finish(&mut tell).map_err(not_written)?;
    drop(stages);
    tell_misleading(&summaries, board);
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

/// What a pipeline is read from: its own file, and those that its scenarios stand in.
fn inputs(arguments: &ReproduceArguments, pipeline: &Pipeline, jobs: &[Job]) -> Inputs {
    let mut inputs = Inputs::of([&arguments.pipeline]);
    inputs.add(pipeline.run.iter().map(|run| Path::new(&run.scenario)).filter(|path| path.is_file()));
    let profiles = jobs.iter().map(|job| Path::new(&job.scenario.initial_shear.profile_csv));
    inputs.add(profiles.filter(|path| path.is_file()));
    inputs
}

/// Hands a run to a reduction, out of its log, which is read once.
fn reduce_log(reduction: &Reduction<'_>, name: &str, log: &Path) -> Result<(), Failure> {
    let failed = |error: LogError| Failure::failed(error);
    let mut reader = RunReader::open(log, reduction.wants(name).topics()).map_err(failed)?;
    let mut passing = reduction.passing_log(name, log, &reader).map_err(not_written)?;
    let mut summarizer = Summarizer::new(name, reader.header(), summary::slider(passing.scenario()));
    while let Some(item) = reader.next_item().map_err(failed)? {
        passing.item(&item).map_err(not_written)?;
        match &item {
            LogItem::Record(Record::Step(record)) => summarizer.record(record),
            LogItem::Record(_) => {}
            LogItem::Event(event) => {
                let problem = |error| {
                    let log = log.display();
                    Failure::failed(format!("{log}: an event of {} cannot be read: {error}", event.topic))
                };
                summarizer.event(event).map_err(problem)?;
            }
        }
    }
    let has_ruptures = reader.event_topics().any(|topic| topic == Rupture::TOPIC);
    let ruptures_from = if has_ruptures { RupturesFrom::Log } else { RupturesFrom::None };
    let summary = summarizer.finish(ruptures_from, reader.end());
    reduction.passed(passing, has_ruptures, summary).map_err(not_written)
}

/// Says of which runs raw slip events do not tell what happened: their claims and figures stand on
/// these.
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
