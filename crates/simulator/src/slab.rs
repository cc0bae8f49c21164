//! What the jumps of a lattice are made of: the stuck lattice, its stiffness a band ([`stuck`]), the
//! slow modes of it ([`modes`], with [`eigen`]), what all jumps of a run share ([`ground`]), and a jump
//! ([`jump`]).

mod eigen;
mod ground;
mod jump;
mod modes;
mod norms;
pub(crate) mod stored;
mod stuck;

pub(crate) use ground::Ground;
pub(crate) use jump::{Attempt, Jump};
pub(crate) use stuck::StuckSlab;
