//! Memory of this program that NumPy, or whoever knows the buffer protocol, reads without a copy.

use std::ffi::c_int;

use arrow_buffer::Buffer;
use pyo3::exceptions::PyBufferError;
use pyo3::ffi;
use pyo3::prelude::*;

/// Memory of the package, which NumPy reads without a copy.
#[pyclass(frozen, module = "asperity._native")]
pub(crate) struct Memory(Buffer);

impl Memory {
    /// An array over these bytes, of the values that NumPy calls `dtype`.
    pub(crate) fn array<'py>(
        py: Python<'py>,
        bytes: Buffer,
        dtype: &str,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyAny>> {
        let numpy = py.import("numpy")?;
        // NumPy refuses to read a buffer of no bytes.
        if bytes.is_empty() {
            return numpy.call_method1("empty", (shape.to_vec(), dtype));
        }
        let memory = Bound::new(py, Memory(bytes))?;
        numpy.call_method1("frombuffer", (memory, dtype))?.call_method1("reshape", (shape.to_vec(),))
    }
}

#[pymethods]
impl Memory {
    #[expect(unsafe_code, reason = "the protocol is one of raw pointers, which pyo3 passes on as they are")]
    unsafe fn __getbuffer__(slf: Bound<'_, Self>, view: *mut ffi::Py_buffer, flags: c_int) -> PyResult<()> {
        if view.is_null() {
            return Err(PyBufferError::new_err("there is no view to fill"));
        }
        let bytes: &Buffer = &slf.get().0;
        let length = ffi::Py_ssize_t::try_from(bytes.len())?;
        // SAFETY: the view is not null. It refers to bytes that `slf` owns and nobody changes (read-only is
        // 1), and holds a reference to `slf` until it is released.
        let filled = unsafe {
            ffi::PyBuffer_FillInfo(view, slf.as_ptr(), bytes.as_ptr().cast_mut().cast(), length, 1, flags)
        };
        if filled == -1 { Err(PyErr::fetch(slf.py())) } else { Ok(()) }
    }
}
