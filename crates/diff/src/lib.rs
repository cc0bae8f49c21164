//! Two tables of slip events in, what became of each event out.
//!
//! In reading order:
//!
//! - [`mod@column`]: the columns of the event table, and what each says.
//! - `cost`: what it costs to say that events belong together.
//! - `grid`: one step of looking for the matching that costs least.
//! - [`matching`]: that matching, found as the tables are read.
//! - [`policy`]: which differences are none, and which are allowed.
//! - [`classify`]: what became of the events that belong together.
//! - [`statistics`]: distributions, where there are no counterparts.
//! - [`tally`]: one pair of runs, from events to report.
//! - [`provenance`]: what tells two runs apart beside their events.
//! - [`report`]: what a diff found, as data.
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
pub mod statistics;
pub mod tally;
