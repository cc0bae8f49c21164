//! Event tables and tables of matches as Parquet files: read for a diff, and
//! written by it, a batch of rows at a time.

use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_record::Cell;
use polars::prelude::{AnyValue, Column, DataFrame, NamedFrom, ParquetWriter, Series};

use crate::error::TableFileError;
use crate::guarded::start_threads;
use crate::parquet_checksum;
use crate::parquet_out::{Buffered, ParquetOut};
use crate::parquet_table::ParquetTable;
use crate::table_file::cell;

/// The rows of a Parquet file, one after the other.
pub struct Rows {
    table: ParquetTable,
    /// The rows that are read, and the next of them.
    part: DataFrame,
    row: usize,
}

impl Rows {
    /// Opens a file.
    ///
    /// # Errors
    /// As [`ParquetTable::open`].
    pub fn open(path: &Path) -> Result<Rows, TableFileError> {
        Ok(Rows { table: ParquetTable::open(path)?, part: DataFrame::empty(), row: 0 })
    }

    /// The names of the columns.
    pub fn names(&self) -> &[String] {
        self.table.names()
    }

    /// The next row, a cell for each column; none after the last.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn next_row(&mut self) -> Result<Option<Vec<Cell>>, TableFileError> {
        while self.row == self.part.height() {
            match self.table.next_part()? {
                Some(part) => (self.part, self.row) = (part, 0),
                None => return Ok(None),
            }
        }
        // Of a kind that no table here has: for an error.
        let unlike = |value: &AnyValue<'_>| Cell::Word(value.to_string().into());
        let cells = self.part.columns().iter().map(|column| {
            let value = column.get(self.row)?;
            Ok(cell(&value).unwrap_or_else(|| unlike(&value)))
        });
        let cells = cells.collect::<Result<_, TableFileError>>()?;
        self.row += 1;
        Ok(Some(cells))
    }
}

/// One match of a diff, as a row. For several events of a side: the numbers of the first and the last, the
/// earliest onset, the latest end and the blocks of all.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchRow {
    /// The run.
    pub run: String,
    /// The class of the events.
    pub class: &'static str,
    /// Whether the policy allows it.
    pub allowed: bool,
    /// The farther of the shifts of onset and end, s.
    pub shift_s: Option<f64>,
    /// The old events.
    pub old: Option<MatchSide>,
    /// The new events.
    pub new: Option<MatchSide>,
}

/// The events of one side of a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchSide {
    /// Number of them.
    pub events: u32,
    /// Number of the first.
    pub event: u64,
    /// Number of the last.
    pub last_event: u64,
    /// The earliest onset, s.
    pub onset_s: f64,
    /// The latest end, s.
    pub end_s: Option<f64>,
    /// The lowest block.
    pub first_block: u32,
    /// The highest block.
    pub last_block: u32,
    /// The lowest row, over an area.
    pub first_across: Option<u32>,
    /// The highest row.
    pub last_across: Option<u32>,
    /// `F_T / F_N` at the earliest onset.
    pub ft_fn_onset: f64,
}

/// Rows that are written at once.
const BATCH: usize = 1 << 16;

/// A Parquet file of matches that is being written.
pub struct MatchFile {
    writer: polars::io::parquet::write::BatchedWriter<Buffered>,
    out: ParquetOut,
    path: PathBuf,
    rows: Vec<MatchRow>,
    /// Whether it has columns of rows.
    is_over_area: bool,
}

impl MatchFile {
    /// Opens the file, as one of a set, with columns of the rows of events if some are over an area.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(files: &FileSet, path: &Path, is_over_area: bool) -> Result<MatchFile, TableFileError> {
        let failed = |problem| TableFileError::Write { path: path.display().to_string(), problem };
        start_threads().map_err(failed)?;
        let file = files.create(path)?;
        let metadata = parquet_checksum::metadata(&file).map_err(|error| failed(error.to_string()))?;
        let (out, writer) = ParquetOut::begin(file).map_err(|error| failed(error.to_string()))?;
        let writer = ParquetWriter::new(writer)
            .with_key_value_metadata(metadata)
            .batched(frame(&[], is_over_area)?.schema())
            .map_err(|error| failed(out.reason(&error)))?;
        Ok(MatchFile { writer, out, path: path.to_owned(), rows: Vec::new(), is_over_area })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn push(&mut self, row: MatchRow) -> Result<(), TableFileError> {
        self.rows.push(row);
        if self.rows.len() == BATCH { self.write() } else { Ok(()) }
    }

    fn write(&mut self) -> Result<(), TableFileError> {
        let written = self.writer.write_batch(&frame(&self.rows, self.is_over_area)?);
        written.map_err(|error| self.failed(self.out.reason(&error)))?;
        self.rows.clear();
        Ok(())
    }

