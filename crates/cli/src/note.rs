//! `asperity note`: the note of a log.

use std::collections::BTreeMap;
use std::path::Path;

use asperity_run::{Verdict, check};
use asperity_runlog::{annotate, note};

use crate::args::NoteArguments;
use crate::exit::Failure;
use crate::terminal::say;
use crate::verdict_exit;

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
