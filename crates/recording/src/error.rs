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
    Input(#[from] InputFault),
}

/// What is read of a recording, or why it is refused.
pub(crate) type Result<T, E = RecordingError> = std::result::Result<T, E>;

impl RecordingError {
    pub(crate) fn io(file: &Path) -> impl Fn(io::Error) -> RecordingError {
        move |error| RecordingError::Io { file: file.to_owned(), error }
    }

    /// Of records that are kept in the folder for temporary files.
    pub(crate) fn spool(error: io::Error) -> RecordingError {
        RecordingError::io(&env::temp_dir())(error)
    }
}

/// What is wrong in a file of samples.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}{place}: {of}{problem:.1000} (accepted: {accepted})", file.display())]
pub struct InputFault {
    file: PathBuf,
    /// Where in it: `:LINE`, `: sample N`, or nothing.
    place: String,
    /// Column or channel, and the value.
    of: String,
    problem: String,
    accepted: &'static str,
}

impl InputFault {
    pub(crate) fn new(
        file: &Path,
        place: impl Into<String>,
        problem: impl Into<String>,
        accepted: &'static str,
    ) -> InputFault {
        let (file, place, problem) = (file.to_owned(), place.into(), problem.into());
        InputFault { file, place, of: String::new(), problem, accepted }
    }

    /// In a column, with a value as it is written: both as long as a file makes them.
    pub(crate) fn of(self, column: impl fmt::Display, value: Option<&str>) -> InputFault {
        let value = value.map_or(String::new(), |value| format!(" = {value:.200}"));
        InputFault { of: format!("{column:.200}{value}: "), ..self }
    }
}
