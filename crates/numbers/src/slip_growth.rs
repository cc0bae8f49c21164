//! How the longest slip event so far tells precursors from others, one event at a time.

use asperity_record::Reach;

/// Tells precursors from other slip events as they go by, in the order of their onsets: a
/// precursor starts at block 1 and runs farther than any before it, until the whole slider
/// has slid. This is the rule for slip events one by one, nothing merged or dropped.
///
/// ```
/// use asperity_numbers::precursors::Growth;
/// use asperity_record::Reach;
///
/// let mut growth = Growth::new(100);
/// // First and last block, and how many blocks slid.
/// let slips = [(1, 5, 5), (40, 60, 21), (1, 3, 3), (1, 17, 17), (1, 100, 100), (1, 100, 100)];
/// let found = slips.map(|(first, last, slipped)| growth.extends(Reach { first, last }, slipped));
/// assert_eq!(found, [true, false, false, true, true, false]);
/// assert!(growth.is_over());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Growth {
    blocks: u32,
    longest: u32,
    over: bool,
}

impl Growth {
    /// For a slider of this many blocks.
    pub fn new(blocks: u32) -> Growth {
        Growth { blocks, longest: 0, over: false }
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
