//! Tables of a log as Parquet, beside the CSV and NDJSON of `asperity-export`;
//! here because only this crate may use polars.
//!
//! Each batch is a row group, so memory does not grow with the table. Units and
//! the run's header stand in the file's key-value metadata under `asperity:`.

use std::fs::File;
use std::io::BufWriter;

use asperity_export::batch::{Batch, Values};
use asperity_export::format::{About, Format, FormatError, TableWriter};
use asperity_export::layout::{Kind, Layout};
use polars::prelude::{
    BatchedWriter, Column, DataFrame, DataType, KeyValueMetadata, NamedFrom, ParquetMetadataContext,
    ParquetWriter, Schema, Series,
};

/// Parquet, compressed with zstd.
#[derive(Debug, Clone, Copy)]
pub struct Parquet;

struct ParquetTable {
    /// What the writer writes to, held to be given back.
    file: File,
    writer: BatchedWriter<BufWriter<File>>,
    layout: Layout,
}

impl Format for Parquet {
    fn extension(&self) -> &'static str {
        "parquet"
    }

    fn start(&self, layout: &Layout, file: File) -> Result<Box<dyn TableWriter>, FormatError> {
        let schema: Schema = layout
            .columns
            .iter()
            .map(|column| {
                let kind = match column.kind {
                    Kind::Count => DataType::UInt32,
                    Kind::Step => DataType::UInt64,
                    Kind::Number => DataType::Float64,
                    Kind::Flag => DataType::Boolean,
                    Kind::Word => DataType::String,
                };
                (column.name.into(), kind)
            })
            .collect();
        let writer = ParquetWriter::new(BufWriter::new(file.try_clone()?)).batched(&schema).map_err(refused)?;
        Ok(Box::new(ParquetTable { file, writer, layout: layout.clone() }))
    }
}

impl TableWriter for ParquetTable {
    fn write(&mut self, batch: &Batch) -> Result<(), FormatError> {
        let columns = self.layout.columns.iter().zip(batch.columns());
        let columns = columns.map(|(column, values)| series(column.name, values)).collect();
        let frame = DataFrame::new(batch.rows(), columns).map_err(refused)?;
        self.writer.write_batch(&frame).map_err(refused)
    }

    fn finish(self: Box<Self>, about: &About) -> Result<File, FormatError> {
        // Whether the log is whole is known only now, and the writer's own way of
        // ending a file takes no more than it was started with.
        let metadata = KeyValueMetadata::from_static(about.pairs(&self.layout))
            .collect(ParquetMetadataContext { arrow_schema: "" })
            .map_err(refused)?;
        let mut writer = self.writer.get_writer().lock().map_err(|error| FormatError::Library(error.to_string()))?;
        writer.end(Some(metadata)).map_err(refused)?;
        drop(writer);
        Ok(self.file)
    }
}

fn series(name: &str, values: &Values) -> Column {
    let name = name.into();
    match values {
        Values::Counts(values) => Series::new(name, values).into(),
        Values::Steps(values) => Series::new(name, values).into(),
        Values::Numbers(values) => Series::new(name, values).into(),
        Values::Flags(values) => Series::new(name, values).into(),
        Values::Words(values) => Series::new(name, values).into(),
    }
}

fn refused(error: polars::error::PolarsError) -> FormatError {
    FormatError::Library(error.to_string())
}
