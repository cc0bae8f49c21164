//! Sizes and radiation of the ruptures of a run, for its summary.

use asperity_record::Rupture;

use crate::catalogue::moment_magnitude;
use crate::rupture_numbers::{energy_error_j, radiated_energy_j, released_energy_j};

/// Collects one number of each rupture, and two sums.
#[derive(Debug, Default)]
pub(crate) struct Magnitudes {
    pub(crate) all: Vec<f64>,
    pub(crate) radiated_j: f64,
    released_j: f64,
    error_j: f64,
}

impl Magnitudes {
    /// Adds a rupture, whose moment may be `per_metre` and have no magnitude.
    pub(crate) fn take(&mut self, rupture: &Rupture, per_metre: bool) {
        let moment_n_m = rupture.moment_n_m.filter(|_| !per_metre);
        self.all.extend(moment_n_m.and_then(moment_magnitude));
        if let (Some(radiated_j), Some(released_j)) = (radiated_energy_j(rupture), released_energy_j(rupture))
        {
            self.radiated_j += radiated_j;
            self.released_j += released_j;
            self.error_j += energy_error_j(rupture).unwrap_or(0.0);
        }
    }

    /// Radiated over released energy of the ruptures of which both are known: 0, or above what the finite step and rounding
    /// added to it.
    pub(crate) fn radiated_ratio(&self) -> Option<f64> {
        let is_known = self.radiated_j == 0.0 || self.radiated_j > self.error_j;
        (self.released_j > 0.0 && is_known).then(|| self.radiated_j / self.released_j)
    }
}
