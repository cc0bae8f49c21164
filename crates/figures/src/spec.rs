//! The figures of a parameter study: as its sweep writes them, and as they are understood once all
//! names in them are known to be keys that vary or numbers of the summary. Who plans a study need
//! not be able to draw, so nothing is drawn here.

mod axes;
mod figure;
mod measured;
mod understand;
mod written;

pub use axes::{Axis, Key, place, read_place};
pub(crate) use figure::theory;
pub use figure::{Figure, Kind, Quantity};
pub use measured::{Measured, MeasuredFile};
pub use written::{Family, Scale, Statistic};
