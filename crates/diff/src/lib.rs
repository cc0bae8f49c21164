//! Two tables of slip events in, what became of each event out. No file is read or written
//! here.
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
//! In reading order:
//!
//! - [`mod@column`]: the columns of the event table, and what each says.
//! - `cost`: what it costs to say that events belong together.
//! - `grid`: one step of looking for the matching that costs least.
//! - `side`: one table as it is read.
//! - [`matching`]: that matching, found as the tables are read.
//! - [`policy`]: which differences are none, and which are allowed.
//! - [`classify`]: what became of the events that belong together.
//! - [`rupture`]: ruptures as rows that are matched as events are.
//! - [`statistics`]: distributions, where there are no counterparts.
//! - [`tally`]: one pair of runs, from events to report.
//! - [`provenance`]: what tells two runs apart beside their events.
//! - [`report`]: what a diff found, as data.
//! - [`summary`]: a report on a terminal.
//! - [`page`]: a report as one HTML page.

pub mod classify;
pub mod column;
mod cost;
mod grid;
pub mod matching;
pub mod page;
pub mod policy;
pub mod provenance;
pub mod report;
pub mod rupture;
mod side;
pub mod statistics;
pub mod summary;
pub mod tally;
