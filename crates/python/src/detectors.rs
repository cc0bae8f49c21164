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
use crate::tables::{Table, described};
use crate::values::{items, scalar};

/// The detectors of one run.
pub(crate) struct Detectors {
    pub(crate) detectors: Vec<Detector>,
    pub(crate) watch: Arc<Watch>,
}

/// What was made of one object, to be carried to the thread of a run.
pub(crate) struct Detector {
    name: String,
    observe: Py<PyAny>,
    finish: Option<Py<PyAny>>,
    /// Its columns in the order in which they first occur, each up to the last row with a value.
    columns: Vec<(String, Vec<Option<Value>>)>,
    rows: usize,
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
        given.push(Detector { name, observe: observe.unbind(), finish, columns: Vec::new(), rows: 0 });
    }
    Ok(given)
}

impl Detectors {
    /// Ends the run for them, and returns the table of each.
    pub(crate) fn finish(self, py: Python<'_>) -> PyResult<BTreeMap<String, Table>> {
        let finish = |mut detector: Detector| {
            if let Some(finish) = &detector.finish {
                let found = finish.bind(py).call0()?;
                detector.add(&found)?;
            }
            let table = py.detach(|| detector.table())?;
            Ok((detector.name, table))
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
        for (column, value) in items(row)? {
            // A number of NumPy is one of Python.
            let value = value.call_method0("item").unwrap_or(value);
            let cell = scalar(&value)?;
            if cell.is_none() && !value.is_none() {
                return Err(PyTypeError::new_err(format!(
                    "{}: {column} = {value} (accepted: a number, a text, a truth value, or None)",
                    self.name
                )));
            }
            let place = self.columns.iter().position(|(known, _)| *known == column).unwrap_or_else(|| {
                self.columns.push((column, Vec::new()));
                self.columns.len() - 1
            });
            let cells = &mut self.columns[place].1;
            cells.resize(self.rows, None);
            cells.push(cell);
        }
        self.rows += 1;
        Ok(())
    }

    /// The rows as a table; whole numbers stay what they are if the whole column is.
    fn table(&mut self) -> PyResult<Table> {
        let detector = &self.name;
        let column = |(name, cells): &mut (String, Vec<Option<Value>>)| {
            cells.resize(self.rows, None);
            let values = column_of(cells).ok_or_else(|| {
                PyTypeError::new_err(format!(
                    "{detector}: the column {name} has values of several kinds (accepted: numbers, texts or truth \
                     values)"
                ))
            })?;
            Ok((name.clone(), described(asperity_record::unit_of(name), ""), values))
        };
        Ok(Table::new(detector, self.columns.iter_mut().map(column).collect::<PyResult<_>>()?))
    }
}

/// The cells as one kind of values, if they are.
fn column_of(cells: &[Option<Value>]) -> Option<ArrayRef> {
    fn all<'a, T>(cells: &'a [Option<Value>], of: fn(&'a Value) -> Option<T>) -> Option<Vec<Option<T>>> {
        cells.iter().map(|cell| cell.as_ref().map_or(Some(None), |cell| of(cell).map(Some))).collect()
    }
    if let Some(values) = all(cells, Value::as_bool) {
        return Some(Arc::new(BooleanArray::from(values)));
    }
    if let Some(values) = all(cells, Value::as_integer) {
        return Some(Arc::new(Int64Array::from(values)));
    }
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|value| value as f64));
    if let Some(values) = all(cells, number) {
        return Some(Arc::new(Float64Array::from(values)));
    }
    // Offsets of 64 bits: the texts of a column may take more than 2 GiB.
    all(cells, Value::as_str).map(|values| -> ArrayRef { Arc::new(LargeStringArray::from(values)) })
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
