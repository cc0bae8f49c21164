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
//! 1000 blocks. There a single step takes 34 ns and 0.75 ns for every block, and other sweeps over
//! the blocks stand to it as told below.

use asperity_model::Plan;

use crate::basis::GRID_STEPS;

/// Steps that leaps have saved are remembered up to so many: some milliseconds. More would be
/// spent in vain on a chain that begins to chatter after a long rest.
pub(crate) const MOST_SAVED_STEPS: u64 = 1 << 16;

/// What a run may spend before anything is saved: a fraction of a millisecond.
pub(crate) const FIRST_SAVED_STEPS: u64 = 1 << 12;

/// How many single steps follow each step that was spent and not saved before.
const PAUSE: u64 = 48;

/// Foreseeing the next switch from two steps.
pub(crate) const FORESIGHT_STEPS: u64 = 1;

/// Asking for how long a chain rests that nothing moves in, and landing at the end of it.
pub(crate) const REST_STEPS: u64 = 3;

/// Of both ends of a span of the energies, beside what every order takes.
const SPAN_STEPS: u64 = 4;

/// Of both, for every order of the work of the scheme.
const SPAN_STEPS_PER_ORDER: u64 = 7;

/// First differences of a window, with the foresight that led to it, its bounds, and its landing.
const WINDOW_STEPS: u64 = 6;

/// Two terms of a window, and what they add to bounds and landing.
const STEPS_OF_TWO_TERMS: u64 = 3;

/// So many blocks take as long in a step as what a step takes besides: with as many, a block that is
/// followed alone to one place takes one step.
const BLOCKS_OF_A_PLACE: u64 = 45;

/// Asking whether the quasi-static part allows a jump.
pub(crate) const QUASI_STATIC_STEPS: u64 = 6;

/// Attempts at a jump, beside those that even the quasi-static part does not allow: stored modes
/// take the square of the blocks, in steps of so many blocks.
const JUMP_STEPS: u64 = 8;

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
        let places = 2 * work.places * BLOCKS_OF_A_PLACE / (BLOCKS_OF_A_PLACE + self.blocks);
        // A logarithm for each block.
        let age = if self.ages { 20 * self.blocks / (BLOCKS_OF_A_PLACE + self.blocks) } else { 0 };
        WINDOW_STEPS + work.terms * STEPS_OF_TWO_TERMS / 2 + places + age
    }

    /// A state inside a window, and the steps from there to the one that is to be recorded.
    pub(crate) fn window_sample_steps(self, work: Work) -> u64 {
        GRID_STEPS / 2 + work.terms / 3
    }

    /// Taking a state apart into stored modes, or putting it together again.
    pub(crate) fn modes_steps(self) -> u64 {
        JUMP_STEPS + 3 * self.blocks * self.blocks / (BLOCKS_OF_A_PLACE + self.blocks)
    }

    /// Whether finding all modes of the chain is worth it in a run of so many steps.
    pub(crate) fn all_modes_pay(self, steps: u64) -> bool {
        let cost_steps = 5 * self.blocks.pow(3) / (BLOCKS_OF_A_PLACE + self.blocks);
        cost_steps <= MODES_FOR_FREE_STEPS.max(steps / PAUSE)
    }
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
