//! The rows of a run's tables, while the run is made or its log is read. Whoever observes with it takes the
//! rows out in batches, or keeps them all.

use std::collections::BTreeMap;

use asperity_model::NodeState;
use asperity_record::{Cell, Column, ColumnKind, Energy, Event, EventKind, Observer, Parts, Record, RowKind};

use crate::foreign;
use crate::layout::{
    EVENTS, FIELDS, NODES, SIGNAL, STEP, SWITCH, StepParts, TRACES, WINDOW, fields_columns, nodes_table,
    record_tables, step_columns, switch_columns,
};
use crate::rows;
use crate::table::Table;

/// Most tables of events without a detector in this program: an export opens a file for each.
pub const MOST_FOREIGN: usize = 100;

/// The chosen tables and rows.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    /// The topics; none for all.
    pub topics: Vec<String>,
    /// Only rows from this time on, s. Events count by their `onset_s`, else by their `time_s` or
    /// `arrival_s`, else by the step that made them certain.
    pub from_s: Option<f64>,
    /// Only rows from before this time, s.
    pub to_s: Option<f64>,
    /// Whether there is a table of nodes as well, with the rows passed to [`RunTables::nodes`].
    pub nodes: bool,
}

/// The tables of a run.
#[derive(Default)]
pub struct RunTables {
    chosen: Chosen,
    /// What the run has.
    of_run: Parts,
    /// Their rows that have not been taken out. Columns of optional parts are known after the first record that may
    /// have them.
    tables: Vec<Table>,
    /// How the events of a topic are parsed, whether or not they have a table.
    events: BTreeMap<String, EventRows>,
    parts: Option<StepParts>,
    /// The optional parts of states of all blocks; known after the first state.
    state_parts: Option<StepParts>,
    last_step: u64,
    /// The time of the last record, s.
    last_s: f64,
    left_out: BTreeMap<String, u64>,
    problem: Option<String>,
}

/// How the events of one topic become rows.
struct EventRows {
    columns: Vec<Column>,
    /// None for events of a detector that this program does not have.
    kind: Option<EventKind>,
    /// The column to which `from_s` and `to_s` apply, if any.
    time: Option<usize>,
}

impl RunTables {
    /// The tables, still empty, of a run with these parts, whose log announces events of these topics with
    /// these schemas. `kinds` are the events with known detectors; tables of others follow the schemas in the
    /// log.
    ///
    /// # Errors
    /// A message, if a chosen topic has no table, or no time is chosen.
    pub fn new(
        of_run: Parts,
        event_schemas: &BTreeMap<&str, &str>,
        kinds: &[EventKind],
        chosen: Chosen,
    ) -> Result<RunTables, String> {
        let (from_s, to_s) = (chosen.from_s.unwrap_or(0.0), chosen.to_s.unwrap_or(f64::INFINITY));
        // Written so that NaN bounds are refused.
        if !(from_s >= 0.0 && from_s < to_s) {
            return Err(format!(
                "no time is from {from_s} s on and before {to_s} s (accepted: from 0 or more, to more than that)"
            ));
        }
        let mut tables = tables(of_run, event_schemas, kinds);
        tables.extend(chosen.nodes.then(|| nodes_table(&[0, 2])));
        for topic in &chosen.topics {
            if !tables.iter().any(|table| table.name == *topic) {
                let accepted = tables.iter().map(|table| &*table.name).collect::<Vec<_>>().join(", ");
                return Err(match kinds.iter().any(|kind| kind.topic == topic) {
                    true => format!(
                        "the log holds no {topic}, since the program that made it did not find such events; \
                         `asperity replay` does (accepted: {accepted})"
                    ),
                    false => format!("no table is made of the topic {topic:?} (accepted: {accepted})"),
                });
            }
        }
        let events = tables
            .iter()
            .filter(|table| table.name.starts_with(EVENTS) || RowKind::with(&table.name).is_some())
            .map(|table| (table.name.to_string(), EventRows::new(table, kinds)))
            .collect();
        let is_chosen = |table: &Table| {
            let is_named = chosen.topics.iter().any(|topic| *topic == table.name);
            chosen.topics.is_empty() || is_named || table.name == NODES
        };
        tables.retain(is_chosen);
        for column in tables.iter_mut().flat_map(|table| &mut table.columns) {
            *column = column.clone().in_run(of_run);
        }
        Ok(RunTables { chosen, of_run, tables, events, ..RunTables::default() })
    }

