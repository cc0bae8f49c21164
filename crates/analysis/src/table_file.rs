//! A table as CSV (full precision, stable order) and as Parquet.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use asperity_export::{CsvRows, Spelling};
use asperity_files::FileSet;
use asperity_record::Cell;
use polars::prelude::{AnyValue, DataFrame, ParquetReader, ParquetWriter, SerReader};

use crate::error::AnalysisError;

/// Writes `NAME.csv` and `NAME.parquet` into a folder, as files of a set.
///
/// # Errors
/// If a file cannot be written.
pub fn write(files: &FileSet, folder: &Path, name: &str, table: &mut DataFrame) -> Result<(), AnalysisError> {
    let failed =
        |path: &Path, problem: String| AnalysisError::Write { path: path.display().to_string(), problem };
    let [csv, parquet] = paths(folder, name);
    write_csv(files.create(&csv)?, table).map_err(|error| failed(&csv, error.to_string()))?;
    let written = ParquetWriter::new(files.create(&parquet)?).finish(table);
    written.map(drop).map_err(|error| failed(&parquet, error.to_string()))
}

/// The files of a table.
pub fn paths(folder: &Path, name: &str) -> [PathBuf; 2] {
    ["csv", "parquet"].map(|ending| folder.join(format!("{name}.{ending}")))
}

/// What every Parquet file starts with.
const PARQUET: &[u8] = b"PAR1";

/// Whether a file is Parquet, by its content: what git hands over may have any name.
///
/// # Errors
/// If it cannot be read.
pub fn is_parquet(path: &Path) -> io::Result<bool> {
    let mut start = Vec::new();
    File::open(path)?.take(PARQUET.len() as u64).read_to_end(&mut start)?;
    Ok(start == PARQUET)
}

/// Reads a table that was written as Parquet.
///
/// # Errors
/// If the file cannot be read or is damaged.
pub fn read_parquet(path: &Path) -> Result<DataFrame, AnalysisError> {
    let problem = |problem: String| AnalysisError::Read { path: path.display().to_string(), problem };
    let file = File::open(path).map_err(|error| problem(error.to_string()))?;
    ParquetReader::new(file).finish().map_err(|error| problem(error.to_string()))
}

/// Writes a table as CSV, the same text whatever the table was read from.
///
/// # Errors
/// If `out` cannot be written, or a column is of a kind that no table here has.
pub fn write_csv(out: impl Write, table: &DataFrame) -> io::Result<()> {
    let columns = table.columns();
    let names = columns.iter().map(|column| column.name().as_str());
    let mut rows = CsvRows::headed(out, names, Spelling::Plain)?;
    for row in 0..table.height() {
        let cells = columns.iter().map(|column| text(&column.get(row).map_err(io::Error::other)?));
        rows.push_texts(cells.collect::<io::Result<Vec<String>>>()?)?;
    }
    rows.finish().map(drop)
}

/// A value as text, as an exported table spells it.
fn text(value: &AnyValue<'_>) -> io::Result<String> {
    let cell = match value {
        AnyValue::Null => Cell::Empty,
        AnyValue::Float64(number) => Cell::Number(*number),
        AnyValue::UInt32(number) => Cell::Count(*number),
        AnyValue::UInt64(number) => Cell::Step(*number),
        AnyValue::Boolean(flag) => Cell::Flag(*flag),
        AnyValue::String(text) => return Ok((*text).to_owned()),
        AnyValue::StringOwned(text) => return Ok(text.to_string()),
        other => return Err(io::Error::other(format!("no way to write {other:?} as CSV"))),
    };
    Ok(cell.to_string())
}
