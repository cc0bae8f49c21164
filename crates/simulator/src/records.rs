//! What a solver gives: rows of records, counters, pace, stops.

pub(crate) mod counters;
pub(crate) mod kind;
pub(crate) mod pace;
pub(crate) mod recorder;
pub(crate) mod solver;
pub(crate) mod stop;
