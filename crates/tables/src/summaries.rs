//! Summaries of runs as files: one table of all, one JSON text of each.

use std::path::Path;

use asperity_files::{FileError, FileSet};
use asperity_numbers::Summary;

use crate::{CsvRows, Spelling};

/// The table of all.
pub const TABLE: &str = "summary.csv";
/// The JSON of one, by itself or behind the name of its run.
pub const JSON: &str = "summary.json";

/// Writes a table with a row for each run.
///
/// # Errors
/// If it cannot be written.
pub fn write_table<'a>(
    files: &FileSet,
    path: &Path,
    summaries: impl IntoIterator<Item = &'a Summary>,
) -> Result<(), FileError> {
    let failed = FileError::io(path);
    let names = Summary::KEYS.iter().map(|key| key.column.name.as_ref());
    let mut rows = CsvRows::headed(files.create(path)?, names, Spelling::Scientific).map_err(&failed)?;
    summaries.into_iter().try_for_each(|summary| rows.push_texts(summary.row())).map_err(&failed)?;
    rows.finish().map(drop).map_err(failed)
}

/// Writes the JSON of one.
///
/// # Errors
/// If it cannot be written.
pub fn write_json(files: &FileSet, path: &Path, summary: &Summary) -> Result<(), FileError> {
    let text = serde_json::to_string_pretty(&summary.to_json())
        .expect("texts and finite numbers can always be JSON");
    files.write(path, text + "\n")
}
