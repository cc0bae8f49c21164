//! Why two sides cannot be compared.

use asperity_files::FileError;

/// Two sides that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A side, or one of its files, is not what can be compared: file, place, problem and what is accepted.
    #[error("{0}")]
    Input(String),
    /// A file would be written over one that is read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file of matches cannot be begun.
    #[error(transparent)]
    NoMatchesFile(FileError),
    /// Matches cannot be written.
    #[error(transparent)]
    Matches(FileError),
}
