//! Fields of a run: a quantity of all contacts over time, and all nodes of a lattice at one.

use arrow_buffer::Buffer;
use asperity_record::RunHeader;
use asperity_run::{Field as States, NodeState, Quantity, Span, StatesError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::errors::{of_states, refused};
use crate::memory::Memory;
use crate::source::Source;
use crate::tables::Table;

/// Most bytes of a field: a quarter of what workstations have.
const MOST_BYTES: u64 = 4 << 30;

/// Samples of a range of time if the caller does not say how far they are apart.
const USUAL_SAMPLES: u64 = 1000;

const QUANTITIES: [(&str, &str, Quantity); 6] = [
    ("displacement", "m", Quantity::Displacement),
    ("velocity", "m/s", Quantity::Velocity),
    ("tangential_force", "N", Quantity::TangentialForce),
    ("displacement_across", "m", Quantity::DisplacementAcross),
    ("velocity_across", "m/s", Quantity::VelocityAcross),
    ("tangential_force_across", "N", Quantity::TangentialForceAcross),
];

/// Computes a field.
pub(crate) fn field(py: Python<'_>, source: &Source, quantity: &str, span: Span) -> PyResult<Field> {
    let (quantity, unit, of) = known(quantity)?;
    let blocks = source.header.blocks;
    let bytes = span.count().saturating_mul(u64::from(blocks)).saturating_mul(8);
    if bytes > MOST_BYTES {
        return Err(refused(format!(
            "{} states of {blocks} blocks take {:.1} GB (accepted: at most {} GB; a longer `every`, or a shorter `t`)",
            span.count(),
            bytes as f64 / 1e9,
            MOST_BYTES >> 30
        )));
    }
    let States { steps, time_s, position_m, position_across_m, values } = source.field(py, of, span)?;
    let shape = [steps.len(), position_m.len()];
    let array = |values: Vec<f64>, shape: &[usize]| doubles(py, values, shape);
    Ok(Field {
        quantity,
        unit,
        steps: Memory::array(py, Buffer::from_vec(steps), "uint64", &shape[..1])?.unbind(),
        t: array(time_s, &shape[..1])?,
        x: array(position_m, &shape[1..])?,
        y: array(position_across_m, &shape[1..])?,
        values: array(values, &shape)?,
    })
}

/// An array of NumPy on these values.
fn doubles(py: Python<'_>, values: Vec<f64>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    Memory::array(py, Buffer::from_vec(values), "float64", shape).map(Bound::unbind)
}

/// The arrays of which pickle has copies, which nobody changes either.
fn restored<const N: usize>(arrays: [Bound<'_, PyAny>; N]) -> PyResult<[Py<PyAny>; N]> {
    for array in &arrays {
        array.call_method1("setflags", (false,))?;
    }
    Ok(arrays.map(Bound::unbind))
}

/// A quantity by its name: that, its unit, and what it is.
fn known(quantity: &str) -> PyResult<(&'static str, &'static str, Quantity)> {
    QUANTITIES.iter().find(|(name, ..)| *name == quantity).copied().ok_or_else(|| {
        let names = QUANTITIES.map(|(name, ..)| name).join(", ");
        refused(format!("quantity = {quantity:?} (accepted: {names})"))
    })
}

/// The steps of a field: of a rupture, by its number and the table that has it, or from one time to another, s; `every` is
/// the time from one sample to the next, s.
pub(crate) fn span(
    header: &RunHeader,
    rupture: Option<(i64, Table)>,
    t: Option<&[f64]>,
    every: Option<f64>,
) -> PyResult<Span> {
    let grid = header.time_grid();
    let (from_step, to_step) = match (&rupture, t) {
        (Some((number, ruptures)), None) => steps_of(*number, ruptures, header)?,
        (None, Some([from_s, to_s])) if *from_s >= 0.0 && from_s <= to_s && to_s.is_finite() => {
            (grid.nearest_step(*from_s), grid.nearest_step(*to_s))
        }
        (None, Some(t)) => {
            return Err(refused(format!("t = {t:?} (accepted: two times in s, from 0, ascending)")));
        }
        (Some(_), Some(_)) | (None, None) => {
            return Err(refused("a field is of rupture=NUMBER or of t=(FROM, TO) (accepted: one of them)"));
        }
    };
    let every_steps = match every {
        Some(every_s) if every_s > 0.0 && every_s.is_finite() => grid.nearest_step(every_s).max(1),
        Some(every_s) => return Err(refused(format!("every = {every_s} (accepted: seconds, above 0)"))),
        // A front crosses a block in no less.
        None if rupture.is_some() => grid.nearest_step(header.scales.block_time_s).max(1),
        None => (to_step.saturating_sub(from_step) / USUAL_SAMPLES).max(1),
    };
    Ok(Span { from_step, to_step, every_steps })
}

/// The first step of a rupture and its last, or the last of the run if it has not ended.
fn steps_of(number: i64, ruptures: &Table, header: &RunHeader) -> PyResult<(u64, u64)> {
    let column = |name: &str| ruptures.steps(name).ok_or_else(|| refused(format!("ruptures have no {name}")));
    let (numbers, onsets, ends) = (column("rupture")?, column("onset_step")?, column("end_step")?);
    let row = numbers
        .iter()
        .position(|other| other.and_then(|other| other.try_into().ok()) == Some(number))
        .ok_or_else(|| {
            let last = numbers.iter().flatten().max();
            let accepted =
                last.map_or("none: the run has no rupture".to_owned(), |last| format!("0 to {last}"));
            refused(format!("rupture = {number} (accepted: {accepted})"))
        })?;
    let end = ends.iter().nth(row).flatten().unwrap_or(header.steps);
    Ok((onsets.value(row), end))
}

/// A quantity of all contacts over time, on the memory of this package.
#[pyclass(frozen, get_all, module = "asperity")]
pub(crate) struct Field {
    /// `displacement`, `velocity` or `tangential_force`, or one of these with `_across`.
    quantity: &'static str,
    /// The unit of the values.
    unit: &'static str,
    /// The steps: shape (times,).
    steps: Py<PyAny>,
    /// Times, s: shape (times,).
    t: Py<PyAny>,
    /// Positions of the contacts along the slider, in a medium their depths, m: shape (contacts,).
    x: Py<PyAny>,
    /// Positions of the contacts across the sliding direction, m: shape (contacts,); 0 in a single row.
    y: Py<PyAny>,
    /// Shape (times, contacts), in `unit`.
    values: Py<PyAny>,
}

#[pymethods]
impl Field {
    /// The values, for NumPy.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.values.bind(py).clone();
        match (dtype, copy) {
            (None, None | Some(false)) => Ok(values),
            (dtype, _) => {
                let dtype = dtype.map_or_else(|| values.getattr("dtype"), Ok)?;
                values.call_method1("astype", (dtype,))
            }
        }
    }

    #[staticmethod]
    fn _restored(quantity: &str, arrays: [Bound<'_, PyAny>; 5]) -> PyResult<Field> {
        let (quantity, unit, _) = known(quantity)?;
        let [steps, t, x, y, values] = restored(arrays)?;
        Ok(Field { quantity, unit, steps, t, x, y, values })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let Field { quantity, steps, t, x, y, values, .. } = slf.get();
        let arrays = [steps, t, x, y, values];
        (slf.get_type().getattr("_restored")?, (*quantity, arrays)).into_pyobject(slf.py())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (times, contacts) = (self.t.bind(py).len()?, self.x.bind(py).len()?);
        Ok(format!("Field({} in {}: {times} times x {contacts} contacts)", self.quantity, self.unit))
    }
}

/// Computes all nodes of a slab, a sheet or a body at a time.
pub(crate) fn nodes(py: Python<'_>, source: &Source, t: f64) -> PyResult<Nodes> {
    let state = source.nodes(py, &[t])?.pop().ok_or_else(|| refused("no time"))?;
    if state.lattice.as_chain().is_some() {
        return Err(of_states(StatesError::of_chain()));
    }
    let NodeState { step, time_s, lattice, displacement_m, velocity_m_per_s, .. } = state;
    let mut shape = vec![lattice.axes(), lattice.rows, lattice.lanes, lattice.columns];
    if lattice.lanes == 1 {
        shape.remove(2);
    }
    let [displacement, velocity] =
        [displacement_m, velocity_m_per_s].map(|values| doubles(py, values, &shape));
    Ok(Nodes { step, t: time_s, displacement: displacement?, velocity: velocity? })
}

/// All nodes at a time. Arrays of a slab have shape (2, rows, columns): along the sliding direction, upwards;
/// those of a body (3, rows, rows across, columns): along, across, upwards; those of a sheet
/// (2, 1, rows across, columns): along, across.
#[pyclass(frozen, get_all, module = "asperity")]
pub(crate) struct Nodes {
    /// The step.
    step: u64,
    /// The time, s.
    t: f64,
    /// From the grid, m; row 0 is the bottom.
    displacement: Py<PyAny>,
    /// m/s.
    velocity: Py<PyAny>,
}

#[pymethods]
impl Nodes {
    #[staticmethod]
    fn _restored(step: u64, t: f64, arrays: [Bound<'_, PyAny>; 2]) -> PyResult<Nodes> {
        let [displacement, velocity] = restored(arrays)?;
        Ok(Nodes { step, t, displacement, velocity })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let Nodes { step, t, displacement, velocity } = slf.get();
        let arrays = [displacement, velocity];
        (slf.get_type().getattr("_restored")?, (*step, *t, arrays)).into_pyobject(slf.py())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let shape: Vec<usize> = self.displacement.bind(py).getattr("shape")?.extract()?;
        let across = if shape.len() > 3 { format!("{} rows across x ", shape[2]) } else { String::new() };
        let (rows, columns) = (shape[1], shape[shape.len() - 1]);
        Ok(format!("Nodes(t = {} s: {rows} rows x {across}{columns} columns)", self.t))
    }
}
