//! Tables as Parquet, compressed with zstd; here because only this crate may use polars.
//!
//! Other programs read them, this one does not. Only a row group is in memory at a time. Units, meanings and the source
//! of the rows are in the file's key-value metadata under `asperity:`.
//!
//! Columns are series of polars, and its crate for Parquet encodes them. The writer above it, of `polars-io`, would bring
//! readers, three more compressions and operations on columns, a tenth of a cold build, and starts threads.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};

use asperity_files::{Refusal, UntilRefused};
use polars::prelude::{CompatLevel, NamedFrom, PolarsError, PolarsResult, Series};
use polars_parquet::write::{
    CompressionOptions, Compressor, DynIter, DynStreamingIterator, FallibleStreamingIterator, FileWriter,
    KeyValue, StatisticsOptions, Version, WriteOptions, array_to_columns, get_dtype_encoding,
};

use crate::format::TableWriter;
use crate::table::{Table, Values};

/// A Parquet file that is being written.
pub(crate) struct Parquet {
    /// The library writes thousands of single bytes and flushes at the end.
    writer: FileWriter<BufWriter<UntilRefused<File>>>,
    /// The system's reason for a refused write: the library reports some of them as a "transport error".
    refusal: Refusal,
    /// The columns of the row group in progress, which take less than half of the memory that they take in a table.
    group: Vec<Series>,
    units_and_meanings: Vec<(String, String)>,
}

impl Parquet {
    pub(crate) fn start(table: &Table, file: File) -> io::Result<Parquet> {
        let out = UntilRefused::new(file);
        let refusal = out.refusal();
        let fields = series(&Table::new("", table.columns.clone())).into_iter().map(|column| {
            let field = column.field().to_arrow(CompatLevel::newest());
            (field.name.clone(), field)
        });
        let options = WriteOptions {
            statistics: StatisticsOptions::default(),
            version: Version::V1,
            compression: CompressionOptions::Zstd(None),
            data_page_size: None,
        };
        let writer = FileWriter::try_new(BufWriter::new(out), fields.collect(), options)
            .map_err(|error| in_words(&refusal, error))?;
        let of_columns = |text: fn(&asperity_record::Column) -> Option<&str>| {
            let texts = table.columns.iter().filter_map(|column| Some((&*column.name, text(column)?)));
            serde_json::to_string(&texts.collect::<BTreeMap<_, _>>()).expect("texts can always be JSON")
        };
        let units_and_meanings = vec![
            ("asperity:units".to_owned(), of_columns(|column| column.unit)),
            ("asperity:meanings".to_owned(), of_columns(|column| Some(&column.about))),
        ];
        Ok(Parquet { writer, refusal, group: Vec::new(), units_and_meanings })
    }

    /// Adds the rows of a table to the row group in progress.
    fn add(&mut self, table: &Table) -> PolarsResult<()> {
        let added = series(table);
        if self.group.is_empty() {
            self.group = added;
            return Ok(());
        }
        self.group.iter_mut().zip(added).try_for_each(|(column, rows)| column.append_owned(rows).map(drop))
    }

    /// Writes the row group in progress, if it has rows.
    fn write_group(&mut self) -> PolarsResult<()> {
        let group = std::mem::take(&mut self.group);
        let rows = group.first().map_or(0, |column| column.len());
        if rows == 0 {
            return Ok(());
        }
        let options = self.writer.options();
        let mut columns = Vec::with_capacity(group.len());
        for (column, kind) in group.into_iter().zip(self.writer.parquet_schema().fields()) {
            let values = column.rechunk().to_arrow(0, CompatLevel::newest());
            let encodings = get_dtype_encoding(values.dtype());
            for pages in array_to_columns(values, kind.clone(), options, &encodings)? {
                let pages = Compressor::new_from_vec(
                    pages.map(|page| page.map_err(Into::into)),
                    options.compression,
                    vec![],
                );
                columns.push(Ok(DynStreamingIterator::new(pages.map_err(PolarsError::from))));
            }
        }
        self.writer.write(rows as u64, DynIter::new(columns.into_iter()))
    }
}

impl TableWriter for Parquet {
    fn write(&mut self, table: &Table) -> io::Result<()> {
        self.add(table).map_err(|error| in_words(&self.refusal, error))
    }

    fn end_group(&mut self) -> io::Result<()> {
        self.write_group().map_err(|error| in_words(&self.refusal, error))
    }

