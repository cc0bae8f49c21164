//! Errors with the file of a table.

use asperity_files::FileError;
use asperity_numbers::run_data::NotKept;
use polars::error::PolarsError;

/// A table that could not be made, read or written.
#[derive(Debug, thiserror::Error)]
pub enum TableFileError {
    /// polars refused.
    #[error("table: {0}")]
    Table(#[from] PolarsError),
    /// It needs data that were not kept of the run.
    #[error(transparent)]
    NotKept(#[from] NotKept),
    /// A file could not be read.
    #[error("{path}: {problem}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        problem: String,
    },
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
