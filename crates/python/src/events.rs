//! The events of a run, as detectors found them.

use std::collections::BTreeMap;

use asperity_record::{Arrival, EventPayload, GlobalSlip, Onset, Rupture, SlipEvent};
use asperity_run::detectors::event_kinds;
use asperity_tables::run_tables::{ChoiceError, Chosen, RunTables};
use pyo3::prelude::*;

use crate::errors::refused;
use crate::tables::Table;

/// The events that detectors found.
#[pyclass(frozen, module = "asperity")]
#[derive(Clone, Default)]
pub(crate) struct Events {
    pub(crate) tables: BTreeMap<String, Table>,
    pub(crate) found: BTreeMap<String, Table>,
}

/// Begins the tables of all events: those of this program's detectors, and those of others that a log
/// announces with these schemas.
pub(crate) fn begin(schemas: &BTreeMap<&str, &str>) -> RunTables {
    let kinds = event_kinds();
    let mut schemas = schemas.clone();
    for kind in &kinds {
        schemas.entry(kind.topic).or_insert("");
    }
    let with = |topics| RunTables::new(&schemas, &kinds, Chosen { topics, ..Chosen::default() });
    let begin = || {
        let mut all = with(Vec::new())?;
        let topics = all.tables().iter().map(|table| table.layout.topic.to_string());
        with(topics.filter(|topic| topic.starts_with("/events/")).collect())
    };
    begin().unwrap_or_else(|error: ChoiceError| unreachable!("all chosen topics have tables: {error}"))
}

impl Events {
    /// Of a run that has been observed.
    pub(crate) fn of(mut tables: RunTables, found: BTreeMap<String, Table>) -> Events {
        let tables = tables.tables().iter();
        Events {
            tables: tables.map(|table| (table.layout.topic.to_string(), Table::of_run(table))).collect(),
            found,
        }
    }

    fn of_kind<P: EventPayload>(&self) -> PyResult<Table> {
        self.table(P::TOPIC)
    }
}

#[pymethods]
impl Events {
    /// Slip events: from the step in which a block first slides to that in which none does.
    #[getter]
    pub(crate) fn events(&self) -> PyResult<Table> {
        self.of_kind::<SlipEvent>()
    }

    #[getter]
    pub(crate) fn onsets(&self) -> PyResult<Table> {
        self.of_kind::<Onset>()
    }

    #[getter]
    pub(crate) fn global_slips(&self) -> PyResult<Table> {
        self.of_kind::<GlobalSlip>()
    }

    #[getter]
    pub(crate) fn ruptures(&self) -> PyResult<Table> {
        self.of_kind::<Rupture>()
    }

    #[getter]
    pub(crate) fn arrivals(&self) -> PyResult<Table> {
        self.of_kind::<Arrival>()
    }

    /// The tables of detectors in Python, by name.
    #[getter]
    pub(crate) fn found(&self) -> BTreeMap<String, Table> {
        self.found.clone()
    }

    #[getter]
    pub(crate) fn topics(&self) -> Vec<String> {
        self.tables.keys().cloned().collect()
    }

    pub(crate) fn table(&self, topic: &str) -> PyResult<Table> {
        self.tables
            .get(topic)
            .cloned()
            .ok_or_else(|| refused(format!("no events {topic} (accepted: {})", self.topics().join(", "))))
    }

    fn __repr__(&self) -> String {
        let tables = self.tables.values().chain(self.found.values());
        tables.map(|table| table.summary()).collect::<Vec<_>>().join("\n")
    }
}