    fn finish(mut self: Box<Self>, about: &[(String, String)]) -> io::Result<()> {
        let about = about.iter().chain(&self.units_and_meanings).cloned();
        let metadata = about.map(|(key, value)| KeyValue { key, value: Some(value) }).collect();
        self.writer.end(Some(metadata)).map(drop).map_err(|error| in_words(&self.refusal, error))
    }
}

/// The columns of a table as series of polars.
fn series(table: &Table) -> Vec<Series> {
    let column = |(column, values): (&asperity_record::Column, &Values)| {
        let name = column.name.as_ref().into();
        match values {
            Values::Counts(values) => Series::new(name, values),
            Values::Steps(values) => Series::new(name, values),
            Values::Numbers(values) => Series::new(name, values),
            Values::Flags(values) => Series::new(name, values),
            Values::Words(values) => {
                Series::new(name, values.iter().map(Option::as_deref).collect::<Vec<_>>())
            }
        }
    };
    table.columns.iter().zip(table.values()).map(column).collect()
}

/// The reason of a failure: the system's, if it refused a write, otherwise the library's.
fn in_words(refusal: &Refusal, error: PolarsError) -> io::Error {
    io::Error::other(refusal.reason().map_or_else(|| error.to_string(), str::to_owned))
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use crate::export::about;
    use crate::format::{DAMAGED, Format};
    use crate::layout::{StepParts, record_tables};
    use asperity_record::{Cell, RunHeader};
    use asperity_testkit::run_header;

    /// Doubles that a format that rounds, or that writes decimals, would lose.
    const DOUBLES: [f64; 6] = [0.1 + 0.2, -0.0, 5e-324, -1.7976931348623157e308, 1e-7, 4.0];

    #[test]
    fn doubles_come_back_to_the_bit_with_units_and_header() {
        let mut table = record_tables(StepParts::default()).remove(2);
        assert_eq!(table.name, "/fields");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.parquet");
        let mut writer = Format::Parquet.start(&table, File::create(&path).unwrap()).unwrap();
        for half in DOUBLES.chunks(3) {
            for value in half {
                let number = || Cell::Number(*value);
                let (step, count, flag) = (Cell::Step(u64::MAX), Cell::Count(u32::MAX), Cell::Flag(true));
                table.push([step, number(), count, number(), number(), Cell::Empty, number(), flag]);
                writer.write(&table).unwrap();
                table.clear();
            }
            writer.end_group().unwrap();
        }
        let (scenario_hash, code_version) = ("5c".to_owned(), "c0de".to_owned());
        let header = RunHeader { scenario_hash, code_version, time_step_s: 1e-7, ..run_header() };
        let source = serde_json::json!({
            "topic": table.name, "log": DAMAGED, "last_step": 8, "from_s": 0.5, "to_s": null,
        });
        writer.finish(&about(&header, source)).unwrap();

        let (metadata, columns) = crate::parquet_reading::read(&path);
        let column = |name| columns.iter().find(|column| column.name() == name).unwrap();
        assert_eq!(metadata.row_groups.len(), 2, "the rows up to the end of a group");
        let read = column("displacement_m").f64().unwrap();
        let read: Vec<u64> = read.iter().map(|value| value.unwrap().to_bits()).collect();
        assert_eq!(read, DOUBLES.map(f64::to_bits));
        assert_eq!(column("tangential_force_n").null_count(), DOUBLES.len());
        assert_eq!(column("step").u64().unwrap().get(0), Some(u64::MAX));
        assert_eq!(column("block").u32().unwrap().get(5), Some(u32::MAX));
        assert_eq!(column("detached").bool().unwrap().sum(), Some(6));

        let pairs = metadata.key_value_metadata().as_ref().unwrap();
        let text = |key: &str| pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.clone());
        for (key, expected) in [
            ("asperity:topic", Some("/fields")),
            ("asperity:log", Some("damaged")),
            ("asperity:last_step", Some("8")),
            ("asperity:scenario_hash", Some("5c")),
            ("asperity:code_version", Some("c0de")),
            ("asperity:time_step_s", Some("0.0000001")),
            ("asperity:block_length_m", Some(&*header.scales.block_length_m.to_string())),
            ("asperity:from_s", Some("0.5")),
            ("asperity:to_s", None),
        ] {
            assert_eq!(text(key).as_deref(), expected, "{key}");
        }
        let units = text("asperity:units").unwrap();
        assert!(units.contains("\"velocity_m_per_s\":\"m/s\"") && !units.contains("block"), "{units}");
        let meanings = text("asperity:meanings").unwrap();
        assert!(meanings.contains("\"velocity_m_per_s\":\"Velocity after the step.\""), "{meanings}");
    }
}