    /// Writes the last rows.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> Result<(), TableFileError> {
        self.write()?;
        self.writer.finish().map_err(|error| self.failed(self.out.reason(&error)))?;
        let path = self.path.display().to_string();
        self.out.seal().map(drop).map_err(|error| TableFileError::Write { path, problem: error.to_string() })
    }

    fn failed(&self, problem: String) -> TableFileError {
        TableFileError::Write { path: self.path.display().to_string(), problem }
    }
}

fn frame(rows: &[MatchRow], is_over_area: bool) -> Result<DataFrame, TableFileError> {
    fn column<T>(name: String, rows: &[MatchRow], value: impl Fn(&MatchRow) -> T) -> Column
    where
        Series: NamedFrom<Vec<T>, [T]>,
    {
        Series::new(name.into(), rows.iter().map(value).collect::<Vec<T>>()).into()
    }
    let mut columns: Vec<Column> = vec![
        column("run".into(), rows, |row| row.run.clone()),
        column("class".into(), rows, |row| row.class.to_owned()),
        column("allowed".into(), rows, |row| row.allowed),
        column("shift_s".into(), rows, |row| row.shift_s),
    ];
    type Of = fn(&MatchRow) -> Option<MatchSide>;
    let sides: [(&str, Of); 2] = [("old", |row| row.old), ("new", |row| row.new)];
    for (side, of) in sides {
        let name = |name: &str| format!("{side}_{name}");
        columns.extend([
            column(name("events"), rows, |row| of(row).map_or(0, |side| side.events)),
            column(name("event"), rows, |row| of(row).map(|side| side.event)),
            column(name("last_event"), rows, |row| of(row).map(|side| side.last_event)),
            column(name("onset_s"), rows, |row| of(row).map(|side| side.onset_s)),
            column(name("end_s"), rows, |row| of(row).and_then(|side| side.end_s)),
            column(name("first_block"), rows, |row| of(row).map(|side| side.first_block)),
            column(name("last_block"), rows, |row| of(row).map(|side| side.last_block)),
            column(name("ft_fn_onset"), rows, |row| of(row).map(|side| side.ft_fn_onset)),
        ]);
        if is_over_area {
            columns.extend([
                column(name("first_across"), rows, |row| of(row).and_then(|side| side.first_across)),
                column(name("last_across"), rows, |row| of(row).and_then(|side| side.last_across)),
            ]);
        }
    }
    Ok(DataFrame::new_infer_height(columns)?)
}

#[cfg(test)]
mod tests {
    use asperity_files::{Existing, FileSet, Inputs};
    use asperity_record::Cell;

    use super::{MatchFile, MatchRow, MatchSide, Rows};

    #[test]
    fn matches_read_back_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matches.parquet");
        let side = MatchSide {
            events: 2,
            event: 4,
            last_event: 5,
            onset_s: 0.1 + 0.2,
            end_s: None,
            first_block: 1,
            last_block: 9,
            first_across: None,
            last_across: None,
            ft_fn_onset: 0.05,
        };
        let row = |old, new| MatchRow {
            run: "default".to_owned(),
            class: "split",
            allowed: false,
            shift_s: None,
            old,
            new,
        };
        let files = FileSet::new(Existing::Refuse, Inputs::default());
        let mut file = MatchFile::create(&files, &path, false).unwrap();
        // More than a batch, so that the second is written too.
        let onset_s = |n: usize| 0.1 + 0.2 * n as f64;
        for n in 0..super::BATCH {
            let ft_fn_onset = 0.7 / (n + 1) as f64;
            file.push(row(Some(MatchSide { onset_s: onset_s(n), ft_fn_onset, ..side }), None)).unwrap();
        }
        file.push(row(None, Some(MatchSide { end_s: Some(1.5), ..side }))).unwrap();
        file.finish().unwrap();
        files.publish().unwrap();
        let mut file = Rows::open(&path).unwrap();
        let names = file.names().to_owned();
        let mut rows = Vec::new();
        while let Some(row) = file.next_row().unwrap() {
            rows.push(row);
        }
        let get =
            |name: &str, row: usize| rows[row][names.iter().position(|there| there == name).unwrap()].clone();
        assert_eq!(rows.len(), super::BATCH + 1);
        assert_eq!(get("old_onset_s", 7), Cell::Number(onset_s(7)));
        assert_eq!(get("old_end_s", 7), Cell::Empty);
        assert_eq!(get("new_event", 7), Cell::Empty);
        assert_eq!(get("new_last_event", super::BATCH), Cell::Step(5));
        assert_eq!(get("new_end_s", super::BATCH), Cell::Number(1.5));
        assert_eq!(get("allowed", 0), Cell::Flag(false));
    }
}
