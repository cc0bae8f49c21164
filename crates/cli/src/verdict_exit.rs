//! Converts verdicts on logs to exits: commands check a log before they write anything, and report
//! its verdict.

use std::fmt::Display;
use std::path::Path;

use asperity_run::{Checked, Observer, Verdict, check, check_seen};

use crate::exit::Failure;
use crate::progress::Board;

/// The failure for a log whose verdict is worse than the command accepts.
pub(crate) fn failure(run: &Path, checked: &Checked) -> Failure {
    Failure::Log(checked.verdict, format!("{}: {checked}", run.display()))
}

/// The failure for a log that cannot be read after the check: its verdict, or that it has changed.
pub(crate) fn unreadable(run: &Path, verdict: Verdict, problem: impl Display) -> Failure {
    if verdict.holds_all() {
        return Failure::Failed(format!("{}: {problem}", run.display()));
    }
    Failure::Log(verdict, format!("{}: {verdict}: {problem}", run.display()))
}

/// Checks a log that is read as far as it is sound.
///
/// # Errors
/// If it is not a run log.
pub(crate) fn readable(run: &Path) -> Result<Checked, Failure> {
    let checked = check(run);
    if checked.verdict == Verdict::NoRunLog { Err(failure(run, &checked)) } else { Ok(checked) }
}

/// Checks a log that must hold all of its run.
///
/// # Errors
/// If it does not.
pub(crate) fn holds_all(run: &Path) -> Result<Checked, Failure> {
    holds_all_seen(run, &mut ())
}

/// Checks a log as [`holds_all`] does, and passes what it reads to an observer.
///
/// # Errors
/// As [`holds_all`].
pub(crate) fn holds_all_seen(run: &Path, observer: &mut dyn Observer) -> Result<Checked, Failure> {
    let checked = check_seen(run, observer);
    if checked.verdict.holds_all() { Ok(checked) } else { Err(failure(run, &checked)) }
}

/// Ends a command that has used the sound part of a log; prints a note if the log is by another
/// code version or other detectors.
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
