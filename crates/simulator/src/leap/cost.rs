//! Cost model of the fast solver's shortcuts, in single steps, and its accounts.
//!
//! A shortcut costs time even where it saves no steps: windows that are refused or shorter than their
//! terms, refused jumps, short spans of the energies. All of this is paid from the steps that leaps have
//! saved, credited up to [`MOST_SAVED_STEPS`]. Once the credit is used up, each further step of cost is
//! followed by [`PAUSE`] single steps without shortcuts. So a run takes at most as long as all of its steps
//! singly, plus a share of `1 / PAUSE`, plus [`MOST_SAVED_STEPS`], however its blocks switch; where leaps
//! pay, the accounts change nothing.
//!
//! Costs are counted in operations, never in time, so that a run is divided, and rounds, in the same way
//! on every machine. The numbers were measured on a processor with 512-bit vectors, for chains of 2 to
//! 1000 blocks. A single step takes 34 ns and 0.75 ns per block there, and the constants below are
//! relative to that.

use asperity_model::Plan;

/// Steps between the numbers of steps for which coefficients are tabulated.
pub(crate) const GRID_STEPS: u64 = 12;

/// Chains of more blocks are long: their modes are not stored, since memory grows as the square of the
/// number of blocks, and loops over all blocks are tried only where they are likely to pay.
pub(crate) const LONG_CHAIN: usize = 256;

/// Most saved steps that are credited: some milliseconds. A larger credit could be wasted on a chain
/// that begins to chatter after a long rest.
pub(crate) const MOST_SAVED_STEPS: u64 = 1 << 16;

/// Credit at the start of a run: a fraction of a millisecond.
pub(crate) const FIRST_SAVED_STEPS: u64 = 1 << 12;

/// Single steps taken for each step of cost that no credit covers.
const PAUSE: u64 = 96;

/// All modes of a chain are computed if that costs at most one part in this many of a run's steps.
const RUNS_OF_MODES: u64 = 48;

/// Foreseeing the next switch from two steps.
pub(crate) const FORESIGHT_STEPS: u64 = 1;

/// Computing how long a chain stays at rest, and advancing it to the end of that.
pub(crate) const REST_STEPS: u64 = 3;

/// Both ends of a span of the energies, besides the cost of each order.
const SPAN_STEPS: u64 = 4;

/// Both ends of a span, for each order of the scheme's work.
const SPAN_STEPS_PER_ORDER: u64 = 7;

/// With a foreseen switch nearer than this, adding up single steps costs less than a span.
pub(crate) const STEPS_WORTH_A_SPAN: f64 = 100.0;

/// First differences of a window, with the prediction that led to it, its bounds and its last state.
const WINDOW_STEPS: u64 = 7;

/// Four terms of a window, with their share of bounds and last state.
const STEPS_OF_FOUR_TERMS: u64 = 5;

/// The terms of longer chains do not fit in the processor's inner caches, and take twice as long
/// relative to steps.
const BLOCKS_AT_HAND: u64 = 1500;

/// The fixed cost of a step, in blocks.
const BLOCKS_OF_A_CALL: u64 = 45;

/// Evaluating the guard of one block at one place, in the time of this many blocks of a step.
const BLOCKS_OF_A_PLACE: u64 = 60;

/// Cost of the logarithm in a block's ageing, in units of one block's share of a step.
const BLOCKS_OF_AN_AGE: u64 = 20;

/// Checking whether the quasi-static part allows a jump.
pub(crate) const QUASI_STATIC_STEPS: u64 = 6;

/// An attempt at a jump, besides the quasi-static check. Stored modes add a cost that grows as the
/// square of the number of blocks.
const JUMP_STEPS: u64 = 8;

/// Projecting the state of a long chain onto its standing waves, or composing it from them, per binary
/// logarithm of the number of blocks.
const WAVE_STEPS: u64 = 8;

/// Predicting the amplitudes of waves after some steps.
pub(crate) const CALM_STEPS: u64 = 5;

