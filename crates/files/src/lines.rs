//! Bounds the length of lines in text files from outside.

use std::io::{self, BufRead, Read};

/// Most bytes of a line. Rows of event tables have some hundred. Readers of CSV load a row whole
/// before they look at it, and another kind of file may contain no line break at all.
const LONGEST_BYTES: usize = 1 << 16;

/// Fills the buffer of a source, again if a signal interrupts it; `fill_buf` then returns what is there.
///
/// # Errors
/// If the source cannot be read.
pub fn fill(source: &mut impl BufRead) -> io::Result<()> {
    loop {
        match source.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other.map(drop),
        }
    }
}

/// Passes a source on, and fails at the first line that is too long.
pub struct ShortLines<R> {
    source: R,
    /// Number of the current line, from 1.
    line: u64,
    /// Bytes of it so far.
    length: usize,
}

impl<R: Read> ShortLines<R> {
    /// Wraps a source at the start of its first line.
    pub fn of(source: R) -> ShortLines<R> {
        ShortLines { source, line: 1, length: 0 }
    }
}

impl<R: Read> Read for ShortLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // A line that begins and ends within one piece of this size cannot be too long.
        let room = buffer.len().min(LONGEST_BYTES);
        let read = self.source.read(&mut buffer[..room])?;
        let piece = &buffer[..read];
        let is_break = |byte: &u8| *byte == b'\n';
        if self.length + piece.iter().position(is_break).unwrap_or(read) > LONGEST_BYTES {
            let problem = format!(
                "line {} is longer than {LONGEST_BYTES} bytes (accepted: rows of a table)",
                self.line
            );
            return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
        }
        match piece.iter().rposition(is_break) {
            Some(last) => {
                // Few enough for a byte, so that many are counted at once.
                let breaks =
                    |few: &[u8]| u64::from(few.iter().map(|byte| u8::from(is_break(byte))).sum::<u8>());
                self.line += piece.chunks(255).map(breaks).sum::<u64>();
                self.length = read - last - 1;
            }
            None => self.length += read,
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::{LONGEST_BYTES, ShortLines};

    #[test]
    fn a_line_that_is_too_long_is_refused_by_its_number_whatever_the_pieces() {
        let lines = |lengths: &[usize]| {
            lengths.iter().map(|length| "x".repeat(*length)).collect::<Vec<_>>().join("\n").into_bytes()
        };
        let read = |bytes: &[u8], piece: usize| {
            let mut lines = ShortLines::of(bytes);
            let mut buffer = vec![0; piece];
            let mut total = 0;
            loop {
                match lines.read(&mut buffer) {
                    Ok(0) => return Ok(total),
                    Ok(read) => total += read,
                    Err(error) => return Err(error.to_string()),
                }
            }
        };
        for piece in [7, 1 << 13, 1 << 17] {
            let sound = lines(&[3, LONGEST_BYTES, 0, LONGEST_BYTES, 9]);
            assert_eq!(read(&sound, piece), Ok(sound.len()));
            let refused = read(&lines(&[3, 0, LONGEST_BYTES + 1, 5]), piece).unwrap_err();
            assert!(refused.starts_with("line 3 is longer than 65536 bytes"), "{refused}");
        }
    }
}
