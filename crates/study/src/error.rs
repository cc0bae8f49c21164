//! Errors between the runs of a pipeline and its tables and figures.

use asperity_figures::draw::FigureError;
use asperity_files::FileError;
use asperity_tables::TableFileError;

/// A table, figure or claim of a pipeline that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A figure could not be made.
    #[error(transparent)]
    Figure(FigureError),
    /// A table could not be made or written.
    #[error(transparent)]
    Table(TableFileError),
    /// A file cannot have its name, or could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A run lacks what a table of several runs needs.
    #[error("{run}: {problem}")]
    Run {
        /// The run.
        run: String,
        /// The error.
        problem: String,
    },
}

impl From<FigureError> for StudyError {
    fn from(error: FigureError) -> StudyError {
        match error {
            FigureError::File(error) => StudyError::File(error),
            error @ FigureError::Figure { .. } => StudyError::Figure(error),
        }
    }
}

impl From<TableFileError> for StudyError {
    fn from(error: TableFileError) -> StudyError {
        match error {
            TableFileError::File(error) => StudyError::File(error),
            error => StudyError::Table(error),
        }
    }
}
