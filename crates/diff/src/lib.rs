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
//! use asperity_record::SlipEvent;
//!
//! let event = |event: u64, onset_s: f64, first_block: u32, last_block: u32| SlipEvent {
//!     onset_s,
//!     end_s: Some(onset_s + 0.01),
//!     first_block,
//!     last_block,
//!     // Loads, steps and the like.
//!     # max_sliding: 1,
//!     # ft_fn_onset: 0.1,
//!     # ft_fn_end: Some(0.1),
//!     # event,
//!     # onset_step: (onset_s * 1e7) as u64,
//!     # end_step: Some((onset_s * 1e7) as u64 + 100_000),
//!     # blocks_slipped: last_block - first_block + 1,
//!     # nucleation_block: first_block,
//!     # ft_fn_min: 0.1,
//!     # ft_fn_max: 0.1,
//!     # open: false,
//!     # breaks_onset: None,
//!     # breaks_end: None,
//!     # repins_onset: None,
//!     # repins_end: None,
//!     # peak_velocity_m_per_s: None,
//!     # first_across: None,
//!     # last_across: None,
//! };
//! let old = [event(0, 0.1, 1, 5), event(1, 0.2, 1, 9), event(2, 0.3, 1, 17)];
//! // Without the second event the third has another number, and is the same event.
//! let new = [event(0, 0.1, 1, 5), event(1, 0.3, 1, 17)];
//!
//! let [old, new] = [&old[..], &new[..]].map(|table| table.iter().cloned().map(Ok::<_, Infallible>));
//! let mut told = Vec::new();
//! match_tables(old, new, Columns::ALL, 1e-3, |group| {
//!     told.push((group.old.len(), group.new.len(), group.identical));
//!     Ok(())
//! })?;
//! assert_eq!(told, [(1, 1, true), (1, 0, false), (1, 1, true)]);
//! # Ok::<(), asperity_diff::matching::MatchError<Infallible>>(())
//! ```
//!
//! In reading order, first the matching of two tables, which reads no files:
//!
//! - [`mod@column`], [`row`]: the columns of the event table, and the rows that have them.
//! - [`progress`]: cycles between global slips, used to pair runs of two parameter sets.
//! - `cost`: the cost of matching events.
//! - `grid`: one step of looking for the matching that costs least.
//! - `pending`: one table as it is read.
//! - [`matching`]: that matching, found as the tables are read.
//! - [`policy`]: which differences are ignored, and which are allowed.
//! - [`classify`]: classes of matched events.
//! - [`statistics`]: distributions, where events have no counterparts.
//! - [`tally`]: one pair of tables, from rows to classes.
//!
//! Then the sides and their files:
//!
//! - [`run_log`], [`table`]: reads run logs, and the slip events of tables one at a time.
//! - [`sides`]: the runs of each side, and their pairs.
//! - [`provenance`]: differences between two runs beside their events.
//! - `ruptures`: the ruptures of two runs, and how those that pair differ.
//! - `precursors`: the effect of changed events on the precursor table.
//! - `claims`: changed claims between two outputs of a pipeline.
//! - `matches`: every match as a row of a Parquet file.
//! - [`compare()`]: all of this, for two sides.
//!
//! And the results: [`report`] as data, rounded by `reading`: [`summary`] on a terminal, [`page`] as one
//! HTML page.
//!

mod claims;
pub mod classify;
pub mod column;
mod compare;
mod cost;
mod error;
mod grid;
mod matches;
pub mod matching;
pub mod page;
mod pending;
pub mod policy;
mod precursors;
pub mod progress;
pub mod provenance;
mod reading;
pub mod report;
pub mod row;
pub mod run_log;
mod ruptures;
pub mod sides;
pub mod statistics;
pub mod summary;
pub mod table;
pub mod tally;

pub use claims::ClaimsError;
pub use compare::{Compared, Settings, compare};
pub use error::CompareError;
