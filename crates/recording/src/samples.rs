//! Samples, whatever file or program they come from.

use serde::Deserialize;

use crate::error::{Place, RecordingError};

/// The next samples of some channels, a row for each.
pub type Block = Vec<Vec<f64>>;

/// Samples of some channels, read once from front to back. Files are one source of them; an array in memory is
/// another.
pub trait Samples {
    /// Replaces the rows of a block by the next samples, so many of each channel. Returns how many: fewer only at the
    /// end.
    ///
    /// # Errors
    /// If the source cannot be read, or holds something other than numbers.
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError>;

    /// Passes over so many samples, for which it may use the block. Returns as [`Samples::next`] does.
    ///
    /// # Errors
    /// As that.
    fn skip(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        self.next(most, block)
    }

    /// How many samples each channel has, if that is known before all have been read.
    fn known_length(&self) -> Option<u64>;

    /// Where a sample stands, for messages.
    fn place(&self, sample: u64) -> Place;

    /// The units of the channels that the source itself states.
    fn units(&self) -> Vec<Option<String>>;
}

/// A channel of a source: by name, or by number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "toml::Value")]
pub(crate) enum Column {
    /// By its name in a heading.
    Name(String),
    /// By its number, from 1.
    Number(u64),
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Column::Name(name) => write!(f, "{name}"),
            Column::Number(number) => write!(f, "{number}"),
        }
    }
}
