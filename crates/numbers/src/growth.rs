//! Selects the growing ruptures from block 1, in whatever order they become known.

use asperity_record::Reach;

/// Keeps of the ruptures that include block 1 and reach farther than all before them that do what
/// somebody wants of them: of the precursors, and of the first slip of the whole slider, which ends
/// them.
///
/// Ruptures are known once nothing can join them any more, which need not be in the order in which
/// they began. No more than one for each block is kept.
#[derive(Debug, Clone)]
pub struct Growth<T> {
    /// By onset, each farther than the one before it.
    farthest: Vec<Grown<T>>,
}

#[derive(Debug, Clone)]
struct Grown<T> {
    starts: (u64, u64),
    to: u32,
    kept: T,
}

impl<T> Default for Growth<T> {
    fn default() -> Growth<T> {
        Growth { farthest: Vec::new() }
    }
}

impl<T> Growth<T> {
    /// Takes the next rupture, by the step of its onset and its number: of two that begin in one
    /// step, the one that was known first comes first.
    pub fn take(&mut self, starts: (u64, u64), reach: Reach, keep: impl FnOnce() -> T) {
        let place = self.farthest.partition_point(|known| known.starts <= starts);
        let before = self.farthest[..place].last().map_or(0, |known| known.to);
        if reach.extends(before) {
            let shorter = self.farthest[place..].partition_point(|later| later.to <= reach.last);
            let new = Grown { starts, to: reach.last, kept: keep() };
            self.farthest.splice(place..place + shorter, [new]);
        }
    }

    /// By onset, the block that each reached and what is kept of it.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &T)> {
        self.farthest.iter().map(|grown| (grown.to, &grown.kept))
    }
}
