//! The files of a table, in one or several formats, while its rows are made.

use std::path::{Path, PathBuf};

use asperity_files::{FileError, FileSet};
use asperity_numbers::run_data::RunData;
use asperity_record::{
    Cell, CellValue, Column, Event, EventKind, Observer, Parts, Record, Rupture, SlipEvent,
};

use crate::format::{Format, TableWriter};
use crate::layout::{StepParts, step_columns};
use crate::rows;
use crate::table::Table;
use crate::tables::rupture_columns;

/// The formats of the tables that runs are reduced to.
const REDUCED: [Format; 2] = [Format::Csv, Format::Parquet];

/// Rows of a table that a run is reduced to in a row group: as many as polars chooses.
const GROUP_ROWS: u64 = 512 * 512;

/// Rows of such a table that are in memory at a time, besides the row group in progress.
const BATCH_ROWS: usize = 1 << 14;

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

    /// Writes the rows of a table, up to the end of a row group, and removes them from it.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&mut self, table: &mut Table) -> Result<(), FileError> {
        self.pass(table, true)
    }

    /// Writes rows that may not be the last of their row group.
    fn pass(&mut self, table: &mut Table, ends_group: bool) -> Result<(), FileError> {
        self.rows += table.rows() as u64;
        for (path, writer) in &mut self.writers {
            let mut written = writer.write(table);
            if ends_group {
                written = written.and_then(|()| writer.end_group());
            }
            written.map_err(FileError::io(path))?;
        }
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
        self.write(table)?;
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

/// The files of such a table that are to be begun: their set, folder and name.
type Begun<'a> = (&'a FileSet, &'a Path, &'a str);

/// Such a table with a row for some records or events, written while these pass.
pub struct PassingTable<'r> {
    table: Table,
    /// Or the first failure to write.
    files: Result<TableFiles, FileError>,
    row: Box<RowOf<'r>>,
}

/// The row of a record or of an event, if it has one.
type RowOf<'r> = dyn Fn(Option<&Record>, Option<&Event>) -> Option<Vec<Cell>> + Send + 'r;

impl<'r> PassingTable<'r> {
    fn begin(begun: Begun<'_>, columns: Vec<Column>, row: Box<RowOf<'r>>) -> PassingTable<'r> {
        let ((files, folder, name), table) = (begun, Table::new(begun.2.to_owned(), columns));
        PassingTable { files: TableFiles::begin(files, folder, name, &REDUCED, &table), table, row }
    }

    /// The load curve of a run, a row per step record. If the drive pulls both ways, its sum means little, so the forces
    /// on both ends are written as well.
    pub fn loads(begun: Begun<'_>, both_ways: bool) -> PassingTable<'r> {
        let parts = StepParts { end_forces: both_ways, ..StepParts::default() };
        let row = move |record: &Record| match record {
            Record::Step(record) => Some(rows::step(record, parts)),
            _ => None,
        };
        PassingTable::begin(begun, step_columns(parts), Box::new(move |record, _| row(record?)))
    }

    /// The table of slip events of a run with these parts, one row per slip event: the columns of [`SlipEvent`] that the run
    /// has, of which a test pins the first seven.
    pub fn events(begun: Begun<'_>, run: Parts) -> PassingTable<'r> {
        let kind = EventKind::of::<SlipEvent>().with(run);
        let columns = kind.columns();
        let row = move |event: &Event| Some(kind.cells_of(event.get::<SlipEvent>()?));
        PassingTable::begin(begun, columns, Box::new(move |_, event| row(event?)))
    }

    /// The rupture table, one row per rupture, in the order in which they became certain: the columns of [`Rupture`] that
    /// the run has, the slip event in which each began, and whether the slip events of this run are reliable, by its
    /// summary.
    pub fn ruptures(begun: Begun<'_>, run: &'r RunData) -> PassingTable<'r> {
        let kind = EventKind::of::<Rupture>().with(run.header.parts());
        let of_run = [run.summary.creeps, run.summary.events_mislead].map(CellValue::cell);
        let row = move |rupture: &Rupture| {
            let event = run.slip_steps.event_at(rupture.onset_step).map(|(event, _)| event).cell();
            [kind.cells_of(rupture), vec![event], of_run.to_vec()].concat()
        };
        let columns = rupture_columns(run.header.parts());
        PassingTable::begin(begun, columns, Box::new(move |_, event| event?.get().map(&row)))
    }

    fn pass(&mut self, record: Option<&Record>, event: Option<&Event>) {
        let Ok(files) = &mut self.files else { return };
        (self.row)(record, event).into_iter().for_each(|row| self.table.push(row));
        if self.table.rows() == BATCH_ROWS {
            let ends_group = (files.rows + BATCH_ROWS as u64).is_multiple_of(GROUP_ROWS);
            if let Err(error) = files.pass(&mut self.table, ends_group) {
                self.files = Err(error);
            }
        }
    }

    /// Writes the last rows.
    ///
    /// # Errors
    /// If a file could not be written.
    pub fn finish(mut self) -> Result<(), FileError> {
        self.files?.finish(&mut self.table, &[]).map(drop)
    }

    /// Discards the table, as if it had never been begun.
    pub fn discard(self, files: &FileSet) {
        self.files.iter().flat_map(|own| &own.writers).for_each(|(path, _)| files.discard(path));
    }
}

impl Observer for PassingTable<'_> {
    fn record(&mut self, record: &Record) {
        self.pass(Some(record), None);
    }

    fn event(&mut self, event: &Event) {
        self.pass(None, Some(event));
    }
}
