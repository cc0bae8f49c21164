//! The slow modes of a stuck lattice, used for its jumps ([`crate::jump::lattice`]): the stuck lattice with
//! its stiffness as a band ([`stuck`]), its slow modes by Arnoldi's iteration ([`arnoldi`], [`eigen`]), and
//! the quantities shared by all jumps of a run ([`precomputed`]).

mod arnoldi;
mod eigen;
mod precomputed;
mod stuck;

pub(crate) use arnoldi::sizes;
pub(crate) use precomputed::Precomputed;
pub(crate) use stuck::StuckLattice;
