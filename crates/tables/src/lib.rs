//! Run logs as tables that data frames read: one file per topic.
//!
//! In reading order:
//!
//! - [`layout`]: the columns of each topic's table, and why arrays become rows.
//! - [`rows`]: converts records to rows.
//! - `foreign`: the columns of events without a detector in this program.
//! - [`batch`]: a batch of rows by columns, the part in memory at a time.
//! - [`mod@format`]: the interface of a file format.
//! - `comma` and `lines`: CSV and NDJSON; [`parquet_tables`]: Parquet, with polars.
//! - [`run_tables`]: the rows of all tables of a run, while it is observed.
//! - [`export`]: from a log that is read to the files.
//!
//! ```
//! use asperity_files::{Existing, Inputs};
//! use asperity_record::{EventKind, SlipEvent};
//! use asperity_run::OpenLog;
//! use asperity_tables::format::State;
//! use asperity_tables::run_tables::Chosen;
//! use asperity_tables::{Csv, Export, Request, name_of};
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
//! let mut export = Export::begin(header, scenario_toml, &schemas, request, &kinds, &Csv)?;
//! assert!(log.check(&mut export).verdict.holds_all());
//! let report = export.finish(State::Whole, None)?;
//! let (path, rows) = &report.files[0];
//! let table = std::fs::read_to_string(path)?;
//! assert!(table.starts_with("onset_s,end_s,first_block,last_block,max_sliding,ft_fn_onset,ft_fn_end"));
//! assert_eq!(table.lines().count() as u64, rows.unwrap() + 1);
//! # assert!(rows.unwrap() > 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod batch;
mod comma;
pub mod curves;
mod error;
pub mod event_file;
pub mod export;
mod foreign;
pub mod format;
mod guarded;
pub mod layout;
mod lines;
pub mod load_table;
mod parquet_bounds;
pub mod parquet_checksum;
mod parquet_out;
pub mod parquet_table;
pub mod parquet_tables;
pub mod rows;
pub mod run_tables;
pub mod summaries;
pub mod table_file;
pub mod tables;
pub mod vtk;

pub use comma::{Csv, CsvRows, Spelling};
pub use error::TableFileError;
pub use export::{Export, ExportError, Ran, Report, Request, name_of};
pub use lines::Ndjson;
/// A table in memory.
pub use polars::prelude::DataFrame as Frame;
pub use rows::NodeRows;
