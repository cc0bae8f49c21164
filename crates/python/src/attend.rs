//! Does work on a thread of its own without the interpreter's lock, and meanwhile heeds signals, reports
//! progress and asks whether to stop, all on the thread of the caller.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::ffi::{PyThread_get_thread_ident, PyThreadState_SetAsyncExc};
use pyo3::prelude::*;

use crate::errors::failed;

/// How often signals are looked at.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// The shared state of work and whoever waits for it.
#[derive(Default)]
pub(crate) struct Watch {
    is_stopped: AtomicBool,
    /// Whether the work has ended.
    is_over: AtomicBool,
    /// The amount of work done.
    pub(crate) done: AtomicU64,
    /// The thread of the work while it runs Python code, by Python's number; 0 otherwise. Only changes under the
    /// interpreter's lock.
    in_python: AtomicUsize,
    /// Why Python code, called by the work, stopped it.
    raised: Mutex<Option<PyErr>>,
}

impl Watch {
    /// Whether the work is to end.
    pub(crate) fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }

    /// Stops the work, since Python code called by it raised an exception; the caller receives the first.
    pub(crate) fn raise(&self, error: PyErr) {
        let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        raised.get_or_insert(error);
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Calls Python code from the work, in which Ctrl-C raises `KeyboardInterrupt`.
    #[expect(unsafe_code, reason = "pyo3 has no other name for the number of a thread")]
    pub(crate) fn call<T>(&self, code: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
        // SAFETY: it only asks which thread this is.
        let thread = unsafe { PyThread_get_thread_ident() };
        self.in_python.store(thread as usize, Ordering::Relaxed);
        let called = code();
        self.in_python.store(0, Ordering::Relaxed);
        called
    }

    /// Raises `KeyboardInterrupt` in Python code that the work runs, which may never end by itself.
    #[expect(unsafe_code, reason = "pyo3 has no other name for an exception in another thread")]
    fn interrupt(&self, py: Python<'_>) {
        let thread = self.in_python.load(Ordering::Relaxed);
        if thread != 0 {
            let exception = py.get_type::<PyKeyboardInterrupt>();
            // SAFETY: the interpreter's lock is held, and the exception is a class.
            unsafe { PyThreadState_SetAsyncExc(thread as _, exception.as_ptr()) };
        }
    }
}

/// The callbacks of a caller.
#[derive(Default)]
pub(crate) struct Callbacks<'py> {
    /// Called with the amounts of work done and in all.
    progress: Option<Bound<'py, PyAny>>,
    /// Stops the work once it returns true.
    stop: Option<Bound<'py, PyAny>>,
    /// The amount of work in all.
    total: u64,
}

impl<'py> Callbacks<'py> {
    /// With a bar of the package for `True` as progress, and a function as it is.
    pub(crate) fn new(
        py: Python<'py>,
        name: &str,
        progress: Option<Bound<'py, PyAny>>,
        stop: Option<Bound<'py, PyAny>>,
        total: u64,
    ) -> PyResult<Callbacks<'py>> {
        let progress = match progress {
            Some(progress) if progress.is_callable() => Some(progress),
            Some(progress) if progress.is_truthy()? => {
                Some(py.import("asperity.progress")?.getattr("Bar")?.call1((name,))?)
            }
            _ => None,
        };
        Ok(Callbacks { progress, stop, total })
    }
}

/// Does the work. It polls [`Watch::is_stopped`].
///
/// # Errors
/// The exception of a signal (`KeyboardInterrupt`), of a callback, or of Python code called by the work; the
/// work has then ended as if stopped.
pub(crate) fn attend<T: Send>(
    py: Python<'_>,
    callbacks: &Callbacks<'_>,
    work: impl FnOnce(&Arc<Watch>) -> T + Send,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let caller = thread::current();
    let result = thread::scope(|scope| {
        let work = || {
            let result = work(&watch);
            watch.is_over.store(true, Ordering::Relaxed);
            caller.unpark();
            result
        };
        let worker = thread::Builder::new()
            .spawn_scoped(scope, work)
            .map_err(|error| failed(format!("failed to start a thread: {error}")))?;
        let wait = || {
            thread::park_timeout(LOOK_INTERVAL);
            watch.is_over.load(Ordering::Relaxed) || worker.is_finished()
        };
        while !py.detach(wait) {
            let looked = if watch.is_stopped() { py.check_signals() } else { look(py, callbacks, &watch) };
            if let Err(error) = looked {
                watch.raise(error);
                watch.interrupt(py);
            }
        }
        Ok::<_, PyErr>(py.detach(|| worker.join()).unwrap_or_else(|panic| resume_unwind(panic)))
    })?;
    let raised = watch.raised.lock().unwrap_or_else(PoisonError::into_inner).take();
    match raised {
        Some(error) => Err(error),
        None => {
            report(callbacks, callbacks.total)?;
            Ok(result)
        }
    }
}

fn look(py: Python<'_>, callbacks: &Callbacks<'_>, watch: &Watch) -> PyResult<()> {
    py.check_signals()?;
    report(callbacks, watch.done.load(Ordering::Relaxed))?;
    if let Some(stop) = &callbacks.stop
        && stop.call0()?.is_truthy()?
    {
        watch.is_stopped.store(true, Ordering::Relaxed);
    }
    Ok(())
}

fn report(callbacks: &Callbacks<'_>, done: u64) -> PyResult<()> {
    callbacks.progress.as_ref().map_or(Ok(()), |progress| progress.call1((done, callbacks.total)).map(drop))
}
