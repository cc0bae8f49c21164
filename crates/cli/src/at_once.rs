//! Several things at once, one per core.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::exit::Failure;

/// Does something for all jobs, so many at once (one per core if not said). The
/// first failure keeps those that have not started from starting.
pub(crate) fn at_once<T: Sync>(
    jobs: &[T],
    workers: Option<NonZeroUsize>,
    each: impl Fn(&T) -> Result<(), Failure> + Sync,
) -> Result<(), Failure> {
    let workers = workers.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            each(job).inspect_err(|_| next.store(jobs.len(), Ordering::Relaxed))?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let outcomes: Vec<Result<(), Failure>> = threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect();
        outcomes.into_iter().collect()
    })
}
