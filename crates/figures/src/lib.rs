//! Figures of runs and of studies.
//!
//! - [`spec`]: the figures of a study, as its sweep writes them and as they are understood.
//! - [`draw`]: figures drawn with plotters and an embedded font.
//! - [`keys`]: kinds of figures and their keys, as `asperity figures` explains them.
//! - [`spelling`]: doc comments as words on a page.
//!
//! A figure of a study, understood once the keys that vary are known:
//!
//! ```
//! use asperity_figures::draw::Figures;
//! use asperity_figures::{Axis, Family, Key};
//! use asperity_record::Cell;
//!
//! let figures: Figures = toml::from_str("
//! [[family]]
//! file = 'count.png'
//! x = 'normal_load.tilt'
//! y = 'precursor_count'
//! ")?;
//! let values = vec![Cell::Number(-0.5), Cell::Number(0.5)];
//! let key = Key { path: "normal_load.tilt", is_number: true, log: false, values };
//! let axes = [Axis { keys: vec![key], joined: true }];
//! let figure = &Family::understand(&figures.family, &axes, true)?[0];
//! assert_eq!(figure.y.label, "precursor count");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod draw;
pub mod keys;
pub mod spec;
pub mod spelling;

pub use spec::*;
