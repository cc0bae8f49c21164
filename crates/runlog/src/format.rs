//! The names and bounds of the format, each in this one place; that of a scenario's text is in
//! `asperity_record::bounds`. What stands where is told at
//! the head of the crate.

/// The first bytes of every MCAP file, and the last.
pub(crate) const MAGIC: &[u8] = mcap::MAGIC;

/// How long the opcode and the length before every record are.
pub(crate) const RECORD_HEAD_BYTES: usize = 1 + 8;

/// What the MCAP header of a log gives as its profile: it tells a log that lacks something from
/// the files of other programs.
pub(crate) const PROFILE: &str = "asperity";

/// Name of the metadata record that opens a log.
pub(crate) const RUN: &str = "run";

/// Name of the metadata record that closes a whole log.
pub(crate) const RUN_END: &str = "run_end";

/// Name of the metadata record that says what a salvaged log lacks.
pub(crate) const SALVAGE: &str = "salvage";

/// Name of the metadata records that vouch for what stands before them.
pub(crate) const CHUNK: &str = "chunk";

/// The first version of the format that has them.
pub(crate) const CHUNK_SINCE: u32 = 3;

/// Name of the attachment that holds the resolved scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";

/// Name of the attachments that hold checkpoints.
pub(crate) const CHECKPOINT: &str = "checkpoint";

/// Topic of the step records.
pub(crate) const STEP: &str = "/step";

/// Topic of the blocks that switched.
pub(crate) const SWITCH: &str = "/switch";

/// Topic of the states of all blocks.
pub(crate) const FIELDS: &str = "/fields";

/// Topic of the states of chosen blocks.
pub(crate) const WINDOW: &str = "/window";

/// How the topics of events begin.
pub(crate) const EVENTS: &str = "/events/";

/// Uncompressed size at which a chunk is closed: large enough to compress well, small enough
/// that a damaged one costs little.
pub(crate) const CHUNK_BYTES: u64 = 1 << 20;

/// No record of ours comes near this: the state of the longest chain is some fifteen million bytes. A
/// length beyond it is damage, and must not be allocated.
pub(crate) const LONGEST_RECORD_BYTES: usize = 1 << 26;

/// Most that is made room for at once: a length is only believed as far as there are bytes.
pub(crate) const LONGEST_READ_BYTES: usize = 1 << 20;

/// Most that is kept of the schemas of a log's topics, in bytes; ours are some thousand.
pub(crate) const MOST_SCHEMA_BYTES: usize = 1 << 20;

/// Most channels, and so topics, of a log: four of records, and one for each detector. Each takes
/// a hash and its state, some two thousand bytes.
pub(crate) const MOST_CHANNELS: usize = 1000;

/// Most schemas: one for each channel.
pub(crate) const MOST_SCHEMAS: usize = MOST_CHANNELS;

/// The longest topic, in bytes: it is said again in counts, digests and names of files.
pub(crate) const LONGEST_TOPIC_BYTES: usize = 256;

/// The longest metadata record, in bytes: that at the end has two entries for each topic, and
/// that of a salvaged log a line for each damage.
pub(crate) const LONGEST_METADATA_BYTES: usize = 1 << 22;

/// The longest payload of an event, in bytes: a flat object of some twenty numbers. What parses
/// it takes ten times as much.
pub(crate) const LONGEST_EVENT_BYTES: usize = 1 << 16;

/// The longest payload of a step or a switch, in bytes: as many numbers.
pub(crate) const LONGEST_STEP_BYTES: usize = 1 << 12;

/// What a state may have besides for each block, in bytes: four numbers, of 25 characters each
/// at most, and whether it is detached.
pub(crate) const LONGEST_STATE_OF_BLOCK_BYTES: usize = 128;
