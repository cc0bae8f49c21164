//! All tests of this crate that need nothing but its interface, as one program: `cargo test --test all`, or a part of
//! them, `cargo test --test all fast::`.

mod area;
mod area_fast;
mod arrest;
mod courses;
mod detach_by;
mod ends;
mod every_body;
mod fast;
mod fast_and_plain;
mod front_speed;
mod instability_stop;
mod junctions;
mod laws;
mod medium;
mod one_block;
mod page;
mod physics;
mod radiation;
mod rate_and_state;
mod rate_and_state_forces;
mod slab;
mod slab_fast;
mod slip_weakening;
mod stops;
mod thresholds;
