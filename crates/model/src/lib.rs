//! From a scenario as a person writes it to a plan that a solver can run, and
//! the theory to compare the outcome with. Pure functions throughout.
//!
//! In reading order:
//!
//! - [`keys`]: every key a scenario may have, once: symbol, unit, range,
//!   default, meaning. The checks, `asperity scenario show` and the key
//!   reference are made from this table.
//! - [`text`]: reading what somebody wrote, and places in it.
//! - [`source`]: scenario texts and `--set` overrides as layers, each value with
//!   the place it was written at, for errors that can point there.
//! - [`scenario`]: the resolved [`Scenario`]: every key present and in range.
//! - `profile`: initial shear from a CSV file.
//! - [`builtin`]: the scenarios that come with the program.
//! - [`plan`]: the [`Plan`]: the numbers of the physics, derived from a scenario.
//! - [`elastic`]: what holds a slider together.
//! - [`load`], [`initial`]: normal load per block; displacements, velocities and
//!   friction springs at the start.
//! - [`chain`]: the stuck chain at rest or in steady motion.
//! - [`analytic`]: what the theory predicts.

pub mod analytic;
pub mod builtin;
pub mod chain;
mod contradictions;
mod derive;
pub mod elastic;
mod fill_in;
pub mod initial;
pub mod keys;
pub mod load;
mod near;
pub mod plan;
mod profile;
mod resolve;
pub mod scenario;
mod show;
pub mod source;
pub mod text;
mod words;

pub use elastic::Elastic;
pub use load::LoadCourse;
pub use plan::{Ageing, Drive, DriveSpring, Friction, InitialState, Law, Plan, RecordingPlan, WindowPlan};
pub use resolve::{ResolveError, resolve};
pub use scenario::Scenario;
pub use source::{ScenarioErrors, ScenarioSource};
pub use words::{DriveKind, ParameterSet, Reattach};
