//! Run logs as tables that data frames read: one file per topic.
//!
//! In reading order:
//!
//! - [`layout`]: which columns each topic's table has, and why arrays become rows.
//! - `rows`: what of a record goes into which row.
//! - [`batch`]: some rows, by columns; what is held in memory at a time.
//! - [`mod@format`]: what a file format must do.
//! - `comma` and `lines`: CSV and NDJSON. Parquet needs polars, so it is in
//!   `asperity-analysis`, and looks like these from here.
//! - [`export`]: from the log to the files.
//! - [`whole`]: files that bear their name only once they are whole, as those of `asperity-runlog`.

pub mod batch;
mod comma;
pub mod export;
pub mod format;
pub mod layout;
mod lines;
mod rows;

pub use comma::Csv;
pub use export::{Export, ExportError, Ran, Report, Request, name_of};
pub use lines::Ndjson;

/// Files that bear their name only once they are whole.
pub mod whole {
    pub use asperity_runlog::WholeFile;
}
