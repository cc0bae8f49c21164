//! Fields of a run: a quantity of all contacts over time, and all nodes of a lattice at one.

use arrow_buffer::Buffer;
use asperity_record::RunHeader;
use asperity_run::{Field as States, NodeState, Quantity, Span};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};

use crate::attend::{Callbacks, attend};
use crate::errors::{of_states, refused};
use crate::memory::{Memory, pickled, restored};
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

/// A field as it is asked for.
pub(crate) struct Asked<'a> {
    pub(crate) quantity: &'a str,
    /// The number of a rupture, and the table that has it.
    pub(crate) rupture: Option<(i64, Table)>,
    /// From and to, s.
    pub(crate) t: Option<Vec<f64>>,
    /// Time from one sample to the next, s.
    pub(crate) every: Option<f64>,
}

/// Computes a field.
pub(crate) fn field(
    py: Python<'_>,
    source: &Source,
    header: &RunHeader,
    asked: Asked<'_>,
) -> PyResult<Field> {
    let (quantity, unit, of) = known(asked.quantity)?;
    let span = span(header, &asked)?;
    let bytes = span.count().saturating_mul(u64::from(header.blocks)).saturating_mul(8);
    if bytes > MOST_BYTES {
        return Err(refused(format!(
            "{} states of {} blocks take {:.1} GB (accepted: at most {} GB; a longer `every`, or a shorter `t`)",
            span.count(),
            header.blocks,
            bytes as f64 / 1e9,
            MOST_BYTES >> 30
        )));
    }
    let states = attend(py, &Callbacks::default(), |watch| {
        let stop = || watch.is_stopped();
        match source {
            Source::Log { path, last_step } => States::of_log(path, *last_step, of, span, &stop),
            Source::Scenario { scenario, solver } => States::of_scenario(scenario, *solver, of, span, &stop),
        }
    })?;
    let States { steps, time_s, position_m, position_across_m, values } = states.map_err(of_states)?;
    let buffer = Buffer::from_vec::<f64>;
    let shape = [steps.len(), position_m.len()];
    Ok(Field {
        quantity,
        unit,
        shape,
        steps: Buffer::from_vec(steps),
        t: buffer(time_s),
        x: buffer(position_m),
        y: buffer(position_across_m),
        values: buffer(values),
    })
}

/// A quantity by its name: that, its unit, and what it is.
fn known(quantity: &str) -> PyResult<(&'static str, &'static str, Quantity)> {
    QUANTITIES.iter().find(|(name, ..)| *name == quantity).copied().ok_or_else(|| {
        let names = QUANTITIES.map(|(name, ..)| name).join(", ");
        refused(format!("quantity = {quantity:?} (accepted: {names})"))
    })
}

/// The steps of a field.
fn span(header: &RunHeader, asked: &Asked<'_>) -> PyResult<Span> {
    let grid = header.time_grid();
    let (from_step, to_step) = match (&asked.rupture, asked.t.as_deref()) {
        (Some((number, ruptures)), None) => rupture(*number, ruptures, header)?,
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
    let every_steps = match asked.every {
        Some(every_s) if every_s > 0.0 && every_s.is_finite() => grid.nearest_step(every_s).max(1),
        Some(every_s) => return Err(refused(format!("every = {every_s} (accepted: seconds, above 0)"))),
        // A front crosses a block in no less.
        None if asked.rupture.is_some() => grid.nearest_step(header.scales.block_time_s).max(1),
        None => (to_step.saturating_sub(from_step) / USUAL_SAMPLES).max(1),
    };
    Ok(Span { from_step, to_step, every_steps })
}

/// The first step of a rupture and its last, or the last of the run if it has not ended.
fn rupture(number: i64, ruptures: &Table, header: &RunHeader) -> PyResult<(u64, u64)> {
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
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Field {
    quantity: &'static str,
    unit: &'static str,
    shape: [usize; 2],
    steps: Buffer,
    t: Buffer,
    x: Buffer,
    y: Buffer,
    values: Buffer,
}

#[pymethods]
impl Field {
    /// `displacement`, `velocity` or `tangential_force`, or one of these with `_across`.
    #[getter]
    fn quantity(&self) -> &str {
        self.quantity
    }

    /// The unit of the values.
    #[getter]
    fn unit(&self) -> &str {
        self.unit
    }

    /// The steps: shape (times,).
    #[getter]
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.steps.clone(), "uint64", &self.shape[..1])
    }

    /// Times, s: shape (times,).
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.t.clone(), "float64", &self.shape[..1])
    }

    /// Positions of the contacts along the slider, m: shape (contacts,).
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.x.clone(), "float64", &self.shape[1..])
    }

    /// Positions of the contacts across the sliding direction, m: shape (contacts,); 0 in a single row.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.y.clone(), "float64", &self.shape[1..])
    }

    /// Shape (times, contacts), in `unit`.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.values.clone(), "float64", &self.shape)
    }

    /// The values, for NumPy.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.values(py)?;
        match (dtype, copy) {
            (None, None | Some(false)) => Ok(values),
            (dtype, _) => {
                let dtype = dtype.map_or_else(|| values.getattr("dtype"), Ok)?;
                values.call_method1("astype", (dtype,))
            }
        }
    }

    #[staticmethod]
    fn _restored(quantity: &str, shape: [usize; 2], memory: [Bound<'_, PyBytes>; 5]) -> PyResult<Field> {
        let (quantity, unit, _) = known(quantity)?;
        let [steps, t, x, y, values] = memory.each_ref().map(restored);
        Ok(Field { quantity, unit, shape, steps, t, x, y, values })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let Field { quantity, shape, steps, t, x, y, values, .. } = slf.get();
        let memory = [steps, t, x, y, values].map(|memory| pickled(slf.py(), memory));
        (slf.get_type().getattr("_restored")?, (*quantity, *shape, memory)).into_pyobject(slf.py())
    }

    fn __repr__(&self) -> String {
        let [times, contacts] = self.shape;
        format!("Field({} in {}: {times} times x {contacts} contacts)", self.quantity, self.unit)
    }
}

