//! Why two sides cannot be compared.

use std::path::PathBuf;

use crate::claims::ClaimsError;
use crate::sides::SideError;
use crate::table::TableError;

/// Two sides that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// There are no runs at a path.
    #[error(transparent)]
    Side(#[from] SideError),
    /// A table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Summary or ruptures of a run log cannot be determined.
    #[error("{}: {problem}", path.display())]
    Log {
        /// The log.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// A table is not in order.
    #[error("{}: {problem}", path.display())]
    Order {
        /// The table.
        path: PathBuf,
        /// The events that are out of order.
        problem: String,
    },
    /// The scenario in a run log is no TOML.
    #[error("{}, {}: scenario.toml: {error}", old.display(), new.display())]
    Scenario {
        /// The old run.
        old: PathBuf,
        /// The new run.
        new: PathBuf,
        /// The error in one of them.
        error: Box<toml::de::Error>,
    },
    /// A table of claims cannot be read.
    #[error(transparent)]
    Claims(#[from] ClaimsError),
    /// A file would be written over one that is read.
    #[error(transparent)]
    File(#[from] asperity_files::FileError),
    /// The file of matches cannot be begun.
    #[error(transparent)]
    NoMatchesFile(asperity_tables::TableFileError),
    /// Matches cannot be written.
    #[error(transparent)]
    Matches(asperity_tables::TableFileError),
}

impl CompareError {
    /// Whether the input is sound and the system refused to write.
    pub fn is_of_output(&self) -> bool {
        matches!(self, CompareError::Matches(_))
    }
}
