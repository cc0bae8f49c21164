//! The slow modes of a stuck lattice, used for its jumps ([`crate::leap::jump::lattice`]): the stuck lattice with
//! its stiffness as a band ([`stuck`]), the motions that its mirror symmetry keeps apart ([`mirror`]), its slow
//! modes by Arnoldi's iteration ([`arnoldi`], [`eigen`]), and the quantities shared by all jumps of a run
//! ([`precomputed`]).

mod arnoldi;
mod assembly;
mod eigen;
mod factor;
mod inverse;
mod mirror;
mod precomputed;
mod stuck;

pub(crate) use mirror::mirrors_itself;
pub(crate) use precomputed::{ClassModes, Precomputed, pressed};
pub(crate) use stuck::{Sizes, StuckLattice};
