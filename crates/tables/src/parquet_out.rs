//! The file of a Parquet table that is being written.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::sync::{Arc, OnceLock};

use crate::parquet_checksum;

/// The file, whose checksum is set once it is written. It keeps the system's reason for a refused write,
/// since the library reports some of them as a "transport error".
pub(crate) struct ParquetOut {
    pub(crate) file: File,
    refused: Arc<OnceLock<String>>,
}

impl ParquetOut {
    pub(crate) fn new(file: File) -> ParquetOut {
        ParquetOut { file, refused: Arc::default() }
    }

    /// The writer for the library, which writes thousands of single bytes and flushes at the end.
    pub(crate) fn writer(&self) -> io::Result<Buffered> {
        let file = self.file.try_clone()?;
        Ok(BufWriter::new(Watched { file, refused: Arc::clone(&self.refused) }))
    }

    /// The reason of a failure: the system's, if it refused a write, otherwise the library's.
    pub(crate) fn reason(&self, error: &impl ToString) -> String {
        self.refused.get().cloned().unwrap_or_else(|| error.to_string())
    }

    /// Sets the checksum, and returns the file.
    pub(crate) fn seal(mut self) -> io::Result<File> {
        parquet_checksum::seal(&mut self.file)?;
        Ok(self.file)
    }
}

pub(crate) type Buffered = BufWriter<Watched>;

/// Writes to the file, and keeps the first refusal.
pub(crate) struct Watched {
    file: File,
    refused: Arc<OnceLock<String>>,
}

impl Write for Watched {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes).inspect_err(|error| {
            if error.kind() != io::ErrorKind::Interrupted {
                self.refused.get_or_init(|| error.to_string());
            }
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
