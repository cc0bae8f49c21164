//! Bounds that all who write and all who read obey, so that what is accepted can be read: of TOML texts (scenarios,
//! pipelines, policies and settings, in files and in logs), and of texts in them.
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
pub const LONGEST_STATE_BYTES: usize = 7 << 20;

/// A TOML text that is too long to be parsed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TooLong {
    /// The number of bytes is above [`LONGEST_TOML_BYTES`].
    Bytes(usize),
    /// The number of marks is above [`MOST_TOML_MARKS`].
    Marks,
}

impl std::fmt::Display for TooLong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            TooLong::Bytes(bytes) => {
                write!(f, "a TOML text of {bytes} bytes (accepted: up to {LONGEST_TOML_BYTES})")
            }
            TooLong::Marks => {
                write!(
                    f,
                    "a TOML text of more than {MOST_TOML_MARKS} keys, values and lines (accepted: fewer)"
                )
            }
        }
    }
}

impl std::error::Error for TooLong {}

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
