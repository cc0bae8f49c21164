//! Several things at once, one per core.

use std::num::NonZeroUsize;

use crate::exit::Failure;

/// Does something for all jobs, several at once ([`asperity_stream::at_once`]).
pub(crate) fn at_once<T: Sync>(
    jobs: &[T],
    workers: Option<NonZeroUsize>,
    each: impl Fn(&T) -> Result<(), Failure> + Sync,
) -> Result<(), Failure> {
    asperity_stream::at_once(jobs, workers, each).map(drop)
}
