//! From a scenario as a user writes it to a plan that a solver can run, and the theory to compare
//! the outcome with. All functions are pure, except those that read the files a scenario names.
//!
//! ```
//! use asperity_model::theory::analytic::{LengthLaw, LengthLawParameters};
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
//! assert_eq!(law.word(), "tilted");
//! assert!((load_ratio - 0.45 * 0.5 * (1.0 + 0.8333 * 0.5)).abs() < 1e-12);
//! # Ok::<(), asperity_model::ResolveError>(())
//! ```
//!
//! The rooms, each listed in its first file:
//!
//! - [`scenario`]: keys, their sections, rules between them; texts, files and overrides that are read into a
//!   [`Scenario`], and how it is shown.
//! - [`body`]: lattices given by a table of bonds, among them the chain, and what their ends are joined to.
//! - [`law`]: how a contact sticks and slides, with a file for each friction law.
//! - [`plan`]: the [`Plan`], the numbers of the physics, derived from a scenario: load, drive and forces from
//!   outside with their courses, disorder, and the state in which a run begins, which is also a checkpoint, and what a run leaves to others.
//! - [`theory`]: predictions that results are compared with, and the preview of a run.

pub mod body;
pub mod law;
pub mod plan;
pub mod scenario;
pub mod theory;

pub use body::lattice::Lattice;
pub use body::medium::{FirstNode, Medium};
pub use body::node_state::NodeState;
pub use law::junctions::Junctions;
pub use law::laws::Law;
pub use law::rate_and_state::{EVENT_SPEED_RATIO, Evolution, RateAndState};
pub use plan::adaptive_state::{AdaptiveState, Crossing};
pub use plan::course::{ContactCourse, Course};
pub use plan::derive::ADVISED_SHARE;
pub use plan::disorder::Draws;
pub use plan::junction_state::{JunctionState, SavedJunctions};
pub use plan::ledger::{Ledger, Span, Sum};
pub use plan::splitmix::mixed;
pub use plan::state::SliderState;
pub use plan::{Ageing, Drive, DriveSpring, Friction, Plan, RecordingPlan, RuptureFields, WindowPlan};
pub use scenario::Scenario;
pub use scenario::choices::{DetachBy, DriveKind, End, JunctionStart, MediumChoice, ParameterSet, Reattach};
pub use scenario::files::{Files, Texts};
pub use scenario::resolve::{ResolveError, find, resolve, source};
pub use scenario::source::{ScenarioErrors, ScenarioSource};
pub use scenario::suggest::{among, key_suggestion, suggestion};
pub use scenario::warnings::{WRONG_FRONT, Warning};
pub use theory::preview::Preview;
pub use theory::stability::Stability;
