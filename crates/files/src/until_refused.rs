//! A writer that writes nothing more once a write was refused.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, OnceLock};

/// Passes writes on until one fails, and keeps the reason.
///
/// Without it, what a library and its buffer still write when they are dropped would follow the gap of the failed
/// write, if there is room again by then: a log with a hole, from which no run can resume.
pub struct UntilRefused<W> {
    file: W,
    refusal: Refusal,
}

/// The reason of the first refused write, also for whom the library tells another.
#[derive(Debug, Clone, Default)]
pub struct Refusal(Arc<OnceLock<(io::ErrorKind, String)>>);

impl Refusal {
    /// The reason, if a write was refused.
    pub fn reason(&self) -> Option<&str> {
        self.0.get().map(|(_, why)| why.as_str())
    }
}

impl<W> UntilRefused<W> {
    /// Wraps a file.
    pub fn new(file: W) -> UntilRefused<W> {
        UntilRefused { file, refusal: Refusal::default() }
    }

    /// Where the reason will be.
    pub fn refusal(&self) -> Refusal {
        self.refusal.clone()
    }

    fn check(&self) -> io::Result<()> {
        match self.refusal.0.get() {
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
                self.refusal.0.get_or_init(|| (error.kind(), error.to_string()));
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
        assert!(writer.refusal().reason().is_some());
        assert_eq!(writer.file.bytes, b"ab");
    }
}
