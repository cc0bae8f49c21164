//! Converts verdicts on logs to exits: commands check a log before they publish anything, and report
//! its verdict.

use std::fmt::Display;
use std::path::Path;

use asperity_run::{Checked, Verdict};

use crate::exit::Failure;
use crate::given;
use crate::progress::Board;

/// The failure for a log whose verdict is worse than the command accepts.
pub(crate) fn failure(run: &Path, checked: &Checked) -> Failure {
    Failure::Log(checked.verdict, format!("{}: {}", run.display(), words(run, checked)))
}

/// A verdict in words; if the path is no run log, its kind.
pub(crate) fn words(run: &Path, checked: &Checked) -> String {
    let instead = if checked.verdict == Verdict::NoRunLog { given::instead_of_log(run) } else { None };
    instead.map_or_else(|| checked.to_string(), |instead| format!("{}: {instead}", checked.verdict))
}

/// The failure for a log that cannot be read after the check: its verdict, or that it has changed.
pub(crate) fn unreadable(run: &Path, verdict: Verdict, problem: impl Display) -> Failure {
    if verdict.holds_all() {
        return Failure::Failed(format!("{}: {problem}", run.display()));
    }
    Failure::Log(verdict, format!("{}: {verdict}: {problem}", run.display()))
}

/// Refuses an incomplete log.
///
/// # Errors
/// If it does not.
pub(crate) fn must_hold_all(run: &Path, checked: &Checked) -> Result<(), Failure> {
    if checked.verdict.holds_all() { Ok(()) } else { Err(failure(run, checked)) }
}

/// Refuses a damaged log; only `asperity salvage` finds its sound parts.
///
/// # Errors
/// If it is damaged.
pub(crate) fn must_be_sound(run: &Path, checked: &Checked) -> Result<(), Failure> {
    if checked.verdict != Verdict::Damaged {
        return Ok(());
    }
    let words = format!("{}: {checked} (accepted: what asperity salvage makes of it)", run.display());
    Err(Failure::Log(checked.verdict, words))
}

/// Ends a command that has used the sound part of a log; prints a note if the log is by another
/// code version or other detectors, or in a file of another program.
///
/// # Errors
/// If the log is incomplete.
pub(crate) fn finish(run: &Path, checked: &Checked, board: &Board) -> Result<(), Failure> {
    if checked.has_note() {
        board.line(&format!("{}: {checked}", run.display()));
    }
    must_hold_all(run, checked)
}
