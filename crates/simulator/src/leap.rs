//! Many steps at once: windows while blocks slide, jumps while all stick.

pub(crate) mod chebyshev;
pub(crate) mod clearance;
pub(crate) mod cost;
pub(crate) mod fast;
pub(crate) mod jump;
pub(crate) mod norms;
pub(crate) mod rest;
pub(crate) mod window;
