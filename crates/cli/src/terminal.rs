//! Prints messages to a terminal: everything printed passes through here.
//!
//! Texts from outside, such as file names and values in logs, are escaped so that they stay within
//! their line ([`printable`]). Notes on stderr are optional: a failure to write them has no effect.
//! Standard output is the result of the command, so that a failure to write it is a failure of the
//! command.
//!
//! Tables and JSON on standard output are data, and are written unchanged, except to terminals,
//! where they are escaped.

use std::io::{self, IsTerminal, LineWriter, Write};

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

/// Standard output for a table, JSON or TOML.
pub(crate) type Data = Box<dyn Write>;

/// Standard output for a table, JSON or TOML: line by line to a terminal, of lines that are longer than this in pieces.
pub(crate) fn data() -> Data {
    const LONGEST_LINE_BYTES: usize = 1 << 16;
    let out = io::stdout().lock();
    if out.is_terminal() {
        Box::new(LineWriter::with_capacity(LONGEST_LINE_BYTES, Shown(out)))
    } else {
        Box::new(out)
    }
}

/// Prints a table, JSON or TOML on standard output.
pub(crate) fn print(text: &[u8]) -> io::Result<()> {
    let mut out = data();
    out.write_all(text)?;
    out.flush()
}

/// Passes lines on as terminals are shown them.
struct Shown<W>(W);

impl<W: Write> Write for Shown<W> {
    fn write(&mut self, lines: &[u8]) -> io::Result<usize> {
        let text: Vec<String> = lines
            .split(|byte| *byte == b'\n')
            .map(|line| printable(&String::from_utf8_lossy(line)).into_owned())
            .collect();
        self.0.write_all(text.join("\n").as_bytes())?;
        Ok(lines.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}
