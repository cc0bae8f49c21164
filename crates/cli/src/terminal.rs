//! Prints messages to a terminal: everything printed passes through here.
//!
//! Texts from outside, such as file names and values in logs, are escaped so that they stay within
//! their line ([`printable`]). Notes on stderr are optional: a failure to write them has no effect.
//! Standard output is the result of the command, so that a failure to write it is a failure of the
//! command.
//!
//! Tables and JSON on standard output are data, and are written unchanged, except to terminals,
//! where they are escaped.

use std::io::{self, IsTerminal, StdoutLock, Write};

use asperity_record::printable;

/// Prints a line of text on standard output.
pub(crate) fn say(line: impl std::fmt::Display) -> io::Result<()> {
    io::stdout().lock().write_all(words(&line.to_string()).as_bytes())
}

/// Prints a line on stderr, if it can be written.
pub(crate) fn note(line: &str) {
    // In one call, so that lines of several threads do not mix.
    io::stderr().lock().write_all(words(line).as_bytes()).ok();
}

/// The printed form of a line, with its break.
fn words(line: &str) -> String {
    let line = LIMITS.iter().fold(printable(line).into_owned(), |line, (error, limit)| {
        line.replace(&format!("(os error {error})"), &format!("(os error {error}; {limit})"))
    });
    line + "\n"
}

/// Explanations of system errors caused by limits of the process, which the system's messages do
/// not mention. The numbers are those of Linux and of the BSDs.
const LIMITS: [(i32, &str); 3] = [
    (12, "the limit on memory, ulimit -v, or all that the machine has"),
    (24, "the limit on open files, ulimit -n"),
    (27, "the file size limit, ulimit -f"),
];

/// Standard output for data.
pub(crate) struct Data {
    out: StdoutLock<'static>,
    /// The current line, if the output is a terminal.
    line: Option<Vec<u8>>,
}

/// Standard output for a table, JSON or TOML.
pub(crate) fn data() -> Data {
    let out = io::stdout().lock();
    Data { line: out.is_terminal().then(Vec::new), out }
}

/// Longer lines are shown in pieces.
const LONGEST_LINE_BYTES: usize = 1 << 16;

impl Data {
    /// Prints the current line without its break.
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
