//! The run log: one MCAP file per run.
//!
//! | in the file | what |
//! |---|---|
//! | MCAP header | the profile `asperity` |
//! | metadata `run` | the [`RunHeader`](asperity_record::RunHeader), first; `crc32` is the checksum of its other keys |
//! | metadata `salvage` | in a salvaged log: what it lacks |
//! | attachment `scenario.toml` | the resolved scenario, every key |
//! | attachments `checkpoint` | the solver's state, about once a second of work: from which an unfinished run resumes |
//! | topic `/step` | one message per step record |
//! | topic `/switch` | one message per block that switched, after its step |
//! | topic `/fields` | the state of all blocks |
//! | topic `/window` | the state of chosen blocks in dense windows |
//! | topics `/events/...` | events, after the record that completed them |
//! | metadata `run_end` | the [`RunEnd`](asperity_record::RunEnd), last: without it the log is not whole |
//! | metadata `note` | behind the others, what users noted: author, lab, comment ... |
//!
//! Messages are JSON objects, each topic with its JSON schema; those of `/fields` and `/window` are
//! [Protocol Buffers](https://protobuf.dev), with the `FileDescriptorSet` of their message. `log_time` is simulated
//! time in nanoseconds; the file contains no wall-clock time. A log is written under a temporary name and
//! renamed once it is whole.
//!
//! Chunks end between steps. Every chunk and attachment has its checksum, and so have the data and the summary
//! as a whole. Other programs may write all of this in other places and forms, as long as every topic has the
//! messages that `run_end` states, in their order.
//!
//! The keys of `run_end`:
//!
//! | key | what |
//! |---|---|
//! | `bytes` | how many bytes of the file precede this record |
//! | `status` | `complete`, `load-not-reached`, `interrupted` or `salvaged` |
//! | `last_step` | the last step taken |
//! | `switches` | how many blocks switched in all |
//! | `messages:TOPIC` | how many messages the topic has |
//! | `digest` | BLAKE3 over all messages |
//! | `digest:TOPIC` | BLAKE3 over the messages of the topic |
//! | `solver:NAME`, `solver_fallbacks` | the solver's counters |
//!
//! A digest is the BLAKE3 hash, as 64 hexadecimal digits, of the following bytes for each message
//! in the order of the file:
//!
//! 1. the length of the topic in bytes, as 8 bytes, the lowest first;
//! 2. the topic, UTF-8;
//! 3. the length of the payload in bytes, in the same way;
//! 4. the payload, byte for byte as in the file.
//!
//! A topic without messages has the hash of an empty input.
//!
//! # Example
//!
//! A log of two steps, written and read:
//!
//! ```
//! use asperity_record::{Energy, Parts, Record, RunHeader, RunStatus, Scales, SolverReport, StepRecord};
//! use asperity_runlog::{Content, Existing, LogItem, RunReader, RunWriter, Topics};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("run.mcap");
//! let header = RunHeader {
//!     record_schema_version: asperity_record::RECORD_SCHEMA_VERSION,
//!     scenario: "two steps".to_owned(),
//!     scenario_hash: String::new(),
//!     run_id: String::new(),
//!     code_version: String::new(),
//!     parameter_set: "as-coded".to_owned(),
//!     solver: "by hand".to_owned(),
//!     blocks: 2,
//!     rows: 1,
//!     junction_count: 0,
//!     flags: Parts::default(),
//!     time_step_s: 0.5,
//!     longest_stable_step_s: None,
//!     steps: 2,
//!     scales: Scales {
//!         block_length_m: 0.01,
//!         block_time_s: 1e-4,
//!         link_time_ratio: 100.0,
//!         modulus_n_per_m: 5e6,
//!         interfacial_stiffness_n_per_m: 2e6,
//!     },
//!     sensors: None,
//! };
//! let step = |step, driving_force_n| StepRecord {
//!     step,
//!     time_s: header.time_grid().time_s(step),
//!     driving_force_n,
//!     normal_load_n: 400.0,
//!     ft_fn_error: None,
//!     end_forces_n: None,
//!     energy: Energy::default(),
//!     junctions: None,
//!     peak_velocity_m_per_s: None,
//!     sliding: 0,
//!     switches: Vec::new(),
//! };
//!
//! // No detectors, so no kinds of events.
//! let mut writer = RunWriter::create(&path, Existing::Refuse, &header, "blocks = 2", &[], Content::Text)?;
//! writer.record(&Record::Step(step(1, 10.0)))?;
//! writer.record(&Record::Step(step(2, 20.0)))?;
//! let written = writer.finish(RunStatus::Complete, SolverReport::default())?;
//!
//! let mut reader = RunReader::open(&path, Topics::STEPS)?;
//! assert_eq!(reader.header(), &header);
//! let mut largest_n: f64 = 0.0;
//! while let Some(item) = reader.next_item()? {
//!     if let LogItem::Record(Record::Step(step)) = item {
//!         largest_n = largest_n.max(step.driving_force_n);
//!     }
//! }
//! assert_eq!(largest_n, 20.0);
//! // Read to its end without an error: it is whole.
//! assert_eq!(reader.end(), Some(&written));
//! assert_eq!(written.message_counts["/step"], 2);
//! # Ok(())
//! # }
//! ```
//!
//! # In reading order
//!
//! - `format`: names and bounds.
//! - `problem`: errors of reading and writing.
//! - `messages`, `descriptor`, `metadata`, `digest`: the contents of the file as types.
//! - `write`: writes a log; `unfinished`: the temporary name of a log until it is whole, and its
//!   lock.
//! - `note`: the note of a finished log.
//! - `parse`, `chunk`, `records`: from bytes to MCAP records, with lengths checked
//!   against the bytes.
//! - `ahead`: header, scenario and end of a log before its messages, wherever they are.
//! - `agree`, `read`: from MCAP records to consistent step records and events.
//! - `findings`, `pieces`, `salvage`: recovers what is left of a damaged log.

mod agree;
mod ahead;
mod chunk;
mod descriptor;
mod digest;
mod findings;
mod format;
mod messages;
mod metadata;
mod note;
mod parse;
mod pieces;
mod problem;
mod read;
mod records;
mod salvage;
mod unfinished;
mod write;

pub use asperity_files::{Existing, is_being_written, partial_path};
pub use findings::{Damage, Gap, Salvaged};
pub use note::{annotate, note};
pub use problem::{LogError, LogProblem, MetadataError, NoRunLog, WriteError};
pub use read::{LogItem, RunReader, Topics};
pub use salvage::{SalvageError, Settle, salvage};
pub use unfinished::{Unfinished, must_be_ours};
pub use write::{Content, RunWriter};
