//! The key numbers of a run: when it slipped, how far its precursors reached, the speed of its
//! fronts, its energy balance.
//!
//! A [`Summarizer`] receives a run live or from a log, and returns a [`Summary`]. [`Summary::KEYS`]
//! defines the meaning and unit of every number; the page that explains them, the tables and
//! [`Summary::schema`] are generated from it. [`text`] formats summaries for a terminal. [`claim`] has
//! claims about such numbers, as they were judged, and reads their table.
//!
//! ```
//! use asperity_record::RunHeader;
//! use asperity_summary::{RupturesFrom, Slider, Summarizer, Summary};
//! use asperity_testkit::quiet_step;
//!
//! let header = RunHeader {
//!     record_schema_version: asperity_record::RECORD_SCHEMA_VERSION,
//!     scenario: "default".to_owned(),
//!     scenario_hash: String::new(),
//!     run_id: String::new(),
//!     code_version: String::new(),
//!     parameter_set: "as-coded".to_owned(),
//!     solver: "fast".to_owned(),
//!     blocks: 10,
//!     rows: 1,
//!     time_step_s: 1e-7,
//!     longest_stable_step_s: None,
//!     steps: 20_000_000,
//!     scales: None,
//! };
//! let mut summarizer = Summarizer::new("mine", &header, Slider::default());
//! summarizer.step(&quiet_step(20_000_000, 2.0, 0.25));
//! let summary = summarizer.finish(RupturesFrom::Log, None);
//! assert_eq!((summary.precursor_count, summary.largest_ft_fn), (Some(0), Some(0.25)));
//! assert_eq!(summary.first_slip_s, None);
//! assert_eq!(Summary::KEYS.len(), summary.row().len());
//! ```

pub mod claim;
mod creep;
mod growth;
mod key;
mod measures;
mod raw;
mod statistics;
mod summarizer;
mod summary;
pub mod text;
mod unloaded;

pub use growth::Growth;
pub use key::Key;
pub use measures::{WIDE_BLOCKS, front_speed_m_per_s};
pub use statistics::median;
pub use summarizer::{LengthLaw, RupturesFrom, Slider, Summarizer};
pub use summary::Summary;
