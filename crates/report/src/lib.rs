//! A run or a whole study as one page: parameters, results of the claims, figures, and for every run its
//! load curve beside the space-time map of its ruptures.
//!
//! It reads and writes no files. The caller passes the records of runs to [`PageCollector`], which keeps
//! only the data for the page; [`Study::html`] assembles the parts.
//!
//! ```
//! use asperity_report::{PageCollector, Limits};
//!
//! // A load that drops in one step of a million is seen in the curve.
//! let mut run = PageCollector::new(1_000_000, 100, Limits::of_runs(1));
//! for step in 0..1_000_000 {
//!     let load = if step == 654_321 { 0.2 } else { 0.4 };
//!     run.step(step, load);
//! }
//! let collected = run.finish();
//! assert!(collected.curve.contains(&(654_321, 0.2)));
//! assert!(collected.curve.len() < 5000);
//! ```
//!
//! In reading order:
//!
//! - `downsample`: a load curve of few points that has lost no drop; the widest of many.
//! - `page_collector`: the data kept of a run.
//! - `study`: the parts of a page.
//! - `symbols`: symbols and numbers as they are printed.
//! - `lattice_sketch`, `sketch`: the model of a scenario, drawn with `pen`.
//! - `parameter_table`: the parameters of scenarios; `derived`: quantities that follow from them.
//! - `over_area`: the map over the area of contact of a rupture.
//! - `verdict`, `claims`, `figures`, `runs`: parts of the page.
//! - `contents`: the description of a page in its folder.
//! - `page`: the page of a study; `sweep`: that of a parameter study; `index`: that of several.

mod claims;
mod contents;
mod derived;
mod downsample;
mod figures;
pub mod html;
mod index;
mod lattice_sketch;
mod measured;
mod over_area;
mod page;
mod page_collector;
mod parameter_table;
mod pen;
mod runs;
mod sketch;
mod study;
mod sweep;
mod symbols;
mod verdict;

pub use contents::{Contents, ReadFile, Recorded, RecordedRun, encoded, files_of_picture, picture};
pub use figures::Figure;
pub use index::{Entry, index};
pub use page::STYLE;
pub use page_collector::{Collected, Limits, PageCollector};
pub use sketch::sketch_alone;
pub use study::{Link, Run, Study};
pub use sweep::{Sweep, UNNAMED};
