//! Reads texts written by users, names places in them as line and column, and writes numbers for readers.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::Path;

use asperity_files::open_text;
use asperity_record::bounds::LONGEST_TOML_BYTES;

/// Longest text that is read; an endless stream such as `/dev/zero` exceeds it.
const LONGEST_BYTES: u64 = LONGEST_TOML_BYTES as u64;

/// Reads the text of a file, or of a stream that this process was started with (`/dev/stdin`,
/// `/dev/fd/3`). Allocates no more than the longest accepted text.
///
/// # Errors
/// If the path leads to something else, the system refuses, or the file is too long or no text.
pub fn read(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    open_text(path)?.take(LONGEST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST_BYTES {
        let problem = format!("the file is longer than {LONGEST_BYTES} bytes, the most that a text may have");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, problem));
    }
    String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()))
}

/// The first byte of each line of a text, computed once, so that many places can be named without a
/// scan for each.
#[derive(Debug, Clone)]
pub struct Lines {
    /// Offsets in bytes, ascending; the first is 0.
    starts: Vec<usize>,
}

impl Lines {
    /// Finds the lines of a text.
    pub fn of(text: &str) -> Lines {
        let behind_breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        Lines { starts: [0].into_iter().chain(behind_breaks).collect() }
    }

    /// Formats a byte offset as `LINE:COLUMN`, both counted from 1, columns in characters.
    pub fn place(&self, text: &str, at: usize) -> String {
        let at = text.floor_char_boundary(at);
        let line = self.starts.partition_point(|start| *start <= at);
        let column = text[self.starts[line - 1]..at].chars().count() + 1;
        format!("{line}:{column}")
    }
}

/// All keys of a TOML text, dotted, with their values; those of a list of tables are its value.
///
/// # Errors
/// If it is no TOML.
pub fn keys_of(toml: &str) -> Result<BTreeMap<String, toml::Value>, toml::de::Error> {
    let mut found = BTreeMap::new();
    let mut left = vec![(String::new(), toml.parse::<toml::Table>()?)];
    while let Some((section, keys)) = left.pop() {
        for (key, value) in keys {
            match value {
                toml::Value::Table(keys) => left.push((format!("{section}{key}."), keys)),
                value => drop(found.insert(format!("{section}{key}"), value)),
            }
        }
    }
    Ok(found)
}

/// A number with at most four significant digits, without trailing zeros.
pub fn short(value: f64) -> String {
    let value: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::{Lines, short};

    #[test]
    fn numbers_for_readers_have_four_digits() {
        for (value, written) in [
            (0.0, "0"),
            (1_200.000_000_1, "1200"),
            (-0.451_294_2, "-0.4513"),
            (25_000.0, "25000"),
            (99_999.0, "1e5"),
            (1.3e12, "1.3e12"),
            (5.664_9e-4, "5.665e-4"),
        ] {
            assert_eq!(short(value), written);
        }
    }

    #[test]
    fn places_count_lines_and_characters_from_1() {
        let text = "a = 1\n\u{b5} = \u{b5}x\n\nend";
        let lines = Lines::of(text);
        for (part, place) in [("a", "1:1"), ("1", "1:5"), ("x", "2:6"), ("end", "4:1"), ("nd", "4:2")] {
            assert_eq!(lines.place(text, text.find(part).unwrap()), place, "{part}");
        }
        assert_eq!(lines.place(text, text.len() + 5), "4:4");
        assert_eq!(Lines::of("").place("", 0), "1:1");
    }
}
