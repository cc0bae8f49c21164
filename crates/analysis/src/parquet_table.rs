//! Parquet tables that somebody else may have made, read a part at a time.
//!
//! `asperity events` reads whatever files a repository holds, as a filter of `git diff`. Sizes
//! are held against the file before polars is asked (`parquet_bounds`), and polars reads some row
//! groups at once, so that memory follows the length of the file. In a damaged file polars may
//! also come upon what it takes to be impossible, and panic. That is caught here and is an error
//! like any other: no state is shared with what panicked, since it owns all that it works on.

use std::cell::Cell;
use std::fs::File;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::Once;

use polars::prelude::{DataFrame, ParallelStrategy, ParquetReader, PolarsResult, SerReader};

use crate::error::AnalysisError;
use crate::parquet_bounds;

/// Rows that are read at once, if row groups allow.
const PART_ROWS: usize = 1 << 16;

/// A Parquet file that is open.
pub struct ParquetTable {
    path: PathBuf,
    file: File,
    names: Vec<String>,
    /// Where each part begins and how many rows it has, the last one first.
    parts: Vec<(usize, usize)>,
    /// Bytes that its texts may have.
    pub(crate) most_text: u64,
}

impl ParquetTable {
    /// Opens a file and looks at how large it says that it is.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or stands for more than its length bears out.
    pub fn open(path: &Path) -> Result<ParquetTable, AnalysisError> {
        let problem = |problem: String| AnalysisError::Read { path: path.display().to_string(), problem };
        let mut file = File::open(path).map_err(|error| problem(error.to_string()))?;
        let bounds = parquet_bounds::check(&mut file).map_err(problem)?;
        let of_names = file.try_clone().map_err(|error| problem(error.to_string()))?;
        let names = guarded(|| {
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
    pub fn next_part(&mut self) -> Result<Option<DataFrame>, AnalysisError> {
        let Some((start, rows)) = self.parts.pop() else { return Ok(None) };
        let file = self.file.try_clone().map_err(|error| self.problem(error.to_string()))?;
        let reader = ParquetReader::new(file)
            .with_slice(Some((start, rows)))
            // A cell is found at once where there is one array for each column.
            .set_rechunk(true)
            // On this thread: its panics are ours to catch, and columns unpack one after another.
            .read_parallel(ParallelStrategy::None);
        let part = guarded(|| reader.finish()).map_err(|problem| self.problem(problem))?;
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
    pub(crate) fn problem(&self, problem: String) -> AnalysisError {
        AnalysisError::Read { path: self.path.display().to_string(), problem }
    }
}

thread_local! {
    /// Whether a panic of this thread is caught and told as an error.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Has polars do something, and makes an error of a panic. Panics of other threads, and of this
/// one at other times, are reported as they always are.
fn guarded<T>(work: impl FnOnce() -> PolarsResult<T>) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_GUARDED.get() {
                usual(info);
            }
        }));
    });
    IS_GUARDED.set(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    IS_GUARDED.set(false);
    match outcome {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(error.to_string()),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let what = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("it does not say at what");
            Err(format!("it is damaged: its reader gave up at: {what}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::guarded;

    #[test]
    fn a_panic_of_polars_is_an_error() {
        let text = |outcome: Result<(), String>| outcome.unwrap_err();
        assert_eq!(text(guarded(|| panic!("row {}", 7))), "it is damaged: its reader gave up at: row 7");
        assert_eq!(guarded(|| Ok(7)), Ok(7));
    }
}
