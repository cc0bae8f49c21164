//! The events of a run, as detectors found them.

use std::collections::BTreeMap;

use asperity_numbers::RuptureGrowth;
use asperity_record::{Arrival, Cell, EventPayload, GlobalSlip, Onset, Parts, Reach, Rupture, SlipEvent};
use asperity_run::detectors::event_kinds;
use asperity_tables::run_tables::{Chosen, RunTables};
use asperity_tables::table;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::detectors::Detectors;
use crate::errors::refused;
use crate::tables::Table;

/// The events that detectors found.
#[pyclass(frozen, subclass, module = "asperity")]
pub(crate) struct Events {
    pub(crate) tables: BTreeMap<String, Table>,
    /// The tables of detectors in Python, by name.
    #[pyo3(get)]
    pub(crate) found: BTreeMap<String, Table>,
}

/// Begins the tables of all events: those of this program's detectors, and those of others that a log
/// announces with these schemas; of a run with these parts.
pub(crate) fn begin(schemas: &BTreeMap<&str, &str>, parts: Parts) -> RunTables {
    let kinds = event_kinds(parts);
    let mut schemas = schemas.clone();
    for kind in &kinds {
        schemas.entry(kind.topic).or_insert("");
    }
    let with = |topics| RunTables::new(parts, &schemas, &kinds, Chosen { topics, ..Chosen::default() });
    let begin = || {
        let mut all = with(Vec::new())?;
        let topics = all.tables().iter().map(|table| table.name.to_string());
        with(topics.filter(|topic| topic.starts_with("/events/")).collect())
    };
    begin().unwrap_or_else(|error: String| unreachable!("all chosen topics have tables: {error}"))
}

/// The name of the table of precursors, which are no topic of a log.
const PRECURSORS: &str = "precursors";

/// Which rows of a table of ruptures are precursors, by the definition of the summary.
fn precursors(ruptures: &table::Table) -> table::Table {
    let cell = |row: usize, name: &str| ruptures.column(name).map_or(Cell::Empty, |column| column.cell(row));
    let step = |row, name| if let Cell::Step(step) = cell(row, name) { step } else { u64::MAX };
    let block = |row, name| if let Cell::Count(block) = cell(row, name) { block } else { 0 };
    let mut growth = RuptureGrowth::default();
    for row in 0..ruptures.rows() {
        let reach = Reach { first: block(row, "first_block"), last: block(row, "last_block") };
        growth.take((step(row, "onset_step"), step(row, "rupture")), reach, || row);
    }
    let mut found = table::Table::new(PRECURSORS, ruptures.columns.clone());
    for (_, row) in growth.iter().filter(|(_, row)| cell(**row, "reached_every_block") == Cell::Flag(false)) {
        found.push(ruptures.row(*row));
    }
    found
}

impl Events {
    /// Of a run that has been observed.
    pub(crate) fn of(py: Python<'_>, mut run: RunTables, detectors: Detectors) -> PyResult<Events> {
        let found = detectors.finish(py)?;
        let mut tables = BTreeMap::new();
        py.detach(|| {
            for table in run.tables() {
                if table.name == Rupture::TOPIC {
                    tables.insert(PRECURSORS.to_owned(), Table::of(&precursors(table)));
                }
                tables.insert(table.name.to_string(), Table::of(table));
            }
        });
        Ok(Events { tables, found })
    }
}

#[pymethods]
impl Events {
    /// Slip events: from the step in which a block first slides to that in which none does.
    #[getter]
    fn events(&self) -> PyResult<Table> {
        self.table(SlipEvent::TOPIC)
    }

    /// The onsets of slip events.
    #[getter]
    fn onsets(&self) -> PyResult<Table> {
        self.table(Onset::TOPIC)
    }

    /// Slip events of the whole slider.
    #[getter]
    fn global_slips(&self) -> PyResult<Table> {
        self.table(GlobalSlip::TOPIC)
    }

    /// Detachments connected in space and time (docs/ruptures.md).
    #[getter]
    pub(crate) fn ruptures(&self) -> PyResult<Table> {
        self.table(Rupture::TOPIC)
    }

    /// The precursors among the ruptures, by onset: they include block 1, do not reach every block, and reach
    /// farther than every rupture that includes block 1 and began before (docs/ruptures.md).
    #[getter]
    fn precursors(&self) -> PyResult<Table> {
        self.table(PRECURSORS)
    }

    /// When each rupture passed each block.
    #[getter]
    fn arrivals(&self) -> PyResult<Table> {
        self.table(Arrival::TOPIC)
    }

    /// The topics of its tables.
    #[getter]
    fn topics(&self) -> Vec<String> {
        self.tables.keys().cloned().collect()
    }

    /// The table of a topic of events, such as `/events/slip`.
    pub(crate) fn table(&self, topic: &str) -> PyResult<Table> {
        self.tables
            .get(topic)
            .cloned()
            .ok_or_else(|| refused(format!("no events {topic} (accepted: {})", self.topics().join(", "))))
    }

    #[staticmethod]
    fn _restored(tables: BTreeMap<String, Table>, found: BTreeMap<String, Table>) -> Events {
        Events { tables, found }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let tables = (slf.get().tables.clone(), slf.get().found.clone());
        (slf.get_type().getattr("_restored")?, tables).into_pyobject(slf.py())
    }

    fn __repr__(&self) -> String {
        let tables = self.tables.values().chain(self.found.values());
        tables.map(|table| table.summary()).collect::<Vec<_>>().join("\n")
    }
}
