//! From a log to the files of its tables, while the log is read and checked, with memory bounded by a
//! few batches of rows.
//!
//! The whole log is checked whatever the selection, so damage outside of it is reported as well. Files get
//! their names together, when all of them are complete; the last is `NAME.FORMAT.export.json`, which lists
//! what was exported and from which run.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_record::{Cell, Column, ColumnKind, Event, EventKind, FieldRecord, Observer, Record, RunHeader};
use serde::Serialize;

use crate::batch::Batch;
use crate::foreign;
use crate::format::{About, Format, FormatError, State, TableWriter};
use crate::layout::{
    EVENTS, FIELDS, Layout, NODES, STEP, SWITCH, StepParts, WINDOW, event_layout, fields_columns,
    nodes_layout, record_layouts, step_columns,
};
use crate::rows::{self, NodeRows};

/// Rows of a table that are buffered before they are written: enough for row groups that suit
/// readers, and a few MB.
const BATCH_ROWS: usize = 1 << 16;

/// Most tables of events without a detector in this program: each is an open file.
pub const MOST_FOREIGN: usize = 100;

/// What to export, and where.
#[derive(Debug, Clone)]
pub struct Request {
    /// The topics; none for all.
    pub topics: Vec<String>,
    /// Only rows from this time on, s. Events count by their `onset_s`, else by their `time_s` or
    /// `arrival_s`, else by the step that made them certain.
    pub from_s: Option<f64>,
    /// Only rows from before this time, s.
    pub to_s: Option<f64>,
    /// Whether to write a table of nodes as well, with the rows passed to [`Export::nodes`].
    pub nodes: bool,
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
    /// A topic without a table.
    #[error("no table is made of the topic {topic:?} (accepted: {accepted})")]
    UnknownTopic {
        /// The topic.
        topic: String,
        /// The topics with tables.
        accepted: String,
    },
    /// Events that this program finds, but not the one that made the log.
    #[error(
        "the log holds no {topic}, since the program that made it did not find such events; `asperity replay` does \
         (accepted: {accepted})"
    )]
    NotFoundThen {
        /// The topic.
        topic: String,
        /// The topics with tables.
        accepted: String,
    },
    /// No time lies between the bounds.
    #[error(
        "no time is from {from_s} s on and before {to_s} s (accepted: from 0 or more, to more than that)"
    )]
    EmptyRange {
        /// The lower bound.
        from_s: f64,
        /// The upper bound.
        to_s: f64,
    },
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
    /// Numbers of events in topics without a table: this program has no detector for them, and their schema
    /// is not flat or unknown, the topic is no file name, or there are more than [`MOST_FOREIGN`] such
    /// topics.
    pub left_out: BTreeMap<String, u64>,
    /// Whether the step records have no energies, so that tables of them have no such columns.
    pub without_energies: bool,
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
    tables: Vec<Table>,
    files: FileSet,
    /// How the events of a topic are parsed, whether or not they have a table.
    events: BTreeMap<String, EventRows>,
    parts: Option<StepParts>,
    /// Whether states have the normal load of each block; known after the first state.
    contact_loads: Option<bool>,
    last_step: u64,
    /// The time of the last record, s.
    last_s: f64,
    left_out: BTreeMap<String, u64>,
    /// Why no further row is written.
    ended: Option<Ended>,
}

/// Why an export rejects further records and events.
enum Ended {
    /// The log has something that no run writes.
    Log(String),
    /// A file cannot be written.
    File(ExportError),
}

impl From<ExportError> for Ended {
    fn from(error: ExportError) -> Ended {
        Ended::File(error)
    }
}

/// How the events of one topic become rows.
struct EventRows {
    columns: Vec<Column>,
    /// None for events of a detector that this program does not have.
    kind: Option<EventKind>,
    /// The column to which `from_s` and `to_s` apply, if any.
    time: Option<usize>,
}

