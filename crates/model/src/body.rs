//! The bodies: chains and lattices, their bonds and ends; a fault line in a medium.

pub mod chain;
pub mod elastic;
pub mod ends;
pub mod lattice;
pub mod medium;
pub(crate) mod node_state;
