//! `asperity draw`: figures of one run.

use std::path::{Path, PathBuf};

use asperity_figures::draw::FigureError;
use asperity_figures::draw::of_one_run::{Kind, OneFigure, Target};
use asperity_files::{Existing, FileSet, Inputs, format_of};
use asperity_model::among;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::Collector;
use asperity_record::Parts;
use asperity_run::{Checked, Nodes, OpenLog};
use asperity_study::Watcher;
use clap::Args;

use crate::exit::Failure;
use crate::outputs::refused;
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::terminal::say;
use crate::{summary, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity draw out/mine.mcap
  asperity draw out/mine.mcap --kind lengths,stress -o out/pictures
  asperity draw out/mine.mcap --kind space-time --set which=longest-precursor

Draws only figures; asperity reduce also makes tables, and asperity reproduce
draws figures that compare runs. Without --kind, a kind for which the run has no
data is left out, with a note; if --kind names such a kind, the command fails
and writes nothing. asperity figures explains
the kinds and their keys.")]
pub(crate) struct DrawArguments {
    /// The run log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// The kinds of figures [default: overview, lengths, space-time, front-profile,
    /// stress-sequence; of recordings load, lengths, space-time, traces, noise].
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(crate) kind: Vec<String>,
    /// Set a key of the figure; needs a single --kind. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder for KIND.png, KIND.svg and KIND.pdf; or a single file with one of these endings
    /// [default: RUN.figures, beside the log].
    #[arg(short, long, value_name = "FOLDER|FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Replace existing figures.
    #[arg(long)]
    pub(crate) force: bool,
    /// Draw figures without the code version and without the line that names
    /// their source: for print, and for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

pub(crate) fn command(arguments: &DrawArguments, board: &Board) -> Result<(), Failure> {
    let DrawArguments { run, kind: named, set, out, no_provenance, force } = arguments;
    let mut kinds = kinds(named)?;
    match (&kinds[..], set.first()) {
        ([kind], _) => kind.check(set).map_err(|error| Failure::BadInput(format!("--set {error}")))?,
        (_, Some(set)) => {
            return Err(Failure::BadInput(format!(
                "--set {set}: several kinds are drawn, each with keys of its own (accepted: --set with one --kind)"
            )));
        }
        _ => {}
    }
    let target = target(run, out.as_deref(), &kinds)?;
    let existing = if *force { Existing::Replace } else { Existing::Refuse };
    let files = FileSet::new(existing, Inputs::of([run]));
    let not_written = |error| refused("--out", &error, true);
    if let Target::Folder(folder) = &target {
        files.folder(folder).map_err(not_written)?;
    }
    let paths: Vec<PathBuf> = kinds.iter().flat_map(|kind| target.files(*kind)).collect();
    files.reserve(paths).map_err(not_written)?;

    let name = summary::name(run);
    let mut figures: Vec<OneFigure> = Vec::new();
    let begin = |log: &OpenLog| {
        let nothing = RequiredData::NOTHING;
        let (header, scenario) = (log.header(), log.shown_scenario()?);
        if named.is_empty() {
            kinds = Kind::usual(header.parts()).collect();
        }
        figures = kinds
            .iter()
            .map(|kind| kind.of_run(&name, header, &scenario, set))
            .collect::<Result<_, String>>()?;
        let required = figures.iter().fold(nothing, |required, figure| required | figure.required_data());
        Collector::of_log(&name, header, &scenario, required)
    };
    let accept = |checked: &Checked| verdict_exit::must_be_sound(run, checked);
    let Reading { checked, observer: mut collector, has_ruptures } = reading::once(run, &[], begin, accept)?;
    let without_nodes = add_nodes(run, &checked, &mut collector).err();
    if collector.wants_traces() {
        reading::once(run, &["/traces"], |_| Ok(&mut collector), |_| Ok(()))?;
    }
    let data = collector.finish(has_ruptures, checked.seen.end.as_ref());
    let mut drawn: Vec<PathBuf> = Vec::new();
    let mut lacking = Vec::new();
    for (done, figure) in figures.iter().enumerate() {
        board.reached("figures", done, figures.len());
        match figure.draw(&data, !no_provenance, &files, &target) {
            Ok(()) => drawn.extend(target.files(figure.kind)),
            Err(FigureError::File(error)) => return Err(not_written(error)),
            // This run may lack data that most runs have.
            Err(error) if named.is_empty() => lacking.push(error),
            Err(error) => return Err(Failure::failed(without_nodes.unwrap_or_else(|| error.to_string()))),
        }
    }
    board.reached("figures", figures.len(), figures.len());
    lacking.iter().for_each(|error| board.line(&format!("{}: not drawn: {error}", run.display())));
    without_nodes.iter().for_each(|error| board.line(&format!("no states are computed: {error}")));
    files.publish().map_err(not_written)?;
    drawn.iter().try_for_each(|path| say(path.display()))?;
    verdict_exit::finish(run, &checked, board)
}

/// The kinds of these names, or the usual ones of any log.
fn kinds(named: &[String]) -> Result<Vec<Kind>, Failure> {
    let found = |name: &String| {
        Kind::find(name).ok_or_else(|| {
            let known: Vec<&str> = Kind::all().map(|kind| kind.name).collect();
            let among = among(name, &known, "`asperity figures`");
            Failure::BadInput(format!("--kind {name} is no kind of figure{among}"))
        })
    };
    let usual = [Parts::default(), Parts::ALL].into_iter().flat_map(Kind::usual);
    let usual = usual.filter(|_| named.is_empty()).map(Ok);
    let mut kinds: Vec<Kind> = Vec::new();
    for kind in named.iter().map(found).chain(usual) {
        let kind = kind?;
        kinds.extend((!kinds.contains(&kind)).then_some(kind));
    }
    Ok(kinds)
}

/// Where the figures go: by default a folder beside the log, named after it.
fn target(run: &Path, out: Option<&Path>, kinds: &[Kind]) -> Result<Target, Failure> {
    let Some(out) = out else { return Ok(Target::Folder(run.with_extension("figures"))) };
    let target = Target::of(out);
    match &target {
        Target::File(_) if kinds.len() > 1 => Err(Failure::BadInput(format!(
            "--out {} is one file, and several kinds are drawn (accepted: a folder, or one --kind)",
            out.display()
        ))),
        Target::Folder(folder) if !folder.is_dir() && format_of(folder).is_some() => {
            Err(Failure::BadInput(format!(
                "--out {}: figures are not written in this format (accepted: a name that ends in .png, .svg or .pdf, \
                 or a folder)",
                folder.display()
            )))
        }
        _ => Ok(target),
    }
}

/// Adds all nodes of a lattice at the times that figures show: no log has them, and they are computed again.
///
/// # Errors
/// In words, why they are not. Whether a figure can be drawn without them it says itself.
fn add_nodes(run: &Path, checked: &Checked, collector: &mut Collector) -> Result<(), String> {
    let at_s = collector.nodes_at_s();
    if at_s.is_empty() {
        return Ok(());
    }
    let failed = |error| format!("{}: {error}", run.display());
    for state in Nodes::of_log(run, checked.seen.last_step, &at_s).map_err(failed)? {
        collector.nodes(state.map_err(failed)?);
    }
    Ok(())
}
