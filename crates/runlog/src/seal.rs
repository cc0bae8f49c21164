//! The metadata records `chunk`, the seals of a log: each ties one piece of it, and all bytes
//! before, to the run.

mod record;
mod tee;
mod verify;

pub(crate) use record::{LONGEST_SEAL_BYTES, Seal, find_seal, seal_at};
pub(crate) use tee::{Sealer, Tee};
pub(crate) use verify::Verifier;
