//! The native part of the Python package `asperity`: runs, replays, studies and diffs in the process that
//! asks, with their tables as Arrow streams and their fields as buffers.
//!
//! It stands on the libraries and knows nothing of the command line. In reading order:
//!
//! - `errors`: raises the exceptions of the package.
//! - `attend`: does work on a thread, while the interpreter's signals are heeded.
//! - `values`: values from and to Python.
//! - `scenario`, `run`, `study`, `diff`: the objects of the package; `recording` is a way to a run.
//! - `tables`, `memory`: tables of a run as Arrow streams, and memory that NumPy reads.
//! - `source`: a run as a log or as a scenario to be run again; `events`, `detectors`, `field`, `figure`:
//!   what is made from it.

mod attend;
mod detectors;
mod diff;
mod errors;
mod events;
mod field;
mod figure;
mod memory;
mod recording;
mod run;
mod scenario;
mod source;
mod study;
mod tables;
mod values;

/// The module `asperity._native`.
#[pyo3::pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    #[pymodule_export]
    use crate::{
        detectors::StepRecord,
        diff::{Diff, diff},
        events::Events,
        field::{Field, Nodes},
        figure::{Figure, figures},
        memory::Memory,
        recording::recording,
        run::{Run, open, resume, run},
        scenario::{Scenario, scenarios},
        study::{Sweep, refine, reproduce, sweep},
        tables::Table,
    };
}
