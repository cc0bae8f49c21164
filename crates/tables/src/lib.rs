//! Run logs as tables that data frames read: one file per topic.
//!
//! In reading order:
//!
//! - [`layout`]: the columns of each topic's table, and why arrays become rows.
//! - `rows`: converts records to rows.
//! - `foreign`: the columns of events without a detector in this program.
//! - [`table`]: columns and cells, of which every table consists.
//! - [`mod@format`]: the formats of files, written by `comma` (CSV), `lines` (NDJSON) and `parquet`, with polars.
//! - [`table_files`]: the files of a table, while its rows are made.
//! - [`run_tables`]: the rows of all tables of a run, while it is observed.
//! - [`export`]: from a log that is read to the files.
//! - [`seas`]: series of a run as text of the SEAS benchmarks.
//! - [`tables`]: what a run is reduced to.
//!
//! ```
//! use asperity_files::{Existing, Inputs};
//! use asperity_record::{EventKind, SlipEvent};
//! use asperity_run::OpenLog;
//! use asperity_tables::format::Format;
//! use asperity_tables::run_tables::Chosen;
//! use asperity_tables::{Export, Request, name_of};
//!
//! # let run = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/complete.mcap");
//! # let run = std::path::Path::new(run);
//! # let folder = tempfile::tempdir()?;
//! # let out = folder.path().to_owned();
//! // The slip events of the log at `run` from 0.5 s on, as CSV in the folder `out`.
//! let request = Request {
//!     chosen: Chosen {
//!         topics: vec!["/events/slip".to_owned()],
//!         from_s: Some(0.5),
//!         ..Chosen::default()
//!     },
//!     out,
//!     name: name_of(run),
//!     existing: Existing::Refuse,
//!     inputs: Inputs::of([run]),
//! };
//! let log = OpenLog::open(run).map_err(|verdict| verdict.to_string())?;
//! let (header, scenario_toml, schemas) = (log.header(), log.scenario_toml(), log.event_schemas());
//! let kinds = [EventKind::of::<SlipEvent>()];
//! let mut export = Export::begin(header, scenario_toml, &schemas, request, &kinds, Format::Csv)?;
//! assert!(log.check(&mut export).verdict.holds_all());
//! let report = export.finish("whole", None)?;
//! let (path, rows) = &report.files[0];
//! let table = std::fs::read_to_string(path)?;
//! assert!(table.starts_with("onset_s,end_s,first_block,last_block,max_sliding,ft_fn_onset,ft_fn_end"));
//! assert_eq!(table.lines().count() as u64, rows.unwrap() + 1);
//! # assert!(rows.unwrap() > 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod comma;
pub mod curves;
pub mod export;
mod foreign;
pub mod format;
pub mod layout;
mod lines;
mod parquet;
#[cfg(test)]
#[path = "../../../tests/support/parquet.rs"]
#[expect(dead_code, reason = "the tests of the root folder use all of it")]
mod parquet_reading;
mod rows;
pub mod run_tables;
pub mod seas;
pub mod summaries;
pub mod table;
pub mod table_files;
pub mod tables;
pub mod vtk;

pub use comma::{CsvRows, Spelling};
pub use export::{Export, ExportError, Ran, Report, Request, name_of};
pub use format::Format;
pub use table::Table;
