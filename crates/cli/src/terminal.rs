//! Words on their way to a terminal: whatever is printed passes here.
//!
//! Two things hold of all of it. What others wrote, such as names of files and values in logs,
//! stays within its line ([`printable`]). And notes on stderr are only words: where they cannot
//! be written, nothing else changes. Standard output is what the command was asked for, so that
//! a failure to write it is one of the command.
//!
//! Tables and JSON on standard output are data, which another program gets as they are; only a
//! terminal gets them escaped.

use std::io::{self, IsTerminal, StdoutLock, Write};

use asperity_record::printable;

/// Prints a line of words on standard output.
pub(crate) fn say(line: impl std::fmt::Display) -> io::Result<()> {
    io::stdout().lock().write_all(words(&line.to_string()).as_bytes())
}

/// Prints a line on stderr, if it can be written.
pub(crate) fn note(line: &str) {
    // At once, so that lines of several threads do not mix.
    io::stderr().lock().write_all(words(line).as_bytes()).ok();
}

/// A line as it is printed, with its break.
fn words(line: &str) -> String {
    let line = LIMITS.iter().fold(printable(line).into_owned(), |line, (error, limit)| {
        line.replace(&format!("(os error {error})"), &format!("(os error {error}; {limit})"))
    });
    line + "\n"
}

/// What errors of the system mean that are limits of a process, which the system's own words
/// do not say. The numbers are those of Linux and of the BSDs.
const LIMITS: [(i32, &str); 3] = [
    (12, "the limit on memory, ulimit -v, or all that the machine has"),
    (24, "the limit on open files, ulimit -n"),
    (27, "the file size limit, ulimit -f"),
];

/// Standard output for data.
pub(crate) struct Data {
    out: StdoutLock<'static>,
    /// The line that has been begun, where it goes to a terminal.
    line: Option<Vec<u8>>,
}

/// Standard output for a table, JSON or TOML.
pub(crate) fn data() -> Data {
    let out = io::stdout().lock();
    Data { line: out.is_terminal().then(Vec::new), out }
}

/// Longer stretches without a line break are shown in pieces.
const LONGEST_LINE_BYTES: usize = 1 << 16;

impl Data {
    /// Shows what there is of the line, but for its break.
    fn show(&mut self) -> io::Result<()> {
        let Some(line) = &mut self.line else { return Ok(()) };
        let text = std::mem::take(line);
        self.out.write_all(printable(&String::from_utf8_lossy(&text)).as_bytes())
    }
}

impl Write for Data {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(line) = &mut self.line else { return self.out.write(bytes) };
        let (part, has_break) = match bytes.iter().position(|byte| *byte == b'\n') {
            Some(at) => (&bytes[..at], true),
            None => (bytes, false),
        };
        line.extend_from_slice(part);
        if has_break {
            self.show()?;
            self.out.write_all(b"\n")?;
        } else if line.len() > LONGEST_LINE_BYTES {
            self.show()?;
        }
        Ok(part.len() + usize::from(has_break))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.show()?;
        self.out.flush()
    }
}