    /// The tables, in the order of topics in which they are exported.
    pub fn tables(&mut self) -> &mut [Table] {
        &mut self.tables
    }

    /// The last step that became rows.
    pub fn last_step(&self) -> u64 {
        self.last_step
    }

    /// Numbers of events in topics without a table: this program has no detector for them, and their
    /// schema is not flat or unknown, the topic is no file name, or there are more than [`MOST_FOREIGN`]
    /// such topics.
    pub fn left_out(&self) -> &BTreeMap<String, u64> {
        &self.left_out
    }

    /// Why no further rows were added: a log has something that no run writes.
    pub fn problem(&self) -> Option<&str> {
        self.problem.as_deref()
    }

    /// Adds the nodes of a lattice after a step, whenever it was.
    ///
    /// # Panics
    /// If no table of nodes is chosen.
    pub fn nodes(&mut self, nodes: &NodeState) {
        let table = self.tables.iter_mut().find(|table| table.name == NODES);
        let table = table.expect("nodes are asked for");
        let empty = nodes_table(nodes.lattice.table.axes);
        if table.columns != empty.columns {
            // The first nodes tell along which axes they move.
            *table = empty;
        }
        rows::nodes(table, nodes);
    }

    fn take_record(&mut self, record: &Record) -> Result<(), String> {
        self.last_s = record.time_s();
        match record {
            Record::Step(record) => {
                let found = StepParts::of(record, self.of_run);
                let parts = *self.parts.get_or_insert_with(|| {
                    set_columns(&mut self.tables, STEP, step_columns(found), self.of_run);
                    set_columns(&mut self.tables, SWITCH, switch_columns(found), self.of_run);
                    found
                });
                let differs = [
                    ("forces on the ends", parts.end_forces, found.end_forces),
                    ("counts of junctions", parts.run.junctions, found.run.junctions),
                    ("largest speeds", parts.run.state, found.run.state),
                ];
                let energies = Energy::COLUMNS.iter().zip(parts.energies).zip(found.energies);
                let energies = energies.map(|((column, first), found)| (&*column.name, first, found));
                if let Some((what, first, _)) =
                    differs.into_iter().chain(energies).find(|(_, first, found)| first != found)
                {
                    let first = if first { "has" } else { "has not" };
                    return Err(format!(
                        "step {}: the {what} differ from the first record's, which {first} them",
                        record.step
                    ));
                }
                if let Some(table) = self.table(STEP, record.time_s) {
                    table.push(rows::step(record, parts));
                }
                if let Some(table) = self.table(SWITCH, record.time_s) {
                    record.switches.iter().for_each(|switch| rows::switch(table, record, switch, parts));
                }
            }
            Record::Fields(record) => {
                let parts = *self.state_parts.get_or_insert_with(|| {
                    let found = StepParts::of_state(record);
                    set_columns(&mut self.tables, FIELDS, fields_columns(found), self.of_run);
                    found
                });
                if let Some(table) = self.table(FIELDS, record.time_s) {
                    rows::fields(table, record, parts)?;
                }
            }
            Record::Window(record) => {
                let run = Parts { area: self.of_run.area, ..Parts::default() };
                let of_run = StepParts { run, ..StepParts::default() };
                if let Some(table) = self.table(WINDOW, record.time_s) {
                    rows::window(table, record, of_run)?;
                }
            }
            Record::Row(row) => self.take_event(&row.values)?,
            Record::Signal(record) => {
                if let Some(table) = self.table(SIGNAL, record.time_s) {
                    rows::signal(table, record)?;
                }
            }
            Record::Traces(record) => {
                if let Some(table) = self.table(TRACES, record.time_s) {
                    rows::traces(table, record);
                }
            }
        }
        self.last_step = record.step();
        Ok(())
    }

