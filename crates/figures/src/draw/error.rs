//! What can go wrong with a figure.

use asperity_files::FileError;

/// A figure that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// A file cannot have its name, or could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A figure asks for what its run does not have.
    #[error("figure {file}: {problem}")]
    Figure {
        /// The figure's file.
        file: String,
        /// What is missing or went wrong.
        problem: String,
    },
}
