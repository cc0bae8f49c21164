//! Run logs to tables, tables to figures, claims against measurements.
//!
//! ```
//! use asperity_analysis::measure::Measure;
//! use asperity_analysis::precursors::{self, PrecursorRules};
//! use asperity_analysis::run_data::RunData;
//!
//! # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/v2/complete.mcap");
//! let run = RunData::read("complete", path.as_ref())?;
//! for precursor in precursors::find(&run, &PrecursorRules::default()) {
//!     let (length, load) = (precursor.length_ratio(run.header.blocks), precursor.start.ft_fn_onset);
//!     println!("L_p/L = {length:.2} at F_T/F_N = {load:.3}");
//! }
//! assert_eq!(Measure::CoefficientRatio.of(&run, None), Some(0.7 / 0.45));
//! assert!(Measure::PrecursorCount.of(&run, None) > Some(0.0));
//! # Ok::<(), asperity_analysis::AnalysisError>(())
//! ```
//!
//! In reading order:
//!
//! - [`wants`]: what is to be kept of a run.
//! - `growth`: precursors told from other slip events, one by one.
//! - [`states`]: the states of all blocks that something is measured in.
//! - [`run_data`]: what is kept of a run while its records pass.
//! - [`precursors`]: which slip events count as precursors.
//! - [`estimate`]: numbers with their standard errors.
//! - [`curves`]: what is read off a run for measures, tables and figures alike.
//! - `beside_theory`: single numbers that set a run beside a theory.
//! - `beside_hold`: the same before the drive is held and after it.
//! - `fronts`: fronts through the slider, read off its switches.
//! - `distributions`: distributions of sizes and times, with what is fitted to them.
//! - `goodness`: whether a sample can be from the law that was fitted to it.
//! - [`tables`]: polars tables of events, precursors, load and residuals.
//! - [`table_file`]: a table as CSV and Parquet.
//! - [`load_table`]: the one table that grows with the records of a run, written as they pass.
//! - [`summaries`]: summaries of runs as files.
//! - [`record`]: what tables and figures were made of, beside them.
//! - `parquet_bounds`, [`parquet_table`]: Parquet files of others, checked against their length
//!   before polars reads it.
//! - [`parquet_tables`]: what a log holds as Parquet, written as it is read.
//! - [`event_file`]: event tables and matches of a diff as Parquet.
//! - [`measure`]: single numbers read off a run.
//! - [`claims`]: what a text claims beside what was measured, and the verdict.
//! - [`study`]: the same numbers of several runs against a parameter.
//! - [`runs`]: the runs of a pipeline, single and in ensembles.
//! - [`figures`]: drawn with plotters and an embedded font.
//! - `spelling`: doc comments as words on a page.
//! - [`pipeline`]: the TOML that says which runs, tables, figures and claims.
//! - [`mod@reference`]: what may stand in it, as `docs/figures.md` has it.
//! - [`reduction`]: tables and figures of a pipeline, made of one run after the other.

mod at_rest;
mod beside_hold;
mod beside_theory;
pub mod claims;
pub mod curves;
mod distributions;
mod error;
pub mod estimate;
pub mod event_file;
pub mod figures;
mod fronts;
mod goodness;
mod growth;
mod guarded;
pub mod load_table;
#[cfg(test)]
mod made_up;
pub mod measure;
mod parquet_bounds;
pub mod parquet_checksum;
pub mod parquet_table;
pub mod parquet_tables;
mod partial;
pub mod pipeline;
mod plane_waves;
pub mod precursors;
pub mod record;
pub mod reduction;
pub mod reference;
pub mod run_data;
pub mod runs;
mod spelling;
pub mod states;
pub mod study;
pub mod summaries;
pub mod table_file;
pub mod tables;
pub mod wants;

pub use error::AnalysisError;
