//! From a scenario as a user writes it to a plan that a solver can run, and the theory to compare
//! the outcome with. All functions are pure, except those that read the files a scenario names.
//!
//! ```
//! use asperity_model::analytic::{LengthLaw, LengthLawParameters};
//! use asperity_model::{Plan, resolve};
//!
//! // A built-in scenario, or the path of a TOML file, with overrides.
//! let scenario = resolve("load-on-driven-end", &["slider.blocks=57", "time.duration_s=2"])?;
//!
//! // The numbers that a solver needs: 2 s in steps of 10 ns.
//! let plan = Plan::new(&scenario);
//! assert_eq!((plan.blocks, plan.steps), (57, 200_000_000));
//!
//! // At which load the theory expects a precursor over half of the slider: by (5.22), the law
//! // for a tilted load, mu_d x (1 + theta (1 - x)).
//! let law = LengthLaw::natural(&scenario);
//! let load_ratio = law.load_ratio(&LengthLawParameters::of(&scenario), 0.5);
//! assert_eq!(law.equation(), "5.22");
//! assert!((load_ratio - 0.45 * 0.5 * (1.0 + 0.8333 * 0.5)).abs() < 1e-12);
//! # Ok::<(), asperity_model::ResolveError>(())
//! ```
//!
//! In reading order; a file uses those above it, and none below:
//!
//! - [`keys`]: every scenario key: symbol, unit, range, default, meaning. The checks,
//!   `asperity scenario show` and the key reference are generated from this table.
//! - `suggest`: the key or scenario that was probably meant.
//! - [`text`]: reads texts and names places in them.
//! - [`rows`]: reads the rows of CSV files.
//! - [`typed`]: reads texts that are no scenarios into types.
//! - `choices`: enumerations of the words that keys accept.
//! - [`scenario`]: the resolved [`Scenario`]: every key present and in range.
//! - [`mod@source`]: scenario texts and `--set` overrides as layers; each value keeps its place for
//!   error messages.
//! - `defaults`: checks written values against their keys and fills in defaults.
//! - [`lattice`]: bodies given by a table of bonds, such as the slab.
//! - `node_state`: all nodes at one time.
//! - [`elastic`]: the elastic body, chain or lattice.
//! - [`rate_and_state`]: the numbers and formulas of rate-and-state friction.
//! - [`law`]: how a contact sticks and slides; [`laws`]: the laws, a file for each.
//! - [`load`]: normal load per block.
//! - [`course`]: the course in time of the load, and of the velocity of the drive.
//! - [`files`]: who opens the files that a scenario names, and how their values become those of keys.
//! - `exact`: lists of numbers as text, to the bit.
//! - [`initial_state`]: the state in which a run begins.
//! - [`plan`]: the [`Plan`]: the numbers of the physics.
//! - [`stability`]: the modes of steady sliding by rate-and-state friction that grow.
//! - [`chain`]: the stuck chain in static equilibrium or in steady motion.
//! - [`initial`]: displacements, velocities and friction springs at the start.
//! - [`slab`]: a body on a foundation in static equilibrium under its load.
//! - `splitmix`: pseudo-random numbers.
//! - `derive`: from a scenario to a plan.
//! - [`preview`]: material and load of a run in advance.
//! - `meaning`: keys without a meaning for a slider, a drive or a friction law.
//! - `as_coded`: describes the slider of a parameter set.
//! - `show`: formats a scenario as commented TOML.
//! - `implausible`: values that no solid has, and the unit that was probably mistaken.
//! - [`junctions`]: the numbers of contacts of many junctions.
//! - `warnings`: accepted values that may surprise.
//! - [`analytic`]: predictions of the theory.
//! - [`front`]: the theory of the speed of fronts.
//! - `rules`: rules between keys.
//! - `profile`: initial shear and prestress from CSV files.
//! - `given_state`: states at the start from tables and logs, and whether they fit.
//! - [`builtin`]: the built-in scenarios.
//! - `resolve`: from a name or a text to a scenario: [`resolve()`], [`Scenario::resolve`].

pub mod analytic;
mod as_coded;
pub mod builtin;
pub mod chain;
mod choices;
pub mod course;
mod defaults;
mod derive;
mod disorder;
pub mod elastic;
pub mod ends;
mod exact;
pub mod files;
pub mod front;
mod given_state;
mod implausible;
pub mod initial;
pub mod initial_state;
pub mod junctions;
mod key;
pub mod keys;
pub mod lattice;
pub mod law;
pub mod laws;
pub mod load;
mod meaning;
mod node_state;
pub mod plan;
pub mod preview;
mod profile;
pub mod rate_and_state;
mod resolve;
pub mod rows;
mod rules;
pub mod scenario;
mod show;
pub mod slab;
pub mod source;
mod splitmix;
pub mod stability;
mod suggest;
pub mod text;
pub mod typed;
mod warnings;

pub use choices::{DetachBy, DriveKind, End, JunctionStart, ParameterSet, Reattach};
pub use course::{ContactCourse, Course};
pub use derive::ADVISED_SHARE;
pub use files::{Files, Texts};
pub use initial_state::InitialState;
pub use junctions::Junctions;
pub use lattice::Lattice;
pub use laws::Law;
pub use node_state::NodeState;
pub use plan::{Ageing, Drive, DriveSpring, Friction, Plan, RecordingPlan, RuptureFields, WindowPlan};
pub use preview::Preview;
pub use rate_and_state::{EVENT_SPEED_RATIO, Evolution, RateAndState};
pub use resolve::{ResolveError, find, resolve, source};
pub use scenario::Scenario;
pub use source::{ScenarioErrors, ScenarioSource};
pub use splitmix::mixed;
pub use stability::Stability;
pub use suggest::{among, key_suggestion, suggestion};
pub use warnings::{WRONG_FRONT, Warning};
