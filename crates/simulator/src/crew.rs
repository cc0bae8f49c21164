//! Threads that compute parts of a step at once.
//!
//! This crate starts no threads: whoever starts a solver may hand in a [`Crew`]. A large body is cut into chunks of
//! its nodes, whatever the crew. Each chunk is computed by one thread, in the order in which any other would, and
//! sums over chunks are added in the order of the chunks. Therefore results do not depend on the crew, to the bit.
//!
//! In every step, a thread has the same chunks, so that its core keeps their nodes in its cache: without that, two
//! cores are no faster than one.

use std::fmt::Debug;
use std::ops::Range;

use asperity_model::{Elastic, Lattice, Plan};

/// Threads that work for a solver.
pub trait Crew: Debug + Send + Sync {
    /// How many parts it can compute at once.
    fn threads(&self) -> usize;

    /// Computes all parts, at most one for each thread, and returns after the last. The order does not matter to the
    /// result; it is fastest if the same thread takes the same number of part each time.
    fn at_once(&self, parts: &mut [&mut (dyn FnMut() + Send)]);
}

/// The calling thread alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alone;

impl Crew for Alone {
    fn threads(&self) -> usize {
        1
    }

    fn at_once(&self, parts: &mut [&mut (dyn FnMut() + Send)]) {
        parts.iter_mut().for_each(|part| part());
    }
}

/// Fewest nodes of a body that is cut into chunks: with a third as many, a run by jumps takes longer with two threads
/// than with one.
const FEWEST_NODES: usize = 40_000;

/// Nodes of a chunk, about.
const NODES_OF_CHUNK: usize = 2_000;

/// Number of threads that a run can use within its steps; 1 if it is too small.
pub fn most_threads(plan: &Plan) -> usize {
    match &plan.elastic {
        Elastic::Chain(_) => 1,
        Elastic::Lattice(lattice) => chunks_of(lattice).len(),
    }
}

/// The nodes of each chunk of a lattice, which are whole lines.
pub(crate) fn chunks_of(lattice: &Lattice) -> Vec<Range<usize>> {
    let (nodes, columns) = (lattice.nodes(), lattice.columns);
    let is_cut = lattice.has_lines() && nodes >= FEWEST_NODES;
    let lines = nodes / columns;
    let count = if is_cut { (nodes / NODES_OF_CHUNK).min(lines) } else { 1 };
    (0..count).map(|n| n * lines / count * columns..(n + 1) * lines / count * columns).collect()
}

/// Computes each chunk, at once if the crew has several threads.
pub(crate) fn each<Chunk: Send>(
    crew: &dyn Crew,
    chunks: impl Iterator<Item = Chunk>,
    compute: impl Fn(&mut Chunk) + Sync,
) {
    let mut chunks: Vec<Chunk> = chunks.collect();
    let of_part = chunks.len().div_ceil(crew.threads());
    let mut parts: Vec<_> =
        chunks.chunks_mut(of_part).map(|part| || part.iter_mut().for_each(&compute)).collect();
    let mut parts: Vec<_> = parts.iter_mut().map(|part| part as &mut (dyn FnMut() + Send)).collect();
    crew.at_once(&mut parts);
}
