//! One step of the plain scheme: bodies, contacts, strength, state.

pub(crate) mod body;
pub(crate) mod junctions;
pub(crate) mod law;
pub(crate) mod plain;
pub(crate) mod single_step;
pub(crate) mod stepper;
pub(crate) mod strength;
