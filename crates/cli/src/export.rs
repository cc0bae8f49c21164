//! `asperity export`: writes logs as tables for data frames.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, Inputs};
use asperity_record::{counted, short_time};
use asperity_run::detectors::event_kinds;
use asperity_run::{Checked, NodeState, Nodes, StatesError, Unchecked, Verdict};
use asperity_tables::format::{Format, State};
use asperity_tables::run_tables::{Chosen, MOST_FOREIGN};
use asperity_tables::{Csv, Export, ExportError, Ndjson, NodeRows, Ran, Report, Request, name_of};

use crate::args::{ExportArguments, ExportFormat};
use crate::exit::{self, Code, Failure};
use crate::outputs::{A_FOLDER, fits, refused};
use crate::progress::Board;
use crate::summary::WITHOUT_ENERGIES;
use crate::terminal;
use crate::verdict_exit;

pub(crate) fn command(arguments: &ExportArguments, board: &Board) -> Result<(), Failure> {
    fits("--out", &arguments.out, "", A_FOLDER)?;
    let requests = requests(arguments)?;
    let exported = exit::each_of(&requests, arguments.jobs, |(run, request)| {
        export_one(run, request, arguments, board)
    })?;
    Code::worst(exported.into_iter().filter_map(Result::err)).said()
}

/// The request for each run; their files must have different names.
fn requests(arguments: &ExportArguments) -> Result<Vec<(PathBuf, Request)>, Failure> {
    let mut names: BTreeMap<String, &PathBuf> = BTreeMap::new();
    let mut requests = Vec::new();
    let inputs = Inputs::of(&arguments.runs);
    for run in &arguments.runs {
        let name = name_of(run);
        if let Some(other) = names.insert(name.clone(), run) {
            return Err(Failure::BadInput(format!(
                "{} and {} would both be exported as {name} (accepted: runs of different names)",
                other.display(),
                run.display()
            )));
        }
        let is_node_topic = |topic: &String| topic == "/nodes";
        if arguments.nodes_at_s.is_empty() && arguments.topic.iter().any(is_node_topic) {
            return Err(Failure::BadInput(
                "--topic /nodes: no log has it, and no time is given (accepted: with --nodes-at-s)"
                    .to_owned(),
            ));
        }
        let request = Request {
            chosen: Chosen {
                topics: arguments.topic.clone(),
                nodes: !arguments.nodes_at_s.is_empty(),
                from_s: arguments.from_s,
                to_s: arguments.to_s,
            },
            out: arguments.out.clone(),
            name,
            existing: if arguments.force { Existing::Replace } else { Existing::Refuse },
            inputs: inputs.clone(),
        };
        requests.push((run.clone(), request));
    }
    Ok(requests)
}

fn export_one(
    run: &Path,
    request: &Request,
    arguments: &ExportArguments,
    board: &Board,
) -> Result<(), Failure> {
    let format: &dyn Format = match arguments.to {
        #[cfg(feature = "analysis")]
        ExportFormat::Parquet => &asperity_tables::parquet_tables::Parquet,
        ExportFormat::Csv => &Csv,
        ExportFormat::Ndjson => &Ndjson,
    };
    let log = Unchecked::open(run).map_err(|checked| match checked.verdict {
        verdict if verdict == Verdict::NoRunLog || arguments.nodes_at_s.is_empty() => {
            verdict_exit::failure(run, &checked)
        }
        verdict => Failure::Log(
            verdict,
            format!("--nodes-at-s: {}: no state can be read; the log is {checked}", run.display()),
        ),
    })?;
    let (header, scenario_toml, schemas) = (log.header(), log.scenario_toml(), log.event_schemas());
    let export =
        Export::begin(header, scenario_toml, &schemas, request.clone(), &event_kinds(header.parts()), format)
            .map_err(failure)?;
    let duration_s = header.time_grid().time_s(header.steps);
    let mut exporting = (export, board.steps(&request.name, header.steps, duration_s));
    let checked = log.check(&mut exporting);
    let (mut export, progress) = exporting;
    progress.clear();
    if checked.verdict == Verdict::NoRunLog {
        return Err(verdict_exit::failure(run, &checked));
    }
    // Nodes are computed from checkpoints, which only a reading of its own finds, up to the last sound
    // step, which only the check knows.
    let mut nodes = match &arguments.nodes_at_s[..] {
        [] => None,
        at_s => Some(Nodes::of_log(run, checked.seen.last_step, at_s).map_err(without_nodes(run, &checked))?),
    };
    while let Some(state) =
        nodes.as_mut().map(Nodes::next_state).transpose().map_err(without_nodes(run, &checked))?.flatten()
    {
        let NodeState { step, time_s, columns, displacement_m, velocity_m_per_s } = &state;
        let rows =
            NodeRows { step: *step, time_s: *time_s, columns: *columns, displacement_m, velocity_m_per_s };
        export.nodes(&rows).map_err(failure)?;
    }
    let problem = checked.problem.as_ref().map(ToString::to_string);
    let Report { files, ran, left_out, without_energies } =
        export.finish(state(checked.verdict), problem).map_err(failure)?;
    for (path, rows) in files {
        match rows {
            Some(rows) => terminal::say(format_args!("{}: {}", path.display(), counted(rows, "row")))?,
            None => terminal::say(format_args!("{}: what the others hold", path.display()))?,
        }
    }
    if without_energies {
        board.line(&format!("{}: {WITHOUT_ENERGIES}", run.display()));
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
        Ran { problem: Some(problem), last_step, last_s, state } => {
            // The export detects damage that the check accepts, such as a column that comes and goes.
            let verdict = if state == State::Damaged { Verdict::Damaged } else { checked.verdict };
            Err(Failure::Log(
                verdict,
                format!(
                    "{}: {verdict}: exported up to step {last_step} ({} s), {}: {problem}",
                    run.display(),
                    short_time(last_s),
                    match verdict {
                        Verdict::Damaged => "where the log is damaged",
                        Verdict::Salvaged => "with gaps",
                        Verdict::Stopped => "where its run was stopped",
                        _ => "where the log ends",
                    }
                ),
            ))
        }
        Ran { problem: None, .. } => verdict_exit::finish(run, &checked, board),
    }
}

/// Converts an error about nodes; adds the verdict if the log is not complete.
fn without_nodes<'a>(run: &'a Path, checked: &'a Checked) -> impl Fn(StatesError) -> Failure + 'a {
    move |error| {
        let said = format!("--nodes-at-s: {}: {error}", run.display());
        match error {
            StatesError::Outside { .. } | StatesError::Log(_) if !checked.verdict.holds_all() => {
                Failure::Log(checked.verdict, format!("{said}; the log is {checked}"))
            }
            StatesError::Log(_) | StatesError::Stopped(_) => Failure::failed(said),
            _ => Failure::BadInput(said),
        }
    }
}

/// The verdict on the log, for the record beside its tables.
fn state(verdict: Verdict) -> State {
    match verdict {
        Verdict::Whole => State::Whole,
        Verdict::OtherCode => State::OtherCode,
        Verdict::Incomplete => State::Incomplete,
        Verdict::Stopped => State::Stopped,
        Verdict::Salvaged => State::Salvaged,
        Verdict::NoRunLog | Verdict::Damaged => State::Damaged,
    }
}

fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::Choice(_) => Failure::bad_input(error),
        ExportError::File(error) => refused("--out", &error, true),
        ExportError::Write { .. } => Failure::failed(error),
    }
}
