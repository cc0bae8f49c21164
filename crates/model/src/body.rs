//! The bodies: chains and lattices, their bonds and ends.

pub mod chain;
pub mod elastic;
pub mod ends;
pub mod lattice;
pub(crate) mod node_state;
