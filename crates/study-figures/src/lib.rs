//! The figures of a parameter study: as its sweep writes them, and as they are understood once all
//! names in them are known to be keys that vary or numbers of the summary. Who plans a study need
//! not be able to draw, so nothing is drawn here.
//!
//! ```
//! use asperity_study_figures::{Axis, Figures, Key, Place};
//!
//! let figures: Figures = toml::from_str("
//! [[family]]
//! file = 'count.png'
//! x = 'normal_load.tilt'
//! y = 'precursor_count'
//! ")?;
//! let values = vec![Place::Number(-0.5), Place::Number(0.5)];
//! let key = Key { path: "normal_load.tilt", is_number: true, log: false, values };
//! let axes = [Axis { keys: vec![key], joined: true }];
//! let figure = &figures.understand(&axes, true)?[0];
//! assert_eq!(figure.y.label, "precursor count");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axes;
mod figure;
mod understand;
mod written;

pub use axes::{Axis, Key, Place};
pub use figure::{Figure, Kind, Quantity, Theory};
pub use written::{Family, Figures, Lengths, PhaseMap, Scale, Statistic, quantile};
