//! The run log: one MCAP file per run.
//!
//! | in the file | what |
//! |---|---|
//! | metadata `run` | the [`RunHeader`](asperity_record::RunHeader), first |
//! | metadata `salvage` | in a log that was put together from a damaged one: what it lacks |
//! | attachment `scenario.toml` | the resolved scenario, every key |
//! | attachments `checkpoint` | the solver's state, about once a second of work: where an unfinished run can be taken up again |
//! | topic `/step` | one message per step record |
//! | topic `/switch` | one message per block that switched, behind its step |
//! | topic `/fields` | the state of all blocks |
//! | topic `/window` | the state of chosen blocks in dense windows |
//! | topics `/events/...` | what the detectors emitted, behind the record that made it certain |
//! | metadata `run_end` | the [`RunEnd`](asperity_record::RunEnd), last: only this says that the run is whole |
//!
//! Messages are JSON objects, each topic with its JSON schema. `log_time` is
//! simulated time in nanoseconds; nothing in the file knows the wall clock.
//! A log is written under a temporary name and renamed when it is whole.

mod agree;
mod chunk;
mod digest;
mod findings;
mod format;
mod layout;
mod messages;
mod metadata;
mod parse;
mod pieces;
mod problem;
mod read;
mod records;
mod salvage;
mod unfinished;
mod versions;
mod whole;
mod write;

pub use findings::{Damage, Gap, Salvaged};
pub use problem::{LogError, LogProblem, MetadataError, NoRunLog, WriteError};
pub use read::{LogItem, RunReader, Topics};
pub use salvage::{SalvageError, Settle, salvage};
pub use unfinished::Unfinished;
pub use whole::{WholeFile, partial_path};
pub use write::{Existing, RunWriter};
