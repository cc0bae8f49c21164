//! Parameter studies: many runs of one scenario, made on one machine or on many, and their tables.
//!
//! ```text
//! sweep (TOML) -> plan -> results in segments, by any number of workers -> tables
//! ```
//!
//! In reading order:
//!
//! - [`axis`]: what varies; [`Sweep`]: the file that says so.
//! - [`Plan`]: every run with its values and its id, made once and never changed.
//! - [`work`]: one run, from its row to what is kept of it.
//! - [`segment`]: where a worker puts results; [`Results`]: what there is in all of them.
//! - [`collect()`]: the tables.
//! - [`emit`]: scripts for clusters.
//!
//! What comes out depends on the plan alone: not on the order of the runs, how many workers there
//! were, or how often they were killed.

pub mod axis;
mod collect;
pub mod emit;
pub mod plan;
pub mod results;
pub mod segment;
mod sweep;
pub mod work;

pub use collect::{CollectError, collect};
pub use plan::{Plan, PlanError};
pub use results::Results;
pub use sweep::{Keep, Sweep, SweepError};
