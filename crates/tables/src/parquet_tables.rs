//! Tables of a log as Parquet, beside CSV and NDJSON;
//! here because only this crate may use polars.
//!
//! Each batch is a row group, so memory does not grow with the table. Units and the run's header are in the
//! file's key-value metadata under `asperity:`, with a checksum of the whole file.

use std::fs::File;

use asperity_record::ColumnKind;
use polars::prelude::{
    BatchedWriter, Column, DataFrame, DataType, KeyValueMetadata, NamedFrom, ParquetMetadataContext,
    ParquetWriter, PolarsResult, Schema, Series,
};

use crate::batch::{Batch, Values};
use crate::format::{Format, FormatError, TableWriter};
use crate::guarded::start_threads;
use crate::layout::Layout;
use crate::parquet_checksum;
use crate::parquet_out::{Buffered, ParquetOut};

/// Parquet, compressed with zstd. A file must be open for reading as well, for its checksum.
#[derive(Debug, Clone, Copy)]
pub struct Parquet;

struct ParquetTable {
    out: ParquetOut,
    writer: BatchedWriter<Buffered>,
    layout: Layout,
}

impl Format for Parquet {
    fn extension(&self) -> &'static str {
        "parquet"
    }

    fn start(&self, layout: &Layout, file: File) -> Result<Box<dyn TableWriter>, FormatError> {
        start_threads().map_err(FormatError::Library)?;
        let schema: Schema = layout
            .columns
            .iter()
            .map(|column| {
                let kind = match column.kind {
                    ColumnKind::Count => DataType::UInt32,
                    ColumnKind::Step => DataType::UInt64,
                    ColumnKind::Number => DataType::Float64,
                    ColumnKind::Flag => DataType::Boolean,
                    ColumnKind::Word => DataType::String,
                };
                (column.name.as_ref().into(), kind)
            })
            .collect();
        let (out, writer) = ParquetOut::begin(file)?;
        let writer = ParquetWriter::new(writer).batched(&schema);
        let writer = writer.map_err(|error| refused(&out, &error))?;
        Ok(Box::new(ParquetTable { out, writer, layout: layout.clone() }))
    }
}

impl TableWriter for ParquetTable {
    fn write(&mut self, batch: &Batch) -> Result<(), FormatError> {
        let written = frame(&self.layout.columns, batch).and_then(|frame| self.writer.write_batch(&frame));
        written.map_err(|error| refused(&self.out, &error))
    }

    fn finish(self: Box<Self>, about: &[(String, String)]) -> Result<File, FormatError> {
        // The state of the log is known only now, but the writer's own method for ending a file accepts no
        // new metadata.
        let mut about = about.to_vec();
        about.extend(parquet_checksum::pair(&self.out.file)?);
        let metadata = KeyValueMetadata::from_static(about)
            .collect(ParquetMetadataContext { arrow_schema: "" })
            .map_err(|error| refused(&self.out, &error))?;
        let mut writer =
            self.writer.get_writer().lock().map_err(|error| FormatError::Library(error.to_string()))?;
        writer.end(Some(metadata)).map_err(|error| refused(&self.out, &error))?;
        drop(writer);
        Ok(self.out.seal()?)
    }
}

/// Rows as a polars table.
pub(crate) fn frame(columns: &[asperity_record::Column], batch: &Batch) -> PolarsResult<DataFrame> {
    let columns = columns.iter().zip(batch.columns());
    DataFrame::new(batch.rows(), columns.map(|(column, values)| series(&column.name, values)).collect())
}

fn series(name: &str, values: &Values) -> Column {
    let name = name.into();
    match values {
        Values::Counts(values) => Series::new(name, values).into(),
        Values::Steps(values) => Series::new(name, values).into(),
        Values::Numbers(values) => Series::new(name, values).into(),
        Values::Flags(values) => Series::new(name, values).into(),
        Values::Words(values) => {
            Series::new(name, values.iter().map(Option::as_deref).collect::<Vec<_>>()).into()
        }
    }
}

fn refused(out: &ParquetOut, error: &polars::error::PolarsError) -> FormatError {
    FormatError::Library(out.reason(error))
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};

    use crate::batch::Batch;
    use crate::format::{About, Format, State};
    use crate::layout::{StepParts, record_layouts};
    use asperity_record::{Cell, RunHeader};
    use asperity_testkit::run_header;
    use polars::prelude::{ParquetReader, SerReader};

    use super::Parquet;

    /// Doubles that a format that rounds, or that writes decimals, would lose.
    const DOUBLES: [f64; 6] = [0.1 + 0.2, -0.0, 5e-324, -1.7976931348623157e308, 1e-7, 4.0];

    #[test]
    fn doubles_come_back_to_the_bit_with_units_and_header() {
        let layout = record_layouts(StepParts::default()).remove(2);
        assert_eq!(layout.topic, "/fields");
        let path = std::env::temp_dir().join(format!("asperity-{}.parquet", std::process::id()));
        let file = File::options().read(true).write(true).create(true).truncate(true).open(&path).unwrap();
        let mut table = Parquet.start(&layout, file).unwrap();
        let mut batch = Batch::new(&layout.columns);
        for half in DOUBLES.chunks(3) {
            for value in half {
                let number = || Cell::Number(*value);
                let (step, count, flag) = (Cell::Step(u64::MAX), Cell::Count(u32::MAX), Cell::Flag(true));
                batch.push(&[step, number(), count, number(), number(), Cell::Empty, number(), flag]);
            }
            table.write(&batch).unwrap();
            batch.clear();
        }
        let (scenario_hash, code_version) = ("5c".to_owned(), "c0de".to_owned());
        let header = RunHeader { scenario_hash, code_version, ..run_header() };
        let about = About { header, state: State::Damaged, last_step: 8, from_s: Some(0.5), to_s: None };
        table.finish(&about.pairs(&layout)).unwrap();

        let mut reader = ParquetReader::new(File::open(&path).unwrap());
        let metadata = reader.get_metadata().unwrap().clone();
        let frame = reader.finish().unwrap();
        fs::remove_file(&path).unwrap();
        assert_eq!(metadata.row_groups.len(), 2, "each batch is a row group");
        let read: Vec<u64> = frame
            .column("displacement_m")
            .unwrap()
            .f64()
            .unwrap()
            .iter()
            .map(|value| value.unwrap().to_bits())
            .collect();
        assert_eq!(read, DOUBLES.map(f64::to_bits));
        assert_eq!(frame.column("tangential_force_n").unwrap().null_count(), DOUBLES.len());
        assert_eq!(frame.column("step").unwrap().u64().unwrap().get(0), Some(u64::MAX));
        assert_eq!(frame.column("block").unwrap().u32().unwrap().get(5), Some(u32::MAX));
        assert_eq!(frame.column("detached").unwrap().bool().unwrap().sum(), Some(6));

        let pairs = metadata.key_value_metadata().as_ref().unwrap();
        let text = |key: &str| pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.clone());
        for (key, expected) in [
            ("asperity:topic", Some("/fields")),
            ("asperity:log", Some("damaged")),
            ("asperity:last_step", Some("8")),
            ("asperity:scenario_hash", Some("5c")),
            ("asperity:code_version", Some("c0de")),
            ("asperity:from_s", Some("0.5")),
            ("asperity:to_s", None),
        ] {
            assert_eq!(text(key).as_deref(), expected, "{key}");
        }
        let units = text("asperity:units").unwrap();
        assert!(units.contains("\"velocity_m_per_s\":\"m/s\"") && !units.contains("block"), "{units}");
    }
}
