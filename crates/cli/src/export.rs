//! `asperity export`: what a log holds as files that data frames read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_export::export::MOST_FOREIGN;
use asperity_export::format::{Format, State};
use asperity_export::{Csv, Export, ExportError, Ndjson, Ran, Report, Request, name_of};

use crate::args::{ExportArguments, ExportFormat};
use crate::exit::{self, Code, Failure};
use crate::progress::Board;
use crate::terminal;
use asperity_run::detectors::event_kinds;

pub(crate) fn command(arguments: &ExportArguments, board: &Board) -> Result<(), Failure> {
    let requests = requests(arguments)?;
    std::fs::create_dir_all(&arguments.out)
        .map_err(|error| Failure::Failed(format!("failed to create {}: {error}", arguments.out.display())))?;
    let exported = exit::each_of(&requests, arguments.jobs, |(run, request)| {
        export_one(run, request, arguments.to, board)
    })?;
    if exported.contains(&None) { Err(Failure::Said(Code::Failed)) } else { Ok(()) }
}

/// What is asked for of each run; their files must not get in each other's way.
fn requests(arguments: &ExportArguments) -> Result<Vec<(PathBuf, Request)>, Failure> {
    let mut names: BTreeMap<String, &PathBuf> = BTreeMap::new();
    let mut requests = Vec::new();
    for run in &arguments.runs {
        let name = name_of(run);
        if let Some(other) = names.insert(name.clone(), run) {
            return Err(Failure::BadInput(format!(
                "{} and {} would both be exported as {name} (accepted: runs of different names)",
                other.display(),
                run.display()
            )));
        }
        let request = Request {
            topics: arguments.topic.clone(),
            from_s: arguments.from_s,
            to_s: arguments.to_s,
            out: arguments.out.clone(),
            name,
            replace: arguments.force,
        };
        requests.push((run.clone(), request));
    }
    Ok(requests)
}

fn export_one(run: &Path, request: &Request, to: ExportFormat, board: &Board) -> Result<(), Failure> {
    let format: &dyn Format = match to {
        #[cfg(feature = "analysis")]
        ExportFormat::Parquet => &asperity_analysis::parquet_tables::Parquet,
        ExportFormat::Csv => &Csv,
        ExportFormat::Ndjson => &Ndjson,
    };
    let export = Export::open(run, request.clone(), &event_kinds(), format).map_err(failure)?;
    let header = export.header();
    let duration_s = header.time_grid().time_s(header.steps);
    let mut progress = board.steps(&request.name, header.steps, duration_s);
    let outcome = export.run(|step| progress.advance(step));
    progress.clear();
    let Report { files, ran, left_out } = outcome.map_err(failure)?;
    for (path, rows) in files {
        match rows {
            Some(rows) => terminal::say(format_args!("{}: {rows} rows", path.display()))?,
            None => terminal::say(format_args!("{}: what the others hold", path.display()))?,
        }
    }
    for (topic, count) in left_out {
        board.line(&format!(
            "warning: {}: {count} events of {topic} are left out: this program has no detector for them, and \
             no table can be made of them (accepted: a topic in small plain letters, the schema of a flat \
             object of numbers and flags, {MOST_FOREIGN} such topics at most)",
            run.display()
        ));
    }
    match ran {
        Ran { problem: None, .. } => Ok(()),
        Ran { problem: Some(problem), state, last_step, last_s } => Err(Failure::Failed(format!(
            "{}: exported up to step {last_step} ({last_s} s), {}: {problem}",
            run.display(),
            match state {
                State::Whole | State::Incomplete => "where the log ends",
                State::Salvaged => "with gaps",
                State::Damaged => "where the log is damaged",
            }
        ))),
    }
}

fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::UnknownTopic { .. } | ExportError::EmptyRange { .. } => Failure::bad_input(error),
        ExportError::Exists(_) => Failure::BadInput(format!(
            "{error}; nothing of this run was written (accepted: another folder, or --force)"
        )),
        ExportError::Log(_) | ExportError::Write { .. } => Failure::failed(error),
    }
}
