//! `asperity summary`: the key numbers of runs; and summaries of logs, for all commands.

use std::fmt::Display;
use std::io::Write;
use std::path::Path;

use asperity_model::WRONG_FRONT;
use asperity_numbers::{Slider, Summarizer, Summary, text};
use asperity_record::{RunHeader, counted};
use asperity_run::{Checked, at_once};
use asperity_tables::{CsvRows, Spelling};

use crate::args::{SummaryArguments, SummaryFormat};
use crate::exit::{self, Code, Failure};
use crate::note;
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::terminal;
use crate::verdict_exit;

/// Prints the summaries, then the verdicts on the logs.
pub(crate) fn command(arguments: &SummaryArguments, board: &Board) -> Result<(), Failure> {
    if arguments.schema {
        return print_json(&Summary::schema());
    }
    let found = at_once(&arguments.runs, None, |run| Ok::<_, Failure>(of_log(run)))?;
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
        if let Err(failure) = told {
            exit::report(&failure);
            codes.push(failure.code());
        }
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
        (SummaryFormat::Json, [summary], [_]) => print_json(summary),
        (SummaryFormat::Json, ..) => print_json(&summaries),
        (SummaryFormat::Csv, ..) => {
            let names = Summary::KEYS.iter().map(|key| key.column.name.as_ref());
            let mut rows = CsvRows::headed(terminal::data(), names, Spelling::Scientific)?;
            summaries.iter().try_for_each(|summary| rows.push_texts(summary.row()))?;
            Ok(rows.finish()?.flush()?)
        }
        (SummaryFormat::Text, [summary], [_]) => Ok(words(&text::of_one(summary, as_coded))?),
        (SummaryFormat::Text, ..) => Ok(words(&text::of_several(summaries.iter().copied()))?),
    }
}

fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).expect("texts and finite numbers are JSON");
    let mut out = terminal::data();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

fn words(text: &str) -> std::io::Result<()> {
    text.lines().try_for_each(terminal::say)
}

/// Prints warnings about a run's numbers.
pub(crate) fn tell(run: impl Display, summary: &Summary, board: &Board) {
    notes(summary).iter().for_each(|note| board.line(&format!("{run}: {note}")));
}

/// Formats the summary in one line.
pub(crate) fn in_short(summary: &Summary) -> String {
    let precursors = counted(summary.precursor_count.unwrap_or_default(), "precursor");
    match (summary.first_global_rupture_onset_s, summary.first_global_rupture_ft_fn) {
        (None, _) => format!("{precursors}, no slip of the whole slider"),
        (Some(onset_s), None) => format!("{precursors}, the whole slider slips at {onset_s:.4} s"),
        (Some(onset_s), Some(ft_fn)) => {
            format!("{precursors}, the whole slider slips at {onset_s:.4} s, F_T/F_N = {ft_fn:.4}")
        }
    }
}

/// The warning about runs without energies.
pub(crate) const WITHOUT_ENERGIES: &str = "its records have no energies, so numbers that need them are empty \
    (recording.energies = \"none\" in an older version of the program, or a log of version 3 or before)";

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
            "the slider creeps: block {} had slid before a front ran, so raw slip events do not show when \
             the slider slipped",
            summary.creep_front_block.unwrap_or_default()
        ));
    } else if summary.raw_events_mislead == Some(true) {
        notes.push(
            "raw slip events mislead: they last far longer than fronts take, or merge ruptures far apart; \
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
            "{} of its {} involve only contacts without load, which rub on nothing{in_air} (docs/slab.md)",
            summary.unloaded_event_count,
            counted(summary.event_count, "slip event")
        ));
    }
    match summary.ruptures_from.as_str() {
        "steps" => notes.push("its log has no ruptures; they were found in its step records".to_owned()),
        "none" => notes.push(
            "its log has no ruptures, and lacks some of the step records that contain them; numbers that \
             need them are missing"
                .to_owned(),
        ),
        _ => {}
    }
    if summary.step_record_count > 0 && summary.drive_work_j.is_none() {
        notes.push(WITHOUT_ENERGIES.to_owned());
    }
    notes
}

/// The name of a run: that of its log.
fn name(run: &Path) -> String {
    run.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The summary of the sound part of a log, its verdict, and, if the run is as coded, words for that.
///
/// # Errors
/// If it is not a run log, or its scenario is invalid.
fn of_log(run: &Path) -> Result<(Summary, Checked, Option<String>), Failure> {
    let mut as_coded = None;
    let begin = |header: &RunHeader, toml: &str| {
        as_coded = reading::scenario(run, toml)?.and_then(|scenario| scenario.as_coded_in_words());
        begin(run, header, toml)
    };
    let Reading { checked, observer, ruptures_from } = reading::once(run, begin, |_| Ok(()))?;
    Ok((observer.finish(ruptures_from, checked.seen.end.as_ref()), checked, as_coded))
}

/// Begins the summary of a log with this header and scenario.
///
/// # Errors
/// In words, if its scenario is invalid.
pub(crate) fn begin(run: &Path, header: &RunHeader, scenario_toml: &str) -> Result<Summarizer, String> {
    // A log that ends early, or was salvaged without its scenario, has none.
    let scenario = reading::scenario(run, scenario_toml)?;
    Ok(Summarizer::new(
        &name(run),
        header,
        scenario.map_or_else(Slider::default, |scenario| Slider::of(&scenario)),
    ))
}
