//! What can be wrong with a run log, read or written.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::{FileError, NoFile};
use asperity_record::bounds::TooLong;
use asperity_record::{Direction, RECORD_SCHEMA_VERSION};

use crate::format::{RUN, RUN_END, SALVAGE};

/// A run log that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct LogError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: LogProblem,
}

/// What is wrong with a run log.
#[derive(Debug, thiserror::Error)]
pub enum LogProblem {
    /// The system refused.
    #[error("{0}")]
    Io(io::Error),
    /// It is none.
    #[error(transparent)]
    NoRunLog(#[from] NoRunLog),
    /// More than a log has of something.
    #[error("{found} {what} (accepted: up to {most})")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many there are, or at least.
        found: usize,
        /// How many there may be.
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
        /// Where in the file it begins, or the chunk that it is in.
        at: u64,
        /// Why.
        error: mcap::McapError,
    },
    /// A record that has no room for what it says it holds.
    #[error("the record at byte {at}, of the kind 0x{opcode:02x}, holds a length that reaches over its end")]
    InnerLength {
        /// Where in the file it begins, or the chunk that it is in.
        at: u64,
        /// Its kind.
        opcode: u8,
    },
    /// A record that reaches over the end of a file that was not cut off.
    #[error(
        "the record at byte {0} claims to be longer than the rest of the file, which was not cut off there"
    )]
    Overlong(u64),
    /// A message on a channel that nothing announced.
    #[error("a message of channel {0}, which nothing announced")]
    UnknownChannel(u16),
    /// A channel that is announced for two topics.
    #[error("channel {id} is that of {topic} and of {other}")]
    ChannelReused {
        /// The channel.
        id: u16,
        /// What it was announced for first.
        topic: String,
        /// What it is announced for then.
        other: String,
    },
    /// A topic on two channels.
    #[error("{0} has two channels")]
    TopicTwice(String),
    /// A message that is missing, or there twice.
    #[error("message {found} of {topic} stands where number {expected} must")]
    Number {
        /// The topic.
        topic: String,
        /// The number that it must have.
        expected: u32,
        /// The number that it has.
        found: u32,
    },
    /// A text that is none.
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
        /// The time that the message has in the file.
        found_ns: u64,
        /// The time of its step.
        expected_ns: Option<u64>,
    },
    /// A message that says two things which cannot both be.
    #[error("step {step}: {what}")]
    Contradiction {
        /// The step.
        step: u64,
        /// What it says.
        what: String,
    },
    /// An array that has not one value per block.
    #[error("step {step}: {key} has {found} values, not {expected}")]
    ArrayLength {
        /// The step.
        step: u64,
        /// The array.
        key: &'static str,
        /// How many values it has.
        found: usize,
        /// How many it must have.
        expected: usize,
    },
    /// Header or end do not say what they must.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
    /// A run log that has lost its header.
    #[error("no metadata `{RUN}` before the first message")]
    NoHeader,
    /// Written by a later version, or by none.
    #[error(
        "written with version {0} of the format; this program reads versions 1 to {RECORD_SCHEMA_VERSION}: a newer one is needed"
    )]
    Version(u32),
    /// A message that is not what its topic promises.
    #[error("message {sequence} of {topic} cannot be read: {error}")]
    Message {
        /// The topic.
        topic: String,
        /// The message's number in it.
        sequence: u32,
        /// What is wrong with it.
        error: serde_json::Error,
    },
    /// Switches that do not belong to the step before them.
    #[error("step {step} promises {promised} switches and has {found}")]
    Switches {
        /// The step.
        step: u64,
        /// How many its message promises.
        promised: u32,
        /// How many follow.
        found: u32,
    },
    /// A switch of a block that the chain does not have, or to where it already is.
    #[error("block {block} cannot {direction:?} at step {step}")]
    ImpossibleSwitch {
        /// The step.
        step: u64,
        /// The block.
        block: u32,
        /// What it is said to do.
        direction: Direction,
    },
    /// A step with another number of sliding blocks than its switches give.
    #[error("step {step} says that {promised} blocks slide; the switches before it leave {found}")]
    Sliding {
        /// The step.
        step: u64,
        /// How many its message says.
        promised: u32,
        /// How many are detached.
        found: u32,
    },
    /// What a log says of itself and is not so: its records `chunk`, its indexes, its summary.
    #[error("the record at byte {at}: {what}")]
    Unsound {
        /// Where in the file it begins, or the chunk that it is in.
        at: u64,
        /// What is wrong.
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
    /// The run could not go on, and why.
    #[error("the run was stopped: {0}")]
    Stopped(String),
    /// The log is what was left of a damaged one.
    #[error("it was salvaged from a damaged log; metadata `{SALVAGE}` says what is missing")]
    Salvaged,
    /// The content is not what `run_end` says.
    #[error("metadata `{RUN_END}` says {what} {promised}, the file has {found}")]
    EndMismatch {
        /// What differs.
        what: String,
        /// What `run_end` says.
        promised: String,
        /// What the file has.
        found: String,
    },
    /// What was found before, in its words: what stands after that is not read.
    #[error("{0}")]
    Before(String),
}

