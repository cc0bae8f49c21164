//! The progress of the creep front, and what it needs where friction weakens slowly with slip.

use asperity_model::theory::analytic::LengthLaw;
use asperity_model::theory::weakening::{Beginning, Weakening, creep_load_ratio};
use asperity_record::Contacts;

use crate::run_data::RunEvents;

/// The creep front over time: the farthest block such that it and all blocks before it have slid; over an
/// area the farthest column of which this is true of all contacts.
#[derive(Debug, Clone, Default)]
pub(crate) struct CreepFront {
    contacts: Contacts,
    slid: Vec<bool>,
    /// How many contacts of each column have not slid.
    left: Vec<u32>,
    /// The first step in which the front had reached a column, for each column that it reached; at most as
    /// many entries as columns.
    came: Vec<(u64, u32)>,
}

impl CreepFront {
    pub(crate) fn new(contacts: Contacts) -> CreepFront {
        CreepFront {
            contacts,
            slid: vec![false; contacts.count() as usize],
            left: vec![contacts.rows(); contacts.columns() as usize],
            came: Vec::new(),
        }
    }

    /// Records that a block begins to slide in a step.
    pub(crate) fn slides(&mut self, block: u32, step: u64) {
        if std::mem::replace(&mut self.slid[block as usize - 1], true) {
            return;
        }
        let column = self.contacts.column(block) as usize - 1;
        self.left[column] -= 1;
        let front = self.came.last().map_or(0, |(_, column)| *column as usize);
        if column == front {
            let more = self.left[front..].iter().take_while(|left| **left == 0).count();
            if more == 0 {
                return;
            }
            self.came.push((step, (front + more) as u32));
        }
    }

    /// The front before a step, or the present one for None.
    pub(crate) fn before(&self, step: Option<u64>) -> Option<u32> {
        let until = step.map_or(self.came.len(), |step| self.came.partition_point(|(came, _)| *came < step));
        self.came[..until].last().map(|(_, column)| *column)
    }
}

/// `d` over that below which slip of the first stretch of blocks beside a stuck one runs away.
pub(crate) fn over_critical(run: &RunEvents) -> Option<f64> {
    let stuck: Vec<u32> = run.scenario.friction.stuck_blocks.iter().map(|block| *block as u32).collect();
    let from = (1..).find(|block| !stuck.contains(block))?;
    let blocks = stuck.iter().find(|block| **block > from)? - from;
    let beginning = if from > 1 { Beginning::Stuck } else { Beginning::Free };
    let critical = beginning.critical_slip(blocks, crate::fronts::theory(run)?.top_stiffness);
    Some(Weakening::of(&run.plan)?.weakening_slip_ratio / critical)
}

/// The load over normal load at which a crack that follows a side drive reaches the middle block.
pub(crate) fn load_theory(run: &RunEvents) -> Option<f64> {
    let (friction, d) = (&run.plan.friction, Weakening::of(&run.plan)?.weakening_slip_ratio);
    let coefficients = [friction.static_coefficient, friction.dynamic_coefficient];
    let is_known =
        LengthLaw::is_for(&run.scenario) && run.scenario.drive.kind == asperity_model::DriveKind::Side;
    is_known.then(|| creep_load_ratio(run.header.blocks / 2, run.header.blocks, coefficients, d))
}

#[cfg(test)]
mod tests {
    use asperity_record::Contacts;

    use super::CreepFront;

    #[test]
    fn it_is_as_far_as_there_is_no_gap() {
        let mut front = CreepFront::new(Contacts::from(10));
        assert_eq!(front.before(None), None);
        for (block, step) in [(3, 5), (1, 10), (1, 11), (4, 20), (10, 21), (2, 30), (5, 40)] {
            front.slides(block, step);
        }
        assert_eq!(front.before(Some(10)), None);
        assert_eq!(front.before(Some(11)), Some(1));
        assert_eq!(front.before(Some(30)), Some(1));
        assert_eq!(front.before(Some(31)), Some(4));
        assert_eq!(front.before(None), Some(5));
    }

    /// Three columns of two rows, numbered 1 to 3 and 4 to 6.
    #[test]
    fn over_an_area_all_contacts_of_a_column_have_slid() {
        let mut front = CreepFront::new(Contacts::in_rows(6, 2).unwrap());
        let seen = [(1, 5), (2, 6), (5, 7), (6, 8), (4, 9), (3, 10)].map(|(contact, step)| {
            front.slides(contact, step);
            front.before(None)
        });
        assert_eq!(seen, [None, None, None, None, Some(2), Some(3)]);
        assert_eq!((front.before(Some(9)), front.before(Some(10))), (None, Some(2)));
    }
}
