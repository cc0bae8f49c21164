//! A run as a library: run, resume, replay, check and salvage.
//!
//! The `asperity` command adds arguments, messages and exit codes; other programs can call the same
//! functions. In reading order:
//!
//! - [`Task`], [`run`]: simulator, detectors and log, observed by the caller ([`Observer`]).
//! - [`Forecast`]: predictions about a run without making it.
//! - [`detectors`]: the registered detectors, and how to choose among them.
//! - [`Replay`]: sends a log through detectors.
//! - [`OpenLog`], [`read_once`]: a log, checked while an observer receives it.
//! - [`write_recording`]: writes the log of a recording of a laboratory.
//! - [`check`], [`Verdict`]: judges a log; [`salvage`]: recovers the sound parts of a damaged one.
//! - [`Opened`]: the files and logs that the scenario of a user names.
//! - [`study`]: named runs in a folder, made unless they exist.
//!
//! The beginning of the first slip of the whole slider, in a small chain:
//!
//! ```
//! use asperity_record::{Event, GlobalSlip};
//! use asperity_run::{Begin, Observer, Task, run};
//!
//! struct First(Option<GlobalSlip>);
//!
//! impl Observer for First {
//!     fn event(&mut self, event: &Event) {
//!         if self.0.is_none() {
//!             self.0 = event.get().cloned();
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
//! `examples/first_global_slip.rs` adds a custom detector. Nothing here prints, shows progress,
//! knows exit codes or handles signals; that is up to the caller.

mod check;
#[cfg(test)]
mod code_version;
pub mod detectors;
mod event_check;
mod field;
mod forecast;
mod header;
mod log;
mod log_target;
mod nodes;
mod open_log;
mod recorded;
mod replay;
mod resume;
mod run;
mod salvage;
mod self_check;
mod start;
mod states;
pub mod stream;
pub mod study;
mod verdict;

pub use asperity_model::NodeState;
pub use asperity_record::{Notice, Observer};
pub use check::{CheckProblem, Checked, Seen, check, check_again};
pub use event_check::{Difference, OtherDetectors};
pub use field::{Field, Quantity, Span, record_again};
pub use forecast::{Forecast, LogEstimate};
pub use header::CODE_VERSION;
pub use log::{CHECKPOINT_INTERVAL, KeepLog, LogTo};
pub use log_target::OtherRun;
pub use nodes::Nodes;
pub use open_log::{OpenLog, Reading, Unread, read_once};
pub use recorded::{check_recording, write_recording};
pub use replay::{Comparison, Replay, ReplayError, Replayed};
pub use resume::LeftError;
pub use run::{Begin, Derived, Outcome, RunError, Task, Threads, run};
pub use salvage::{SalvageProblem, salvage};
pub use self_check::SelfCheckProblem;
pub use start::{Opened, OpenedForStudy, begins_at_end};
pub use states::StatesError;
pub use verdict::Verdict;

pub use asperity_detect::{Detector, Detectors};
pub use asperity_simulator::{Counters, SolverKind};
