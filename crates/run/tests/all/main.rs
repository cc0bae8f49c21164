//! All tests of this crate that need nothing but its interface, as one program: `cargo test --test all`, or a part of
//! them, `cargo test --test all starts::`.

mod area_tables;
mod extremes;
mod library;
mod order;
mod preview;
mod starts;
