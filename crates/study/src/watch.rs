//! Whoever waits for a study: hears of its progress, and may stop it.

use asperity_record::Observer;
use asperity_run::study::Job;

use crate::work::Made;

/// Whoever waits for a study. All threads call it.
pub trait Watcher: Sync {
    /// Whether to stop.
    fn is_stopped(&self) -> bool;

    /// A line for people, which is no error.
    fn note(&self, _line: &str) {}

    /// So many runs begin to be made, with this work in all, in block steps; 0 if all take the same.
    fn begin(&self, _runs: u64, _work: u64) {}

    /// What observes a run that has a name while it is made.
    fn run(&self, _job: &Job) -> Box<dyn Observer + '_> {
        Box::new(())
    }

    /// A run is over.
    fn over(&self, _made: &Made) {}

    /// All runs are over.
    fn end(&self) {}

    /// So many of these things are done; none is left after the last.
    fn reached(&self, _what: &str, _done: usize, _of: usize) {}
}
