//! A run as a library: make it, go on with it, replay its log, check, salvage, verify it.
//!
//! The `asperity` command is arguments, words and exit codes around this crate; a program of
//! one's own calls the same functions. In reading order:
//!
//! - [`Task`], [`run`]: simulator, detectors and log, and what of them a caller sees ([`Observer`]).
//! - [`Forecast`]: what can be said of a run without making it.
//! - [`detectors`]: the registered detectors, and how to choose among them.
//! - [`Replay`]: a log through detectors again.
//! - [`check`], [`Verdict`]: what a log is worth, for whoever reads one; [`salvage`]: what is left of
//!   a damaged one.
//! - [`verify`](verify::verify): the fast solver compared with the plain one.
//! - [`study`]: runs by name in a folder, made unless they are there.
//!
//! When the first slip event that took the whole slider began, of a small chain:
//!
//! ```
//! use asperity_record::{Event, GlobalSlip};
//! use asperity_run::{Begin, Task, Observer, run};
//!
//! struct First(Option<GlobalSlip>);
//!
//! impl Observer for First {
//!     fn event(&mut self, event: &Event) {
//!         if let (None, Some(Ok(global))) = (&self.0, event.decode()) {
//!             self.0 = Some(global);
//!         }
//!     }
//! }
//!
//! let scenario = asperity_model::resolve("default", &["slider.blocks=10", "time.duration_s=3"])?;
//! let mut first = First(None);
//! run(Task::new(&scenario), Begin::Anew, &|| false, &mut first)?;
//! let first = first.0.expect("it slides as a whole within three seconds");
//! assert!((2.0..3.0).contains(&first.onset_s));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/first_global_slip.rs` does so beside a detector of its own. Nothing here prints, draws
//! progress, knows exit codes or listens to signals: whoever calls does.

mod check;
#[cfg(test)]
mod code_version;
pub mod detectors;
mod event_check;
mod forecast;
mod header;
mod log;
mod log_target;
mod nodes;
mod observer;
mod replay;
mod resume;
mod run;
mod salvage;
mod self_check;
pub mod study;
mod verdict;
pub mod verify;

pub use check::{CheckProblem, Checked, Seen, check, check_again, check_seen};
pub use event_check::{Difference, OtherDetectors};
pub use forecast::{Forecast, MostLogBytes};
pub use header::CODE_VERSION;
pub use log::{CHECKPOINT_INTERVAL, KeepLog, LogTo};
pub use log_target::{LogTargetError, OtherRun};
pub use nodes::{NodeState, Nodes, NodesError};
pub use observer::{Notice, Observer};
pub use replay::{Comparison, Replay, ReplayError, Replayed};
pub use resume::LeftError;
pub use run::{Begin, Outcome, RunError, Task, Threads, run};
pub use salvage::{SalvageProblem, salvage};
pub use self_check::SelfCheckProblem;
pub use verdict::Verdict;

pub use asperity_detect::Detector;
pub use asperity_simulator::{Counters, SolverKind};
pub use asperity_stream::at_once;