/// The table of one topic while it is made.
struct Table {
    layout: Layout,
    path: PathBuf,
    batch: Batch,
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
        let (from_s, to_s) = (request.from_s.unwrap_or(0.0), request.to_s.unwrap_or(f64::INFINITY));
        // Written so that NaN bounds are refused.
        if !(from_s >= 0.0 && from_s < to_s) {
            return Err(ExportError::EmptyRange { from_s, to_s });
        }
        let mut layouts = layouts(event_schemas, kinds);
        layouts.extend(request.nodes.then(nodes_layout));
        for topic in &request.topics {
            if !layouts.iter().any(|layout| layout.topic == *topic) {
                let accepted = layouts.iter().map(|layout| &*layout.topic).collect::<Vec<_>>().join(", ");
                let topic = topic.clone();
                return Err(match kinds.iter().any(|kind| kind.topic == topic) {
                    true => ExportError::NotFoundThen { topic, accepted },
                    false => ExportError::UnknownTopic { topic, accepted },
                });
            }
        }
        let events = layouts
            .iter()
            .filter(|layout| layout.topic.starts_with(EVENTS))
            .map(|layout| (layout.topic.to_string(), EventRows::new(layout, kinds)))
            .collect();
        let chosen = |layout: &Layout| {
            let is_named = request.topics.iter().any(|topic| *topic == layout.topic);
            request.topics.is_empty() || is_named || layout.topic == NODES
        };
        let tables: Vec<Table> = layouts
            .into_iter()
            .filter(chosen)
            .map(|layout| {
                let file = format!("{}.{}.{}", request.name, layout.file_part(), format.extension());
                Table {
                    path: request.out.join(file),
                    batch: Batch::new(&layout.columns),
                    layout,
                    writer: None,
                    rows: 0,
                }
            })
            .collect();
        let files = FileSet::new(request.existing, request.inputs.clone());
        let export = Export {
            header: header.clone(),
            scenario_toml: scenario_toml.to_owned(),
            request,
            format,
            tables,
            files,
            events,
            parts: None,
            contact_loads: None,
            last_step: 0,
            last_s: 0.0,
            left_out: BTreeMap::new(),
            ended: None,
        };
        let tables = export.tables.iter().map(|table| table.path.clone());
        export.files.reserve(tables.chain([export.manifest_path()]))?;
        Ok(export)
    }

    /// Adds the nodes of a slab after a step, whenever it was.
    ///
    /// # Errors
    /// If a file cannot be written.
    ///
    /// # Panics
    /// If the request has no table of nodes.
    pub fn nodes(&mut self, nodes: &NodeRows<'_>) -> Result<(), ExportError> {
        let table = self.tables.iter_mut().find(|table| table.layout.topic == NODES);
        rows::nodes(&mut table.expect("nodes are asked for").batch, nodes);
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
        let (state, problem) = match self.ended.take() {
            Some(Ended::File(error)) => return Err(error),
            Some(Ended::Log(problem)) => (State::Damaged, Some(problem)),
            None => (state, problem),
        };
        let last_s = self.header.time_grid().time_s(self.last_step);
        let ran = Ran { state, last_step: self.last_step, last_s, problem };
        let without_energies = self.parts.is_some_and(|parts| !parts.energies);
        let (files, left_out) = self.publish(&ran)?;
        Ok(Report { files, ran, left_out, without_energies })
    }

    fn take_record(&mut self, record: &Record) -> Result<(), Ended> {
        self.last_s = match record {
            Record::Step(record) => record.time_s,
            Record::Fields(record) => record.time_s,
            Record::Window(record) => record.time_s,
        };
        let outcome = match record {
            Record::Step(record) => {
                let found = StepParts::of(record);
                let parts = match self.parts {
                    Some(parts) => parts,
                    None => self.first_step(found),
                };
                let differs = [
                    ("forces on the ends", parts.end_forces, found.end_forces),
                    ("energies", parts.energies, found.energies),
                ];
                if let Some((what, first, _)) = differs.into_iter().find(|(_, first, found)| first != found) {
                    let first = if first { "has" } else { "has not" };
                    return Err(Ended::Log(format!(
                        "step {}: the {what} differ from the first record's, which {first} them",
                        record.step
                    )));
                }
                if let Some(batch) = self.batch(STEP, record.time_s) {
                    rows::step(batch, record, parts);
                }
                if let Some(batch) = self.batch(SWITCH, record.time_s) {
                    record.switches.iter().for_each(|switch| rows::switch(batch, record, switch));
                }
                Ok(())
            }
            Record::Fields(record) => {
                let contact_loads = self.contact_loads.unwrap_or_else(|| self.first_state(record));
                self.batch(FIELDS, record.time_s)
                    .map_or(Ok(()), |batch| rows::fields(batch, record, contact_loads))
            }
            Record::Window(record) => {
                self.batch(WINDOW, record.time_s).map_or(Ok(()), |batch| rows::window(batch, record))
            }
        };
        self.flush(BATCH_ROWS)?;
        outcome.map_err(|ragged| Ended::Log(ragged.to_string()))?;
        self.last_step = record.step();
        Ok(())
    }

    fn take_event(&mut self, event: &Event) -> Result<(), Ended> {
        let Some(rows) = self.events.get(event.topic()) else {
            *self.left_out.entry(event.topic().to_owned()).or_insert(0) += 1;
            return Ok(());
        };
        let cells = rows.cells(event).map_err(|problem| {
            Ended::Log(format!("an event of {} cannot be read: {problem}", event.topic()))
        })?;
        let time_s = match rows.time.map(|time| cells[time]) {
            Some(Cell::Number(time_s)) => time_s,
            _ => self.last_s,
        };
        if let Some(batch) = self.batch(event.topic(), time_s) {
            batch.push(&cells);
        }
        Ok(self.flush(BATCH_ROWS)?)
    }

    /// The table for rows of a topic and time, if requested.
    fn batch(&mut self, topic: &str, time_s: f64) -> Option<&mut Batch> {
        let Request { from_s, to_s, .. } = self.request;
        if from_s.is_some_and(|from_s| time_s < from_s) || to_s.is_some_and(|to_s| time_s >= to_s) {
            return None;
        }
        self.tables.iter_mut().find(|table| table.layout.topic == topic).map(|table| &mut table.batch)
    }

    /// Records the optional parts of step records and sets the columns of the table of steps; no
    /// row has been written yet.
    fn first_step(&mut self, parts: StepParts) -> StepParts {
        self.parts = Some(parts);
        self.set_columns(STEP, step_columns(parts));
        parts
    }

    /// Records the optional parts of states of all blocks, and sets the columns of their table.
    fn first_state(&mut self, record: &FieldRecord) -> bool {
        let contact_loads = !record.normal_load_n.is_empty();
        self.contact_loads = Some(contact_loads);
        self.set_columns(FIELDS, fields_columns(StepParts { contact_loads, ..StepParts::default() }));
        contact_loads
    }

    fn set_columns(&mut self, topic: &str, columns: Vec<Column>) {
        if let Some(table) = self.tables.iter_mut().find(|table| table.layout.topic == topic) {
            table.layout.columns = columns;
            table.batch = Batch::new(&table.layout.columns);
        }
    }

    /// Writes the rows of tables that have at least `rows`.
    fn flush(&mut self, rows: usize) -> Result<(), ExportError> {
        let (format, files) = (self.format, &self.files);
        self.tables
            .iter_mut()
            .filter(|table| table.batch.rows() >= rows)
            .try_for_each(|table| table.flush(format, files))
    }

    #[expect(clippy::type_complexity, reason = "two fields of the report, which is made of them")]
    fn publish(
        mut self,
        ran: &Ran,
    ) -> Result<(Vec<(PathBuf, Option<u64>)>, BTreeMap<String, u64>), ExportError> {
        self.flush(0)?;
        let about = About {
            header: self.header.clone(),
            state: ran.state,
            last_step: ran.last_step,
            from_s: self.request.from_s,
            to_s: self.request.to_s,
        };
        let manifest = Manifest {
            run: &about.header,
            scenario_toml: &self.scenario_toml,
            log: LogState {
                state: ran.state,
                last_step: ran.last_step,
                last_s: ran.last_s,
                problem: ran.problem.as_deref(),
            },
            from_s: about.from_s,
            to_s: about.to_s,
            tables: self.tables.iter().map(TableEntry::of).collect(),
        };
        let manifest =
            serde_json::to_string_pretty(&manifest).expect("texts and finite numbers can always be JSON");
        let mut written = Vec::new();
        for table in &mut self.tables {
            if let Some(writer) = table.writer.take() {
                writer
                    .finish(&about.pairs(&table.layout))
                    .map_err(|error| write_error(&table.path, error))?;
                written.push((table.path.clone(), Some(table.rows)));
            }
        }
        let manifest_path = self.manifest_path();
        self.files.write_record(&manifest_path, manifest + "\n")?;
        written.push((manifest_path, None));
        self.files.publish()?;
        Ok((written, self.left_out))
    }
}

