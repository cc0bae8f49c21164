//! The names and bounds of the format, which reader and writer obey. The bound of a scenario's text is in
//! `asperity_record::bounds`. The documentation of the crate describes the layout.

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

/// The first version of the format in which a salvaged log states how events are ordered in its gaps.
pub(crate) const GAPS_SINCE: u32 = 3;

/// The key of `run_end` with the number of bytes before it: another program that writes the log again has other ones.
pub(crate) const BYTES: &str = "bytes";

/// Name of the attachment with the resolved scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";

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

/// Prefix of the topics of events.
pub(crate) const EVENTS: &str = "/events/";

/// Uncompressed size at which a chunk is closed: large enough to compress well, small enough that
/// losing one costs little.
pub(crate) const CHUNK_BYTES: u64 = 1 << 20;

/// Bound on the length of any record. The largest, a state of the longest chain, has some fifteen
/// million bytes; a greater length is damage and must not be allocated.
pub(crate) const LONGEST_RECORD_BYTES: usize = 1 << 26;

/// The longest checkpoint, with room for what is beside it in its record.
pub(crate) const LONGEST_CHECKPOINT_BYTES: usize = LONGEST_RECORD_BYTES - (1 << 10);

/// Most bytes allocated at once while reading: memory grows with bytes read, not with stated
/// lengths.
pub(crate) const LONGEST_READ_BYTES: usize = 1 << 20;

/// Most bytes stored of the schemas of a log's topics; ours have some thousand.
pub(crate) const MOST_SCHEMA_BYTES: usize = 1 << 20;

/// Most channels, and so topics, of a log: four of records, and one per detector. Each needs a hash state
/// of some two thousand bytes.
pub(crate) const MOST_CHANNELS: usize = 1000;

/// Most schemas: one for each channel.
pub(crate) const MOST_SCHEMAS: usize = MOST_CHANNELS;

/// The longest topic, in bytes: it is repeated in counts, digests and names of files.
pub(crate) const LONGEST_TOPIC_BYTES: usize = 256;

/// The longest metadata record, in bytes: `run_end` has two entries per topic, `salvage` a line per
/// damage.
pub(crate) const LONGEST_METADATA_BYTES: usize = 1 << 22;

/// The longest payload of an event, in bytes: a flat object of some twenty numbers. Parsing needs ten times
/// as much memory.
pub(crate) const LONGEST_EVENT_BYTES: usize = 1 << 16;

/// The longest payload of a step or a switch, in bytes: some twenty numbers.
pub(crate) const LONGEST_STEP_BYTES: usize = 1 << 12;

/// Most bytes per block in a state: eleven numbers of at most 25 characters each, a count of junctions,
/// and whether the block slides.
pub(crate) const LONGEST_STATE_OF_BLOCK_BYTES: usize = 292;
