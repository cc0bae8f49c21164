//! Shared by the tests of several crates: plans, made-up records and events, pseudo-random numbers,
//! pictures, logs read to their end. All functions panic on errors, so tests contain only what they are
//! about.
//!
//! ```
//! use asperity_testkit::{quiet_step, read_log, scenario};
//!
//! let (_, plan) = scenario("default", &["slider.blocks=3", "time.duration_s=1e-3"]);
//! assert_eq!(plan.blocks, 3);
//!
//! // 40 N of driving force on the usual 100 N of normal load.
//! let step = quiet_step(7, 0.7, 0.4);
//! assert_eq!((step.driving_force_n, step.switches.len()), (40.0, 0));
//!
//! assert!(read_log("no-such.mcap".as_ref()).is_err());
//! ```
//!
//! It is for tests alone: no crate depends on it but by `[dev-dependencies]`. The unit tests of
//! `record`, `model` and `runlog` cannot use it, since it would bring them a second copy of the
//! crate that they are part of.

// Lets `made_up` refer to this crate by its name, in `numbers` as well, whose unit tests include it.
extern crate self as asperity_testkit;

mod convolution;
mod direct_junctions;
pub mod equality;
mod grey;
mod logs;
pub mod made_up;
mod plans;
mod random;
mod records;
mod reference;

pub use convolution::mirrored_convolution;
pub use direct_junctions::{DirectChain, DirectContact};
pub use grey::Grey;
pub use logs::{first_stray, read_log, read_until_problem, run_end};
pub use plans::{SMALL_SLAB, plan, scenario};
pub use random::Random;
pub use records::{quiet_step, run_header, rupture, slip_event, switch};
pub use reference::reference;

/// A temporary folder, removed when the value is dropped.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}