/// That there are no more of something than there may be.
///
/// # Errors
/// If there are.
pub(crate) fn most(what: &'static str, found: usize, most: usize) -> Result<(), LogProblem> {
    if found > most { Err(LogProblem::TooMany { what, found, most }) } else { Ok(()) }
}

impl LogProblem {
    /// The same for who asks again: an early end as it is, since it tells what the log can be
    /// used for, all else in its words.
    pub(crate) fn again(&self) -> LogProblem {
        match self {
            LogProblem::NoEnd => LogProblem::NoEnd,
            LogProblem::Interrupted(step) => LogProblem::Interrupted(*step),
            LogProblem::Stopped(why) => LogProblem::Stopped(why.clone()),
            LogProblem::Salvaged => LogProblem::Salvaged,
            LogProblem::Mcap(mcap::McapError::UnexpectedEof) => mcap::McapError::UnexpectedEof.into(),
            LogProblem::NoRunLog(reason) => LogProblem::NoRunLog(reason.clone()),
            other => LogProblem::Before(other.to_string()),
        }
    }

    /// The same, with where in the file it is.
    pub(crate) fn at(self, at: u64) -> LogProblem {
        match self {
            LogProblem::Mcap(error) => LogProblem::Record { at, error },
            other => other,
        }
    }

    /// Whether the file is no run log at all: then nothing is damaged, there is nothing that
    /// could be.
    pub fn is_no_run_log(&self) -> bool {
        matches!(self, LogProblem::NoRunLog(_))
    }

    /// Whether the file only ends too early: what stands before is as it was written. Of an
    /// empty file both are true, that it is no run log and that it ends too early: a run that
    /// is stopped as it begins may leave one. In words it is only said to be empty.
    pub fn is_early_end(&self) -> bool {
        matches!(
            self,
            LogProblem::NoEnd
                | LogProblem::NoRunLog(NoRunLog::Empty)
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

/// Why something is no run log.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoRunLog {
    /// Nothing stands there.
    #[error("there is no such file")]
    Missing,
    /// Something else than a file stands there.
    #[error("not a run log: it is {}", .0.words())]
    NoFile(NoFile),
    /// A file of no bytes, which may also be a log that was hardly begun.
    #[error("the file is empty")]
    Empty,
    /// A file of another kind.
    #[error("not a run log: it does not begin with the eight bytes that begin every MCAP file")]
    NotMcap,
    /// An MCAP file, but of another program.
    #[error("not a run log: it is an MCAP file of another program ({library:?}), without metadata `{RUN}`")]
    OtherProgram {
        /// What the file says of the library that wrote it.
        library: String,
    },
}

/// A metadata record that does not say what it must.
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
    /// A value is not of its key's type or range.
    #[error("metadata `{record}` has {key} = {value:?}, which is not {accepted}")]
    Invalid {
        /// Name of the metadata record.
        record: &'static str,
        /// The key.
        key: String,
        /// The value.
        value: String,
        /// What would be accepted.
        accepted: Cow<'static, str>,
    },
}

/// A run log that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The final name is taken; nothing was written.
    #[error("{} exists already", .0.display())]
    Exists(PathBuf),
    /// Another process writes this log.
    #[error("{} is being written by another process", .0.display())]
    Busy(PathBuf),
    /// What stands where the unfinished log would is none, and is not written over.
    #[error("{0}, and is where the unfinished log would stand; it is not replaced")]
    Foreign(Box<LogError>),
    /// Another reason why the file is not written, or does not get its name.
    #[error(transparent)]
    File(FileError),
    /// The system refused.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The MCAP library refused.
    #[error("{}: {error}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// Why.
        error: mcap::McapError,
    },
    /// An event of a topic that no detector announced.
    #[error("an event of the topic {0}, which no detector announced")]
    UnknownTopic(String),
    /// A value that JSON cannot hold.
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

impl WriteError {
    pub(crate) fn of_mcap(path: &Path, error: mcap::McapError) -> WriteError {
        let path = path.to_owned();
        match error {
            // In the system's words, which say that the disk is full.
            mcap::McapError::Io(error) => WriteError::Io { path, error },
            error => WriteError::Mcap { path, error },
        }
    }
}
