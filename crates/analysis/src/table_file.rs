//! A table as CSV (full precision, stable order) and as Parquet.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use polars::prelude::{AnyValue, DataFrame, ParquetWriter};

use crate::AnalysisError;

/// Writes `NAME.csv` and `NAME.parquet` into a folder, each under a temporary
/// name until it is whole.
///
/// # Errors
/// If a file cannot be written.
pub fn write(folder: &Path, name: &str, table: &mut DataFrame) -> Result<(), AnalysisError> {
    published(&folder.join(format!("{name}.csv")), |file| write_csv(file, table))?;
    published(&folder.join(format!("{name}.parquet")), |file| {
        ParquetWriter::new(file).finish(table).map(|_bytes| ()).map_err(|error| error.to_string())
    })
}

/// Writes a file under a temporary name and renames it once it is whole.
pub(crate) fn published(
    path: &Path,
    write: impl FnOnce(File) -> Result<(), String>,
) -> Result<(), AnalysisError> {
    let partial = with_suffix(path, ".partial");
    let outcome = File::create(&partial)
        .map_err(|error| error.to_string())
        .and_then(write)
        .and_then(|()| fs::rename(&partial, path).map_err(|error| error.to_string()));
    outcome.map_err(|problem| {
        // A part of a table is of no use to anybody, and may fill the disk. If it cannot be
        // removed either, the first problem is the one to tell.
        fs::remove_file(&partial).ok();
        AnalysisError::Write { path: path.display().to_string(), problem }
    })
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

fn write_csv(file: File, table: &DataFrame) -> Result<(), String> {
    let mut writer = csv::Writer::from_writer(file);
    let columns = table.columns();
    let write = |writer: &mut csv::Writer<File>, row: Vec<String>| {
        writer.write_record(row).map_err(|error| error.to_string())
    };
    write(&mut writer, columns.iter().map(|column| column.name().to_string()).collect())?;
    for row in 0..table.height() {
        let cells = columns.iter().map(|column| {
            let value = column.get(row).map_err(|error| error.to_string())?;
            cell(&value)
        });
        write(&mut writer, cells.collect::<Result<_, String>>()?)?;
    }
    writer.flush().map_err(|error| error.to_string())
}

/// A value as text: numbers with as many digits as it takes to read the same
/// double back, nothing for null.
fn cell(value: &AnyValue<'_>) -> Result<String, String> {
    Ok(match value {
        AnyValue::Null => String::new(),
        AnyValue::Float64(number) => number.to_string(),
        AnyValue::UInt32(number) => number.to_string(),
        AnyValue::UInt64(number) => number.to_string(),
        AnyValue::Boolean(flag) => flag.to_string(),
        AnyValue::String(text) => (*text).to_owned(),
        AnyValue::StringOwned(text) => text.to_string(),
        other => return Err(format!("no way to write {other:?} as CSV")),
    })
}
