//! `asperity export`: writes logs as tables for data frames.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileSet, Inputs};
use asperity_numbers::curve::NamedCurves;
use asperity_numbers::run_data::Collector;
use asperity_record::{Observer, counted, short_time};
use asperity_run::detectors::event_kinds;
use asperity_run::{Checked, NodeState, Nodes, OpenLog, StatesError, Verdict};
use asperity_tables::format::DAMAGED;
use asperity_tables::run_tables::{Chosen, MOST_FOREIGN};
use asperity_tables::seas::Seas;
use asperity_tables::table_files::TableFiles;
use asperity_tables::vtk::{Array, Image, pvd};
use asperity_tables::{Export, ExportError, Format, Ran, Report, Request, name_of};
use clap::{Args, ValueEnum};

use crate::exit::{self, Code, Failure};
use crate::outputs::{A_FOLDER, fits, refused};
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::{terminal, verdict_exit};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// Columns with types and units, compressed.
    Parquet,
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
    /// One JSON object per row, each on its own line.
    Ndjson,
    /// All nodes and all contacts at the times of --nodes-at-s, for ParaView and VTK.
    Vtk,
    /// The series of a run as solved (recording.series_every), as text of the SEAS benchmarks.
    Seas,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity export out/mine.mcap --to parquet -o out/tables
  asperity export out/mine.mcap --to csv --topic /step -o out/tables
  asperity export out/mine.mcap --to ndjson --from-s 0.5 --to-s 0.6 -o out/part
  asperity export out/mine.mcap --curve forces --to csv -o out/tables
  asperity export out/chapter5/runs/*.mcap --to parquet -o out/tables
  asperity export out/slab.mcap --to csv --nodes-at-s 0.2 -o out/nodes
  asperity export out/body.mcap --to vtk --nodes-at-s 0.2 -o out/images
  asperity export out/spring.mcap --to seas -o out/seas

Writes one file per topic (NAME.step.parquet for /step of NAME.mcap), and
NAME.FORMAT.export.json with the header and scenario of the run, the columns
with their units, and the number of rows of each file. Tables are long: states
of all blocks (/fields, /window) have one row per block. The whole log is read
and checked, even if only a part is exported. No log contains all nodes of a
slab, a sheet or a body: they are computed by repeating steps of the run, which
takes the version of the program that made the log.

--to vtk writes images instead of tables: for each time of --nodes-at-s,
NAME.nodes.STEP.vti of all nodes and NAME.contacts.STEP.vti of the contacts.
NAME.nodes.pvd and NAME.contacts.pvd list them with their times; ParaView opens
these.

--to seas writes global.txt, and fltst_bNNN.txt of each block of
recording.series_blocks.")]
pub(crate) struct ExportArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// The format of the files.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) to: ExportFormat,
    /// Folder for the files.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Only this topic. May be repeated [default: all].
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Vec<String>,
    /// Only what happened at this time or later; events count by their onset.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) from_s: Option<f64>,
    /// Only what happened before this time.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) to_s: Option<f64>,
    /// Instead of topics, these curves of the run, as NAME.curve.CURVE (asperity figures lists them).
    #[arg(long, value_name = "CURVE", conflicts_with_all = ["topic", "from_s", "to_s", "nodes_at_s"])]
    pub(crate) curve: Option<String>,
    /// A key of the curves, such as blocks=5. May be repeated.
    #[arg(long, value_name = "KEY=VALUE", requires = "curve")]
    pub(crate) set: Vec<String>,
    /// Also export all nodes of a slab, a sheet or a body at this time, as NAME.nodes. May be repeated.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) nodes_at_s: Vec<f64>,
    /// Replace existing files.
    #[arg(long)]
    pub(crate) force: bool,
    /// How many runs to export at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

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
        let files = if arguments.to == ExportFormat::Seas { "global.txt" } else { &name };
        if let Some(other) = names.insert(files.to_owned(), run) {
            return Err(Failure::BadInput(format!(
                "{} and {} would both be exported as {files} (accepted: runs of different names, or one)",
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
        of_whole_run(arguments)?;
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

/// Refuses what has no meaning for states of all nodes, or for series.
fn of_whole_run(arguments: &ExportArguments) -> Result<(), Failure> {
    let ExportArguments { to, topic, from_s, to_s, nodes_at_s, .. } = arguments;
    let (to, accepted) = match to {
        ExportFormat::Vtk => ("vtk", "--nodes-at-s SECONDS, once or more"),
        ExportFormat::Seas => ("seas", "all series of a run"),
        _ => return Ok(()),
    };
    let refuse =
        |problem: &str| Err(Failure::BadInput(format!("--to {to}: {problem} (accepted: {accepted})")));
    if to == "vtk" && nodes_at_s.is_empty() {
        return refuse("no time is given");
    }
    let rows = [("--topic", !topic.is_empty()), ("--from-s", from_s.is_some()), ("--to-s", to_s.is_some())];
    let of_nodes = ("--nodes-at-s", to == "seas" && !nodes_at_s.is_empty());
    match rows.into_iter().chain([of_nodes]).find(|(_, is_given)| *is_given) {
        Some((option, _)) => refuse(&format!("{option} chooses rows of tables, and it writes none")),
        None => Ok(()),
    }
}

fn export_one(
    run: &Path,
    request: &Request,
    arguments: &ExportArguments,
    board: &Board,
) -> Result<(), Failure> {
    let format = match arguments.to {
        ExportFormat::Parquet => Some(Format::Parquet),
        ExportFormat::Csv => Some(Format::Csv),
        ExportFormat::Ndjson => Some(Format::Ndjson),
        ExportFormat::Vtk | ExportFormat::Seas => None,
    };
    if let Some(curve) = &arguments.curve {
        return curves(run, request, (curve, &arguments.set), format, board);
    }
    let log = OpenLog::open(run).map_err(|checked| match checked.verdict {
        verdict if verdict.tells_nothing() || arguments.nodes_at_s.is_empty() => {
            verdict_exit::failure(run, &checked)
        }
        verdict => Failure::Log(
            verdict,
            format!("--nodes-at-s: {}: no state can be read; the log is {checked}", run.display()),
        ),
    })?;
    if arguments.to == ExportFormat::Seas {
        return seas(log, run, request, board);
    }
    let Some(format) = format else { return vtk(log, run, request, arguments, board) };
    let (header, scenario_toml, schemas) = (log.header(), log.scenario_toml(), log.event_schemas());
    let export =
        Export::begin(header, scenario_toml, &schemas, request.clone(), &event_kinds(header.parts()), format)
            .map_err(failure)?;
    let (checked, mut export) = read(log, run, export, board)?;
    if !arguments.nodes_at_s.is_empty() {
        for state in nodes(run, &checked, arguments)? {
            export.nodes(&state.map_err(without_nodes(run, &checked))?).map_err(failure)?;
        }
    }
    let problem = checked.problem.as_ref().map(ToString::to_string);
    let Report { files, ran, left_out } = export.finish(checked.verdict.word(), problem).map_err(failure)?;
    for (path, rows) in files {
        match rows {
            Some(rows) => terminal::say(format_args!("{}: {}", path.display(), counted(rows, "row")))?,
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
        Ran { problem: Some(problem), last_step, last_s, state } => {
            // The export detects damage that the check accepts, such as a column that comes and goes.
            let verdict = if state == DAMAGED { Verdict::Damaged } else { checked.verdict };
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

/// Writes the table of curves of a name, with these keys.
fn curves(
    run: &Path,
    request: &Request,
    (name, set): (&str, &[String]),
    format: Option<Format>,
    board: &Board,
) -> Result<(), Failure> {
    let bad = |problem: String| Failure::BadInput(format!("--curve {problem}"));
    let named = NamedCurves::find(name).map_err(bad)?;
    let keys = named.keys_of(set).map_err(|problem| Failure::BadInput(format!("--set {problem}")))?;
    let format = format
        .ok_or_else(|| bad(format!("{name}: it is a table (accepted: --to csv, ndjson or parquet)")))?;
    let begin = |log: &OpenLog| {
        Collector::of_log(&request.name, log.header(), log.needed_scenario()?, named.required_data(&keys))
    };
    let accept = |checked: &Checked| verdict_exit::must_be_sound(run, checked);
    let Reading { checked, observer, has_ruptures } = reading::once(run, &[], begin, accept)?;
    let data = observer.finish(has_ruptures, checked.seen.end.as_ref());
    let curves = named.of(&data, &keys).map_err(Failure::failed)?;
    let mut table = asperity_tables::curves::table(named, &curves);
    let name = format!("{}.{}", request.name, table.file_part());
    let rows = table.rows() as u64;
    let files = FileSet::new(request.existing, request.inputs.clone());
    let across = [("asperity:x".to_owned(), named.across(&data, &keys).to_owned())];
    let written = TableFiles::begin(&files, &request.out, &name, &[format], &table)
        .and_then(|writing| writing.finish(&mut table, &across));
    let paths = written.map_err(|error| failure(error.into()))?;
    files.publish().map_err(|error| refused("--out", &error, true))?;
    terminal::say(format_args!("{}: {}", paths[0].display(), counted(rows, "row")))?;
    verdict_exit::finish(run, &checked, board)
}

/// Writes an image of all nodes and one of all contacts for each time, and their collections.
fn vtk(
    log: OpenLog,
    run: &Path,
    request: &Request,
    arguments: &ExportArguments,
    board: &Board,
) -> Result<(), Failure> {
    // A collection, which is XML, names the files.
    if run.to_str().is_none() || request.name.contains(char::is_control) {
        return Err(Failure::BadInput(format!(
            "--to vtk: {:?} (accepted: a name in UTF-8 without control characters)",
            run.file_name().unwrap_or_default()
        )));
    }
    let (checked, ()) = read(log, run, (), board)?;
    let nodes = nodes(run, &checked, arguments)?;
    let parts = ["nodes", "contacts"];
    let name = |part: &str, rest: &str| format!("{}.{part}.{rest}", request.name);
    let files = FileSet::new(request.existing, request.inputs.clone());
    let refuse = |error| refused("--out", &error, true);
    let steps = nodes.steps();
    let of_steps = parts.iter().flat_map(|part| steps.iter().map(|step| name(part, &format!("{step}.vti"))));
    let collections = parts.iter().map(|part| name(part, "pvd"));
    let all: Vec<PathBuf> = of_steps.chain(collections).map(|file| request.out.join(file)).collect();
    files.reserve(&all).map_err(refuse)?;
    let write = |file: &str, text: String| files.write(&request.out.join(file), text).map_err(refuse);
    let mut listed: [Vec<(f64, String)>; 2] = Default::default();
    for state in nodes {
        let state = state.map_err(without_nodes(run, &checked))?;
        for ((part, image), listed) in parts.iter().zip(images(&state)).zip(&mut listed) {
            let file = name(part, &format!("{}.vti", state.step));
            write(&file, image)?;
            listed.push((state.time_s, file));
        }
    }
    for (part, listed) in parts.iter().zip(&listed) {
        write(&name(part, "pvd"), pvd(listed.iter().map(|(time_s, file)| (*time_s, file.as_str()))))?;
    }
    files.publish().map_err(refuse)?;
    for file in all {
        terminal::say(file.display())?;
    }
    verdict_exit::finish(run, &checked, board)
}

/// Writes the series of the slider and of its chosen blocks.
fn seas(log: OpenLog, run: &Path, request: &Request, board: &Board) -> Result<(), Failure> {
    let scenario = log.scenario().ok().flatten().filter(|_| log.header().flags.series).ok_or_else(|| {
        let accepted = "a run with recording.series_every above 0";
        Failure::BadInput(format!("--to seas: {} has no series (accepted: {accepted})", run.display()))
    })?;
    let files = FileSet::new(request.existing, request.inputs.clone());
    let refuse = |error| refused("--out", &error, true);
    let seas = Seas::begin(log.header(), scenario, &files, &request.out).map_err(refuse)?;
    let (checked, seas) = read(log, run, seas, board)?;
    let paths = seas.finish(&files).map_err(refuse)?;
    files.publish().map_err(refuse)?;
    paths.iter().try_for_each(|path| terminal::say(path.display()))?;
    verdict_exit::finish(run, &checked, board)
}

/// Reads a log with an observer, and shows the progress.
fn read<O: Observer>(log: OpenLog, run: &Path, of: O, board: &Board) -> Result<(Checked, O), Failure> {
    let (steps, grid) = (log.header().steps, log.header().time_grid());
    let mut both = (of, board.steps(&name_of(run), steps, grid.time_s(steps)));
    let checked = log.check(&mut both);
    let failure = checked.verdict.tells_nothing().then(|| verdict_exit::failure(run, &checked));
    failure.map_or(Ok((checked, both.0)), Err)
}

/// The images of all nodes, and of all contacts.
fn images(state: &NodeState) -> [String; 2] {
    let NodeState { time_s, lattice, spacing_m, displacement_m, velocity_m_per_s, .. } = state;
    let (axes, nodes, contacts) = (lattice.table.axes, lattice.nodes(), lattice.contacts());
    let counts = [lattice.columns, lattice.lanes, lattice.rows];
    let image = |counts, arrays| Image { counts, spacing_m: *spacing_m, time_s: *time_s, arrays }.vti();
    let of_nodes = image(
        counts,
        vec![
            Array::vectors("displacement_m", axes, displacement_m),
            Array::vectors("velocity_m_per_s", axes, velocity_m_per_s),
        ],
    );
    // The first nodes are the contacts.
    let bottom = |values: &[f64]| -> Vec<f64> {
        values.chunks(nodes).flat_map(|along| &along[..contacts]).copied().collect()
    };
    let (displacement_m, velocity_m_per_s) = (bottom(displacement_m), bottom(velocity_m_per_s));
    let tangential = &axes[..state.tangential_force_n.len() / contacts];
    let of_contacts = image(
        [counts[0], counts[1], 1],
        vec![
            Array::vectors("displacement_m", axes, &displacement_m),
            Array::vectors("velocity_m_per_s", axes, &velocity_m_per_s),
            Array::vectors("tangential_force_n", tangential, &state.tangential_force_n),
            Array::of("normal_load_n", &state.normal_load_n),
            Array::of("slides", &state.slides),
        ],
    );
    [of_nodes, of_contacts]
}

/// The nodes of a log at the times asked for. They are computed from checkpoints, which only a reading of its own finds, up
/// to the last sound step, which only the check knows.
fn nodes(run: &Path, checked: &Checked, arguments: &ExportArguments) -> Result<Nodes, Failure> {
    let nodes = Nodes::of_log(run, checked.seen.last_step, &arguments.nodes_at_s);
    nodes.and_then(Nodes::of_lattice).map_err(without_nodes(run, checked))
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

fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::Choice(_) => Failure::bad_input(error),
        ExportError::File(error) => refused("--out", &error, true),
    }
}
