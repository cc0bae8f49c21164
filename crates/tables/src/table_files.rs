//! The files of a table, in one or several formats, while its rows are made.

use std::path::{Path, PathBuf};

use asperity_files::{FileError, FileSet};
use asperity_record::StepRecord;

use crate::format::{Format, TableWriter};
use crate::layout::{STEP, StepParts, step_columns};
use crate::rows;
use crate::table::Table;

/// The formats of the tables that runs are reduced to.
const REDUCED: [Format; 2] = [Format::Csv, Format::Parquet];

/// Rows of the table of loads that are in memory at a time: those that polars puts into a row group.
const GROUP_ROWS: usize = 512 * 512;

/// The files of a table that is being written, each with the same rows.
pub struct TableFiles {
    writers: Vec<(PathBuf, Box<dyn TableWriter>)>,
    /// Rows that are written.
    pub rows: u64,
}

impl TableFiles {
    /// Begins `NAME.FORMAT` in a folder for each format, as files of a set, for a table with these columns.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(
        files: &FileSet,
        folder: &Path,
        name: &str,
        formats: &[Format],
        table: &Table,
    ) -> Result<TableFiles, FileError> {
        let path = |format: &Format| (folder.join(format!("{name}.{}", format.extension())), *format);
        TableFiles::at(files, formats.iter().map(path).collect(), table)
    }

    /// Begins them at these paths.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn at(
        files: &FileSet,
        paths: Vec<(PathBuf, Format)>,
        table: &Table,
    ) -> Result<TableFiles, FileError> {
        let begin = |(path, format): (PathBuf, Format)| {
            let writer = format.start(table, files.create(&path)?).map_err(FileError::io(&path))?;
            Ok((path, writer))
        };
        let writers = paths.into_iter().map(begin).collect::<Result<_, FileError>>()?;
        Ok(TableFiles { writers, rows: 0 })
    }

    /// Writes the rows of a table, and removes them from it.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&mut self, table: &mut Table) -> Result<(), FileError> {
        for (path, writer) in &mut self.writers {
            writer.write(table).map_err(FileError::io(path))?;
        }
        self.rows += table.rows() as u64;
        table.clear();
        Ok(())
    }

    /// Writes the last rows and ends the files, whose paths it returns. `about` describes the source of the rows, as
    /// names and texts, for formats that have a place for it.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(
        mut self,
        table: &mut Table,
        about: &[(String, String)],
    ) -> Result<Vec<PathBuf>, FileError> {
        // A table without rows has a row group as well.
        if table.rows() > 0 || self.rows == 0 {
            self.write(table)?;
        }
        let end = |(path, writer): (PathBuf, Box<dyn TableWriter>)| {
            writer.finish(about).map_err(FileError::io(&path)).map(|()| path)
        };
        self.writers.into_iter().map(end).collect()
    }
}

/// Writes a table that a run is reduced to, `NAME.csv` and `NAME.parquet` in a folder, as files of a set.
///
/// # Errors
/// If a file cannot be written.
pub fn write(files: &FileSet, folder: &Path, name: &str, mut table: Table) -> Result<(), FileError> {
    TableFiles::begin(files, folder, name, &REDUCED, &table)?.finish(&mut table, &[]).map(drop)
}

/// The files of such a table.
pub fn paths(folder: &Path, name: &str) -> [PathBuf; 2] {
    REDUCED.map(|format| folder.join(format!("{name}.{}", format.extension())))
}

/// The load curve of a run as such a table, a row per step record, written while these pass.
pub struct LoadTable {
    parts: StepParts,
    table: Table,
    files: TableFiles,
}

impl LoadTable {
    /// Begins it. If the drive pulls both ways, its sum means little, so the forces on both ends are written as well.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(
        files: &FileSet,
        folder: &Path,
        name: &str,
        both_ways: bool,
    ) -> Result<LoadTable, FileError> {
        let parts = StepParts { end_forces: both_ways, ..StepParts::default() };
        let table = Table::new(STEP, step_columns(parts));
        let files = TableFiles::begin(files, folder, name, &REDUCED, &table)?;
        Ok(LoadTable { parts, table, files })
    }

    /// Adds the row of a step record.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn push(&mut self, record: &StepRecord) -> Result<(), FileError> {
        rows::step(&mut self.table, record, self.parts);
        if self.table.rows() == GROUP_ROWS { self.files.write(&mut self.table) } else { Ok(()) }
    }

    /// Writes the last rows.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(mut self) -> Result<(), FileError> {
        self.files.finish(&mut self.table, &[]).map(drop)
    }

    /// Discards the table, as if it had never been begun.
    pub fn discard(self, files: &FileSet) {
        self.files.writers.iter().for_each(|(path, _)| files.discard(path));
    }
}
