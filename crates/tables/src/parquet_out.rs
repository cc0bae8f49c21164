//! The file of a Parquet table that is being written.

use std::fs::File;
use std::io::{self, BufWriter};

use asperity_files::{Refusal, UntilRefused};

use crate::parquet_checksum;

/// The writer for the library, which writes thousands of single bytes and flushes at the end.
pub(crate) type Buffered = BufWriter<UntilRefused<File>>;

/// The file, whose checksum is set once it is written. It keeps the system's reason for a refused write,
/// since the library reports some of them as a "transport error".
pub(crate) struct ParquetOut {
    pub(crate) file: File,
    refusal: Refusal,
}

impl ParquetOut {
    /// The file, and the writer to it.
    pub(crate) fn begin(file: File) -> io::Result<(ParquetOut, Buffered)> {
        let writer = UntilRefused::new(file.try_clone()?);
        Ok((ParquetOut { file, refusal: writer.refusal() }, BufWriter::new(writer)))
    }

    /// The reason of a failure: the system's, if it refused a write, otherwise the library's.
    pub(crate) fn reason(&self, error: &impl ToString) -> String {
        self.refusal.reason().map_or_else(|| error.to_string(), str::to_owned)
    }

    /// Sets the checksum, and returns the file.
    pub(crate) fn seal(mut self) -> io::Result<File> {
        parquet_checksum::seal(&mut self.file)?;
        Ok(self.file)
    }
}
