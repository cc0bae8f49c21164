//! Parameter studies: many runs of one scenario, on one machine or many, and their tables.
//!
//! ```text
//! study (TOML) -> plan -> results, by any number of threads and processes -> tables, figures, claims
//! ```
//!
//! The runs and their parameters:
//!
//! ```
//! use asperity_study::{Plan, Study};
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("study.toml");
//! let text = "
//! title = 'Tilts'
//! scenario = 'default'
//! [[axis]]
//! key = 'normal_load.tilt'
//! from = -0.5
//! to = 0.5
//! count = 3
//! ";
//! # std::fs::write(&path, text)?;
//! let plan = Plan::of(&Study::read(&path)?, false, None)?;
//! assert_eq!(plan.rows.len(), 3);
//! assert_eq!(plan.common.assignments(&plan.rows[2].values), ["normal_load.tilt=0.5"]);
//! let (scenario, _) = plan.scenario(&plan.rows[2])?;
//! assert_eq!(scenario.normal_load.tilt, 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In reading order:
//!
//! - [`axis`]: the parameters that vary; [`runs`]: named runs; [`Study`]: the file with both;
//!   `parameter_sets`: the parameter sets of runs, and their source.
//! - [`Plan`]: every run with its values and its id; never changed once made.
//! - [`work`]: makes runs, for a [`Watcher`]; [`staging`]: unfinished logs of long runs.
//! - [`segment`]: the file of a thread's results; [`Results`]: all results, run logs included, and contradictions
//!   among them or with the plan.
//! - [`verification`]: the runs that are made a second time, to find nodes that compute wrongly.
//! - [`collect()`]: the tables of runs over axes; [`Outputs`]: these, their figures, claims and page.
//! - [`reduction`]: the outputs of runs that have names; [`Reproduction`]: makes all runs and all outputs.
//! - [`refine`]: the study of one scenario on other meshes, which shows what its numbers are worth.
//! - [`emit`]: scripts for clusters.
//! - [`given`]: recognises the kind of a path: a run log, a scenario, a sweep, a folder of these.
//!
//! The tables depend on the plan alone: not on the order of the runs, the number of threads and processes, or how
//! often they were killed.

pub mod axis;
mod collect;
mod each;
pub mod emit;
mod error;
mod file;
pub mod given;
mod named;
mod outputs;
pub mod page;
mod parameter_sets;
pub mod parameter_table;
pub mod pipeline;
pub mod plan;
pub mod record;
pub mod reduction;
pub mod refine;
mod relative_link;
pub mod results;
pub mod runs;
pub mod segment;
pub mod staging;
mod study;
pub mod verification;
mod watch;
pub mod work;

pub use collect::{RUNS, RowSink, collect};
pub use error::StudyError;
pub use named::{Reproduction, reduce};
pub use outputs::Outputs;
pub use plan::Plan;
pub use relative_link::relative_link;
pub use results::Results;
pub use study::{Grid, Keep, Study};
pub use watch::Watcher;