    fn take_event(&mut self, event: &Event) -> Result<(), String> {
        let Some(rows) = self.events.get(event.topic()) else {
            *self.left_out.entry(event.topic().to_owned()).or_insert(0) += 1;
            return Ok(());
        };
        let unread = |problem: String| format!("an event of {} cannot be read: {problem}", event.topic());
        let cells = match &rows.kind {
            Some(kind) => kind.cells(event).map_err(|error| unread(error.to_string()))?,
            None => foreign::cells(&rows.columns, &event.json()).map_err(unread)?,
        };
        let time_s = match rows.time.map(|time| &cells[time]) {
            Some(Cell::Number(time_s)) => *time_s,
            _ => self.last_s,
        };
        if let Some(table) = self.table(event.topic(), time_s) {
            table.push(cells);
        }
        Ok(())
    }

    /// The table for rows of a topic and time, if chosen.
    fn table(&mut self, topic: &str, time_s: f64) -> Option<&mut Table> {
        let Chosen { from_s, to_s, .. } = self.chosen;
        if from_s.is_some_and(|from_s| time_s < from_s) || to_s.is_some_and(|to_s| time_s >= to_s) {
            return None;
        }
        self.tables.iter_mut().find(|table| table.name == topic)
    }
}

/// Sets the columns of a table that are known since the first of its records; no row has been added yet.
fn set_columns(tables: &mut [Table], topic: &'static str, columns: Vec<Column>, of_run: Parts) {
    if let Some(table) = tables.iter_mut().find(|table| table.name == topic) {
        *table = Table::new(topic, columns.into_iter().map(|column| column.in_run(of_run)).collect());
    }
}

impl Observer for RunTables {
    fn record(&mut self, record: &Record) {
        if self.problem.is_none() {
            self.problem = self.take_record(record).err();
        }
    }

    fn event(&mut self, event: &Event) {
        if self.problem.is_none() {
            self.problem = self.take_event(event).err();
        }
    }
}

impl EventRows {
    fn new(table: &Table, kinds: &[EventKind]) -> EventRows {
        let place = |name: &str| {
            let is_it = |column: &Column| column.name == name && column.kind == ColumnKind::Number;
            table.columns.iter().position(is_it)
        };
        EventRows {
            columns: table.columns.clone(),
            kind: (kinds.iter().find(|kind| kind.topic == table.name).cloned())
                .or_else(|| RowKind::with(&table.name).map(|row| (row.kind)())),
            time: ["onset_s", "time_s", "arrival_s"].into_iter().find_map(place),
        }
    }
}

/// The tables that a log supports: its records, known events, and events whose schema in the log is flat. A
/// log lists its topics before its first message; a log damaged there may have any known topic.
fn tables(of_run: Parts, announced: &BTreeMap<&str, &str>, kinds: &[EventKind]) -> Vec<Table> {
    let mut tables = record_tables(StepParts {
        run: Parts { area: of_run.area, recording: of_run.recording, ..Parts::default() },
        ..StepParts::default()
    });
    let rows = RowKind::all_in(of_run).map(|row| (row.kind)().with(of_run));
    let there = |kind: &&EventKind| announced.is_empty() || announced.contains_key(kind.topic);
    let known = rows.chain(kinds.iter().filter(there).cloned());
    tables.extend(known.map(|kind| Table::new(kind.topic, kind.columns())));
    let known = |topic: &str| kinds.iter().any(|kind| kind.topic == topic);
    let others = announced.iter().filter(|(topic, _)| !known(topic) && foreign::is_plain(topic));
    let table =
        |(topic, schema): (&&str, &&str)| Some(Table::new((*topic).to_owned(), foreign::columns(schema)?));
    tables.extend(others.take(MOST_FOREIGN).filter_map(table));
    tables
}
