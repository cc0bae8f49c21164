//! Reads Parquet files, which the program only writes.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use polars::prelude::{AnyValue, DataType, Series};
use polars_parquet::read::{
    BasicDecompressor, FileMetadata, PageReader, RowGroupMetadata, column_iter_to_arrays, infer_schema,
    read_metadata,
};

/// What a file says of itself, and its columns.
pub(crate) fn read(path: &Path) -> (FileMetadata, Vec<Series>) {
    let bytes = fs::read(path).expect("there is such a table");
    let metadata = read_metadata(&mut Cursor::new(&bytes)).expect("it is a table");
    let fields = infer_schema(&metadata).expect("its columns have types");
    let columns = fields.iter_values().map(|field| {
        let of_group = |group: &RowGroupMetadata| {
            let chunk = group.columns_under_root_iter(&field.name).expect("there is such a column").next();
            let chunk = chunk.expect("a column has one chunk");
            let range = chunk.byte_range();
            let bytes = bytes[range.start as usize..range.end as usize].to_vec();
            let pages = PageReader::new(Cursor::new(bytes.into()), chunk, vec![], usize::MAX);
            let kind = &chunk.descriptor().descriptor.primitive_type;
            let columns = vec![BasicDecompressor::new(pages, vec![])];
            column_iter_to_arrays(columns, vec![kind], field.clone(), None).expect("its pages can be read").0
        };
        let arrays: Vec<_> = metadata.row_groups.iter().flat_map(of_group).collect();
        if arrays.is_empty() {
            return Series::new_empty(field.name.clone(), &DataType::from_arrow_field(field));
        }
        Series::try_from((field.name.clone(), arrays)).expect("the chunks of a column have one type")
    });
    let columns = columns.collect();
    (metadata, columns)
}

/// The table in a Parquet file as the CSV table beside it.
pub(crate) fn csv_of(path: &Path) -> String {
    let (_, columns) = read(path);
    let names: Vec<&str> = columns.iter().map(|column| column.name().as_str()).collect();
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
        let cells = columns.iter().map(|column| cell(column.get(row).expect("there is such a row")));
        cells.collect::<Vec<_>>().join(",")
    };
    let rows = columns.first().map_or(0, |column| column.len());
    let lines = [names.join(",")].into_iter().chain((0..rows).map(row));
    lines.map(|line| line + "\n").collect()
}
