//! Reads Parquet files, which the program only writes.

use std::fs::File;
use std::path::Path;

use polars::prelude::{AnyValue, ParquetReader, SerReader};

/// The table in a Parquet file as the CSV table beside it.
pub(crate) fn csv_of(path: &Path) -> String {
    let file = File::open(path).expect("there is such a table");
    let frame = ParquetReader::new(file).finish().expect("it is a table");
    let names: Vec<&str> = frame.get_column_names().into_iter().map(|name| name.as_str()).collect();
    let cell = |value: AnyValue<'_>| match value {
        AnyValue::Null => String::new(),
        AnyValue::Float64(number) => number.to_string(),
        AnyValue::UInt32(number) => number.to_string(),
        AnyValue::UInt64(number) => number.to_string(),
        AnyValue::Boolean(flag) => flag.to_string(),
        AnyValue::String(word) => word.to_owned(),
        AnyValue::StringOwned(word) => word.to_string(),
        other => panic!("{}: tables have no {other:?}", path.display()),
    };
    let row = |row: usize| {
        let cells = frame.columns().iter().map(|column| cell(column.get(row).expect("there is such a row")));
        cells.collect::<Vec<_>>().join(",")
    };
    let lines = [names.join(",")].into_iter().chain((0..frame.height()).map(row));
    lines.map(|line| line + "\n").collect()
}
