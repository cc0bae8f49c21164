//! Errors with the file of a table.

use std::path::Path;

use asperity_files::FileError;

/// A table that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum TableFileError {
    /// A file cannot have its name, or could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A table could not be written.
    #[error("{path}: {problem}")]
    Write {
        /// The file.
        path: String,
        /// Why.
        problem: String,
    },
}

impl TableFileError {
    pub(crate) fn at(path: &Path) -> impl Fn(std::io::Error) -> TableFileError {
        move |error| TableFileError::Write { path: path.display().to_string(), problem: error.to_string() }
    }
}
