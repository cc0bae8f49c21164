//! Converts panics of polars to errors.
//!
//! polars panics if a damaged file violates its assumptions, or if the system refuses the threads that it
//! starts at first use.

use std::cell::Cell;
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Once, OnceLock};

use polars::prelude::{DataFrame, NamedFrom, ParquetWriter, PolarsResult, Series};

thread_local! {
    /// Whether a panic of this thread is caught and returned as an error.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Calls polars and returns a panic's message as an error. Panics of other threads, and of this one at
/// other times, are reported as they always are.
pub(crate) fn guarded<T>(work: impl FnOnce() -> PolarsResult<T>) -> Result<PolarsResult<T>, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_GUARDED.get() {
                usual(info);
            }
        }));
    });
    IS_GUARDED.set(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    IS_GUARDED.set(false);
    outcome.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("it does not say at what").to_owned()
    })
}

/// Makes polars start its threads, unless they run already. Called before Parquet is written or read.
///
/// # Errors
/// If the system refuses threads, in words.
pub(crate) fn start_threads() -> Result<(), String> {
    static STARTED: OnceLock<Result<(), String>> = OnceLock::new();
    let start = || {
        guarded(|| {
            let column = Series::new("step".into(), [0_u64]).into();
            ParquetWriter::new(io::sink()).finish(&mut DataFrame::new_infer_height(vec![column])?)
        })
    };
    let started = STARTED.get_or_init(|| match start() {
        Ok(written) => written.map(drop).map_err(|error| error.to_string()),
        Err(panic) => Err(format!("failed to start the threads that tables need: {panic}")),
    });
    started.clone()
}

#[cfg(test)]
mod tests {
    use super::{guarded, start_threads};

    #[test]
    fn a_panic_of_polars_is_an_error() {
        assert_eq!(guarded::<()>(|| panic!("row {}", 7)).unwrap_err(), "row 7");
        assert_eq!(guarded(|| Ok(7)).unwrap().unwrap(), 7);
        assert_eq!(start_threads(), Ok(()));
    }
}
