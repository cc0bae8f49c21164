//! Lines that somebody wrote, of a length that a row may have.

use std::io::{self, Read};

/// No row of a table is longer: ours have some hundred bytes. A row is read as a whole before it
/// is looked at, and a file of other content may have no line break at all.
const LONGEST_BYTES: usize = 1 << 16;

/// Reads on as long as there is a line break now and then.
pub(crate) struct ShortLines<R> {
    source: R,
    line: u64,
    /// Bytes of the line so far.
    length: usize,
}

impl<R: Read> ShortLines<R> {
    /// Of a source at the start of its first line.
    pub(crate) fn of(source: R) -> ShortLines<R> {
        ShortLines { source, line: 1, length: 0 }
    }
}

impl<R: Read> Read for ShortLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        for byte in &buffer[..read] {
            if *byte == b'\n' {
                (self.line, self.length) = (self.line + 1, 0);
                continue;
            }
            self.length += 1;
            if self.length > LONGEST_BYTES {
                let problem = format!(
                    "line {} is longer than {LONGEST_BYTES} bytes (accepted: rows of a table)",
                    self.line
                );
                return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
            }
        }
        Ok(read)
    }
}
