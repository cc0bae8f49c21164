//! Runs jobs in parallel and returns their results in the order of the jobs.

use std::num::NonZeroUsize;
use std::panic;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Runs `work` on every job, on this many threads (None for one per core), and returns the results
/// in the order of the jobs. Jobs start in their order, each as soon as a thread is free.
///
/// ```
/// let squares = asperity_files::at_once(&[1, 2, 3], None, |n| Ok::<_, String>(n * n));
/// assert_eq!(squares, Ok(vec![1, 4, 9]));
/// ```
///
/// # Errors
/// The first failure in the order of the jobs. No job starts after a failure.
pub fn at_once<Job: Sync, Done: Send, Error: Send>(
    jobs: &[Job],
    workers: Option<NonZeroUsize>,
    work: impl Fn(&Job) -> Result<Done, Error> + Sync,
) -> Result<Vec<Done>, Error> {
    let workers = workers.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<Result<Done, Error>>>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    let take_jobs = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(index) else { return };
            let result = work(job);
            if result.is_err() {
                next.store(jobs.len(), Ordering::Relaxed);
            }
            *results[index].lock().expect("no thread panics with the lock") = Some(result);
        }
    };
    thread::scope(|scope| {
        // If the system grants fewer threads, those do all jobs; without any, this thread does.
        let spawn = |_| thread::Builder::new().spawn_scoped(scope, take_jobs).ok();
        let threads: Vec<_> = (0..workers.min(jobs.len())).map_while(spawn).collect();
        if threads.is_empty() {
            take_jobs();
        }
        for thread in threads {
            if let Err(panic) = thread.join() {
                panic::resume_unwind(panic);
            }
        }
    });
    results
        .into_iter()
        .filter_map(|result| result.into_inner().expect("no thread panics with the lock"))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;
    use std::sync::Mutex;

    use super::at_once;

    #[test]
    fn results_keep_the_order_of_the_jobs() {
        let jobs: Vec<u32> = (0..200).collect();
        for workers in [None, NonZeroUsize::new(1), NonZeroUsize::new(7)] {
            let doubled: Result<Vec<u32>, String> = at_once(&jobs, workers, |job| Ok(job * 2));
            assert_eq!(doubled.unwrap(), jobs.iter().map(|job| job * 2).collect::<Vec<_>>());
        }
        assert_eq!(at_once(&[], None, |_: &u32| Ok::<(), ()>(())), Ok(Vec::new()));
    }

    #[test]
    fn the_first_failure_is_reported_and_keeps_others_from_starting() {
        let jobs: Vec<u32> = (0..200).collect();
        let failed = at_once(&jobs, None, |job| if job % 50 == 49 { Err(*job) } else { Ok(()) });
        assert_eq!(failed.unwrap_err() % 50, 49);

        let begun = Mutex::new(Vec::new());
        let one = NonZeroUsize::new(1);
        let failed = at_once(&jobs, one, |job| {
            begun.lock().unwrap().push(*job);
            if *job == 3 { Err("three") } else { Ok(()) }
        });
        assert_eq!(failed, Err("three"));
        assert_eq!(begun.into_inner().unwrap(), [0, 1, 2, 3]);
    }

    #[test]
    #[should_panic(expected = "the job's own words")]
    fn a_panic_of_a_job_is_passed_on() {
        let done = at_once(&[1], None, |_| -> Result<(), ()> { panic!("the job's own words") });
        assert_eq!(done, Ok(vec![()]));
    }
}
