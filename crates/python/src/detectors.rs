//! Detectors in Python: objects with `observe(record)`, and perhaps `finish()`, each of which may return a
//! dictionary or several; these are the rows of a table.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, StringArray};
use asperity_record::{Direction, Observer, Record, StepRecord as Recorded};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::attend::Watch;
use crate::errors::refused;
use crate::tables::Table;
use crate::values::to_json;

/// The detectors of one run.
pub(crate) struct Detectors {
    detectors: Vec<Detector>,
    watch: Arc<Watch>,
}

/// What was made of one object, to be carried to the thread of a run.
pub(crate) struct Detector {
    name: String,
    observe: Py<PyAny>,
    finish: Option<Py<PyAny>>,
    rows: Vec<Vec<(String, Value)>>,
}

/// The detectors that a caller gives.
pub(crate) fn given(detectors: &[Bound<'_, PyAny>]) -> PyResult<Vec<Detector>> {
    let mut given: Vec<Detector> = Vec::new();
    for detector in detectors {
        let class = detector.get_type().name()?.to_string();
        let name = detector.getattr_opt("name")?.map_or(Ok(class), |name| name.extract())?;
        let observe = detector.getattr_opt("observe")?.ok_or_else(|| {
            PyTypeError::new_err(format!("{name} is no detector (accepted: an object with observe(record))"))
        })?;
        let finish = detector.getattr_opt("finish")?.map(Bound::unbind);
        if given.iter().any(|other| other.name == name) {
            return Err(refused(format!("two detectors are called {name} (accepted: a name for each)")));
        }
        given.push(Detector { name, observe: observe.unbind(), finish, rows: Vec::new() });
    }
    Ok(given)
}

impl Detectors {
    pub(crate) fn begin(detectors: Vec<Detector>, watch: &Arc<Watch>) -> Detectors {
        Detectors { detectors, watch: Arc::clone(watch) }
    }

    /// Ends the run for them, and returns the table of each.
    pub(crate) fn finish(self, py: Python<'_>) -> PyResult<BTreeMap<String, Table>> {
        let finish = |mut detector: Detector| {
            if let Some(finish) = &detector.finish {
                let found = finish.bind(py).call0()?;
                detector.add(&found)?;
            }
            Ok((detector.name.clone(), detector.table()))
        };
        self.detectors.into_iter().map(finish).collect()
    }
}

impl Observer for Detectors {
    fn record(&mut self, record: &Record) {
        let Record::Step(step) = record else { return };
        if self.detectors.is_empty() || self.watch.is_stopped() {
            return;
        }
        Python::attach(|py| {
            let observed = Bound::new(py, StepRecord(step.clone())).and_then(|step| {
                self.detectors.iter_mut().try_for_each(|detector| {
                    detector.observe.bind(py).call1((&step,)).and_then(|found| detector.add(&found))
                })
            });
            if let Err(error) = observed {
                self.watch.raise(error);
            }
        });
    }
}

impl Detector {
    /// Adds what was returned: nothing, a row, or several.
    fn add(&mut self, found: &Bound<'_, PyAny>) -> PyResult<()> {
        if found.is_none() {
            return Ok(());
        }
        if let Ok(row) = found.cast::<PyDict>() {
            let cells = row.iter().map(|(key, value)| Ok((key.extract()?, to_json(&value)?)));
            self.rows.push(cells.collect::<PyResult<_>>()?);
            return Ok(());
        }
        let rows = found.try_iter().map_err(|_| {
            let name = &self.name;
            PyTypeError::new_err(format!(
                "{name} returned {found} (accepted: None, a dict, or several dicts)"
            ))
        })?;
        for row in rows {
            let row = row?;
            if !row.is_instance_of::<PyDict>() {
                let name = &self.name;
                return Err(PyTypeError::new_err(format!(
                    "{name} returned {row} among rows (accepted: dicts)"
                )));
            }
            self.add(&row)?;
        }
        Ok(())
    }

    /// The columns in the order in which they first occur; whole numbers and truth values stay what they
    /// are if the whole column is.
    fn table(self) -> Table {
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in self.rows.iter().flatten() {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        let cell = |row: &'_ [(String, Value)], name: &str| {
            row.iter().rev().find(|(other, _)| other == name).map_or(Value::Null, |(_, value)| value.clone())
        };
        let column = |name: &str| {
            let values: Vec<Value> = self.rows.iter().map(|row| cell(row, name)).collect();
            (name.to_owned(), asperity_record::unit_of(name), String::new(), column_of(&values))
        };
        Table::new(&self.name, names.into_iter().map(column).collect())
    }
}

fn column_of(values: &[Value]) -> ArrayRef {
    let all = |is: fn(&Value) -> bool| values.iter().all(|value| value.is_null() || is(value));
    if all(Value::is_boolean) {
        return Arc::new(BooleanArray::from_iter(values.iter().map(Value::as_bool)));
    }
    if all(Value::is_i64) {
        return Arc::new(Int64Array::from_iter(values.iter().map(Value::as_i64)));
    }
    if all(Value::is_number) {
        return Arc::new(Float64Array::from_iter(values.iter().map(Value::as_f64)));
    }
    let word = |value: &Value| match value {
        Value::Null => None,
        Value::String(word) => Some(word.clone()),
        other => Some(other.to_string()),
    };
    Arc::new(StringArray::from_iter(values.iter().map(word)))
}

/// What is known of a slider at a step: at every step with a switch, first and last steps of slip, samples.
///
/// F_T is the sum of the driving forces, F_N the normal load. Definition: docs/rules.md.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct StepRecord(Recorded);

#[pymethods]
impl StepRecord {
    #[getter]
    fn step(&self) -> u64 {
        self.0.step
    }

    #[getter]
    fn time_s(&self) -> f64 {
        self.0.time_s
    }

    #[getter]
    fn driving_force_n(&self) -> f64 {
        self.0.driving_force_n
    }

    #[getter]
    fn normal_load_n(&self) -> f64 {
        self.0.normal_load_n
    }

    /// F_T / F_N.
    #[getter]
    fn ft_fn(&self) -> f64 {
        self.0.load_ratio()
    }

    /// How many blocks slide in the step.
    #[getter]
    fn sliding(&self) -> u32 {
        self.0.sliding
    }

    /// The blocks that began to slide in it, from 1.
    #[getter]
    fn detached(&self) -> Vec<u32> {
        self.switched(Direction::Detach)
    }

    /// The blocks that stopped in it, from 1.
    #[getter]
    fn attached(&self) -> Vec<u32> {
        self.switched(Direction::Attach)
    }
}

impl StepRecord {
    fn switched(&self, direction: Direction) -> Vec<u32> {
        let switches = self.0.switches.iter().filter(|switch| switch.direction == direction);
        switches.map(|switch| switch.block).collect()
    }
}