impl Observer for Export<'_> {
    fn record(&mut self, record: &Record) {
        if self.ended.is_none() {
            self.ended = self.take_record(record).err();
        }
    }

    fn event(&mut self, event: &Event) {
        if self.ended.is_none() {
            self.ended = self.take_event(event).err();
        }
    }

    fn is_done(&self) -> bool {
        matches!(self.ended, Some(Ended::File(_)))
    }
}

impl EventRows {
    fn new(layout: &Layout, kinds: &[EventKind]) -> EventRows {
        let place = |name: &str| {
            let is_it = |column: &Column| column.name == name && column.kind == ColumnKind::Number;
            layout.columns.iter().position(is_it)
        };
        EventRows {
            columns: layout.columns.clone(),
            kind: kinds.iter().find(|kind| kind.topic == layout.topic).cloned(),
            time: ["onset_s", "time_s", "arrival_s"].into_iter().find_map(place),
        }
    }

    fn cells(&self, event: &Event) -> Result<Vec<Cell>, String> {
        match &self.kind {
            Some(kind) => kind.cells(event).map_err(|error| error.to_string()),
            None => foreign::cells(&self.columns, &event.json()),
        }
    }
}

impl Table {
    fn flush(&mut self, format: &dyn Format, files: &FileSet) -> Result<(), ExportError> {
        let at = |error: FormatError| write_error(&self.path, error);
        let writer = match &mut self.writer {
            Some(writer) => writer,
            None => {
                let file = files.create(&self.path)?;
                self.writer.insert(format.start(&self.layout, file).map_err(at)?)
            }
        };
        writer.write(&self.batch).map_err(at)?;
        self.rows += self.batch.rows() as u64;
        self.batch.clear();
        Ok(())
    }
}

/// The tables that a log supports: its records, known events, and events whose schema in the log is flat. A
/// log lists its topics before its first message; a log damaged there may have any known topic.
fn layouts(announced: &BTreeMap<&str, &str>, kinds: &[EventKind]) -> Vec<Layout> {
    let mut layouts = record_layouts(StepParts::default());
    let there = |kind: &&EventKind| announced.is_empty() || announced.contains_key(kind.topic);
    layouts.extend(kinds.iter().filter(there).map(event_layout));
    let known = |topic: &str| kinds.iter().any(|kind| kind.topic == topic);
    let others = announced.iter().filter(|(topic, _)| !known(topic) && foreign::is_plain(topic));
    layouts.extend(others.take(MOST_FOREIGN).filter_map(|(topic, schema)| {
        Some(Layout { topic: Cow::Owned((*topic).to_owned()), columns: foreign::columns(schema)? })
    }));
    layouts
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
    fn of(table: &Table) -> TableEntry {
        let columns = &table.layout.columns;
        TableEntry {
            file: table.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            topic: table.layout.topic.to_string(),
            rows: table.rows,
            columns: columns
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
