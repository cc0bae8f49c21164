//! Run logs to tables, tables to figures, claims against measurements.
//!
//! In reading order:
//!
//! - [`run_data`]: a run log in memory.
//! - [`precursors`]: which slip events count as precursors.
//! - [`tables`]: polars tables of events, precursors, load and residuals.
//! - [`table_file`]: a table as CSV and Parquet.
//! - [`parquet_tables`]: what a log holds as Parquet, written as it is read.
//! - [`event_file`]: event tables and matches of a diff as Parquet.
//! - [`measure`]: single numbers read off a run.
//! - [`claims`]: what a text claims beside what was measured, and the verdict.
//! - [`study`]: such numbers against a parameter.
//! - [`figures`]: drawn with plotters and an embedded font.
//! - [`pipeline`]: the TOML that says which runs, tables, figures and claims.

pub mod claims;
pub mod event_file;
pub mod figures;
#[cfg(test)]
mod made_up;
pub mod measure;
pub mod parquet_tables;
pub mod pipeline;
pub mod precursors;
pub mod run_data;
pub mod study;
pub mod table_file;
pub mod tables;

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
    /// A file could not be written.
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
