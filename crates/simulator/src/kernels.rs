//! The loops over all blocks that steps, windows and jumps consist of, compiled for several
//! instruction sets.
//!
//! Each is a function of slices, whose arguments prove to the compiler that the arrays do not overlap;
//! it vectorises them only then. Every block is computed by itself with the same operations in the same
//! order, and multiplication and addition are never fused, so all instruction sets give the same bits.
//! Where stuck and sliding blocks differ, both results are computed and one is selected: an `if` would
//! become a branch or a masked store, which is slow on some processors.
//!
//! In reading order: `elastic`, the pull between nodes; `step`, the equations of a step; `terms`,
//! `coefficients`, `guards` and `linear`, for windows; `fourier`, for jumps of long chains; `energy`,
//! sums for the energies. `lattice` moves the nodes of a lattice, `contacts` is for its contacts, and `dense`
//! and `band` serve its modes; `junctions` is for the contacts of any body, `balance` for a line in a
//! medium, and all else is of chains. `simd`
//! lists the instruction sets.

mod balance;
mod band;
mod coefficients;
mod contacts;
mod dense;
mod elastic;
mod energy;
mod fourier;
mod guards;
mod junctions;
mod lattice;
mod linear;
mod simd;
mod step;
mod terms;

pub(crate) use balance::{NodeFriction, age, powers, velocities};
pub(crate) use band::{Entry, ROWS, factor_rows, solve_band};
pub(crate) use coefficients::{Coefficients, FOLLOWED, next_coefficients};
pub(crate) use contacts::{ContactInputs, apply_friction, friction_work, tangential_force};
pub(crate) use dense::{add_columns, dots, product, reflect, subtract_multiple};
pub(crate) use elastic::pull;
pub(crate) use energy::{
    Changing, Forms, Moved, StepWork, directed, forms, sliding_product, step_work, stored,
};
pub(crate) use fourier::{NEAR, Near, bessel, fourier, from_cosines, gather, multiply, spread, to_cosines};
pub(crate) use guards::{Course, Reserve, crossing_ahead, first_crossing, margin, margins};
pub(crate) use junctions::{Bearing, drag, heat_and_stretch, resist};
pub(crate) use lattice::{lattice_dashpots, lattice_move, lattice_springs};
pub(crate) use linear::{
    add_course, add_multiples, are_finite, combine, compound, follow, grow, largest, products,
};
#[cfg(test)]
pub(crate) use simd::tests::by_all;
pub(crate) use step::{After, Blocks, Strengths, step, switching};
pub(crate) use terms::{
    Held, TermChain, Terms, classify, first_difference, radiate, second_difference, terms,
};
