//! What the fast solver's means cost, in single steps, and how it keeps accounts of that.
//!
//! Whatever saves steps costs something, also where it saves none: windows that are not certified
//! or shorter than their terms, jumps that are refused, spans of the energies that end soon. All of
//! it is paid from what leaps have saved, up to [`MOST_SAVED_STEPS`]. Once that is used up, whatever
//! costs so many steps more is followed by [`PAUSE`] times as many single steps with nothing beside
//! them. So a run takes at most the time of all its steps one by one, a share of `1 / PAUSE` more,
//! and that of [`MOST_SAVED_STEPS`], however its blocks switch; and where leaps pay, the accounts
//! change nothing.
//!
//! Costs are counted in what is done, never in time: a run is cut up, and rounds, in the same way
//! on every machine. What each costs was measured on one with 512-bit vectors, for chains of 2 to
//! 1000 blocks. There a single step takes 34 ns and 0.75 ns for every block, and other loops over
//! the blocks stand to it as told below.

use asperity_model::Plan;

use crate::chebyshev::GRID_STEPS;

/// Chains of more blocks are long: their modes are not stored, which would take memory as the square
/// of the blocks, and whatever loops over all blocks in vain is not even tried.
pub(crate) const LONG_CHAIN: usize = 256;

/// Steps that leaps have saved are remembered up to so many: some milliseconds. More would be
/// spent in vain on a chain that begins to chatter after a long rest.
pub(crate) const MOST_SAVED_STEPS: u64 = 1 << 16;

/// What a run may spend before anything is saved: a fraction of a millisecond.
pub(crate) const FIRST_SAVED_STEPS: u64 = 1 << 12;

/// How many single steps follow each step that was spent and not saved before.
const PAUSE: u64 = 96;

/// All modes of a chain are found if that takes no more than such a part of a run's steps.
const RUNS_OF_MODES: u64 = 48;

/// Foreseeing the next switch from two steps.
pub(crate) const FORESIGHT_STEPS: u64 = 1;

/// Asking for how long a chain rests that nothing moves in, and landing at the end of it.
pub(crate) const REST_STEPS: u64 = 3;

/// Of both ends of a span of the energies, beside what every order takes.
const SPAN_STEPS: u64 = 4;

/// Of both, for every order of the work of the scheme.
const SPAN_STEPS_PER_ORDER: u64 = 7;

/// Where no switch is foreseen for longer, a span takes less than adding up single steps.
pub(crate) const STEPS_WORTH_A_SPAN: f64 = 100.0;

/// First differences of a window, with the foresight that led to it, its bounds, and its landing.
const WINDOW_STEPS: u64 = 7;

/// Four terms of a window, and what they add to bounds and landing.
const STEPS_OF_FOUR_TERMS: u64 = 5;

/// Terms of longer chains than this do not stay in the processor's nearer memory, and take twice as
/// long beside steps.
const BLOCKS_AT_HAND: u64 = 1500;

/// A step takes as long for so many blocks as it takes besides.
const BLOCKS_OF_A_CALL: u64 = 45;

/// Following a block alone to one place, in the time of so many blocks in a step.
const BLOCKS_OF_A_PLACE: u64 = 60;

/// The logarithm by which a block ages, in the same unit.
const BLOCKS_OF_AN_AGE: u64 = 20;

/// Asking whether the quasi-static part allows a jump.
pub(crate) const QUASI_STATIC_STEPS: u64 = 6;

/// Attempts at a jump, beside those that even the quasi-static part does not allow: stored modes
/// take the square of the blocks, in steps of so many blocks.
const JUMP_STEPS: u64 = 8;

/// Taking the state of a long chain apart into waves, or putting it together again, for every power
/// of two in its blocks.
const WAVE_STEPS: u64 = 8;

/// Asking waves how large they will be after so many steps.
pub(crate) const CALM_STEPS: u64 = 5;

/// What it takes to find all of them.
const STEPS_OF_ALL_WAVES: u64 = 16_000;

/// Modes that take no longer than this are found in any case: some milliseconds.
const MODES_FOR_FREE_STEPS: u64 = 40_000;

/// What opening a window took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Work {
    /// Terms that were taken.
    pub(crate) terms: u64,
    /// Places that blocks were followed to one by one.
    pub(crate) places: u64,
}

/// The costs that depend on the chain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Costs {
    blocks: u64,
    ages: bool,
}

impl Costs {
    pub(crate) fn of(plan: &Plan) -> Costs {
        Costs { blocks: plan.blocks as u64, ages: plan.friction.ageing.is_some() }
    }

