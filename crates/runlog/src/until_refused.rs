//! A writer that writes nothing more once a write was refused.

use std::io::{self, Seek, SeekFrom, Write};

/// Passes writes on until one fails. Without it, what the MCAP library and the buffer still write when they are
/// dropped would follow the gap of the failed write, if there is room again by then: a log with a hole, from
/// which no run can resume. So the log ends where the failed write began, or within it.
pub(crate) struct UntilRefused<W> {
    file: W,
    refused: Option<(io::ErrorKind, String)>,
}

impl<W> UntilRefused<W> {
    pub(crate) fn new(file: W) -> UntilRefused<W> {
        UntilRefused { file, refused: None }
    }

    fn check(&self) -> io::Result<()> {
        match &self.refused {
            Some((kind, why)) => Err(io::Error::new(*kind, why.clone())),
            None => Ok(()),
        }
    }
}

impl<W: Write> Write for UntilRefused<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.check()?;
        self.file.write(bytes).inspect_err(|error| {
            if error.kind() != io::ErrorKind::Interrupted {
                self.refused = Some((error.kind(), error.to_string()));
            }
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.check()?;
        self.file.flush()
    }
}

impl<W: Seek> Seek for UntilRefused<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{self, Write};

    use super::UntilRefused;

    /// A disk that is full once, and a call that is interrupted once.
    #[derive(Default)]
    struct Once {
        calls: usize,
        bytes: Vec<u8>,
    }

    impl Write for Once {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.calls += 1;
            match self.calls {
                2 => Err(io::ErrorKind::Interrupted.into()),
                4 => Err(io::ErrorKind::StorageFull.into()),
                _ => self.bytes.write(bytes),
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn nothing_follows_a_write_that_failed() {
        let mut writer = UntilRefused::new(Once::default());
        writer.write_all(b"a").unwrap();
        writer.write_all(b"b").unwrap();
        for _ in 0..3 {
            assert_eq!(writer.write_all(b"c").unwrap_err().kind(), io::ErrorKind::StorageFull);
        }
        writer.flush().unwrap_err();
        assert_eq!(writer.file.bytes, b"ab");
    }
}
