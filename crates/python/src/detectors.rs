//! Detectors in Python: objects with `observe(record)`, and perhaps `finish()`, each of which may return a
//! dictionary or several; these are the rows of a table.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, LargeStringArray};
use asperity_record::{Direction, Observer, Record, StepRecord as Recorded};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyMapping, PyString};

use crate::attend::Watch;
use crate::errors::refused;
use crate::tables::Table;

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
    rows: Vec<Vec<(String, Cell)>>,
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
                let step = Bound::new(py, StepRecord(step.clone()))?;
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

/// A cell of a row.
#[derive(Clone, PartialEq)]
enum Cell {
    Missing,
    Flag(bool),
    Whole(i64),
    Number(f64),
    Word(String),
}

impl Cell {
    fn of(value: &Bound<'_, PyAny>) -> PyResult<Option<Cell>> {
        // A number of NumPy is one of Python.
        let item = value.call_method0("item").ok();
        let value = item.as_ref().unwrap_or(value);
        Ok(Some(match value {
            value if value.is_none() => Cell::Missing,
            value if value.is_instance_of::<PyBool>() => Cell::Flag(value.is_truthy()?),
            value if value.is_instance_of::<PyInt>() => Cell::Whole(value.extract()?),
            value if value.is_instance_of::<PyFloat>() => Cell::Number(value.extract()?),
            value if value.is_instance_of::<PyString>() => Cell::Word(value.extract()?),
            _ => return Ok(None),
        }))
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
            let cell = Cell::of(&value)?.ok_or_else(|| {
                PyTypeError::new_err(format!(
                    "{}: {column} = {value} (accepted: a number, a text, a truth value, or None)",
                    self.name
                ))
            })?;
            cells.push((column, cell));
        }
        self.rows.push(cells);
        Ok(())
    }
}

/// The rows of a detector as a table: columns in the order in which they first occur; whole numbers stay what
/// they are if the whole column is.
fn table(detector: &str, rows: &[Vec<(String, Cell)>]) -> PyResult<Table> {
    let mut columns: Vec<(&str, Vec<&Cell>)> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        for (name, cell) in row {
            let place = columns.iter().position(|(column, _)| column == name).unwrap_or_else(|| {
                columns.push((name, Vec::new()));
                columns.len() - 1
            });
            columns[place].1.resize(index, &Cell::Missing);
            columns[place].1.push(cell);
        }
    }
    let column = |(name, mut cells): (&str, Vec<&Cell>)| {
        cells.resize(rows.len(), &Cell::Missing);
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
fn column_of(cells: &[&Cell]) -> Option<ArrayRef> {
    fn all<'a, T>(cells: &[&'a Cell], of: impl Fn(&'a Cell) -> Option<T>) -> Option<Vec<Option<T>>> {
        let value = |cell: &&'a Cell| match cell {
            Cell::Missing => Some(None),
            cell => of(cell).map(Some),
        };
        cells.iter().map(value).collect()
    }
    let flag = |cell: &Cell| if let Cell::Flag(flag) = cell { Some(*flag) } else { None };
    let whole = |cell: &Cell| if let Cell::Whole(value) = cell { Some(*value) } else { None };
    let number = |cell: &Cell| match cell {
        Cell::Whole(value) => Some(*value as f64),
        Cell::Number(value) => Some(*value),
        _ => None,
    };
    // Offsets of 64 bits: the texts of a column may take more than 2 GiB.
    fn word(cell: &Cell) -> Option<&str> {
        if let Cell::Word(word) = cell { Some(word) } else { None }
    }
    if let Some(values) = all(cells, flag) {
        return Some(Arc::new(BooleanArray::from(values)));
    }
    if let Some(values) = all(cells, whole) {
        return Some(Arc::new(Int64Array::from(values)));
    }
    if let Some(values) = all(cells, number) {
        return Some(Arc::new(Float64Array::from(values)));
    }
    all(cells, word).map(|values| -> ArrayRef { Arc::new(LargeStringArray::from(values)) })
}

/// What is known of a slider at a step: at every step with a switch, first and last steps of slip, samples.
///
/// F_T is the sum of the driving forces, F_N the normal load. Definition: docs/rules.md.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct StepRecord(Recorded);

#[pymethods]
impl StepRecord {
    fn __repr__(&self) -> String {
        let Recorded { step, time_s, sliding, .. } = &self.0;
        format!(
            "StepRecord(step {step}, {time_s} s: F_T/F_N = {}, {sliding} blocks slide)",
            self.0.load_ratio()
        )
    }

    /// The step, counted from 1.
    #[getter]
    fn step(&self) -> u64 {
        self.0.step
    }

    /// Simulated time at its end, s.
    #[getter]
    fn time_s(&self) -> f64 {
        self.0.time_s
    }

    /// F_T, the sum of the driving forces, N.
    #[getter]
    fn driving_force_n(&self) -> f64 {
        self.0.driving_force_n
    }

    /// F_N, the total normal load, N.
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

    /// How many junctions broke in all steps before it; None by laws without junctions.
    #[getter]
    fn breaks(&self) -> Option<u64> {
        self.0.junctions.map(|totals| totals.breaks)
    }

    /// How many junctions were pinned again in all steps before it; None by laws without junctions.
    #[getter]
    fn repins(&self) -> Option<u64> {
        self.0.junctions.map(|totals| totals.repins)
    }
}

impl StepRecord {
    fn switched(&self, direction: Direction) -> Vec<u32> {
        let switches = self.0.switches.iter().filter(|switch| switch.direction == direction);
        switches.map(|switch| switch.block).collect()
    }
}
