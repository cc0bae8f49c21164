//! What the commands that read logs do with one that is not whole: they ask `asperity_run::check`
//! what it is worth before they write anything, and say so in its words.

use std::fmt::Display;
use std::path::Path;

use asperity_run::{Checked, Verdict, check};

use crate::exit::Failure;
use crate::progress::Board;

/// The failure that a log's verdict is for a command that needs more.
pub(crate) fn failure(run: &Path, checked: &Checked) -> Failure {
    Failure::Log(checked.verdict, format!("{}: {checked}", run.display()))
}

/// Why a log cannot be read by a command that has judged it: what it is worth, or else that it has
/// changed since.
pub(crate) fn unreadable(run: &Path, verdict: Verdict, problem: impl Display) -> Failure {
    if verdict.holds_all() {
        return Failure::Failed(format!("{}: {problem}", run.display()));
    }
    Failure::Log(verdict, format!("{}: {verdict}: {problem}", run.display()))
}

/// A log that is to be read as far as it is sound.
///
/// # Errors
/// If there is none.
pub(crate) fn readable(run: &Path) -> Result<Checked, Failure> {
    let checked = check(run);
    if checked.verdict == Verdict::NoRunLog { Err(failure(run, &checked)) } else { Ok(checked) }
}

/// A log that must hold all of its run.
///
/// # Errors
/// If it does not.
pub(crate) fn holds_all(run: &Path) -> Result<Checked, Failure> {
    let checked = check(run);
    if checked.verdict.holds_all() { Ok(checked) } else { Err(failure(run, &checked)) }
}

/// What a command says once it has given what there is of a log: a note on one by other code or
/// detectors, which is no failure.
///
/// # Errors
/// If the log does not hold all of its run.
pub(crate) fn finish(run: &Path, checked: &Checked, board: &Board) -> Result<(), Failure> {
    match checked.verdict {
        Verdict::Whole => Ok(()),
        Verdict::OtherCode => {
            board.line(&format!("{}: {checked}", run.display()));
            Ok(())
        }
        _ => Err(failure(run, checked)),
    }
}
