//! Sweeps over the blocks, which steps, windows and jumps are made of, compiled for
//! the instruction sets that a machine may have.
//!
//! They are functions of slices: from their arguments the compiler knows that
//! the arrays do not overlap, which it must know to vectorise them. Every block
//! is computed on its own, with the same operations in the same order, and
//! multiplication and addition are never fused, so all versions give the same
//! bits. Where stuck and sliding blocks differ, both are computed and one is selected:
//! an `if` would be compiled to a branch, or to stores under a mask, which some
//! processors are slow at.
//!
//! In reading order: `elastic`, how nodes pull at each other; `step`, the equations of a step; `terms`,
//! `coefficients`, `guards` and `linear`, what windows are made of; `fourier`, what jumps of long chains are;
//! `energy`, sums for the energies. `lattice` moves the nodes of a slab, and `dense` is what its modes
//! are made of; all else is of chains. `versions` has the instruction sets.

mod coefficients;
mod dense;
mod elastic;
mod energy;
mod fourier;
mod guards;
mod lattice;
mod linear;
mod step;
mod terms;
mod versions;

pub(crate) use coefficients::{Coefficients, FOLLOWED};
pub(crate) use energy::{Changing, Forms, Moved, StepWork, Stored};
pub(crate) use fourier::{NEAR, Near, Parts};
pub(crate) use guards::{Course, Guarded, Reserve, Steps, margin};
pub(crate) use lattice::{Forces, MovedWork};
pub(crate) use step::{After, Blocks};
pub(crate) use terms::{Held, Second, TermChain, Terms};
pub(crate) use versions::Sweeps;
