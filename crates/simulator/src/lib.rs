//! The chain of blocks and its solvers.
//!
//! A solver is a state machine: asked for the next [`Record`], it advances as
//! far as it must and answers. It does no I/O, reads no clock and starts no
//! thread, so that the same plan gives the same records wherever it runs.
//!
//! [`Plain`] takes every step and reads like the equations; it is the oracle
//! that [`Fast`] is held against, which computes the same discrete trajectory for
//! a cost that follows the switches: certified windows (`window.rs`, `basis.rs`) where no block
//! switches, certified jumps (`jump.rs`, `modes.rs`, `waves.rs`) where all are stuck, plain steps
//! in between.

mod basis;
mod complex;
mod contacts;
mod counters;
pub mod equality;
mod exact;
mod fast;
mod jump;
mod kind;
mod modes;
mod plain;
mod recorder;
mod rest;
mod solver;
mod state;
mod stepper;
mod sweep;
mod waves;
mod window;

pub use counters::Counters;
pub use exact::Exact;
pub use fast::Fast;
pub use kind::SolverKind;
pub use plain::Plain;
pub use solver::{SimulationError, Solver};
pub use state::ChainState;
pub use stepper::Driving;
