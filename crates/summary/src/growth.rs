//! Selects the growing ruptures from block 1, in whatever order they become known.

use asperity_record::Rupture;

/// Keeps the ruptures that include block 1 and reach farther than all earlier ones that do: the
/// precursors, and the first slip of the whole slider, which ends them.
///
/// Ruptures become known when nothing can join them any more, possibly in another order than that
/// of their onsets. Keeps at most one per block.
#[derive(Debug, Clone, Default)]
pub(crate) struct Growth {
    /// By onset, each farther than the previous one.
    farthest: Vec<Rupture>,
}

impl Growth {
    /// Adds a rupture.
    pub(crate) fn take(&mut self, rupture: &Rupture) {
        if rupture.first_block != 1 {
            return;
        }
        let place = self.farthest.partition_point(|known| starts(known) <= starts(rupture));
        if place > 0 && self.farthest[place - 1].last_block >= rupture.last_block {
            return;
        }
        let shorter = self.farthest[place..].partition_point(|later| later.last_block <= rupture.last_block);
        self.farthest.splice(place..place + shorter, [rupture.clone()]);
    }

    /// The precursors, by onset.
    pub(crate) fn precursors(&self) -> impl Iterator<Item = &Rupture> {
        self.farthest.iter().filter(|rupture| !rupture.reached_every_block)
    }

    /// The first of them that spans at least this many blocks.
    pub(crate) fn first_over(&self, blocks: u32) -> Option<&Rupture> {
        self.farthest.iter().find(|rupture| rupture.last_block >= blocks)
    }
}

/// The sort key; of two that begin in one step, the one known first precedes.
fn starts(rupture: &Rupture) -> (u64, u64) {
    (rupture.onset_step, rupture.rupture)
}
