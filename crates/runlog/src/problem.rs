//! Errors of reading and writing run logs.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::{FileError, NoFile};
use asperity_record::RECORD_SCHEMA_VERSION;
use asperity_record::bounds::TooLong;

use crate::format::{RUN, RUN_END, SALVAGE};

/// Why a run log cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct LogError {
    /// The file.
    pub path: PathBuf,
    /// The error in it.
    pub problem: LogProblem,
}

/// An error in a run log.
#[derive(Debug, thiserror::Error)]
pub enum LogProblem {
    /// The system call failed.
    #[error("{0}")]
    Io(io::Error),
    /// It is not a run log.
    #[error(transparent)]
    NoRunLog(#[from] NoRunLog),
    /// More of something than a log may have.
    #[error("{found} {what} (accepted: up to {most})")]
    TooMany {
        /// Its name.
        what: &'static str,
        /// The number found, or a lower bound.
        found: usize,
        /// The most accepted.
        most: usize,
    },
    /// A scenario that is too long to be parsed.
    #[error("attachment `scenario.toml`: {0}")]
    LongScenario(#[from] TooLong),
    /// A damaged MCAP file.
    #[error("not a whole MCAP file: {0}")]
    Mcap(#[from] mcap::McapError),
    /// A record that cannot be read.
    #[error("the record at byte {at} cannot be read: {error}")]
    Record {
        /// Offset of the record, or of its chunk, in the file.
        at: u64,
        /// Why.
        error: mcap::McapError,
    },
    /// A message that contradicts itself, its place in the file, or those before it.
    #[error("step {step}: {what}")]
    Contradiction {
        /// The step.
        step: u64,
        /// The contradiction.
        what: String,
    },
    /// A header or end with invalid values.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
    /// A run log without its header.
    #[error("no metadata `{RUN}` before the first message")]
    NoHeader,
    /// It is of another version of the format.
    #[error("written with version {0} of the format; this program reads version {RECORD_SCHEMA_VERSION}")]
    Version(u32),
    /// A message that does not match its topic.
    #[error("message {sequence} of {topic} cannot be read: {error}")]
    Message {
        /// The topic.
        topic: String,
        /// The message's number in it.
        sequence: u32,
        /// The error in it.
        error: serde_json::Error,
    },
    /// A record that no run log has.
    #[error("the record at byte {at}: {what}")]
    Unsound {
        /// Offset of the record, or of its chunk, in the file.
        at: u64,
        /// The error.
        what: &'static str,
    },
    /// Records that do not belong together, or something after the end.
    #[error("{0}")]
    Misplaced(String),
    /// The file ends before the run does.
    #[error("no metadata `{RUN_END}`: the run did not finish, or the file was cut off")]
    NoEnd,
    /// A signal stopped the run.
    #[error("the run was interrupted after step {0}")]
    Interrupted(u64),
    /// The solver stopped the run, and why.
    #[error("the run was stopped: {0}")]
    Stopped(String),
    /// The log was salvaged from a damaged one.
    #[error("it was salvaged from a damaged log; metadata `{SALVAGE}` says what is missing")]
    Salvaged,
    /// The contents contradict `run_end`.
    #[error("metadata `{RUN_END}` says {what} {promised}, the file has {found}")]
    EndMismatch {
        /// The difference.
        what: String,
        /// The value in `run_end`.
        promised: String,
        /// The value in the file.
        found: String,
    },
    /// An earlier error, as text: nothing after it is read.
    #[error("{0}")]
    Before(String),
}

/// Checks an upper bound.
///
/// # Errors
/// If it is exceeded.
pub(crate) fn most(what: &'static str, found: usize, most: usize) -> Result<(), LogProblem> {
    if found > most { Err(LogProblem::TooMany { what, found, most }) } else { Ok(()) }
}

impl LogProblem {
    pub(crate) fn misplaced(what: impl Into<String>) -> LogProblem {
        LogProblem::Misplaced(what.into())
    }

    /// A copy for repeated reads: an early end stays one, and a contradiction to `run_end`, since these
    /// determine how the log can be used; other errors become text.
    pub(crate) fn again(&self) -> LogProblem {
        match self {
            LogProblem::NoEnd => LogProblem::NoEnd,
            LogProblem::Interrupted(step) => LogProblem::Interrupted(*step),
            LogProblem::Stopped(why) => LogProblem::Stopped(why.clone()),
            LogProblem::Salvaged => LogProblem::Salvaged,
            LogProblem::EndMismatch { what, promised, found } => LogProblem::EndMismatch {
                what: what.clone(),
                promised: promised.clone(),
                found: found.clone(),
            },
            LogProblem::Mcap(mcap::McapError::UnexpectedEof) => mcap::McapError::UnexpectedEof.into(),
            LogProblem::NoRunLog(reason) => LogProblem::NoRunLog(reason.clone()),
            LogProblem::Io(error) => LogProblem::Io(io::Error::new(error.kind(), error.to_string())),
            other => LogProblem::Before(other.to_string()),
        }
    }

    /// Adds the position in the file.
    pub(crate) fn at(self, at: u64) -> LogProblem {
        match self {
            LogProblem::Mcap(error) => LogProblem::Record { at, error },
            other => other,
        }
    }

    /// Whether the file is not a run log at all, or one of another version of the format, of which nothing is
    /// known: neither is damaged.
    pub fn is_no_run_log(&self) -> bool {
        matches!(self, LogProblem::NoRunLog(_) | LogProblem::Version(_))
    }

    /// Whether the file only ends too early and is sound before. Both this and
    /// [`LogProblem::is_no_run_log`] are true of an empty file and of one that begins with zeros, which a run
    /// stopped at its beginning may leave; the message only mentions that.
    pub fn is_early_end(&self) -> bool {
        matches!(
            self,
            LogProblem::NoEnd
                | LogProblem::NoRunLog(NoRunLog::Empty | NoRunLog::Torn)
                | LogProblem::Interrupted(_)
                | LogProblem::Stopped(_)
                | LogProblem::Salvaged
                | LogProblem::Mcap(mcap::McapError::UnexpectedEof)
        )
    }
}

impl From<io::Error> for LogProblem {
    fn from(error: io::Error) -> LogProblem {
        match (NoFile::of(&error), error.kind()) {
            (Some(what), _) => NoRunLog::NoFile(what).into(),
            (None, io::ErrorKind::NotFound) => NoRunLog::Missing.into(),
            _ => LogProblem::Io(error),
        }
    }
}

/// Why something is not a run log.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoRunLog {
    /// There is no such file.
    #[error("there is no such file")]
    Missing,
    /// The path leads to something other than a file.
    #[error("not a run log: it is {}", .0.0)]
    NoFile(NoFile),
    /// An empty file, which may be a log that was just begun.
    #[error("the file is empty")]
    Empty,
    /// The beginning of a run log was never written, as after a power cut.
    #[error("the file begins with zeros, as after a power cut")]
    Torn,
    /// A file of another kind.
    #[error("not a run log: it does not begin with the eight bytes that begin every MCAP file")]
    NotMcap,
    /// An MCAP file, but of another program.
    #[error(
        "not a run log: it is an MCAP file of another program{}, without metadata `{RUN}`",
        in_brackets(library)
    )]
    OtherProgram {
        /// The library stated in the file; empty if there is none.
        library: String,
    },
}

