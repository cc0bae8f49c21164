//! Two tables of slip events in, what became of each event out.
//!
//! In reading order:
//!
//! - [`column`]: the columns of the event table, and what each says.
//! - [`report`]: what a diff found, as data.
//! - [`page()`]: a report as one HTML page.

pub mod column;
mod page;
pub mod report;

pub use page::page;
