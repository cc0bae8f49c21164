//! Counts events of contacts without load, which are not slip.

use std::collections::BTreeSet;

use asperity_record::{Direction, StepRecord, Switch};

/// Follows the detachments of contacts without load.
///
/// A contact without load, such as one of a slab that has lifted off, has a threshold of 0. It
/// detaches in every step in which it sticks, and moves without friction: formally a slip event,
/// but without rubbing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unloaded {
    contacts: BTreeSet<u32>,
    detachments: u64,
    events: u64,
    /// Whether a contact with load has detached in the current slip event; None without an event.
    bears: Option<bool>,
    /// Whether a contact slid in the last record.
    slides: bool,
}

impl Unloaded {
    /// Adds a record.
    pub(crate) fn take(&mut self, record: &StepRecord) {
        self.slides = record.sliding > 0;
        if !self.slides {
            self.events += u64::from(self.bears.take() == Some(false));
        }
        // What sensors saw bears a load that is not known.
        let detaches = |switch: &&Switch| switch.direction == Direction::Detach && switch.measured.is_none();
        for switch in record.switches.iter().filter(detaches) {
            let bears = switch.threshold_n > 0.0;
            self.bears = Some(self.bears.unwrap_or_default() || bears);
            if !bears {
                self.detachments += 1;
                self.contacts.insert(switch.block);
            }
        }
    }

    /// The numbers of contacts, detachments and slip events without load in a finished run.
    pub(crate) fn counts(&self) -> [u64; 3] {
        // Blocks that detached in the last step have not slid.
        let last = u64::from(self.slides && self.bears == Some(false));
        [self.contacts.len() as u64, self.detachments, self.events + last]
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{Direction, StepRecord, Switch};
    use asperity_testkit::{quiet_step, switch};

    use super::Unloaded;

    fn record(step: u64, sliding: u32, switches: &[(u32, Direction, f64)]) -> StepRecord {
        let of = |&(block, direction, threshold_n): &(u32, Direction, f64)| Switch {
            threshold_n,
            ..switch(block, direction)
        };
        StepRecord {
            sliding,
            switches: switches.iter().map(of).collect(),
            ..quiet_step(step, step as f64, 0.4)
        }
    }

    #[test]
    fn events_without_load_are_those_in_which_no_contact_bears() {
        use Direction::{Attach, Detach};
        let mut unloaded = Unloaded::default();
        for record in [
            // Block 2 alone is in the air.
            record(1, 0, &[(2, Detach, 0.0)]),
            record(2, 1, &[(2, Attach, 0.0)]),
            // Again, together with block 3, which carries load.
            record(3, 0, &[(2, Detach, 0.0)]),
            record(4, 1, &[(3, Detach, 1.5)]),
            record(5, 2, &[(2, Attach, 0.0), (3, Attach, 1.5)]),
            record(6, 0, &[]),
            // The run ends while block 1 moves in the air.
            record(7, 0, &[(1, Detach, 0.0)]),
            record(8, 1, &[]),
        ] {
            unloaded.take(&record);
        }
        assert_eq!(unloaded.counts(), [2, 3, 2]);
        // After its last step there is no event.
        unloaded.take(&record(9, 1, &[(1, Attach, 0.0)]));
        unloaded.take(&record(10, 0, &[(1, Detach, 0.0)]));
        assert_eq!(unloaded.counts(), [2, 4, 2]);
    }
}
