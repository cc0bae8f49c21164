//! The two definitions of growth from block 1: among ruptures, which become known in any order, and among
//! slip events, one after the other.

use asperity_record::Reach;

/// The growing ruptures: those that include block 1 and reach farther than every rupture that does and
/// began before. They are the precursors, and the first rupture of the whole slider, which ends them. The
/// caller chooses the data to keep of each.
///
/// Ruptures become known once nothing can join them any more, not necessarily in the order of their onsets.
/// No more than one for each block is kept.
#[derive(Debug, Clone)]
pub struct RuptureGrowth<T> {
    /// By onset, each farther than the one before it.
    farthest: Vec<Grown<T>>,
}

#[derive(Debug, Clone)]
struct Grown<T> {
    starts: (u64, u64),
    to: u32,
    kept: T,
}

impl<T> Default for RuptureGrowth<T> {
    fn default() -> RuptureGrowth<T> {
        RuptureGrowth { farthest: Vec::new() }
    }
}

impl<T> RuptureGrowth<T> {
    /// Adds the next rupture, by the step of its onset and its number: of two with the same onset, the one
    /// that became known first comes first.
    pub fn take(&mut self, starts: (u64, u64), reach: Reach, keep: impl FnOnce() -> T) {
        let place = self.farthest.partition_point(|known| known.starts <= starts);
        let before = self.farthest[..place].last().map_or(0, |known| known.to);
        if reach.extends(before) {
            let shorter = self.farthest[place..].partition_point(|later| later.to <= reach.last);
            let new = Grown { starts, to: reach.last, kept: keep() };
            self.farthest.splice(place..place + shorter, [new]);
        }
    }

    /// By onset, the block that each reached and the data kept of it.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &T)> {
        self.farthest.iter().map(|grown| (grown.to, &grown.kept))
    }
}

/// The growing slip events, in the order of their onsets: a precursor starts at block 1 and runs
/// farther than any before it, until the whole slider has slid. Nothing is merged or dropped.
///
/// ```
/// use asperity_numbers::EventGrowth;
/// use asperity_record::Reach;
///
/// let mut growth = EventGrowth::new(100);
/// // First and last block, and how many blocks slid.
/// let slips = [(1, 5, 5), (40, 60, 21), (1, 3, 3), (1, 17, 17), (1, 100, 100), (1, 100, 100)];
/// let found = slips.map(|(first, last, slipped)| growth.extends(Reach { first, last }, slipped));
/// assert_eq!(found, [true, false, false, true, true, false]);
/// assert!(growth.is_over());
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct EventGrowth {
    blocks: u32,
    longest: u32,
    over: bool,
}

impl EventGrowth {
    /// For a slider of this many blocks.
    pub fn new(blocks: u32) -> EventGrowth {
        EventGrowth { blocks, ..EventGrowth::default() }
    }

    /// Whether the next slip event is a precursor, or the slip of the whole slider that ends
    /// them.
    pub fn extends(&mut self, reach: Reach, blocks_slipped: u32) -> bool {
        if self.over {
            return false;
        }
        self.over = blocks_slipped == self.blocks;
        // All blocks may slide after the last one already has.
        let extends = reach.extends(if self.over { 0 } else { self.longest });
        if extends {
            self.longest = reach.last;
        }
        extends
    }

    /// Whether the whole slider has slid, so that no precursor follows.
    pub fn is_over(&self) -> bool {
        self.over
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::Reach;

    use super::RuptureGrowth;

    /// Of two ruptures that begin in one step, the one with the lower number is first, in whatever order they
    /// become known.
    #[test]
    fn ruptures_of_one_step_grow_in_the_order_of_their_numbers() {
        let grown = |order: [usize; 2]| {
            let ruptures = [((5, 0), 3), ((5, 1), 2)];
            let mut growth = RuptureGrowth::default();
            for (starts, last) in order.map(|place| ruptures[place]) {
                growth.take(starts, Reach { first: 1, last }, || starts.1);
            }
            growth.iter().map(|(to, number)| (to, *number)).collect::<Vec<(u32, u64)>>()
        };
        assert_eq!([grown([0, 1]), grown([1, 0])], [[(3, 0)], [(3, 0)]]);
    }
}
