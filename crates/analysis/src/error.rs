//! What can go wrong between a run log and its tables and figures.

/// A table, figure or claim that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// A run log could not be read.
    #[error(transparent)]
    Log(#[from] asperity_runlog::LogError),
    /// A run log holds an event or scenario that cannot be understood.
    #[error("{run}: {problem}")]
    Run {
        /// The run.
        run: String,
        /// What is wrong.
        problem: String,
    },
    /// polars refused.
    #[error("table: {0}")]
    Table(#[from] polars::error::PolarsError),
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
    File(#[from] asperity_files::FileError),
    /// A table could not be written.
    #[error("{path}: {problem}")]
    Write {
        /// The file.
        path: String,
        /// Why.
        problem: String,
    },
    /// A figure asks for what its run does not have.
    #[error("figure {file}: {problem}")]
    Figure {
        /// The figure's file.
        file: String,
        /// What is missing or went wrong.
        problem: String,
    },
}
