//! The seals of a log, metadata records `chunk`: each assigns one piece of the log to its run, and
//! covers all bytes before it with a checksum.

mod record;
mod tee;
mod verify;

pub(crate) use record::{LONGEST_SEAL_BYTES, Seal, find_seal, seal_at};
pub(crate) use tee::{Sealer, Tee};
pub(crate) use verify::Verifier;
