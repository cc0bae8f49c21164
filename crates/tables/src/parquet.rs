//! Tables as Parquet, compressed with zstd; here because only this crate may use polars.
//!
//! Other programs read them, this one does not. Only a row group is in memory at a time. Units, meanings and the source
//! of the rows are in the file's key-value metadata under `asperity:`.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::panic;
use std::sync::OnceLock;

use asperity_files::{Refusal, UntilRefused};
use polars::prelude::{
    BatchedWriter, Column, DataFrame, KeyValueMetadata, NamedFrom, ParquetMetadataContext, ParquetWriter,
    PolarsResult, Series,
};

use crate::format::TableWriter;
use crate::table::{Table, Values};

/// A Parquet file that is being written.
pub(crate) struct Parquet {
    /// The library writes thousands of single bytes and flushes at the end.
    writer: BatchedWriter<BufWriter<UntilRefused<File>>>,
    /// The system's reason for a refused write: the library reports some of them as a "transport error".
    refusal: Refusal,
    /// The row group in progress: its rows take less than half of the memory that they take in a table.
    group: DataFrame,
    units_and_meanings: Vec<(String, String)>,
}

impl Parquet {
    pub(crate) fn start(table: &Table, file: File) -> io::Result<Parquet> {
        start_threads().map_err(io::Error::other)?;
        let out = UntilRefused::new(file);
        let refusal = out.refusal();
        let writer = frame(&Table::new("", table.columns.clone()))
            .and_then(|empty| ParquetWriter::new(BufWriter::new(out)).batched(empty.schema()))
            .map_err(|error| in_words(&refusal, error))?;
        let of_columns = |text: fn(&asperity_record::Column) -> Option<&str>| {
            let texts = table.columns.iter().filter_map(|column| Some((&*column.name, text(column)?)));
            serde_json::to_string(&texts.collect::<BTreeMap<_, _>>()).expect("texts can always be JSON")
        };
        let units_and_meanings = vec![
            ("asperity:units".to_owned(), of_columns(|column| column.unit)),
            ("asperity:meanings".to_owned(), of_columns(|column| Some(&column.about))),
        ];
        Ok(Parquet { writer, refusal, group: DataFrame::default(), units_and_meanings })
    }

    /// Ends the file. The writer's own method for that accepts no metadata, of which some are known only now.
    fn end(&self, about: Vec<(String, String)>) -> PolarsResult<()> {
        let context = ParquetMetadataContext { arrow_schema: "" };
        let metadata = KeyValueMetadata::from_static(about).collect(context)?;
        self.writer.get_writer().lock().expect("no thread panicked with it").end(Some(metadata)).map(drop)
    }
}

impl TableWriter for Parquet {
    fn write(&mut self, table: &Table) -> io::Result<()> {
        let added = frame(table).and_then(|rows| self.group.vstack_mut_owned(rows).map(drop));
        added.map_err(|error| in_words(&self.refusal, error))
    }

    fn end_group(&mut self) -> io::Result<()> {
        let written = self.writer.write_batch(std::mem::take(&mut self.group).rechunk_mut());
        written.map_err(|error| in_words(&self.refusal, error))
    }

    fn finish(self: Box<Self>, about: &[(String, String)]) -> io::Result<()> {
        let about = [about, &self.units_and_meanings].concat();
        self.end(about).map_err(|error| in_words(&self.refusal, error))
    }
}

/// Rows as a polars table.
fn frame(table: &Table) -> PolarsResult<DataFrame> {
    let column = |(column, values): (&asperity_record::Column, &Values)| {
        let name = column.name.as_ref().into();
        Column::from(match values {
            Values::Counts(values) => Series::new(name, values),
            Values::Steps(values) => Series::new(name, values),
            Values::Numbers(values) => Series::new(name, values),
            Values::Flags(values) => Series::new(name, values),
            Values::Words(values) => {
                Series::new(name, values.iter().map(Option::as_deref).collect::<Vec<_>>())
            }
        })
    };
    DataFrame::new(table.rows(), table.columns.iter().zip(table.values()).map(column).collect())
}

/// The reason of a failure: the system's, if it refused a write, otherwise the library's.
fn in_words(refusal: &Refusal, error: polars::error::PolarsError) -> io::Error {
    io::Error::other(refusal.reason().map_or_else(|| error.to_string(), str::to_owned))
}

thread_local! {
    /// Whether a panic of this thread becomes an error, which says why.
    static IS_STARTING: Cell<bool> = const { Cell::new(false) };
}

/// Makes polars start its threads, unless they run already: it panics if the system refuses them.
fn start_threads() -> Result<(), String> {
    static STARTED: OnceLock<Result<(), String>> = OnceLock::new();
    let start = || {
        let column = Series::new("step".into(), [0_u64]).into();
        ParquetWriter::new(io::sink()).finish(&mut DataFrame::new_infer_height(vec![column])?)
    };
    let started = STARTED.get_or_init(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_STARTING.get() {
                usual(info);
            }
        }));
        in_words_of_panic(start)?.map(drop).map_err(|error| error.to_string())
    });
    started.clone()
}

/// Calls polars, and returns a panic's message as an error.
fn in_words_of_panic<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    IS_STARTING.set(true);
    let outcome = panic::catch_unwind(panic::AssertUnwindSafe(work));
    IS_STARTING.set(false);
    outcome.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason is given");
        format!("failed to start the threads that tables need: {text}")
    })
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};

    use asperity_record::{Cell, RunHeader};
    use asperity_testkit::run_header;
    use polars::prelude::{ParquetReader, SerReader};

    use super::{in_words_of_panic, start_threads};
    use crate::export::about;
    use crate::format::{DAMAGED, Format};
    use crate::layout::{StepParts, record_tables};

    /// Doubles that a format that rounds, or that writes decimals, would lose.
    const DOUBLES: [f64; 6] = [0.1 + 0.2, -0.0, 5e-324, -1.7976931348623157e308, 1e-7, 4.0];

    #[test]
    fn a_panic_of_polars_is_an_error() {
        let text = in_words_of_panic::<()>(|| panic!("row {}", 7)).unwrap_err();
        assert_eq!(text, "failed to start the threads that tables need: row 7");
        assert_eq!(start_threads(), Ok(()));
    }

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

        let mut reader = ParquetReader::new(File::open(&path).unwrap());
        let metadata = reader.get_metadata().unwrap().clone();
        let frame = reader.finish().unwrap();
        fs::remove_file(&path).unwrap();
        assert_eq!(metadata.row_groups.len(), 2, "the rows up to the end of a group");
        let read = frame.column("displacement_m").unwrap().f64().unwrap();
        let read: Vec<u64> = read.iter().map(|value| value.unwrap().to_bits()).collect();
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
