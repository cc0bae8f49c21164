//! Reads lines of bounded length one at a time, so that neither an endless file nor a few bytes that
//! decompress to gigabytes needs more memory than one line.

use std::io::{self, BufRead, Read};

/// A reader of bounded lines.
#[derive(Debug)]
pub(crate) struct Lines<R> {
    source: R,
    line: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn of(source: R) -> Lines<R> {
        Lines { source, line: Vec::new(), number: 0 }
    }

    /// Returns the next line without its break; `None` at the end.
    ///
    /// # Errors
    /// If it is too long or not UTF-8, or the file ends within it.
    pub(crate) fn next(&mut self, longest_bytes: usize) -> io::Result<Option<&str>> {
        self.line.clear();
        self.number += 1;
        let wrong = |number: u64, what: &str| {
            io::Error::new(io::ErrorKind::InvalidData, format!("line {number} {what}"))
        };
        let most = longest_bytes as u64 + 1;
        if self.source.by_ref().take(most).read_until(b'\n', &mut self.line)? == 0 {
            return Ok(None);
        }
        if self.line.pop() != Some(b'\n') {
            let is_long = self.line.len() >= longest_bytes;
            let too_long = format!("is longer than {longest_bytes} bytes");
            return Err(wrong(self.number, if is_long { &too_long } else { "has no end" }));
        }
        match str::from_utf8(&self.line) {
            Ok(line) => Ok(Some(line)),
            Err(_) => Err(wrong(self.number, "is not UTF-8")),
        }
    }
}

/// The message of a JSON error, without the line number, which is always 1.
pub(crate) fn problem_of(error: &serde_json::Error) -> String {
    let words = error.to_string();
    match words.rsplit_once(" at line ") {
        Some((problem, _)) => format!("column {}: {problem}", error.column()),
        None => words,
    }
}

#[cfg(test)]
mod tests {
    use super::Lines;

    #[test]
    fn a_line_is_refused_that_is_too_long_or_cut_off_or_no_text() {
        let next = |bytes: &[u8]| {
            let mut lines = Lines::of(bytes);
            lines.next(4).map(|line| line.map(str::to_owned)).map_err(|error| error.to_string())
        };
        assert_eq!(next(b""), Ok(None));
        assert_eq!(next(b"abcd\n"), Ok(Some("abcd".to_owned())));
        assert_eq!(next(b"\n\n"), Ok(Some(String::new())));
        assert_eq!(next(b"abcde\n"), Err("line 1 is longer than 4 bytes".to_owned()));
        assert_eq!(next(b"abc"), Err("line 1 has no end".to_owned()));
        assert_eq!(next(b"ab\xff\n"), Err("line 1 is not UTF-8".to_owned()));
    }
}
