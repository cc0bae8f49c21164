//! Why a recording is refused.

use std::env;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a recording cannot be read. Nothing is written then.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// Its description is not accepted: file, line, column, key, value, and what is accepted.
    #[error("{0}")]
    Description(String),
    /// A file cannot be opened or read.
    #[error("{}: {error}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Whoever waits for it has stopped it.
    #[error("interrupted")]
    Interrupted,
    /// A file holds what is not accepted.
    #[error(transparent)]
    Input(#[from] Box<InputFault>),
}

impl RecordingError {
    pub(crate) fn io(file: &Path) -> impl Fn(io::Error) -> RecordingError {
        let file = file.to_owned();
        move |error| RecordingError::Io { file: file.clone(), error }
    }

    /// Of records that are kept in the folder for temporary files.
    pub(crate) fn spool(error: io::Error) -> RecordingError {
        RecordingError::io(&env::temp_dir())(error)
    }
}

/// What is wrong with a value in a file of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct InputFault {
    /// The file.
    pub file: PathBuf,
    /// Where in it.
    pub place: Place,
    /// Name or number of the column or channel.
    pub column: Option<String>,
    /// The value, as it is written.
    pub value: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What is accepted.
    pub accepted: &'static str,
}

impl InputFault {
    pub(crate) fn new(
        file: &Path,
        place: Place,
        problem: impl Into<String>,
        accepted: &'static str,
    ) -> Box<InputFault> {
        let (file, problem) = (file.to_owned(), problem.into());
        Box::new(InputFault { file, place, column: None, value: None, problem, accepted })
    }

    pub(crate) fn of(mut self: Box<InputFault>, column: impl fmt::Display) -> Box<InputFault> {
        self.column = Some(column.to_string());
        self
    }

    pub(crate) fn with(mut self: Box<InputFault>, value: Option<String>) -> Box<InputFault> {
        self.value = value;
        self
    }
}

/// Where a value stands in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Anywhere in it.
    File,
    /// A line, from 1.
    Line(u64),
    /// A sample, from 0.
    Sample(u64),
}

impl fmt::Display for InputFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let InputFault { file, place, column, value, problem, accepted } = self;
        write!(f, "{}", file.display())?;
        match place {
            Place::File => {}
            Place::Line(line) => write!(f, ":{line}")?,
            Place::Sample(sample) => write!(f, ": sample {sample}")?,
        }
        write!(f, ": ")?;
        // Names and values may be as long as a file makes them.
        match (column, value) {
            (Some(column), Some(value)) => write!(f, "{column:.200} = {value:.200}: ")?,
            (Some(column), None) => write!(f, "{column:.200}: ")?,
            _ => {}
        }
        write!(f, "{problem:.1000} (accepted: {accepted})")
    }
}

impl std::error::Error for InputFault {}
