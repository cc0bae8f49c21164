//! From a log to the files of its tables, while the log is read and checked, with memory bounded by a
//! few batches of rows.
//!
//! The whole log is checked whatever the selection, so damage outside of it is reported as well. Files get
//! their names together, when all of them are complete; the last is `NAME.FORMAT.export.json`, which lists
//! what was exported and from which run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_record::{Event, EventKind, Observer, Record, RunHeader};
use serde::Serialize;

use crate::format::{About, Format, FormatError, State, TableWriter};
use crate::layout::Layout;
use crate::rows::NodeRows;
use crate::run_tables::{ChoiceError, Chosen, RunTable, RunTables};

/// Rows of a table that are buffered before they are written: enough for row groups that suit
/// readers, and a few MB.
const BATCH_ROWS: usize = 1 << 16;

/// What to export, and where.
#[derive(Debug, Clone)]
pub struct Request {
    /// The tables and rows.
    pub chosen: Chosen,
    /// The folder, which exists.
    pub out: PathBuf,
    /// How the files' names begin.
    pub name: String,
    /// What to do with existing files.
    pub existing: Existing,
    /// Inputs of the command, including this run, which are never overwritten.
    pub inputs: Inputs,
}

/// A log that cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// There is no such table.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// A file cannot have its name; none has been written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A table cannot be written.
    #[error("failed to write {}: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: FormatError,
    },
}

/// The result of an export.
#[derive(Debug)]
pub struct Report {
    /// The files, with the number of rows in each, and the one that describes them.
    pub files: Vec<(PathBuf, Option<u64>)>,
    /// How far the log was exported.
    pub ran: Ran,
    /// Numbers of events in topics without a table, see [`RunTables::left_out`].
    pub left_out: BTreeMap<String, u64>,
}

/// How far a log was exported.
#[derive(Debug)]
pub struct Ran {
    /// The state of the log.
    pub state: State,
    /// The last step.
    pub last_step: u64,
    /// Its time, s.
    pub last_s: f64,
    /// Why not to its end.
    pub problem: Option<String>,
}

/// The name of a run's files: that of its log, without `.mcap` or `.mcap.partial`.
pub fn name_of(run: &Path) -> String {
    let name = run.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".partial").unwrap_or(&name);
    name.strip_suffix(".mcap").unwrap_or(name).to_owned()
}

/// The tables of a log while it is read. It observes the sound part of the log; the checker finishes it,
/// and without that there are no files.
pub struct Export<'a> {
    header: RunHeader,
    scenario_toml: String,
    request: Request,
    format: &'a dyn Format,
    tables: RunTables,
    /// One for each table.
    outputs: Vec<Output>,
    files: FileSet,
    /// Why no further row can be written.
    failed: Option<ExportError>,
}

/// The file of a table while it is made.
struct Output {
    path: PathBuf,
    /// None until the first rows are written.
    writer: Option<Box<dyn TableWriter>>,
    rows: u64,
}

