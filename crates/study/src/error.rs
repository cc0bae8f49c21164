//! Why a study cannot be read, made or written.

use std::path::Path;

use asperity_figures::draw::FigureError;
use asperity_files::FileError;
use asperity_numbers::run_data::NotKept;

/// Why a study cannot be read, made or written.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// Its file, its plan or what is asked of it is not accepted: the message names the place, the value and what is
    /// accepted.
    #[error("{0}")]
    Refused(String),
    /// A file cannot have its name, or could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A run, a result, a table or a figure could not be made or read.
    #[error("{0}")]
    Failed(String),
    /// The caller stopped it; what is done stays.
    #[error("stopped; a later call goes on")]
    Stopped,
}

impl StudyError {
    /// A failure, in its own words.
    pub(crate) fn failed(error: impl std::fmt::Display) -> StudyError {
        StudyError::Failed(error.to_string())
    }

    /// What is wrong with what a path has.
    pub(crate) fn refused(path: &Path) -> impl Fn(String) -> StudyError + use<> {
        let path = path.display().to_string();
        move |problem| StudyError::Refused(format!("{path}: {problem}"))
    }

    /// The failure of the system at a path.
    pub(crate) fn at(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
        move |error| StudyError::Failed(format!("{}: {error}", path.display()))
    }
}

impl From<FigureError> for StudyError {
    fn from(error: FigureError) -> StudyError {
        match error {
            FigureError::File(error) => StudyError::File(error),
            error @ FigureError::Figure { .. } => StudyError::failed(error),
        }
    }
}

impl From<NotKept> for StudyError {
    fn from(error: NotKept) -> StudyError {
        StudyError::failed(error)
    }
}
