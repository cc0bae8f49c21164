//! A laboratory recording as a source of the records from which slip events and ruptures follow, as those of a
//! simulated run.
//!
//! A recording is a set of streams, each with a clock of its own, in one part or many, and channels with a role and
//! a unit. An array of sensors along the slider makes its contacts: sensor `j` is block `j`. In reading order:
//!
//! - [`Description`]: what a `recording.toml` says; [`unit`] converts what stands in files.
//! - [`Samples`]: blocks of numbers of the channels of a file; [`input`] opens files, inside the folder of the
//!   description only.
//! - `survey`: the parts of a stream, and when each of their samples was taken.
//! - `noise`: the noise of every channel, and what is wrong with it.
//! - `window`, `pick`, `ramp`, `arrival`: steps in a channel, found without a model, each with its errors.
//! - `force`: load drops, and the loads at any time.
//! - [`Recording`]: all of it, in two passes over the files, in memory bounded by the window.
//! - `steps`: the step records, one sensor a block.
//!
//! Nothing here prints or writes.

mod arrival;
mod csv;
mod description;
mod error;
mod force;
pub mod input;
mod line;
mod noise;
mod npy;
mod pick;
mod ramp;
mod recording;
mod resample;
mod samples;
mod steps;
mod survey;
pub mod unit;
mod window;

pub use description::{Description, EXAMPLE, Role};
pub use error::{InputFault, Place, RecordingError};
pub use recording::{Detected, Recording};
pub use samples::{Block, Samples};
