//! Bounds that all who write and all who read obey, so that what is accepted can be read: of TOML texts (scenarios,
//! pipelines, policies and settings, in files and in logs) and what is in them, of run logs, and of studies.
//!
//! A parser uses some ten bytes per byte of comments, and some hundred per value. So the length is checked before
//! parsing.

/// The longest TOML text, in bytes: as many numbers of 24 characters as [`MOST_TOML_MARKS`] allow. A scenario whose text
/// in a log would be longer is refused.
pub const LONGEST_TOML_BYTES: usize = 12 << 20;

/// Most marks in a TOML text that begin or end a key, a value or a line: `,` `=` `.` `[` `{` and line
/// breaks. The scenario of a slider of [`MOST_BLOCKS`](crate::MOST_BLOCKS) blocks in which four quantities are drawn
/// for each has eight hundred thousand.
pub const MOST_TOML_MARKS: usize = 1_000_000;

/// The longest name, summary or path in a scenario, in bytes: as that of a path on most systems.
pub const LONGEST_NAME_BYTES: usize = 4096;

/// The longest text of a state in a scenario, in bytes.
pub const LONGEST_STATE_BYTES: usize = 10 << 20;

/// Bound on the length of any record. The largest, a state of the longest chain, has some nine
/// million bytes; a greater length is damage and must not be allocated.
pub const LONGEST_RECORD_BYTES: usize = 1 << 26;

/// The longest checkpoint, with room for what is beside it in its record.
pub const LONGEST_CHECKPOINT_BYTES: usize = LONGEST_RECORD_BYTES - (1 << 10);

/// Most bytes allocated at once while reading: memory grows with bytes read, not with stated
/// lengths.
pub const LONGEST_READ_BYTES: usize = 1 << 20;

/// Most bytes stored of the schemas of a log's topics; ours have some thousand.
pub const MOST_SCHEMA_BYTES: usize = 1 << 20;

/// Most channels, and so topics, of a log: six of records, and one per detector. Each needs a hash state
/// of some two thousand bytes.
pub const MOST_CHANNELS: usize = 1000;

/// The longest topic, in bytes: it is repeated in counts, digests and names of files.
pub const LONGEST_TOPIC_BYTES: usize = 256;

/// The longest metadata record, in bytes: `run_end` has two entries per topic, `salvage` a line per
/// damage.
pub const LONGEST_METADATA_BYTES: usize = 1 << 22;

/// The longest payload of an event, in bytes: a flat object of some twenty numbers. Parsing needs ten times
/// as much memory.
pub const LONGEST_EVENT_BYTES: usize = 1 << 16;

/// The longest payload of a step or a switch, in bytes: some twenty numbers.
pub const LONGEST_STEP_BYTES: usize = 1 << 12;

/// Most bytes per block in a state: eleven numbers of eight each, a count of junctions of at most five, and
/// whether the block slides.
pub const LONGEST_STATE_OF_BLOCK_BYTES: usize = 94;

/// The longest payload of what the channels of a recording read, or of samples about a rupture: three numbers for each
/// of two arrays of [`MOST_BLOCKS`](crate::MOST_BLOCKS) sensors, and room for the rest.
pub const LONGEST_SIGNAL_BYTES: usize = 1 << 23;

/// The longest texts and states that the scenarios of a plan name, together.
pub const LONGEST_COMMON_BYTES: usize = 4 * LONGEST_TOML_BYTES;

/// The longest plan, of some hundred bytes a run.
pub const LONGEST_PLAN_BYTES: usize = 1 << 30;

/// Most runs of a sweep.
pub const MOST_RUNS: u64 = 1_000_000;

/// The longest result of a run in a segment, unpacked. A summary has some three thousand bytes, an event some hundred.
pub const LONGEST_RESULT_BYTES: usize = 1 << 27;

/// Most values of a course, which a log stores as text.
pub const MOST_COURSE_VALUES: usize = 200_000;

/// The least and the greatest magnitude of a number that is not 0. All that follows from the keys, as
/// stiffnesses, displacements and energies, is a product of a few of them and of their squares. With
/// these bounds it is finite, and far from the numbers below 2e-308 that have fewer digits.
pub const LEAST_MAGNITUDE: f64 = 1e-30;
/// See [`LEAST_MAGNITUDE`].
pub const MOST_MAGNITUDE: f64 = 1e30;

/// A TOML text that is too long to be parsed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TooLong {
    /// The number of bytes is above [`LONGEST_TOML_BYTES`].
    #[error("a TOML text of {0} bytes (accepted: up to {LONGEST_TOML_BYTES})")]
    Bytes(usize),
    /// The number of marks is above [`MOST_TOML_MARKS`].
    #[error("a TOML text of more than {MOST_TOML_MARKS} keys, values and lines (accepted: fewer)")]
    Marks,
}

/// Checks that a text is short enough to be parsed as TOML.
///
/// # Errors
/// If it is too long.
pub fn check_toml(text: &str) -> Result<(), TooLong> {
    if text.len() > LONGEST_TOML_BYTES {
        return Err(TooLong::Bytes(text.len()));
    }
    let is_mark = |byte: &&u8| matches!(byte, b',' | b'=' | b'.' | b'[' | b'{' | b'\n');
    match text.as_bytes().iter().filter(is_mark).take(MOST_TOML_MARKS + 1).count() {
        count if count > MOST_TOML_MARKS => Err(TooLong::Marks),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::{LONGEST_TOML_BYTES, MOST_TOML_MARKS, TooLong, check_toml};

    #[test]
    fn a_text_is_measured_before_it_is_parsed() {
        let profile = "0.123456789012345, ".repeat(2 * crate::MOST_BLOCKS as usize);
        assert_eq!(check_toml(&format!("profile = [{profile}]")), Ok(()));
        let long = "#".repeat(LONGEST_TOML_BYTES + 1);
        assert_eq!(check_toml(&long), Err(TooLong::Bytes(long.len())));
        assert_eq!(check_toml(&long[1..]), Ok(()));
        assert_eq!(check_toml(&"\n".repeat(MOST_TOML_MARKS + 1)), Err(TooLong::Marks));
    }
}
