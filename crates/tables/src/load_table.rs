//! The load curve of a run as a table, written while its step records pass.

use std::fs::File;
use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_record::{Cell, Column, StepRecord};
use polars::prelude::{BatchedWriter, ParquetWriter};

use crate::batch::Batch;
use crate::error::TableFileError;
use crate::guarded::start_threads;
use crate::layout::{StepParts, step_columns};
use crate::parquet_checksum;
use crate::parquet_out::{Buffered, ParquetOut};
use crate::parquet_tables;
use crate::table_file;
use crate::{CsvRows, Spelling, rows};

/// Rows of a row group: those that polars puts into one. No more are in memory at a time.
const GROUP_ROWS: usize = 512 * 512;

/// A row per step record, as CSV and as Parquet.
pub struct LoadTable {
    parts: StepParts,
    columns: Vec<Column>,
    /// Of the next row group.
    rows: Batch,
    line: Vec<Cell>,
    paths: [PathBuf; 2],
    csv: CsvRows<File>,
    parquet: BatchedWriter<Buffered>,
    /// The file of the Parquet table.
    out: ParquetOut,
    /// Row groups that are written.
    groups: usize,
}

impl LoadTable {
    /// Begins `NAME.csv` and `NAME.parquet` in a folder, as files of a set. If the drive pulls both ways,
    /// its sum means little, so the forces on both ends are written as well.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(
        files: &FileSet,
        folder: &Path,
        name: &str,
        both_ways: bool,
    ) -> Result<LoadTable, TableFileError> {
        let paths = table_file::paths(folder, name);
        let parts = StepParts { end_forces: both_ways, ..StepParts::default() };
        let columns = step_columns(parts);
        let csv = CsvRows::new(files.create(&paths[0])?, &columns, Spelling::Plain)
            .map_err(|error| refused(&paths[0], &error))?;
        let rows = Batch::new(&columns);
        start_threads().map_err(|error| refused(&paths[1], &error))?;
        let file = files.create(&paths[1])?;
        let metadata = parquet_checksum::metadata(&file).map_err(|error| refused(&paths[1], &error))?;
        let (out, writer) = ParquetOut::begin(file).map_err(|error| refused(&paths[1], &error))?;
        let parquet = parquet_tables::frame(&columns, &rows)
            .and_then(|empty| {
                ParquetWriter::new(writer).with_key_value_metadata(metadata).batched(empty.schema())
            })
            .map_err(|error| refused(&paths[1], &out.reason(&error)))?;
        Ok(LoadTable { parts, columns, rows, line: Vec::new(), paths, csv, parquet, out, groups: 0 })
    }

    /// Writes the row of a step record.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn push(&mut self, record: &StepRecord) -> Result<(), TableFileError> {
        rows::step(&mut self.rows, record, self.parts);
        let row = self.rows.rows() - 1;
        self.line.clear();
        self.line.extend(self.rows.columns().iter().map(|values| values.cell(row)));
        self.csv.push(&self.line).map_err(|error| refused(&self.paths[0], &error))?;
        if self.rows.rows() == GROUP_ROWS { self.end_group() } else { Ok(()) }
    }

    /// Flushes both files.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(mut self) -> Result<(), TableFileError> {
        // A table without rows has a row group as well.
        if self.rows.rows() > 0 || self.groups == 0 {
            self.end_group()?;
        }
        self.csv.finish().map_err(|error| refused(&self.paths[0], &error))?;
        self.parquet.finish().map_err(|error| refused(&self.paths[1], &self.out.reason(&error)))?;
        self.out.seal().map(drop).map_err(|error| refused(&self.paths[1], &error))
    }

    /// Discards the table, as if it had never been begun.
    pub fn discard(self, files: &FileSet) {
        self.paths.iter().for_each(|path| files.discard(path));
    }

    fn end_group(&mut self) -> Result<(), TableFileError> {
        let group = parquet_tables::frame(&self.columns, &self.rows);
        let written = group.and_then(|group| self.parquet.write_batch(&group));
        self.groups += 1;
        self.rows.clear();
        written.map_err(|error| refused(&self.paths[1], &self.out.reason(&error)))
    }
}

fn refused(path: &Path, problem: &impl ToString) -> TableFileError {
    TableFileError::Write { path: path.display().to_string(), problem: problem.to_string() }
}
