//! Reads Parquet tables from any source, a part at a time.
//!
//! `asperity events` reads any files in a repository, as a filter of `git diff`. Sizes are checked against
//! the file before polars reads it (`parquet_bounds`), and polars reads some row groups at once, so that
//! memory follows the length of the file. A damaged file may also violate assumptions of polars, which then
//! panics. The panic is caught here and becomes an error: no state is shared, since the panicking code owns
//! all its data.

use std::fs::File;
use std::path::{Path, PathBuf};

use polars::prelude::{DataFrame, ParallelStrategy, ParquetReader, PolarsResult, SerReader};

use crate::error::TableFileError;
use crate::guarded::{guarded, start_threads};
use crate::{parquet_bounds, parquet_checksum};

/// Rows that are read at once, if row groups allow.
const PART_ROWS: usize = 1 << 16;

/// A Parquet file that is open.
pub struct ParquetTable {
    path: PathBuf,
    file: File,
    names: Vec<String>,
    /// Start and number of rows of each part, the last one first.
    parts: Vec<(usize, usize)>,
    /// Bytes that its texts may have.
    pub(crate) most_text: u64,
}

impl ParquetTable {
    /// Opens a file and checks the sizes that it claims.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or claims more than its length supports; or if the system refuses
    /// threads.
    pub fn open(path: &Path) -> Result<ParquetTable, TableFileError> {
        let problem = |problem: String| TableFileError::Read { path: path.display().to_string(), problem };
        let mut file = asperity_files::open(path).map_err(|error| problem(error.to_string()))?;
        let bounds = parquet_bounds::check(&mut file).map_err(problem)?;
        parquet_checksum::verify(&mut file, &bounds.footer).map_err(problem)?;
        start_threads().map_err(problem)?;
        let of_names = file.try_clone().map_err(|error| problem(error.to_string()))?;
        let names = read(|| {
            let schema = ParquetReader::new(of_names).schema()?;
            Ok(schema.iter_names().map(ToString::to_string).collect())
        })
        .map_err(problem)?;
        let mut parts: Vec<(usize, usize)> = Vec::new();
        let mut start = 0;
        for rows in bounds.rows {
            match parts.last_mut() {
                Some((_, length)) if *length + rows <= PART_ROWS => *length += rows,
                _ => parts.push((start, rows)),
            }
            start += rows;
        }
        parts.reverse();
        Ok(ParquetTable { path: path.to_owned(), file, names, parts, most_text: bounds.most_text })
    }

    /// The names of its columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The next rows; none after the last.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn next_part(&mut self) -> Result<Option<DataFrame>, TableFileError> {
        let Some((start, rows)) = self.parts.pop() else { return Ok(None) };
        let file = self.file.try_clone().map_err(|error| self.problem(error.to_string()))?;
        let reader = ParquetReader::new(file)
            .with_slice(Some((start, rows)))
            // Cells are found directly if each column is a single array.
            .set_rechunk(true)
            // On this thread: its panics are ours to catch, and columns unpack one after another.
            .read_parallel(ParallelStrategy::None);
        let part = read(|| reader.finish()).map_err(|problem| self.problem(problem))?;
        let (found, columns) = (part.height(), part.width());
        if found != rows || columns != self.names.len() {
            let (wanted, expected) = (rows, self.names.len());
            return Err(self.problem(format!(
                "{found} rows of {columns} columns from row {start} on, not {wanted} of {expected}"
            )));
        }
        Ok(Some(part))
    }

    /// An error about this table.
    pub(crate) fn problem(&self, problem: String) -> TableFileError {
        TableFileError::Read { path: self.path.display().to_string(), problem }
    }
}

/// Has polars read something, and makes an error of a panic.
fn read<T>(work: impl FnOnce() -> PolarsResult<T>) -> Result<T, String> {
    match guarded(work) {
        Ok(outcome) => outcome.map_err(|error| error.to_string()),
        Err(panic) => Err(format!("it is damaged: its reader gave up at: {panic}")),
    }
}

#[cfg(test)]
mod tests {
    use super::read;

    #[test]
    fn a_panic_of_the_reader_is_damage() {
        let text = read::<()>(|| panic!("row {}", 7)).unwrap_err();
        assert_eq!(text, "it is damaged: its reader gave up at: row 7");
    }
}
