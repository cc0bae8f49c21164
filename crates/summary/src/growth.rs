//! The ruptures that grow from block 1, in whatever order they become known.

use asperity_record::Rupture;

/// Keeps the ruptures that include block 1 and reach farther than all before them that do: the
/// precursors, and the first slip of the whole slider, which ends them.
///
/// Ruptures are known once nothing can join them any more, which need not be in the order in which
/// they began. No more than one for each block is kept.
#[derive(Debug, Clone, Default)]
pub(crate) struct Growth {
    /// By onset, each farther than the one before it.
    farthest: Vec<Rupture>,
}

impl Growth {
    /// Takes the next rupture.
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

    /// The first of those that span this many blocks or more.
    pub(crate) fn first_over(&self, blocks: u32) -> Option<&Rupture> {
        self.farthest.iter().find(|rupture| rupture.last_block >= blocks)
    }
}

/// Of two that begin in one step, the one that was known first.
fn starts(rupture: &Rupture) -> (u64, u64) {
    (rupture.onset_step, rupture.rupture)
}