    /// A window with its landing, or one that was refused.
    pub(crate) fn window_steps(self, work: Work) -> u64 {
        let ages = if self.ages { self.blocks } else { 0 };
        let alone = work.places * BLOCKS_OF_A_PLACE + ages * BLOCKS_OF_AN_AGE;
        let of_four_terms = if self.blocks > BLOCKS_AT_HAND { 2 } else { 1 } * STEPS_OF_FOUR_TERMS;
        WINDOW_STEPS + work.terms * of_four_terms / 4 + alone / (BLOCKS_OF_A_CALL + self.blocks)
    }

    /// A state inside a window, and the steps from there to the one that is to be recorded.
    pub(crate) fn window_sample_steps(self, work: Work) -> u64 {
        GRID_STEPS / 2 + work.terms / 3
    }

    /// Taking a state apart into stored modes, or putting it together again.
    pub(crate) fn modes_steps(self) -> u64 {
        JUMP_STEPS + 3 * self.blocks * self.blocks / (BLOCKS_OF_A_CALL + self.blocks)
    }

    /// The same with waves.
    pub(crate) fn waves_steps(self) -> u64 {
        WAVE_STEPS * u64::from(self.blocks.max(1).ilog2())
    }

    /// Whether finding all modes of the chain is worth it in a run of so many steps: as they are
    /// stored, or as the waves that they are in long chains.
    pub(crate) fn all_modes_pay(self, steps: u64, are_stored: bool) -> bool {
        let cost_steps = match are_stored {
            true => 5 * self.blocks.pow(3) / (BLOCKS_OF_A_CALL + self.blocks),
            false => STEPS_OF_ALL_WAVES,
        };
        cost_steps <= MODES_FOR_FREE_STEPS.max(steps / RUNS_OF_MODES)
    }
}

/// A window, if terms took no longer than steps.
pub(crate) fn least_window_steps(work: Work) -> u64 {
    WINDOW_STEPS + work.terms
}

/// Both ends of a span of the energies.
pub(crate) fn span_steps(orders: usize) -> u64 {
    SPAN_STEPS + SPAN_STEPS_PER_ORDER * orders as u64
}

/// Adds what a leap has saved.
pub(crate) fn earn(saved_steps: &mut u64, steps: u64) {
    *saved_steps = saved_steps.saturating_add(steps).min(MOST_SAVED_STEPS);
}

/// Takes a cost from what was saved; what is missing.
pub(crate) fn pay(saved_steps: &mut u64, cost_steps: u64) -> u64 {
    let debt_steps = cost_steps.saturating_sub(*saved_steps);
    *saved_steps = saved_steps.saturating_sub(cost_steps);
    debt_steps
}

/// The single steps that make up for a debt.
pub(crate) fn pause_steps(debt_steps: u64) -> u64 {
    PAUSE.saturating_mul(debt_steps)
}

#[cfg(test)]
mod tests {
    use super::{FIRST_SAVED_STEPS, MOST_SAVED_STEPS, PAUSE, earn, pause_steps, pay};

    #[test]
    fn what_was_not_saved_is_a_small_share_of_all_steps() {
        // Tries of 50 steps' cost that save 60, 0 or 3 steps in turn.
        let (mut saved_steps, mut steps, mut spent_steps, mut covered_steps) = (FIRST_SAVED_STEPS, 0, 0, 0);
        for round in 0..10_000 {
            let covers = [60, 0, 3][round % 3];
            earn(&mut saved_steps, covers);
            let pause = pause_steps(pay(&mut saved_steps, 50));
            (steps, spent_steps, covered_steps) = (steps + pause, spent_steps + 50, covered_steps + covers);
        }
        let lost_steps = spent_steps - covered_steps;
        assert!(lost_steps <= FIRST_SAVED_STEPS + steps / PAUSE, "{lost_steps} of {steps}");
        assert!(steps > 1_000_000, "{steps}");
    }

    #[test]
    fn what_pays_is_never_paused_and_not_saved_for_ever() {
        let mut saved_steps = 0;
        for _ in 0..10_000 {
            earn(&mut saved_steps, 80);
            assert_eq!(pay(&mut saved_steps, 50), 0);
        }
        earn(&mut saved_steps, u64::MAX);
        assert_eq!(saved_steps, MOST_SAVED_STEPS);
        assert_eq!(pay(&mut saved_steps, MOST_SAVED_STEPS + 7), 7);
        assert_eq!((saved_steps, pause_steps(u64::MAX)), (0, u64::MAX));
    }
}
