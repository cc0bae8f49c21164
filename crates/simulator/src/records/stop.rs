//! How a caller has a solver return before its next record.

use std::cell::Cell;
use std::sync::OnceLock;

use asperity_model::Plan;

/// Single steps between two looks, times the numbers of a step: milliseconds.
const NUMBERS_BETWEEN_LOOKS: u64 = 1 << 22;

/// What a step costs besides its numbers, in numbers.
const NUMBERS_OF_A_STEP: u64 = 64;

/// A request to return. A solver looks at it after bounded work, counted in steps, and reads no clock. Once it has
/// come, it stays.
pub struct Stop<'a> {
    asks: &'a dyn Fn() -> bool,
    has_come: Cell<bool>,
}

impl<'a> Stop<'a> {
    /// It comes once `asks` returns true.
    pub fn when(asks: &'a dyn Fn() -> bool) -> Stop<'a> {
        Stop { asks, has_come: Cell::new(false) }
    }

    /// It never comes.
    pub fn never() -> Stop<'static> {
        Stop::when(&|| false)
    }

    /// Whether a look has found it.
    pub fn has_come(&self) -> bool {
        self.has_come.get()
    }

    /// Looks whether it has come.
    pub(crate) fn look(&self) -> bool {
        if !self.has_come() {
            self.has_come.set((self.asks)());
        }
        self.has_come()
    }

    /// What a cell holds, or what is found now; nothing, and nothing is held, once the stop has come.
    pub(crate) fn get_or_find<'c, T>(
        &self,
        cell: &'c OnceLock<Option<T>>,
        find: impl FnOnce() -> Option<T>,
    ) -> Option<&'c T> {
        if cell.get().is_none() {
            let found = find();
            if self.has_come() {
                return None;
            }
            // Another thread may have found the same.
            cell.set(found).ok();
        }
        cell.get()?.as_ref()
    }
}

/// Single steps between two looks; junctions count, since a step may visit all of them.
pub(crate) fn steps_between_looks(plan: &Plan) -> u64 {
    let junctions = plan.friction.law.junctions().map_or(0, |law| law.count * plan.blocks);
    let numbers = NUMBERS_OF_A_STEP + (plan.elastic.freedoms() + junctions) as u64;
    (NUMBERS_BETWEEN_LOOKS / numbers).max(1)
}
