//! Recordings of laboratories, of files and of arrays of NumPy.

use std::ffi::CString;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use asperity_recording::input::Given;
use asperity_recording::{Description, Recording, RecordingError, npy_head};
use asperity_run::stream::StreamError;
use asperity_run::write_recording;
use asperity_runlog::Existing;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyMemoryView, PySlice, PyTuple};

use crate::attend::{Callbacks, attend};
use crate::errors::{error, failed, refused};
use crate::run::{Run, absolute, open_with};

/// The bytes of an array behind those of a header, read where they are, a block at a time. The interpreter waits
/// meanwhile.
#[derive(Clone)]
struct Bytes {
    header: Arc<[u8]>,
    /// A view of single bytes.
    data: Arc<Py<PyAny>>,
    bytes: usize,
    at: usize,
}

impl Read for Bytes {
    fn read(&mut self, block: &mut [u8]) -> io::Result<usize> {
        let count = if let Some(rest) = self.header.get(self.at..).filter(|rest| !rest.is_empty()) {
            (&*rest).read(block)?
        } else {
            let from = self.at - self.header.len();
            Python::attach(|py| {
                let range = PySlice::new(py, from as isize, (from + block.len()) as isize, 1);
                let bytes = self.data.bind(py).get_item(range)?.call_method0("tobytes")?;
                (bytes.cast::<PyBytes>()?.as_bytes()).read(block).map_err(PyErr::from)
            })
            .map_err(|error| io::Error::other(error.to_string()))?
        };
        self.at += count;
        Ok(count)
    }
}

impl Seek for Bytes {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let end = (self.header.len() + self.bytes) as i64;
        let at = match to {
            SeekFrom::Start(at) => at as i64,
            SeekFrom::End(by) => end + by,
            SeekFrom::Current(by) => self.at as i64 + by,
        };
        self.at = at.clamp(0, end) as usize;
        Ok(self.at as u64)
    }
}

/// An array as the bytes of its file.
fn in_memory(array: &Bound<'_, PyAny>) -> PyResult<Bytes> {
    let flags = array.getattr("flags")?;
    let is_fortran = !flags.getattr("c_contiguous")?.extract::<bool>()?;
    if is_fortran && !flags.getattr("f_contiguous")?.extract::<bool>()? {
        return Err(refused("its numbers are apart (accepted: numpy.ascontiguousarray of it)"));
    }
    let numbers: String = array.getattr("dtype")?.getattr("str")?.extract()?;
    let shape = array.getattr("shape")?.cast_into::<PyTuple>()?.repr()?;
    let header = npy_head(&numbers, is_fortran, &shape.to_string());
    let by_rows = if is_fortran { array.getattr("T")? } else { array.clone() };
    let data = PyMemoryView::from(&by_rows)?.call_method1("cast", ("B",))?;
    let (bytes, data) = (data.len()?, Arc::new(data.unbind()));
    Ok(Bytes { header: header.into(), data, bytes, at: 0 })
}

/// In which progress is counted, since how many samples there are is known late.
const THOUSANDTHS: u64 = 1000;

/// Reads a recording into a log, as `asperity recording read` does, and opens it.
///
/// `toml` is the path of its description or the text, as `asperity recording show` prints one; paths in a text count from
/// the working folder. `arrays` are arrays of NumPy by the names that files have in the description: they are read in
/// place of these, without a copy. `log` is the path of a new run log (MCAP). `progress` and `stop` are those of `run`,
/// but that progress is in thousandths.
///
/// Raises `Refused` for a recording that is not accepted, with what is wrong and where.
#[pyfunction]
#[pyo3(signature = (toml, arrays = None, *, log, progress = None, stop = None))]
pub(crate) fn recording(
    py: Python<'_>,
    toml: &Bound<'_, PyAny>,
    arrays: Option<&Bound<'_, PyDict>>,
    log: PathBuf,
    progress: Option<Bound<'_, PyAny>>,
    stop: Option<Bound<'_, PyAny>>,
) -> PyResult<Py<Run>> {
    let log = absolute(log)?;
    let of_text = toml.extract::<String>().ok().filter(|text| text.contains('\n'));
    let described = match of_text {
        Some(text) => Description::parse(Path::new("recording.toml"), &text),
        None => Description::read(&toml.extract::<PathBuf>()?),
    };
    let description = described.map_err(|error| refused(error.to_string()))?;
    let mut given = Given::new();
    for (name, array) in arrays.into_iter().flatten() {
        let name: String = name.extract()?;
        let array = in_memory(&array).map_err(|error| refused(format!("arrays[{name:?}]: {error}")))?;
        given.insert(name, Arc::new(move || Box::new(array.clone())));
    }
    let name = description.name.clone();
    let callbacks = Callbacks::new(py, &name, progress, stop, THOUSANDTHS)?;
    let written = attend(py, &callbacks, |watch| {
        let recording = Recording::of_given(description, given).map_err(StreamError::Source)?;
        let found = recording.read(&|done, of| {
            watch.done.store(done * THOUSANDTHS / of.max(1), Ordering::Relaxed);
            watch.is_stopped()
        });
        let mut found = found.map_err(StreamError::Source)?;
        let recorded = recording.recorded(&mut found);
        let warnings: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
        let stop = || watch.is_stopped();
        let records = recording.records(&mut found, &stop);
        write_recording(recorded, &log, Existing::Refuse, records).map(|_| warnings)
    })?;
    let warnings = written.map_err(|why| match why {
        StreamError::Source(RecordingError::Interrupted) => error("Interrupted", "no log was written"),
        StreamError::Source(why) => refused(why.to_string()),
        why => failed(why),
    })?;
    for warning in warnings {
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(warning)?, 1)?;
    }
    open_with(py, log, Vec::new())
}
