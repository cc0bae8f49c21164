//! Exit codes and failures: the one place where outcomes become numbers.

use std::borrow::Cow;
use std::io;
use std::num::NonZeroUsize;

use asperity_files::at_once;
use asperity_run::Verdict;

use crate::terminal;

/// The exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Code {
    /// The command succeeded; the logs are whole, or equal. Also used when a reader closes the pipe
    /// early.
    Success = 0,
    /// The command failed: a system call failed or a run became unstable; or a replay gave other
    /// events, or two runs differ.
    Failed = 1,
    /// Invalid input: unknown names, bad scenarios, existing outputs, files that are not run logs,
    /// tables that cannot be compared. Nothing was written.
    BadInput = 2,
    /// A log ends before its run does.
    Incomplete = 3,
    /// A log is damaged.
    Damaged = 4,
    /// A log was salvaged from a damaged one.
    Salvaged = 5,
    /// A log is by another code version or other detectors, where the command checks that.
    ByOthers = 6,
    /// A log is of a run that the solver stopped.
    Stopped = 7,
    /// Stopped by SIGINT; the log in progress was closed as interrupted.
    Interrupted = 130,
    /// Stopped by SIGTERM, likewise.
    Terminated = 143,
}

impl From<Verdict> for Code {
    fn from(verdict: Verdict) -> Code {
        match verdict {
            Verdict::Whole => Code::Success,
            Verdict::OtherCode => Code::ByOthers,
            Verdict::Incomplete => Code::Incomplete,
            Verdict::Stopped => Code::Stopped,
            Verdict::Salvaged => Code::Salvaged,
            Verdict::NoRunLog => Code::BadInput,
            Verdict::Unreadable => Code::Failed,
            Verdict::Damaged => Code::Damaged,
        }
    }
}

impl Code {
    /// The code of several results in one call: that of the worst log, otherwise that of the
    /// failure.
    pub(crate) fn worst(codes: impl IntoIterator<Item = Code>) -> Code {
        let order = [
            Code::Success,
            Code::ByOthers,
            Code::Failed,
            Code::Incomplete,
            Code::Stopped,
            Code::Salvaged,
            Code::BadInput,
            Code::Damaged,
            Code::Interrupted,
            Code::Terminated,
        ];
        let rank = |code: &Code| order.iter().position(|known| known == code);
        codes.into_iter().max_by_key(rank).unwrap_or(Code::Success)
    }

    /// Converts a code whose messages have been printed to a result.
    pub(crate) fn said(self) -> Result<(), Failure> {
        if self == Code::Success { Ok(()) } else { Err(Failure::Said(self)) }
    }
}

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// Invalid input; the message names the place, the problem and the accepted values.
    #[error("{0}")]
    BadInput(String),
    /// The verdict on a log is worse than the command accepts.
    #[error("{1}")]
    Log(Verdict, String),
    /// A failure after the input was accepted.
    #[error("{0}")]
    Failed(String),
    /// All messages have been printed; only the code remains.
    #[error("")]
    Said(Code),
    /// Standard output could not be written.
    #[error("failed to write to standard output: {0}")]
    Output(#[from] io::Error),
}

/// The standard library's words for it. Readers of inputs give the reasons of the system as text.
const OUT_OF_MEMORY: &str = "out of memory";

impl Failure {
    pub(crate) fn bad_input(error: impl std::fmt::Display) -> Failure {
        Failure::BadInput(error.to_string())
    }

    pub(crate) fn failed(error: impl std::fmt::Display) -> Failure {
        Failure::Failed(error.to_string())
    }

    pub(crate) fn code(&self) -> Code {
        match self {
            // An input is not bad because the system refuses memory for it.
            Failure::BadInput(text) if text.contains(OUT_OF_MEMORY) => Code::Failed,
            Failure::BadInput(_) => Code::BadInput,
            Failure::Log(verdict, _) => Code::from(*verdict),
            Failure::Failed(_) | Failure::Output(_) => Code::Failed,
            Failure::Said(code) => *code,
        }
    }
}

/// Prints on stderr why the command failed.
pub(crate) fn report(failure: &Failure) {
    let text = failure.to_string();
    let mut lines = text.lines();
    for line in lines.by_ref().take(MOST_LINES) {
        terminal::note(&format!("error: {}", shortened(line)));
    }
    match lines.count() {
        0 => {}
        more => terminal::note(&format!("error: and {more} lines more")),
    }
}

/// The code of an outcome; a failure is printed.
pub(crate) fn reported(outcome: Result<(), Failure>) -> Code {
    let Err(failure) = outcome else { return Code::Success };
    report(&failure);
    failure.code()
}

/// Processes several items, `jobs` of them in parallel (None for one per core), and returns the
/// results in order. If one of several fails, it is reported, its result is the exit code, and the
/// others continue; invalid input stops all.
pub(crate) fn each_of<T: Sync, Done: Send>(
    things: &[T],
    jobs: Option<NonZeroUsize>,
    each: impl Fn(&T) -> Result<Done, Failure> + Sync,
) -> Result<Vec<Result<Done, Code>>, Failure> {
    at_once(things, jobs, |thing| match each(thing) {
        Err(failure @ (Failure::Failed(_) | Failure::Log(..))) if things.len() > 1 => {
            report(&failure);
            Ok(Err(failure.code()))
        }
        outcome => outcome.map(Ok),
    })
}

/// Most lines, and most characters per line, that are printed of one failure: errors quote the refused
/// input, which may be a file of one line.
const MOST_LINES: usize = 100;
const MOST_CHARACTERS: usize = 2000;

/// Shortens a long line by its middle.
pub(crate) fn shortened(line: &str) -> Cow<'_, str> {
    let count = line.chars().count();
    if count <= MOST_CHARACTERS {
        return line.into();
    }
    let kept = MOST_CHARACTERS / 2;
    let start: String = line.chars().take(kept).collect();
    let end: String = line.chars().skip(count - kept).collect();
    format!("{start} [{} characters] {end}", count - 2 * kept).into()
}

#[cfg(test)]
mod tests {
    use super::shortened;

    #[test]
    fn a_line_that_nobody_could_read_loses_its_middle() {
        assert_eq!(shortened("as it is"), "as it is");
        let long = shortened(&format!("a{}z", "\u{e9}".repeat(10_000_000))).into_owned();
        assert!(long.starts_with("a\u{e9}") && long.ends_with("\u{e9}z"), "{long}");
        assert!(long.contains("[9998002 characters]") && long.chars().count() < 2100, "{}", long.len());
    }
}
