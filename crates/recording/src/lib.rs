//! A laboratory recording as a source of the records from which slip events and ruptures follow, as those of a
//! simulated run.
//!
//! A recording is a set of streams, each with a clock of its own, in one part or many, and channels with a role and
//! a unit. An array of sensors along the slider makes its contacts: sensor `j` is block `j`. In reading order:
//!
//! - [`Description`]: what a `recording.toml` says; [`Unit`](unit::Unit) converts what stands in files.
//! - `samples`: blocks of numbers of the channels of a file; [`input`] opens files, inside the folder of the
//!   description only.
//! - `survey`: the parts of a stream, and when each of their samples was taken.
//! - `pass`: goes over the samples of a stream.
//! - `noise`: the noise of every channel, what is wrong with it, and the steps of sensors.
//! - `window`, `pick`, `ramp`, `arrival`: steps in a channel, found without a model, each with its errors.
//! - `force`: load drops, and the loads at any time.
//! - [`Recording`]: all of it, in memory bounded by the window.
//! - `estimates`: numbers of a model that samples tell.
//! - `steps`: the step records, one sensor a block.
//! - `signals`: what all channels read, in short, and the samples about ruptures, for figures.
//! - [`scenario()`]: a scenario by what a log tells.
//! - [`Sampler`]: the way back, a run as instruments would have recorded it.
//!
//! Nothing here prints or writes. A force that falls once, read from a table beside its description:
//!
//! ```
//! use asperity_recording::{Description, Recording};
//!
//! # let folder = tempfile::tempdir()?;
//! # let force_n = |n: u32| 0.05 * f64::from(n) + 0.01 * f64::from(n * n % 7) - if n < 200 { 0.0 } else { 5.0 };
//! # let rows: String = (0..400).map(|n| format!("{:.3},{:.2}\n", f64::from(n) * 1e-3, force_n(n))).collect();
//! # std::fs::write(folder.path().join("forces.csv"), format!("time,F_T\n{rows}"))?;
//! let description = r#"
//!     format = 1
//!     name = "one drop"
//!     [slider]
//!     length_m = 0.1
//!     width_m = 0.005
//!     height_m = 0.02
//!     youngs_modulus_pa = 2.5e9
//!     wave_speed_m_per_s = 1450.6
//!
//!     [[stream]]
//!     file = "forces.csv"
//!     time = { column = "time", unit = "s" }
//!     channel = [{ column = "F_T", role = "tangential-force", unit = "N" }]
//! "#;
//! let description = Description::parse(&folder.path().join("recording.toml"), description)?;
//! let found = Recording::open(description)?.detect(&|_, _| false)?;
//! assert_eq!(found.drops.len(), 1);
//! assert!((found.drops[0].onset_s - 0.199).abs() < 1e-3 && (found.drops[0].drop_n - 5.0).abs() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod array;
mod arrival;
mod csv;
mod description;
mod error;
mod estimates;
mod force;
mod hdf5;
pub mod input;
mod matlab;
mod noise;
mod npy;
mod pass;
mod pick;
mod ramp;
mod recording;
mod resample;
mod sample;
mod samples;
mod scenario;
mod signals;
mod steps;
mod survey;
mod tdms;
pub mod unit;
mod window;

pub use array::Source;
pub use description::{Description, EXAMPLE, Role};
pub use error::{InputFault, RecordingError};
pub use npy::head as npy_head;
pub use recording::{Detected, Recording};
pub use sample::{NOISE, Sampler};
pub use scenario::scenario;