/// Computes all nodes of a slab, a sheet or a body at a time.
pub(crate) fn nodes(py: Python<'_>, source: &Source, t: f64) -> PyResult<Nodes> {
    let state = attend(py, &Callbacks::default(), |watch| {
        let stop = || watch.is_stopped();
        source.nodes(&[t])?.next_state_unless(&stop)
    })?;
    let state = state.map_err(of_states)?.ok_or_else(|| refused("no time"))?;
    let NodeState { step, time_s, lattice, displacement_m, velocity_m_per_s, .. } = state;
    let mut shape = vec![lattice.axes(), lattice.rows, lattice.lanes, lattice.columns];
    if lattice.lanes == 1 {
        shape.remove(2);
    }
    let buffer = Buffer::from_vec::<f64>;
    Ok(Nodes {
        step,
        time_s,
        shape,
        displacement: buffer(displacement_m),
        velocity: buffer(velocity_m_per_s),
    })
}

/// All nodes at a time. Arrays of a slab have shape (2, rows, columns): along the sliding direction, upwards;
/// those of a body (3, rows, rows across, columns): along, across, upwards; those of a sheet
/// (2, 1, rows across, columns): along, across.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Nodes {
    step: u64,
    time_s: f64,
    shape: Vec<usize>,
    displacement: Buffer,
    velocity: Buffer,
}

#[pymethods]
impl Nodes {
    /// The step.
    #[getter]
    fn step(&self) -> u64 {
        self.step
    }

    /// The time, s.
    #[getter]
    fn t(&self) -> f64 {
        self.time_s
    }

    /// From the grid, m; row 0 is the bottom.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.displacement.clone(), "float64", &self.shape)
    }

    /// m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Memory::array(py, self.velocity.clone(), "float64", &self.shape)
    }

    #[staticmethod]
    fn _restored(step: u64, time_s: f64, shape: Vec<usize>, memory: [Bound<'_, PyBytes>; 2]) -> Nodes {
        let [displacement, velocity] = memory.each_ref().map(restored);
        Nodes { step, time_s, shape, displacement, velocity }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let Nodes { step, time_s, shape, displacement, velocity } = slf.get();
        let memory = [displacement, velocity].map(|memory| pickled(slf.py(), memory));
        (slf.get_type().getattr("_restored")?, (*step, *time_s, shape.clone(), memory))
            .into_pyobject(slf.py())
    }

    fn __repr__(&self) -> String {
        let across =
            if self.shape.len() > 3 { format!("{} rows across x ", self.shape[2]) } else { String::new() };
        let (rows, columns) = (self.shape[1], self.shape[self.shape.len() - 1]);
        format!("Nodes(t = {} s: {rows} rows x {across}{columns} columns)", self.time_s)
    }
}
