//! From a log to the files of its tables, while the log is read and checked, with memory bounded by a
//! few batches of rows.
//!
//! The whole log is checked whatever the selection, so damage outside of it is reported as well. Files get
//! their names together, when all of them are complete; the last is `NAME.FORMAT.export.json`, which lists
//! what was exported and from which run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_model::NodeState;
use asperity_record::{Cell, Column, Event, EventKind, Observer, Record, RunHeader};
use serde::Serialize;
use serde_json::Value;

use crate::format::{DAMAGED, Format};
use crate::run_tables::{Chosen, RunTables};
use crate::table::Table;
use crate::table_files::TableFiles;

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
    #[error("{0}")]
    Choice(String),
    /// A file cannot have its name, and none has been written; or a table cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
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
#[derive(Debug, Serialize)]
pub struct Ran {
    /// The state of the log.
    pub state: &'static str,
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
pub struct Export {
    header: RunHeader,
    scenario_toml: String,
    request: Request,
    format: Format,
    tables: RunTables,
    /// One for each table, from its first rows on.
    outputs: Vec<Option<TableFiles>>,
    files: FileSet,
    /// Why no further row can be written.
    failed: Option<ExportError>,
}

impl Export {
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
        format: Format,
    ) -> Result<Export, ExportError> {
        let mut tables = RunTables::new(header.parts(), event_schemas, kinds, request.chosen.clone())
            .map_err(ExportError::Choice)?;
        let name = |table: &Table| format!("{}.{}", request.name, table.file_part());
        let file = |table: &Table| request.out.join(format!("{}.{}", name(table), format.extension()));
        let paths: Vec<PathBuf> = tables.tables().iter().map(file).collect();
        let outputs = paths.iter().map(|_| None).collect();
        let files = FileSet::new(request.existing, request.inputs.clone());
        let scenario_toml = scenario_toml.to_owned();
        let header = header.clone();
        let export = Export { header, scenario_toml, request, format, tables, outputs, files, failed: None };
        let all = paths.into_iter().chain([export.manifest_path()]);
        export.files.reserve(all)?;
        Ok(export)
    }

    /// Adds the nodes of a lattice after a step, whenever it was.
    ///
    /// # Errors
    /// If a file cannot be written.
    ///
    /// # Panics
    /// If the request has no table of nodes.
    pub fn nodes(&mut self, nodes: &NodeState) -> Result<(), ExportError> {
        self.tables.nodes(nodes);
        self.flush(BATCH_ROWS)
    }

    /// The path of the file that describes the others.
    fn manifest_path(&self) -> PathBuf {
        self.request.out.join(format!("{}.{}.export.json", self.request.name, self.format.extension()))
    }

    /// Writes the files from the observed part of the log, with its state in a word and the reason if it is
    /// incomplete: for an incomplete or damaged log the sound part, for a salvaged one everything outside
    /// its gaps.
    ///
    /// # Errors
    /// If a file cannot be written, or its name is in use by now. Then no files are left.
    pub fn finish(mut self, state: &'static str, problem: Option<String>) -> Result<Report, ExportError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        let (state, problem) = match self.tables.problem() {
            Some(problem) => (DAMAGED, Some(problem.to_owned())),
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
        let Export { request, format, tables, outputs, files, .. } = self;
        for (table, output) in tables.tables().iter_mut().zip(outputs) {
            if table.rows() >= rows {
                let output = match output {
                    Some(output) => output,
                    None => {
                        let name = format!("{}.{}", request.name, table.file_part());
                        output.insert(TableFiles::begin(files, &request.out, &name, &[*format], table)?)
                    }
                };
                output.write(table)?;
            }
        }
        Ok(())
    }

    fn publish(mut self, ran: &Ran) -> Result<Vec<(PathBuf, Option<u64>)>, ExportError> {
        self.flush(0)?;
        let manifest_path = self.manifest_path();
        let Export { header, scenario_toml, request, mut tables, outputs, files, .. } = self;
        let Chosen { from_s, to_s, .. } = request.chosen;
        let &Ran { state, last_step, .. } = ran;
        let (mut entries, mut written) = (Vec::new(), Vec::new());
        for (table, output) in tables.tables().iter_mut().zip(outputs.into_iter().flatten()) {
            let rows = output.rows;
            let source = serde_json::json!({
                "topic": table.name, "log": state, "last_step": last_step, "from_s": from_s, "to_s": to_s,
            });
            let paths = output.finish(table, &about(&header, source))?;
            entries.extend(paths.iter().map(|path| TableEntry {
                file: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                topic: table.name.to_string(),
                rows,
                columns: table.columns.iter().map(ColumnEntry::of).collect(),
            }));
            written.extend(paths.into_iter().map(|path| (path, Some(rows))));
        }
        let manifest =
            Manifest { run: &header, scenario_toml: &scenario_toml, log: ran, from_s, to_s, tables: entries };
        let manifest =
            serde_json::to_string_pretty(&manifest).expect("texts and finite numbers can always be JSON");
        files.write_record(&manifest_path, manifest + "\n")?;
        written.push((manifest_path, None));
        files.publish()?;
        Ok(written)
    }

    fn flush_full(&mut self) {
        self.failed = self.flush(BATCH_ROWS).err();
    }
}

impl Observer for Export {
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

/// The source of a table's rows, as pairs of name and text, for formats that store metadata: what is known of the rows,
/// and what the header has in a log.
pub(crate) fn about(header: &RunHeader, source: Value) -> Vec<(String, String)> {
    let mut keys = serde_json::json!(header);
    let scales = keys["scales"].take();
    // Positions of sensors are a list, and stand in /events/arrival.
    keys["sensors"].take();
    let all = [source, keys, scales].into_iter().filter_map(|keys| keys.as_object().cloned()).flatten();
    let there = all.filter(|(_, value)| !value.is_null());
    let text = |value| serde_json::from_value::<Cell>(value).expect("these are cells").to_string();
    there.map(|(name, value)| (format!("asperity:{name}"), text(value))).collect()
}

/// `NAME.FORMAT.export.json`: what was exported and from which run.
#[derive(Serialize)]
struct Manifest<'a> {
    run: &'a RunHeader,
    log: &'a Ran,
    from_s: Option<f64>,
    to_s: Option<f64>,
    tables: Vec<TableEntry>,
    scenario_toml: &'a str,
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

impl ColumnEntry {
    fn of(column: &Column) -> ColumnEntry {
        ColumnEntry { name: column.name.to_string(), unit: column.unit }
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