fn in_brackets(library: &str) -> String {
    if library.is_empty() { String::new() } else { format!(" ({library:?})") }
}

/// A metadata record with invalid contents.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MetadataError {
    /// A key is missing.
    #[error("metadata `{record}` lacks the key {key}")]
    Missing {
        /// Name of the metadata record.
        record: &'static str,
        /// The key.
        key: &'static str,
    },
    /// A value is not of its key's type, or out of range.
    #[error("metadata `{record}` has {key} = {value:?}, which is not {accepted}")]
    Invalid {
        /// Name of the metadata record.
        record: &'static str,
        /// The key.
        key: String,
        /// The value.
        value: String,
        /// The accepted values.
        accepted: Cow<'static, str>,
    },
}

/// Why a run log cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// Another process writes this log.
    #[error("{} is being written by another process", .0.display())]
    Busy(PathBuf),
    /// The temporary name belongs to something other than an unfinished log, which is not
    /// overwritten.
    #[error("{0}, and is where the unfinished log would stand; it is not replaced")]
    Foreign(Box<LogError>),
    /// Other reasons why the file is not written or renamed.
    #[error(transparent)]
    File(FileError),
    /// The MCAP library failed.
    #[error("{}: {error}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// Why.
        error: mcap::McapError,
    },
    /// A part that readers would refuse.
    #[error("{0}: {1}")]
    TooLong(&'static str, String),
    /// An event of an unannounced topic.
    #[error("an event of the topic {0}, which no detector announced")]
    UnknownTopic(String),
    /// A value that JSON cannot represent.
    #[error("a message of {topic} at step {step} holds a value that is not finite")]
    NotFinite {
        /// The topic.
        topic: &'static str,
        /// The step.
        step: u64,
    },
}

impl From<FileError> for WriteError {
    fn from(error: FileError) -> WriteError {
        match error {
            FileError::Busy(path) => WriteError::Busy(path),
            error => WriteError::File(error),
        }
    }
}

impl From<LogError> for WriteError {
    fn from(error: LogError) -> WriteError {
        match error {
            LogError { path, problem: LogProblem::Io(error) } => WriteError::io(&path, error),
            foreign => WriteError::Foreign(Box::new(foreign)),
        }
    }
}

impl WriteError {
    pub(crate) fn io(path: &Path, error: io::Error) -> WriteError {
        WriteError::File(FileError::Io { path: path.to_owned(), error })
    }

    pub(crate) fn of_mcap(path: &Path, error: mcap::McapError) -> WriteError {
        match error {
            // The system's message, which may be that the disk is full.
            mcap::McapError::Io(error) => WriteError::io(path, error),
            error => WriteError::Mcap { path: path.to_owned(), error },
        }
    }
}
