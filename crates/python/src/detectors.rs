//! Detectors in Python: objects with `observe(record)`, and perhaps `finish()`, each of which may return a
//! dictionary or several; these are the rows of a table.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, LargeStringArray};
use asperity_record::{Direction, Observer, Record, StepRecord as Recorded};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use toml::Value;

use crate::attend::Watch;
use crate::errors::refused;
use crate::tables::Table;
use crate::values::scalar;

/// The detectors of one run.
pub(crate) struct Detectors {
    detectors: Vec<Detector>,
    watch: Arc<Watch>,
}

/// What a detector returned: its columns, and their values where they have one.
type Row = Vec<(String, Option<Value>)>;

/// What was made of one object, to be carried to the thread of a run.
pub(crate) struct Detector {
    name: String,
    observe: Py<PyAny>,
    finish: Option<Py<PyAny>>,
    rows: Vec<Row>,
}

/// The detectors that a caller gives: none, one, or several.
pub(crate) fn given(detectors: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<Detector>> {
    let Some(detectors) = detectors else { return Ok(Vec::new()) };
    let several = match detectors.hasattr("observe")? {
        true => vec![detectors.clone()],
        false => detectors.try_iter()?.collect::<PyResult<Vec<_>>>()?,
    };
    let mut given: Vec<Detector> = Vec::new();
    for detector in several {
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

    /// They again, for another run.
    pub(crate) fn unused(self) -> Vec<Detector> {
        self.detectors
    }

    /// Ends the run for them, and returns the table of each.
    pub(crate) fn finish(self, py: Python<'_>) -> PyResult<BTreeMap<String, Table>> {
        let finish = |mut detector: Detector| {
            if let Some(finish) = &detector.finish {
                let found = finish.bind(py).call0()?;
                detector.add(&found)?;
            }
            let Detector { name, rows, .. } = detector;
            let table = py.detach(|| table(&name, &rows))?;
            Ok((name, table))
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
            let observed = self.watch.call(|| {
                let step = Bound::new(py, StepRecord::of(step))?;
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
        if let Ok(row) = found.cast::<PyMapping>() {
            return self.add_row(row);
        }
        let name = self.name.clone();
        let refused = || {
            PyTypeError::new_err(format!(
                "{name} returned {found} (accepted: None, a dict, or several dicts)"
            ))
        };
        for row in found.try_iter().map_err(|_| refused())? {
            self.add_row(row?.cast::<PyMapping>().map_err(|_| refused())?)?;
        }
        Ok(())
    }

    fn add_row(&mut self, row: &Bound<'_, PyMapping>) -> PyResult<()> {
        let mut cells = Vec::new();
        for pair in row.items()?.try_iter()? {
            let (column, value): (String, Bound<'_, PyAny>) = pair?.extract()?;
            // A number of NumPy is one of Python.
            let value = value.call_method0("item").unwrap_or(value);
            let cell = scalar(&value)?;
            if cell.is_none() && !value.is_none() {
                return Err(PyTypeError::new_err(format!(
                    "{}: {column} = {value} (accepted: a number, a text, a truth value, or None)",
                    self.name
                )));
            }
            cells.push((column, cell));
        }
        self.rows.push(cells);
        Ok(())
    }
}

/// The rows of a detector as a table: columns in the order in which they first occur; whole numbers stay what
/// they are if the whole column is.
fn table(detector: &str, rows: &[Row]) -> PyResult<Table> {
    let mut columns: Vec<(&str, Vec<Option<&Value>>)> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        for (name, cell) in row {
            let place = columns.iter().position(|(column, _)| column == name).unwrap_or_else(|| {
                columns.push((name, Vec::new()));
                columns.len() - 1
            });
            columns[place].1.resize(index, None);
            columns[place].1.push(cell.as_ref());
        }
    }
    let column = |(name, mut cells): (&str, Vec<Option<&Value>>)| {
        cells.resize(rows.len(), None);
        let values = column_of(&cells).ok_or_else(|| {
            PyTypeError::new_err(format!(
                "{detector}: the column {name} has values of several kinds (accepted: numbers, texts or truth \
                 values)"
            ))
        })?;
        Ok((name.to_owned(), asperity_record::unit_of(name), String::new(), values))
    };
    let columns = columns.into_iter().map(column).collect::<PyResult<_>>()?;
    Ok(Table::new(detector, columns))
}

/// The cells as one kind of values, if they are.
fn column_of(cells: &[Option<&Value>]) -> Option<ArrayRef> {
    fn all<'a, T>(cells: &[Option<&'a Value>], of: fn(&'a Value) -> Option<T>) -> Option<Vec<Option<T>>> {
        cells.iter().map(|cell| cell.map_or(Some(None), |cell| of(cell).map(Some))).collect()
    }
    if let Some(values) = all(cells, Value::as_bool) {
        return Some(Arc::new(BooleanArray::from(values)));
    }
    if let Some(values) = all(cells, Value::as_integer) {
        return Some(Arc::new(Int64Array::from(values)));
    }
    if let Some(values) = all(cells, number) {
        return Some(Arc::new(Float64Array::from(values)));
    }
    // Offsets of 64 bits: the texts of a column may take more than 2 GiB.
    all(cells, Value::as_str).map(|values| -> ArrayRef { Arc::new(LargeStringArray::from(values)) })
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|value| value as f64))
}

/// What is known of a slider at a step: at every step with a switch, first and last steps of slip, samples.
///
/// F_T is the sum of the driving forces, F_N the normal load. Definition: docs/rules.md.
#[pyclass(frozen, get_all, module = "asperity")]
pub(crate) struct StepRecord {
    /// The step, counted from 1.
    step: u64,
    /// Simulated time at its end, s.
    time_s: f64,
    /// F_T, the sum of the driving forces, N.
    driving_force_n: f64,
    /// F_N, the total normal load, N.
    normal_load_n: f64,
    /// F_T / F_N.
    ft_fn: f64,
    /// How many blocks slide in the step.
    sliding: u32,
    /// The blocks that began to slide in it, from 1.
    detached: Vec<u32>,
    /// The blocks that stopped in it, from 1.
    attached: Vec<u32>,
    /// How many junctions broke in all steps before it; None by laws without junctions.
    breaks: Option<u64>,
    /// How many junctions were pinned again in all steps before it; None by laws without junctions.
    repins: Option<u64>,
}

impl StepRecord {
    fn of(record: &Recorded) -> StepRecord {
        let &Recorded { step, time_s, driving_force_n, normal_load_n, sliding, junctions, .. } = record;
        let switched = |direction: Direction| {
            let switches = record.switches.iter().filter(|switch| switch.direction == direction);
            switches.map(|switch| switch.block).collect()
        };
        StepRecord {
            step,
            time_s,
            driving_force_n,
            normal_load_n,
            ft_fn: record.load_ratio(),
            sliding,
            detached: switched(Direction::Detach),
            attached: switched(Direction::Attach),
            breaks: junctions.map(|totals| totals.breaks),
            repins: junctions.map(|totals| totals.repins),
        }
    }
}

#[pymethods]
impl StepRecord {
    fn __repr__(&self) -> String {
        let StepRecord { step, time_s, ft_fn, sliding, .. } = self;
        format!("StepRecord(step {step}, {time_s} s: F_T/F_N = {ft_fn}, {sliding} blocks slide)")
    }
}
