//! A table as CSV (full precision, stable order) and as Parquet.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_record::Cell;
use polars::prelude::{AnyValue, DataFrame, ParquetWriter};

use crate::error::TableFileError;
use crate::guarded::start_threads;
use crate::parquet_checksum;
use crate::parquet_out::ParquetOut;
use crate::parquet_table::ParquetTable;
use crate::{CsvRows, Spelling};

/// Writes `NAME.csv` and `NAME.parquet` into a folder, as files of a set.
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    files: &FileSet,
    folder: &Path,
    name: &str,
    table: &mut DataFrame,
) -> Result<(), TableFileError> {
    let failed =
        |path: &Path, problem: String| TableFileError::Write { path: path.display().to_string(), problem };
    let [csv, parquet] = paths(folder, name);
    write_csv(files.create(&csv)?, table).map_err(|error| failed(&csv, error.to_string()))?;
    let file = files.create(&parquet)?;
    write_parquet(file, table).map_err(|problem| failed(&parquet, problem))
}

fn write_parquet(file: File, table: &mut DataFrame) -> Result<(), String> {
    start_threads()?;
    let in_words = |error: io::Error| error.to_string();
    let metadata = parquet_checksum::metadata(&file).map_err(in_words)?;
    let (out, writer) = ParquetOut::begin(file).map_err(in_words)?;
    let writer = ParquetWriter::new(writer).with_key_value_metadata(metadata);
    writer.finish(table).map_err(|error| out.reason(&error))?;
    out.seal().map(drop).map_err(in_words)
}

/// The files of a table.
pub fn paths(folder: &Path, name: &str) -> [PathBuf; 2] {
    ["csv", "parquet"].map(|ending| folder.join(format!("{name}.{ending}")))
}

/// The first bytes of every Parquet file.
const PARQUET: &[u8] = b"PAR1";

/// Whether a file is Parquet, by its content: files from git may have any name.
///
/// # Errors
/// If it cannot be read.
pub fn is_parquet(path: &Path) -> io::Result<bool> {
    let mut start = Vec::new();
    asperity_files::open(path)?.take(PARQUET.len() as u64).read_to_end(&mut start)?;
    Ok(start == PARQUET)
}

/// A table that cannot be printed.
#[derive(Debug, thiserror::Error)]
pub enum PrintError {
    /// It cannot be read.
    #[error(transparent)]
    Table(#[from] TableFileError),
    /// The output cannot be written.
    #[error(transparent)]
    Output(#[from] io::Error),
}

/// Prints a table that was written as Parquet as [`write_csv`] would have written it, up to where
/// it can be read.
///
/// # Errors
/// If `out` cannot be written, the file is damaged, or has columns of a kind that no table here
/// has.
pub fn print_parquet(out: impl Write, path: &Path) -> Result<(), PrintError> {
    let mut table = ParquetTable::open(path)?;
    let mut rows = CsvRows::headed(out, table.names().iter().map(String::as_str), Spelling::Plain)?;
    let mut text_bytes = 0;
    while let Some(part) = table.next_part()? {
        for row in 0..part.height() {
            let cells = part.columns().iter().map(|column| text(&column.get(row).map_err(io::Error::other)?));
            let cells: Vec<String> =
                cells.collect::<io::Result<_>>().map_err(|error| table.problem(error.to_string()))?;
            // A text may be stored once in the file, but appear in every row of the table.
            text_bytes +=
                cells.iter().map(|cell| cell.len() as u64).filter(|length| *length > LONG_BYTES).sum::<u64>();
            if text_bytes > table.most_text {
                return Err(table
                    .problem(format!(
                        "its long texts have more than {} bytes in all (accepted: 8 for each byte of the file and \
                         8000000)",
                        table.most_text
                    ))
                    .into());
            }
            rows.push_texts(cells)?;
        }
    }
    Ok(rows.finish().map(drop)?)
}

/// No number is longer, and no word of ours.
const LONG_BYTES: u64 = 32;

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
    let unlike = || io::Error::other(format!("no way to write {value:?} as CSV"));
    Ok(cell(value).ok_or_else(unlike)?.to_string())
}

/// A value of polars as a cell, if it is of a kind that tables have here or other programs store instead.
pub(crate) fn cell(value: &AnyValue<'_>) -> Option<Cell> {
    Some(match value {
        AnyValue::Null => Cell::Empty,
        AnyValue::Float64(number) => Cell::Number(*number),
        AnyValue::Float32(number) => Cell::Number((*number).into()),
        AnyValue::UInt32(number) => Cell::Count(*number),
        AnyValue::UInt64(number) => Cell::Step(*number),
        AnyValue::Int64(number) => Cell::Step((*number).try_into().ok()?),
        AnyValue::Int32(number) => Cell::Step((*number).try_into().ok()?),
        AnyValue::Boolean(flag) => Cell::Flag(*flag),
        AnyValue::String(text) => Cell::word(text),
        AnyValue::StringOwned(text) => Cell::word(text),
        _ => return None,
    })
}