/// Computing all standing waves of a chain.
const STEPS_OF_ALL_WAVES: u64 = 16_000;

/// Modes that cost at most this are computed in any run: some milliseconds.
const MODES_FOR_FREE_STEPS: u64 = 40_000;

/// Work done to open a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Work {
    /// Terms used.
    pub(crate) terms: u64,
    /// Places at which guards of single blocks were evaluated.
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

    /// A window that was used, or one that was refused.
    pub(crate) fn window_steps(self, work: Work) -> u64 {
        let ages = if self.ages { self.blocks } else { 0 };
        let alone = work.places * BLOCKS_OF_A_PLACE + ages * BLOCKS_OF_AN_AGE;
        let of_four_terms = if self.blocks > BLOCKS_AT_HAND { 2 } else { 1 } * STEPS_OF_FOUR_TERMS;
        WINDOW_STEPS + work.terms * of_four_terms / 4 + alone / (BLOCKS_OF_A_CALL + self.blocks)
    }

    /// A state inside a window, and the single steps from there to the one to be recorded.
    pub(crate) fn window_sample_steps(self, work: Work) -> u64 {
        GRID_STEPS / 2 + work.terms / 3
    }

    /// Whether the modes of the chain are standing waves, which are not stored.
    fn is_long(self) -> bool {
        self.blocks > LONG_CHAIN as u64
    }

    /// Projecting a state onto the modes, or composing it from them.
    pub(crate) fn modes_steps(self) -> u64 {
        match self.is_long() {
            true => WAVE_STEPS * u64::from(self.blocks.ilog2()),
            false => JUMP_STEPS + 3 * self.blocks * self.blocks / (BLOCKS_OF_A_CALL + self.blocks),
        }
    }

    /// Whether computing all modes of the chain pays in a run of `steps` steps.
    pub(crate) fn all_modes_pay(self, steps: u64) -> bool {
        let cost_steps = match self.is_long() {
            true => STEPS_OF_ALL_WAVES,
            false => 5 * self.blocks.pow(3) / (BLOCKS_OF_A_CALL + self.blocks),
        };
        cost_steps <= MODES_FOR_FREE_STEPS.max(steps / RUNS_OF_MODES)
    }
}

/// The sum over all pairs of a chain's modes, two for each block: at most 120 ns for each pair of blocks, beside steps of 34
/// ns and 0.75 ns for each block.
pub(crate) fn products_steps(blocks: u64) -> u64 {
    120 * blocks * blocks / (34 + 3 * blocks / 4)
}

/// Length of a window that saves as much as it costs, if terms cost what steps do.
pub(crate) fn least_window_steps(terms: u64) -> u64 {
    WINDOW_STEPS + terms
}

/// Both ends of a span of the energies.
pub(crate) fn span_steps(orders: usize) -> u64 {
    SPAN_STEPS + SPAN_STEPS_PER_ORDER * orders as u64
}

/// Credits saved steps.
pub(crate) fn earn(saved_steps: &mut u64, steps: u64) {
    *saved_steps = saved_steps.saturating_add(steps).min(MOST_SAVED_STEPS);
}

/// Debits a cost; returns the part that no credit covered.
pub(crate) fn pay(saved_steps: &mut u64, cost_steps: u64) -> u64 {
    let debt_steps = cost_steps.saturating_sub(*saved_steps);
    *saved_steps = saved_steps.saturating_sub(cost_steps);
    debt_steps
}

/// Single steps to be taken for an uncovered cost.
pub(crate) fn pause_steps(debt_steps: u64) -> u64 {
    PAUSE.saturating_mul(debt_steps)
}

#[cfg(test)]
mod tests {
    use super::{FIRST_SAVED_STEPS, MOST_SAVED_STEPS, PAUSE, earn, pause_steps, pay};

    #[test]
    fn what_was_not_saved_is_a_small_share_of_all_steps() {
        // Attempts that cost 50 steps and save 60, 0 or 3 steps in turn.
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
