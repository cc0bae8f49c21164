//! The names of the format. Its bounds, which reader and writer obey, are in `asperity_record::bounds`. The documentation of the crate describes the layout.

pub(crate) use asperity_record::bounds::{
    LONGEST_CHECKPOINT_BYTES, LONGEST_EVENT_BYTES, LONGEST_METADATA_BYTES, LONGEST_READ_BYTES,
    LONGEST_RECORD_BYTES, LONGEST_SIGNAL_BYTES, LONGEST_STATE_OF_BLOCK_BYTES, LONGEST_STEP_BYTES,
    LONGEST_TOPIC_BYTES, MOST_CHANNELS, MOST_SCHEMA_BYTES,
};

/// The first bytes of every MCAP file, and the last.
pub(crate) const MAGIC: &[u8] = mcap::MAGIC;

/// Bytes of the opcode and length before every record.
pub(crate) const RECORD_HEAD_BYTES: usize = 1 + 8;

/// The profile in the MCAP header of a log, which distinguishes damaged logs from files of other
/// programs.
pub(crate) const PROFILE: &str = "asperity";

/// How the library in the MCAP header of a log begins.
pub(crate) const LIBRARY: &str = "asperity-runlog ";

/// Name of the metadata record that begins a log.
pub(crate) const RUN: &str = "run";

/// Name of the metadata record that ends a whole log.
pub(crate) const RUN_END: &str = "run_end";

/// Name of the metadata record that lists what a salvaged log lacks.
pub(crate) const SALVAGE: &str = "salvage";

/// Name of the metadata record with what users note on a log, which may follow `run_end`.
pub(crate) const NOTE: &str = "note";

/// The key of `run_end` with the number of bytes before it: another program that writes the log again has other ones.
pub(crate) const BYTES: &str = "bytes";

/// Name of the attachment with the resolved scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";

/// Name of the attachment in its place, with the description of a recording.
pub(crate) const RECORDING: &str = "recording.toml";

/// What a log describes itself by.
pub(crate) const DESCRIPTIONS: [&str; 2] = [SCENARIO, RECORDING];

/// Name of the metadata record with the files of a recording.
pub(crate) const INPUTS: &str = "recording";

/// Name of the attachments with checkpoints.
pub(crate) const CHECKPOINT: &str = "checkpoint";

/// Topic of the step records.
pub(crate) const STEP: &str = "/step";

/// Topic of the blocks that switched.
pub(crate) const SWITCH: &str = "/switch";

/// Topic of the states of all blocks.
pub(crate) const FIELDS: &str = "/fields";

/// Topic of the states of chosen blocks.
pub(crate) const WINDOW: &str = "/window";

/// Topic of what the channels of a recording read.
pub(crate) const SIGNAL: &str = "/signal";

/// Topic of samples about ruptures.
pub(crate) const TRACES: &str = "/traces";

/// Prefix of the topics of events.
pub(crate) const EVENTS: &str = "/events/";

/// Uncompressed size at which a chunk is closed: large enough to compress well, small enough that
/// losing one costs little.
pub(crate) const CHUNK_BYTES: u64 = 1 << 20;
