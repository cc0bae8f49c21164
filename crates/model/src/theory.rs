//! The theory that results are compared with.

pub mod analytic;
pub mod front;
pub mod medium;
pub mod preview;
pub mod stability;
pub mod weakening;