impl<'a> Export<'a> {
    /// Begins the tables of a log with this header and scenario, which announces events of these topics
    /// with these schemas, and finds out whether the files can be written. `kinds` are the events with
    /// known detectors; tables of others follow the schemas in the log.
    ///
    /// # Errors
    /// If the request cannot be met.
    pub fn begin(
        header: &RunHeader,
        scenario_toml: &str,
        event_schemas: &BTreeMap<&str, &str>,
        request: Request,
        kinds: &[EventKind],
        format: &'a dyn Format,
    ) -> Result<Export<'a>, ExportError> {
        let mut tables = RunTables::new(header.parts(), event_schemas, kinds, request.chosen.clone())?;
        let path = |table: &RunTable| {
            let file = format!("{}.{}.{}", request.name, table.layout.file_part(), format.extension());
            request.out.join(file)
        };
        let paths = tables.tables().iter().map(path);
        let outputs = paths.map(|path| Output { path, writer: None, rows: 0 }).collect();
        let files = FileSet::new(request.existing, request.inputs.clone());
        let scenario_toml = scenario_toml.to_owned();
        let header = header.clone();
        let export = Export { header, scenario_toml, request, format, tables, outputs, files, failed: None };
        let paths = export.outputs.iter().map(|output| output.path.clone());
        export.files.reserve(paths.chain([export.manifest_path()]))?;
        Ok(export)
    }

    /// Adds the nodes of a lattice after a step, whenever it was.
    ///
    /// # Errors
    /// If a file cannot be written.
    ///
    /// # Panics
    /// If the request has no table of nodes.
    pub fn nodes(&mut self, nodes: &NodeRows<'_>) -> Result<(), ExportError> {
        self.tables.nodes(nodes);
        self.flush(BATCH_ROWS)
    }

    /// The path of the file that describes the others.
    fn manifest_path(&self) -> PathBuf {
        self.request.out.join(format!("{}.{}.export.json", self.request.name, self.format.extension()))
    }

    /// Writes the files from the observed part of the log, with its state and the reason if it is
    /// incomplete: for an incomplete or damaged log the sound part, for a salvaged one everything outside
    /// its gaps.
    ///
    /// # Errors
    /// If a file cannot be written, or its name is in use by now. Then no files are left.
    pub fn finish(mut self, state: State, problem: Option<String>) -> Result<Report, ExportError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        let (state, problem) = match self.tables.problem() {
            Some(problem) => (State::Damaged, Some(problem.to_owned())),
            None => (state, problem),
        };
        let last_step = self.tables.last_step();
        let last_s = self.header.time_grid().time_s(last_step);
        let ran = Ran { state, last_step, last_s, problem };
        let left_out = self.tables.left_out().clone();
        let files = self.publish(&ran)?;
        Ok(Report { files, ran, left_out })
    }

    /// Writes the rows of tables that have at least `rows`.
    fn flush(&mut self, rows: usize) -> Result<(), ExportError> {
        let (format, files) = (self.format, &self.files);
        let tables = self.tables.tables().iter_mut().zip(&mut self.outputs);
        tables
            .filter(|(table, _)| table.batch.rows() >= rows)
            .try_for_each(|(table, output)| output.write(table, format, files))
    }

    fn publish(mut self, ran: &Ran) -> Result<Vec<(PathBuf, Option<u64>)>, ExportError> {
        self.flush(0)?;
        let Chosen { from_s, to_s, .. } = self.request.chosen;
        let about =
            About { header: self.header.clone(), state: ran.state, last_step: ran.last_step, from_s, to_s };
        let tables = self.tables.tables().iter().zip(&self.outputs);
        let manifest = Manifest {
            run: &about.header,
            scenario_toml: &self.scenario_toml,
            log: LogState {
                state: ran.state,
                last_step: ran.last_step,
                last_s: ran.last_s,
                problem: ran.problem.as_deref(),
            },
            from_s,
            to_s,
            tables: tables.map(|(table, output)| TableEntry::of(&table.layout, output)).collect(),
        };
        let manifest =
            serde_json::to_string_pretty(&manifest).expect("texts and finite numbers can always be JSON");
        let mut written = Vec::new();
        for (table, output) in self.tables.tables().iter().zip(&mut self.outputs) {
            if let Some(writer) = output.writer.take() {
                writer
                    .finish(&about.pairs(&table.layout))
                    .map_err(|error| write_error(&output.path, error))?;
                written.push((output.path.clone(), Some(output.rows)));
            }
        }
        let manifest_path = self.manifest_path();
        self.files.write_record(&manifest_path, manifest + "\n")?;
        written.push((manifest_path, None));
        self.files.publish()?;
        Ok(written)
    }

    fn flush_full(&mut self) {
        self.failed = self.flush(BATCH_ROWS).err();
    }
}

impl Observer for Export<'_> {
    fn record(&mut self, record: &Record) {
        if self.failed.is_none() {
            self.tables.record(record);
            self.flush_full();
        }
    }

    fn event(&mut self, event: &Event) {
        if self.failed.is_none() {
            self.tables.event(event);
            self.flush_full();
        }
    }

    fn is_done(&self) -> bool {
        self.failed.is_some()
    }
}

impl Output {
    fn write(
        &mut self,
        table: &mut RunTable,
        format: &dyn Format,
        files: &FileSet,
    ) -> Result<(), ExportError> {
        let at = |error: FormatError| write_error(&self.path, error);
        let writer = match &mut self.writer {
            Some(writer) => writer,
            None => {
                let file = files.create(&self.path)?;
                self.writer.insert(format.start(&table.layout, file).map_err(at)?)
            }
        };
        writer.write(&table.batch).map_err(at)?;
        self.rows += table.batch.rows() as u64;
        table.batch.clear();
        Ok(())
    }
}

fn write_error(path: &Path, error: impl Into<FormatError>) -> ExportError {
    ExportError::Write { path: path.to_owned(), error: error.into() }
}

/// `NAME.FORMAT.export.json`: what was exported and from which run.
#[derive(Serialize)]
struct Manifest<'a> {
    run: &'a RunHeader,
    log: LogState<'a>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    tables: Vec<TableEntry>,
    scenario_toml: &'a str,
}

#[derive(Serialize)]
struct LogState<'a> {
    state: State,
    last_step: u64,
    last_s: f64,
    problem: Option<&'a str>,
}

#[derive(Serialize)]
struct TableEntry {
    file: String,
    topic: String,
    rows: u64,
    columns: Vec<ColumnEntry>,
}

#[derive(Serialize)]
struct ColumnEntry {
    name: String,
    unit: Option<&'static str>,
}

impl TableEntry {
    fn of(layout: &Layout, output: &Output) -> TableEntry {
        TableEntry {
            file: output.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            topic: layout.topic.to_string(),
            rows: output.rows,
            columns: layout
                .columns
                .iter()
                .map(|column| ColumnEntry { name: column.name.to_string(), unit: column.unit })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::name_of;

    #[test]
    fn files_are_named_after_the_log() {
        for (run, name) in [
            ("out/mine.mcap", "mine"),
            ("mine.mcap.partial", "mine"),
            ("mine.v2.mcap", "mine.v2"),
            ("mine", "mine"),
        ] {
            assert_eq!(name_of(Path::new(run)), name);
        }
    }
}
