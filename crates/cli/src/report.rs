//! `asperity report`: runs, a study or several as a page.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use asperity_diff::side_by_side::embedded;
use asperity_figures::draw::of_one_run::{Kind, OneFigure};
use asperity_files::{Existing, FileSet, Inputs, at_once};
use asperity_model::scenario::text;
use asperity_numbers::claim::Claim;
use asperity_numbers::precursors::PrecursorRules;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Collector, RunData, RunEvents};
use asperity_report::{
    Contents, Entry, Figure, Limits, Link, PageCollector, Recorded, Run, Study, encoded, files_of_picture,
    index,
};
use asperity_run::{Checked, OpenLog};
use asperity_study::given::{Given, RECORD};
use asperity_study::page::{self, CLAIMS, claims_in};
use asperity_study::pipeline::REPORT as PAGE;
use asperity_study::relative_link;
use clap::Args;
use serde_json::json;

use crate::exit::{self, Code, Failure};
use crate::outputs::{fits, refused};
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::terminal::say;
use crate::{study, summary, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity report out/mine.mcap --out out/mine.html
  asperity report out/chapter5 --out out/chapter5.html
  asperity report out/tilts --out out/tilts.html
  asperity report out/chapter5 out/chapter6 --out out/index.html

A page is one file that fetches nothing. It shows what a study asks, its claims
beside their figures, and for every run the load curve, the space-time map of
its ruptures, and a table of them; a rupture selected in one is marked in all.
Without scripts, text and tables remain. docs/outputs.md describes the page.

For several folders, the page shows their scores and figures and links to the
report.html of each; pictures stay in their folders. asperity reproduce and
asperity sweep collect write report.html themselves.")]
pub(crate) struct ReportArguments {
    /// Run logs; or one or more folders of pipelines or sweeps.
    #[arg(value_name = "RUN.mcap|STUDY", required = true)]
    pub(crate) of: Vec<PathBuf>,
    /// The page.
    #[arg(short, long, value_name = "PAGE.html")]
    pub(crate) out: PathBuf,
    /// Omit the code version, the time step and the solver of the runs.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// Replace an existing file.
    #[arg(long)]
    pub(crate) force: bool,
}

const ACCEPTED: &str = "run logs; or folders of a pipeline, which have a reproduce.json, or of a sweep, which have a \
                        plan.ndjson";

pub(crate) fn command(arguments: &ReportArguments, board: &Board) -> Result<(), Failure> {
    let ReportArguments { of, out, .. } = arguments;
    fits("--out", out, "html", "a page")?;
    let existing = if arguments.force { Existing::Replace } else { Existing::Refuse };
    let files = FileSet::new(existing, Inputs::of(of.iter().filter(|path| path.is_file())));
    let not_written = |error| refused("--out", &error, true);
    files.reserve([out]).map_err(not_written)?;
    let kinds = of.iter().map(|path| kind(path)).collect::<Result<Vec<Given>, Failure>>()?;
    let mut codes = Vec::new();
    let html = match kinds.as_slice() {
        [Given::Reproduced] => {
            let mut study = pipeline(&of[0], arguments, &files)?;
            study.lead(&relative_link(out, &of[0]));
            study.html()
        }
        [Given::Study] => {
            let (plan, results) = &study::read(&of[0])?;
            let html = page::of_folder(&of[0], (plan, results), out, &files, !arguments.no_provenance)?;
            board.line(&results.in_words());
            html
        }
        kinds if kinds.iter().all(|kind| *kind == Given::Log) => {
            let (study, told) = logs(arguments, board)?;
            codes = told;
            study.html()
        }
        kinds if kinds.iter().all(|kind| *kind != Given::Log) => {
            let entries = of.iter().zip(kinds).map(|(folder, kind)| entry(folder, *kind, out, &files));
            index("Studies", &entries.collect::<Result<Vec<Entry>, Failure>>()?)
        }
        _ => {
            return Err(Failure::BadInput(format!(
                "{} is a folder and others are not (accepted: {ACCEPTED})",
                of[kinds.iter().position(|kind| *kind != Given::Log).unwrap_or_default()].display()
            )));
        }
    };
    files.write(out, html).map_err(not_written)?;
    files.publish().map_err(not_written)?;
    say(out.display())?;
    Code::worst(codes).said()
}

/// The kind of input at a path: that of a folder of a pipeline or a sweep, or a log.
fn kind(path: &Path) -> Result<Given, Failure> {
    fs::metadata(path)
        .map_err(|error| Failure::BadInput(format!("{}: {error} (accepted: {ACCEPTED})", path.display())))?;
    match Given::of(path) {
        given @ (Given::Reproduced | Given::Study) => Ok(given),
        Given::Logs => Err(Failure::BadInput(format!(
            "{0}: a folder of run logs, and of neither a pipeline nor a sweep (accepted: {0}/*.mcap; {ACCEPTED})",
            path.display()
        ))),
        Given::Folder => Err(Failure::BadInput(format!(
            "{}: a folder of neither a pipeline nor a sweep (accepted: {ACCEPTED})",
            path.display()
        ))),
        // Reading it shows whether it is a run log.
        _ => Ok(Given::Log),
    }
}

/// Reads runs from their logs.
fn logs(arguments: &ReportArguments, board: &Board) -> Result<(Study, Vec<Code>), Failure> {
    let ReportArguments { of, out, .. } = arguments;
    if let Some(twice) = (1..of.len()).find(|&n| of[..n].contains(&of[n])) {
        return Err(Failure::BadInput(format!(
            "{} is given twice (accepted: each run log once)",
            of[twice].display()
        )));
    }
    let names: BTreeSet<String> = of.iter().map(|path| summary::name(path)).collect();
    // Logs of the same name are named by their paths.
    let is_told_apart = names.len() == of.len();
    let limits = Limits::of_runs(of.len());
    let found = at_once(of, None, |path| {
        let name = if is_told_apart { summary::name(path) } else { path.display().to_string() };
        let accept = |checked: &Checked| verdict_exit::must_be_sound(path, checked);
        let (mut run, figures, checked) = run(&name, path, limits, accept)?;
        let words = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        run.links = vec![Link { path: relative_link(out, path), words }];
        Ok::<_, Failure>((run, figures, checked))
    })?;
    let (mut runs, mut figures): (Vec<Run>, Vec<Figure>) = Default::default();
    let mut codes = Vec::new();
    for (path, (run, of_run, checked)) in of.iter().zip(found) {
        codes.push(exit::reported(verdict_exit::finish(path, &checked, board)));
        runs.push(run);
        figures.extend(of_run);
    }
    let title = match runs.as_slice() {
        [run] => format!("Run {}", run.name),
        runs => format!("{} runs", runs.len()),
    };
    let study = Study {
        title,
        runs,
        claims: Vec::new(),
        figures,
        links: Vec::new(),
        provenance: !arguments.no_provenance,
    };
    Ok((study, codes))
}

/// The figures of a recording on its page.
const OF_RECORDING: [&str; 3] = ["lengths", "load", "noise"];

/// Reads the sound part of a run's log, and draws the figures of a recording.
fn run(
    name: &str,
    log: &Path,
    limits: Limits,
    accept: impl FnOnce(&Checked) -> Result<(), Failure>,
) -> Result<(Run, Vec<Figure>, Checked), Failure> {
    let mut figures = Vec::new();
    let begin = |log: &OpenLog| {
        // A log that ends early, or was salvaged without its scenario, has no parameters.
        let (header, scenario) = (log.header(), log.shown_scenario()?);
        let kinds =
            OF_RECORDING.iter().filter(|_| header.sensors.is_some()).filter_map(|kind| Kind::find(kind));
        figures = kinds
            .map(|kind| kind.of_run(name, header, &scenario, &[]))
            .collect::<Result<Vec<OneFigure>, String>>()?;
        let required = figures.iter().fold(RequiredData::NOTHING, |all, of| all | of.required_data());
        let collector =
            Collector::of_log(name, header, &scenario, required)?.bounded(&PrecursorRules::default());
        Ok((collector, PageCollector::new(header.steps, header.contacts(), limits)))
    };
    let Reading { checked, observer: (collector, page), has_ruptures } =
        reading::once(log, &[], begin, accept)?;
    let data = collector.finish(has_ruptures, checked.seen.end.as_ref());
    let mut drawn: Vec<Figure> =
        figures.iter().filter_map(|figure| embedded(figure, &[&data], vec![name.to_owned()])).collect();
    // Of several recordings each figure has a place of its own.
    drawn.iter_mut().for_each(|figure| figure.file.insert_str(0, &format!("{}-", name.replace('/', "-"))));
    let RunData { run: RunEvents { header, scenario, summary, .. }, noise, .. } = data;
    let run = Run {
        name: name.to_owned(),
        summary,
        collected: page.finish(),
        noise,
        header,
        scenario,
        lacks: (!checked.verdict.holds_all()).then(|| checked.to_string()),
        note: asperity_runlog::note(log),
        links: Vec::new(),
    };
    Ok((run, drawn, checked))
}

/// The record of a pipeline's folder.
fn recorded(folder: &Path) -> Result<Recorded, Failure> {
    let path = folder.join(RECORD);
    let bad = |problem: String| Failure::BadInput(format!("{}: {problem}", path.display()));
    let text = text::read(&path).map_err(|error| bad(format!("{error} (accepted: a text file)")))?;
    Recorded::read(&text).map_err(bad)
}

/// The files of a pipeline's folder that a page uses or links to, except the page itself.
fn inputs(folder: &Path, recorded: &[String], contents: &Contents) -> Vec<PathBuf> {
    let recorded = recorded.iter().filter(|file| *file != PAGE).cloned();
    let pictures = contents.figures.iter().flat_map(|figure| files_of_picture(&figure.file));
    let own = [RECORD, CLAIMS].map(str::to_owned);
    recorded.chain(pictures).chain(own).map(|file| folder.join(file)).collect()
}

/// Reads a pipeline from its folder.
fn pipeline(folder: &Path, arguments: &ReportArguments, files: &FileSet) -> Result<Study, Failure> {
    let recorded = recorded(folder)?;
    let contents = recorded.page;
    let logs: Vec<PathBuf> =
        recorded.runs.iter().map(|run| folder.join("runs").join(format!("{}.mcap", run.name))).collect();
    let inputs = inputs(folder, &recorded.files, &contents).into_iter().chain(logs.iter().cloned());
    files.add_inputs(inputs).map_err(|error| refused("--out", &error, true))?;
    let limits = Limits::of_runs(logs.len());
    let places: Vec<usize> = (0..logs.len()).collect();
    let runs = at_once(&places, None, |&place| {
        let (of, log) = (&recorded.runs[place], &logs[place]);
        let (run, ..) = run(&of.name, log, limits, |checked| verdict_exit::must_hold_all(log, checked))?;
        if of.run != json!(run.header) {
            return Err(Failure::BadInput(format!(
                "{}: its run is not the run that {RECORD} names (accepted: the log that its tables were \
                 made from; asperity reproduce makes new tables from the present logs)",
                log.display()
            )));
        }
        Ok(run)
    })?;
    let claims = claims(folder, &recorded.files)?;
    let read = |file: &str| asperity_files::read_if_there(&folder.join(file));
    Study::of(&contents, &recorded.files, runs, claims, &read, !arguments.no_provenance)
        .map_err(Failure::failed)
}

/// The claims of a pipeline's folder, if they are recorded.
fn claims(folder: &Path, recorded: &[String]) -> Result<Vec<Claim>, Failure> {
    let is_there = recorded.iter().any(|file| file == CLAIMS);
    Ok(if is_there { claims_in(folder)? } else { Vec::new() })
}

/// A study among several.
fn entry(folder: &Path, kind: Given, out: &Path, files: &FileSet) -> Result<Entry, Failure> {
    let way = relative_link(out, folder);
    let report = folder.join(PAGE).is_file().then(|| format!("{way}{PAGE}"));
    if kind == Given::Study {
        return Ok(page::entry(folder, &study::read(folder)?.0, &way, report, files)?);
    }
    let recorded = recorded(folder)?;
    let contents = recorded.page;
    files
        .add_inputs(inputs(folder, &recorded.files, &contents))
        .map_err(|error| refused("--out", &error, true))?;
    let there = contents.figures.into_iter().filter(|figure| folder.join(&figure.file).is_file());
    let title = match contents.title {
        title if title.is_empty() => folder.display().to_string(),
        title => title,
    };
    Ok(Entry {
        title,
        report,
        runs: recorded.runs.len() as u64,
        claims: claims(folder, &recorded.files)?,
        figures: there
            .map(|figure| Figure { file: format!("{way}{}", encoded(figure.file.as_bytes())), ..figure })
            .collect(),
    })
}
