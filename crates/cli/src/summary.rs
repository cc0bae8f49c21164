//! `asperity summary`: the key numbers of runs; and summaries of logs, for all commands.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

use asperity_files::at_once;
use asperity_model::{Scenario, WRONG_FRONT};
use asperity_numbers::{OfRecording, Summarizer, Summary, text};
use asperity_record::{EventPayload, Rupture, SlipEvent, counted};
use asperity_run::{Checked, OpenLog};
use asperity_tables::{CsvRows, Spelling};
use clap::{Args, ValueEnum};

use crate::exit::{self, Code, Failure};
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::{note, terminal, verdict_exit};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SummaryFormat {
    /// For people, six digits: all numbers of one run, the first of several.
    Text,
    /// Comma-separated, one header line, one row for each run, numbers in full precision.
    Csv,
    /// An object; an array of them if several runs are named.
    Json,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity summary out/mine.mcap
  asperity summary out/chapter5/runs/*.mcap
  asperity summary out/chapter5/runs/*.mcap --format csv > out/summary.csv
  asperity summary out/mine.mcap --format json | python3 -m json.tool
  asperity summary out/mine.mcap --quick
  asperity summary --schema > out/summary.schema.json

Numbers describe ruptures: sets of detachments that a front connects, whatever
slides elsewhere at the same time. Numbers of slip events have `event` in
their names. A precursor is a rupture that includes block 1, does not reach
every block, and reaches farther than every earlier rupture that includes
block 1. Units are SI. asperity numbers and the schema explain every key.")]
pub(crate) struct SummaryArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required_unless_present = "schema")]
    pub(crate) runs: Vec<PathBuf>,
    /// How to print it.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: SummaryFormat,
    /// Read only what is needed, found by the index of the file, and verify
    /// nothing: for a look at a long log.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Print the JSON schema of a summary: each key with its meaning and unit.
    #[arg(long, conflicts_with_all = ["runs", "format", "quick"])]
    pub(crate) schema: bool,
}

/// Prints the summaries, then the verdicts on the logs.
pub(crate) fn command(arguments: &SummaryArguments, board: &Board) -> Result<(), Failure> {
    if arguments.schema {
        return print_json(&Summary::schema());
    }
    let found = at_once(&arguments.runs, None, |run| Ok::<_, Failure>(of_log(run, arguments.quick)))?;
    let summaries: Vec<&Summary> = found.iter().flatten().map(|(summary, ..)| summary).collect();
    let as_coded = found.iter().flatten().find_map(|(.., as_coded)| as_coded.as_deref());
    if !summaries.is_empty() {
        print(arguments, &summaries, as_coded)?;
    }
    if arguments.format == SummaryFormat::Text {
        arguments.runs.iter().try_for_each(|run| note::show(run))?;
    }
    let mut codes = Vec::new();
    for (run, found) in arguments.runs.iter().zip(found) {
        let told = found.and_then(|(summary, checked, as_coded)| {
            if let Some(as_coded) = as_coded.filter(|_| arguments.runs.len() > 1) {
                board.line(&format!("{}: {as_coded}", run.display()));
            }
            tell(run.display(), &summary, board);
            wrong_fronts(&summary).iter().for_each(|note| board.line(&format!("{}: {note}", run.display())));
            verdict_exit::finish(run, &checked, board)
        });
        codes.push(exit::reported(told));
    }
    Code::worst(codes).said()
}

/// Prints the summaries; `as_coded` marks a single run as one of the thesis' program.
fn print(
    arguments: &SummaryArguments,
    summaries: &[&Summary],
    as_coded: Option<&str>,
) -> Result<(), Failure> {
    match (arguments.format, summaries, arguments.runs.as_slice()) {
        (SummaryFormat::Json, [summary], [_]) => print_json(&summary.to_json()),
        (SummaryFormat::Json, ..) => {
            print_json(&summaries.iter().map(|summary| summary.to_json()).collect::<Vec<_>>())
        }
        (SummaryFormat::Csv, ..) => {
            let has_recordings = summaries.iter().any(|summary| summary.of_recording.is_some());
            let others = if has_recordings { OfRecording::KEYS } else { &[] };
            let names = Summary::KEYS.iter().chain(others).map(|key| key.column.name.as_ref());
            let mut rows = CsvRows::headed(terminal::data(), names, Spelling::Scientific)?;
            for summary in summaries {
                let mut row = summary.row();
                row.resize(Summary::KEYS.len() + others.len(), String::new());
                rows.push_texts(row)?;
            }
            Ok(rows.finish()?.flush()?)
        }
        (SummaryFormat::Text, [summary], [_]) => Ok(words(&text::of_one(summary, as_coded))?),
        (SummaryFormat::Text, ..) => Ok(words(&text::of_several(summaries.iter().copied()))?),
    }
}

pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).expect("texts and finite numbers are JSON");
    let mut out = terminal::data();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

fn words(text: &str) -> std::io::Result<()> {
    text.lines().try_for_each(terminal::say)
}

/// Why there are no ruptures.
pub(crate) const WITHOUT_RUPTURES: &str = "its log has no ruptures, since other detectors wrote it";

/// Prints warnings about a run's numbers.
pub(crate) fn tell(run: impl Display, summary: &Summary, board: &Board) {
    notes(summary).iter().for_each(|note| board.line(&format!("{run}: {note}")));
}

/// Formats the summary in one line.
pub(crate) fn in_short(summary: &Summary) -> String {
    let precursors = match (summary.precursor_count, summary.rupture_count) {
        (None, Some(ruptures)) => counted(ruptures, "rupture"),
        (precursors, _) => counted(precursors.unwrap_or_default(), "precursor"),
    };
    match (summary.first_global_rupture_onset_s, summary.first_global_rupture_ft_fn) {
        (None, _) => format!("{precursors}, no slip of the whole slider"),
        (Some(onset_s), None) => format!("{precursors}, the whole slider slips at {onset_s:.4} s"),
        (Some(onset_s), Some(ft_fn)) => {
            format!("{precursors}, the whole slider slips at {onset_s:.4} s, F_T/F_N = {ft_fn:.4}")
        }
    }
}

/// The warning about the speeds of fronts, as before the run.
fn wrong_fronts(summary: &Summary) -> Option<String> {
    summary.front_speed_error_ratio.filter(|error| *error > WRONG_FRONT).map(|error| {
        format!(
            "its time step is so long that speeds of fronts are wrong by about {:.0} %, in proportion to the step \
             (docs/ruptures.md)",
            100.0 * error
        )
    })
}

fn notes(summary: &Summary) -> Vec<String> {
    let mut notes = Vec::new();
    if summary.creeps == Some(true) {
        notes.push(format!(
            "the slider creeps: block {} had slid before a front ran, so slip events do not show when \
             the slider slipped",
            summary.creep_front_block.unwrap_or_default()
        ));
    } else if summary.events_mislead == Some(true) {
        notes.push(
            "slip events mislead: they last far longer than fronts take, or merge ruptures far apart; \
             count its ruptures instead"
                .to_owned(),
        );
    }
    if summary.unloaded_event_count > 0 || summary.contact_steps_in_air > Some(0) {
        let in_air = match summary.contact_steps_in_air {
            Some(steps) if steps > 0 => {
                format!("; contacts were in the air for {}, summed over them", counted(steps, "step"))
            }
            _ => String::new(),
        };
        notes.push(format!(
            "{} of its {} involve only contacts without load, which rub on nothing{in_air} (docs/bodies.md)",
            summary.unloaded_event_count,
            counted(summary.event_count, "slip event")
        ));
    }
    if summary.rupture_count.is_none() && summary.of_recording.is_none() {
        notes.push(format!("{WITHOUT_RUPTURES}; numbers that need them are missing"));
    }
    notes
}

/// The name of a run: that of its log.
pub(crate) fn name(run: &Path) -> String {
    run.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The summary of the sound part of a log, its verdict, and, if the run is as coded, words for that.
///
/// # Errors
/// If it is not a run log, or its scenario is invalid.
fn of_log(run: &Path, quick: bool) -> Result<(Summary, Checked, Option<String>), Failure> {
    let mut as_coded = None;
    let begin = |log: &OpenLog| {
        as_coded = log.scenario()?.and_then(Scenario::as_coded_in_words);
        begin(run, log)
    };
    let skims: &[_] = if quick { &["/step", "/switch", SlipEvent::TOPIC, Rupture::TOPIC] } else { &[] };
    let Reading { checked, observer, has_ruptures } = reading::once(run, skims, begin, |_| Ok(()))?;
    Ok((observer.finish(has_ruptures, checked.seen.end.as_ref()), checked, as_coded))
}

/// Begins the summary of a log.
///
/// # Errors
/// In words, if its scenario is invalid.
pub(crate) fn begin(run: &Path, log: &OpenLog) -> Result<Summarizer, String> {
    // A log that ends early, or was salvaged without its scenario, has none.
    Ok(Summarizer::new(&name(run), log.header(), log.scenario()?))
}
