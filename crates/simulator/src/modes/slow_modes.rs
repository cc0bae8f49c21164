//! The slow modes of a stuck lattice, used for its jumps ([`crate::leap::jump::lattice`]): the stuck lattice with
//! its stiffness as a band ([`stuck`]), the motions that its mirror symmetry keeps apart ([`mirror`]), its slow
//! modes by Arnoldi's iteration ([`arnoldi`], [`eigen`]), and what each does to contacts ([`class_modes`]).

mod arnoldi;
mod assembly;
mod class_modes;
mod eigen;
mod factor;
mod inverse;
mod mirror;
mod stuck;

pub(crate) use class_modes::{ClassModes, top_loads};
pub(crate) use mirror::mirrors_itself;
pub(crate) use stuck::{StuckLattice, SystemSizes};
