//! The threads of a single run of a large body: one for each core, which compute parts of its steps.
//!
//! The solver works on one of these threads ([`Pool::lead`]). Each thread takes its own part of a step, whose nodes
//! are in the cache of its core. What another has not begun by then, it computes as well. So on a busy machine
//! nobody waits for a thread to wake up.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::thread;

use asperity_model::Plan;
use asperity_simulator::{Crew, most_threads};
use rayon::{ThreadPool, ThreadPoolBuilder, current_thread_index};

/// Such threads.
#[derive(Debug)]
pub(crate) struct Pool(ThreadPool);

impl Pool {
    /// As many as there are cores, or as the steps of a plan have parts; `None` if that is one, or if the system
    /// grants no threads.
    pub(crate) fn of(plan: &Plan) -> Option<Pool> {
        let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
        Pool::with(cores.min(most_threads(plan)))
    }

    /// This number of threads.
    fn with(threads: usize) -> Option<Pool> {
        if threads < 2 {
            return None;
        }
        ThreadPoolBuilder::new().num_threads(threads).build().ok().map(Pool)
    }

    /// Calls a function on one of the threads.
    pub(crate) fn lead<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.0.install(work)
    }
}

impl Crew for Pool {
    fn threads(&self) -> usize {
        self.0.current_num_threads()
    }

    fn at_once(&self, parts: &mut [&mut (dyn FnMut() + Send)]) {
        let count = parts.len();
        let parts: Vec<_> = parts.iter_mut().map(|part| Mutex::new(Some(part))).collect();
        // Computes the part of the calling thread, or else the next that nobody has begun.
        let take = || {
            let own = current_thread_index().unwrap_or(0);
            let taken = (own..own + count)
                .find_map(|part| parts[part % count].lock().expect("nobody panics while taking").take());
            if let Some(part) = taken {
                part();
            }
        };
        self.0.scope(|scope| {
            for _ in 1..count {
                scope.spawn(|_| take());
            }
            take();
        });
    }
}

#[cfg(test)]
mod tests {
    use asperity_simulator::Crew;

    use super::Pool;

    #[test]
    fn each_part_is_computed_once() {
        for threads in [2, 3, 7] {
            let pool = Pool::with(threads).expect("the system has threads");
            assert_eq!(pool.threads(), threads);
            let mut counts = vec![0; threads];
            let mut parts: Vec<_> = counts.iter_mut().map(|count| move || *count += 1).collect();
            let mut parts: Vec<_> = parts.iter_mut().map(|part| part as &mut (dyn FnMut() + Send)).collect();
            pool.lead(|| (0..100).for_each(|_| pool.at_once(&mut parts)));
            // As well if no thread of the pool leads.
            pool.at_once(&mut parts);
            assert_eq!(counts, vec![101; threads]);
        }
        assert!(Pool::with(1).is_none());
    }
}
