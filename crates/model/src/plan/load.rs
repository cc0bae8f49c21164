//! The normal load: of each block at the start, and of all over time.

use crate::body::elastic::gaps;

/// `p_n = F_N / N (1 - theta (2n - N - 1) / (N - 1))` (5.18), n from 1.
///
/// The sign is that of (5.18) and of the thesis' program: a positive `theta`
/// loads the driven end more. (5.10) and (2.8) have the other sign.
///
/// Over an area all rows across are alike, one after the other: `n` is the column, and `F_N` is divided by the
/// number of contacts.
pub fn tilted(total_n: f64, theta: f64, columns: usize, rows: usize) -> Vec<f64> {
    let (count, mean_n) = (columns as f64, total_n / (columns * rows) as f64);
    let at = |n: usize| mean_n * (1.0 - (2.0 * n as f64 - count - 1.0) / gaps(columns) as f64 * theta);
    (0..rows).flat_map(|_| (1..=columns).map(at)).collect()
}

/// The normal load of a step relative to that of the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load(pub(crate) f64);

impl Load {
    /// That of the start.
    pub const OF_START: Load = Load(1.0);

    /// A force under this load that is proportional to it and equals `at_start_n` at the start.
    #[inline]
    pub fn scaled_n(self, at_start_n: f64) -> f64 {
        self.0 * at_start_n
    }

    /// The load over that of the start.
    pub fn factor(self) -> f64 {
        self.0
    }

    /// The relative decrease from this load to another.
    pub fn fall_to(self, other: Load) -> f64 {
        1.0 - other.0 / self.0
    }
}

/// The normal load of a step, and its rate up to the next knot of its course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// The load.
    pub load: Load,
    /// Change per step, relative to the load of the start.
    pub(crate) rate: f64,
}

impl Ramp {
    /// The constant load of the start.
    pub const FLAT: Ramp = Ramp { load: Load::OF_START, rate: 0.0 };

    /// Change per step of a force that is proportional to the load and equals `at_start_n` at the start.
    #[inline]
    pub fn change_n(self, at_start_n: f64) -> f64 {
        self.rate * at_start_n
    }

    /// Whether the load is constant.
    pub fn is_flat(self) -> bool {
        self.rate == 0.0
    }

    /// The load `steps` steps later.
    pub fn ahead(self, steps: f64) -> Load {
        if self.is_flat() { self.load } else { Load(self.load.0 + self.rate * steps) }
    }

    /// The load `steps` steps later, relative to the present one.
    pub fn decline(self, steps: f64) -> f64 {
        if self.is_flat() { 1.0 } else { (self.load.0 + self.rate * steps) / self.load.0 }
    }

    /// The relative decrease per step.
    pub fn fall(self) -> f64 {
        -self.rate / self.load.0
    }
}

#[cfg(test)]
mod tests {
    use super::tilted;

    #[test]
    fn tilt_shifts_load_to_the_driven_end_and_keeps_the_total() {
        assert_eq!(tilted(400.0, 0.0, 4, 1), [100.0; 4]);
        let p = tilted(400.0, 0.5, 5, 1);
        assert_eq!((p[0], p[2], p[4]), (120.0, 80.0, 40.0));
        assert!((p.iter().sum::<f64>() - 400.0).abs() < 1e-12);
        assert_eq!(tilted(400.0, 0.0, 1, 1), [400.0]);
    }
}
