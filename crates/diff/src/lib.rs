//! Compares the slip events and ruptures of runs: finds, pairs and reads the runs, and matches their events
//! by the times and blocks of slip.
//!
//! ```
//! use asperity_diff::report::Class;
//! use asperity_diff::{Settings, compare};
//! use asperity_files::{Existing, FileSet, Inputs};
//!
//! # let folder = tempfile::tempdir()?;
//! # let [before, after] = ["before.csv", "after.csv"].map(|name| folder.path().join(name));
//! std::fs::write(&before, "onset_s,end_s,first_block,last_block\n0.1,0.2,1,5\n0.4,0.5,1,9\n")?;
//! std::fs::write(&after, "onset_s,end_s,first_block,last_block\n0.1,0.2,1,5\n")?;
//!
//! // Nothing is written here: no file of matches is asked for.
//! let files = FileSet::new(Existing::Refuse, Inputs::default());
//! let report = compare(&before, &after, &Settings::default(), &files)?.report;
//! assert_eq!(report.counts[Class::Identical], 1);
//! assert_eq!(report.counts[Class::Missing], 1);
//! for line in asperity_diff::summary::lines(&report) {
//!     println!("{line}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The matching alone, without files:
//!
//! ```
//! use std::convert::Infallible;
//!
//! use asperity_diff::column::Columns;
//! use asperity_diff::matching::match_tables;
//! use asperity_diff::table::Table;
//! use asperity_record::{Parts, SlipEvent};
//!
//! let event = |event: u64, onset_s: f64, last_block: u32| SlipEvent {
//!     event,
//!     onset_s,
//!     end_s: Some(onset_s + 0.01),
//!     first_block: 1,
//!     last_block,
//!     ..SlipEvent::default()
//! };
//! let old = Table::of(Parts::default(), &[event(0, 0.1, 5), event(1, 0.2, 9), event(2, 0.3, 17)]);
//! // Without the second event the third has another number, and is the same event.
//! let new = Table::of(Parts::default(), &[event(0, 0.1, 5), event(1, 0.3, 17)]);
//!
//! let mut found = Vec::new();
//! match_tables([&old, &new], Columns::ALL, 1e-3, None, |group| {
//!     found.push((group.old.len(), group.new.len(), group.identical));
//!     Ok::<(), Infallible>(())
//! })?;
//! assert_eq!(found, [(1, 1, true), (1, 0, false), (1, 1, true)]);
//! # Ok::<(), Infallible>(())
//! ```
//!
//! In reading order, first the matching of two tables:
//!
//! - [`mod@column`]: the columns of the event table, and the role of each.
//! - [`table`]: a table of events in memory, from a run log or a CSV file.
//! - [`progress`]: cycles between global slips, used to pair runs of two parameter sets.
//! - `cost`: the cost of matching events.
//! - `grid`: one step of looking for the matching that costs least.
//! - [`matching`]: that matching.
//! - [`policy`]: which differences are ignored, and which are allowed.
//! - [`classify`]: classes of matched events.
//! - [`statistics`]: distributions, where events have no counterparts.
//! - [`tally`]: one pair of tables, from rows to classes.
//!
//! Then the sides and their files:
//!
//! - [`run_log`]: what is compared of a run log.
//! - [`sides`]: the runs of each side, and their pairs.
//! - [`provenance`]: differences between two runs beside their events.
//! - [`side_by_side`]: what is compared of two parameter sets before single events.
//! - `ruptures`: the ruptures of two runs, and how those that pair differ.
//! - `precursors`: the effect of changed events on the precursor table.
//! - `claims`: changed claims between two outputs of a pipeline.
//! - `matches`: every match as a row of a Parquet file.
//! - [`compare()`]: all of this, for two sides.
//!
//! And the results: [`report`] as data, rounded by `reading`; `document` says in words and tables what differs,
//! [`summary`] shows that on a terminal, [`page`] as one HTML page.

mod claims;
pub mod classify;
pub mod column;
mod compare;
mod cost;
mod document;
mod error;
mod finding;
mod grid;
mod matches;
pub mod matching;
pub mod page;
pub mod policy;
mod precursors;
pub mod progress;
pub mod provenance;
mod reading;
pub mod report;
pub mod run_log;
mod ruptures;
pub mod side_by_side;
pub mod sides;
pub mod statistics;
pub mod summary;
pub mod table;
pub mod tally;
mod timeline;

pub use compare::{Compared, Settings, compare};
pub use error::CompareError;
