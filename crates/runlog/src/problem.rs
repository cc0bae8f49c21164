//! Errors of reading and writing run logs.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::{FileError, NoFile};
use asperity_record::bounds::TooLong;
use asperity_record::{Direction, RECORD_SCHEMA_VERSION};

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
    /// A record whose contents exceed its length.
    #[error("the record at byte {at}, of the kind 0x{opcode:02x}, holds a length that reaches over its end")]
    InnerLength {
        /// Offset of the record, or of its chunk, in the file.
        at: u64,
        /// Its kind.
        opcode: u8,
    },
    /// A record that exceeds the end of a file that was not truncated.
    #[error(
        "the record at byte {0} claims to be longer than the rest of the file, which was not cut off there"
    )]
    Overlong(u64),
    /// A message on an unannounced channel.
    #[error("a message of channel {0}, which nothing announced")]
    UnknownChannel(u16),
    /// A channel announced for two topics.
    #[error("channel {id} is that of {topic} and of {other}")]
    ChannelReused {
        /// The channel.
        id: u16,
        /// The first.
        topic: String,
        /// The other.
        other: String,
    },
    /// A topic on two channels.
    #[error("{0} has two channels")]
    TopicTwice(String),
    /// A missing or repeated message.
    #[error("message {found} of {topic} stands where number {expected} must")]
    Number {
        /// The topic.
        topic: String,
        /// The expected number.
        expected: u32,
        /// The number found.
        found: u32,
    },
    /// A text that is not UTF-8.
    #[error("attachment `{0}` is not UTF-8")]
    NotText(&'static str),
    /// A time in the file that is not that of the message's step.
    #[error(
        "{topic}: the message of step {step} stands at {found_ns} ns, not at {}",
        expected_ns.map_or("any time that a file can give".to_owned(), |ns| format!("{ns} ns"))
    )]
    LogTime {
        /// The topic.
        topic: String,
        /// The step.
        step: u64,
        /// The message's time in the file.
        found_ns: u64,
        /// The time of its step.
        expected_ns: Option<u64>,
    },
    /// A message that contradicts itself.
    #[error("step {step}: {what}")]
    Contradiction {
        /// The step.
        step: u64,
        /// The contradiction.
        what: String,
    },
    /// An array that does not have one value per block.
    #[error("step {step}: {key} has {found} values, not {expected}")]
    ArrayLength {
        /// The step.
        step: u64,
        /// The array.
        key: &'static str,
        /// Its length.
        found: usize,
        /// The number of blocks.
        expected: usize,
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
    /// Switches that do not belong to the step before them.
    #[error("step {step} promises {promised} switches and has {found}")]
    Switches {
        /// The step.
        step: u64,
        /// The number that the step states.
        promised: u32,
        /// The number that follows.
        found: u32,
    },
    /// A switch of a block that does not exist, or to the state that it already has.
    #[error("block {block} cannot {direction:?} at step {step}")]
    ImpossibleSwitch {
        /// The step.
        step: u64,
        /// The block.
        block: u32,
        /// The direction of the switch.
        direction: Direction,
    },
    /// A step whose number of sliding blocks contradicts the switches.
    #[error("step {step} says that {promised} blocks slide; the switches before it leave {found}")]
    Sliding {
        /// The step.
        step: u64,
        /// The number that the step states.
        promised: u32,
        /// The number detached.
        found: u32,
    },
    /// A wrong record `chunk`, index or summary.
    #[error("the record at byte {at}: {what}")]
    Unsound {
        /// Offset of the record, or of its chunk, in the file.
        at: u64,
        /// The error.
        what: &'static str,
    },
    /// Two headers, or something after the end.
    #[error("{0}")]
    Misplaced(&'static str),
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

    /// Whether the file is not a run log at all, so that nothing can be damaged.
    pub fn is_no_run_log(&self) -> bool {
        matches!(self, LogProblem::NoRunLog(_))
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
    /// The final name is taken; nothing was written.
    #[error("{} exists already", .0.display())]
    Exists(PathBuf),
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
    /// The system call failed.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
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
            FileError::Exists(path) => WriteError::Exists(path),
            FileError::Busy(path) => WriteError::Busy(path),
            FileError::Io { path, error } => WriteError::Io { path, error },
            error => WriteError::File(error),
        }
    }
}

impl From<LogError> for WriteError {
    fn from(error: LogError) -> WriteError {
        match error {
            LogError { path, problem: LogProblem::Io(error) } => WriteError::Io { path, error },
            foreign => WriteError::Foreign(Box::new(foreign)),
        }
    }
}

impl WriteError {
    pub(crate) fn of_mcap(path: &Path, error: mcap::McapError) -> WriteError {
        let path = path.to_owned();
        match error {
            // The system's message, which may be that the disk is full.
            mcap::McapError::Io(error) => WriteError::Io { path, error },
            error => WriteError::Mcap { path, error },
        }
    }
}
