//! `asperity note`: the note of a log.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_run::{Verdict, check};
use asperity_runlog::{annotate, note};
use clap::Args;

use crate::exit::Failure;
use crate::terminal::say;
use crate::verdict_exit;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity note out/mine.mcap author='A. Name' comment='before the new springs'
  asperity note out/mine.mcap

A note stays when keys are added; KEY= removes one. Nothing else of the log
changes: not its verdict, its events or any number. check, summary and report
show the note.")]
pub(crate) struct NoteArguments {
    /// The finished log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// What to note; without any, the note is printed.
    #[arg(value_name = "KEY=VALUE")]
    pub(crate) notes: Vec<String>,
}

pub(crate) fn command(arguments: &NoteArguments) -> Result<(), Failure> {
    let NoteArguments { run, notes } = arguments;
    let pair = |text: &String| match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err(Failure::BadInput(format!("{text:?} (accepted: KEY=VALUE, as in author=\"A. Name\")"))),
    };
    let changes = notes.iter().map(pair).collect::<Result<Vec<_>, Failure>>()?;
    let checked = check(run);
    if !checked.verdict.holds_all() && checked.verdict != Verdict::Stopped {
        return Err(verdict_exit::failure(run, &checked));
    }
    let noted = match changes.is_empty() {
        true => note(run),
        false => annotate(run, &changes).map_err(Failure::failed)?,
    };
    print(run, &noted)
}

/// Prints the note of a log, a line for each key.
pub(crate) fn show(run: &Path) -> Result<(), Failure> {
    print(run, &note(run))
}

fn print(run: &Path, noted: &BTreeMap<String, String>) -> Result<(), Failure> {
    noted
        .iter()
        .try_for_each(|(key, value)| Ok(say(format_args!("{}: note: {key} = {value}", run.display()))?))
}
