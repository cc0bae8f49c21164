//! Distributions of the quantities of events, and a test whether two of them may be equal.
//!
//! Beyond the horizon of a chaotic run no event has its counterpart, and only
//! statistics can be compared. The values are counted in bins of a 256th of
//! their octave, so that memory does not grow with the table.
//!
//! The test is that of Kolmogorov and Smirnov for two samples; its probability is that of the asymptotic
//! distribution with the correction for small samples of M. A. Stephens, J. R. Stat. Soc. B 32, 115 (1970):
//! with n = n₁n₂/(n₁+n₂) and λ = (√n + 0.12 + 0.11/√n) D, p = 2 Σ (-1)^(k-1) exp(-2k²λ²). For values with
//! ties, as lengths in blocks are, and for those in one bin, p is too large and never too small (G. E.
//! Noether, Metrika 7, 115 (1963)). The test assumes independent events, but slip events of one chain are
//! correlated: a small p indicates a change only if the runs are long compared with the correlation time.

use std::collections::BTreeMap;

use crate::report::{KolmogorovSmirnov, Sample};

/// Fewest values on either side for a test: below this, it has hardly any power, and the asymptotic
/// distribution is no longer accurate to a few per cent.
pub const FEWEST: u64 = 20;

/// Bits of a double that a bin ignores: all but 8 of the mantissa.
const DROPPED_BITS: u32 = 44;

/// Histogram of non-negative values.
#[derive(Debug, Clone, Default)]
pub(crate) struct Distribution {
    counts: BTreeMap<u64, u64>,
    total: u64,
}

impl Distribution {
    pub(crate) fn add(&mut self, value: f64) {
        // The bits of doubles that are not negative are in the order of their values.
        *self.counts.entry(value.max(0.0).to_bits() >> DROPPED_BITS).or_insert(0) += 1;
        self.total += 1;
    }

    /// The median, to a bin's lower edge; exact for whole numbers up to 512.
    fn median(&self) -> Option<f64> {
        let half = self.total.div_ceil(2);
        let mut seen = 0;
        let bin = self.counts.iter().find(|(_, count)| {
            seen += **count;
            seen >= half && half > 0
        });
        bin.map(|(bin, _)| f64::from_bits(bin << DROPPED_BITS))
    }
}

impl FromIterator<f64> for Distribution {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Distribution {
        let mut distribution = Distribution::default();
        values.into_iter().for_each(|value| distribution.add(value));
        distribution
    }
}

/// Both sides of a quantity, and the test.
pub(crate) fn compare(old: &Distribution, new: &Distribution) -> Sample {
    Sample {
        old_median: old.median(),
        new_median: new.median(),
        counts: [old.total, new.total],
        test: kolmogorov_smirnov(old, new),
    }
}

fn kolmogorov_smirnov(old: &Distribution, new: &Distribution) -> Option<KolmogorovSmirnov> {
    if old.total.min(new.total) < FEWEST {
        return None;
    }
    let bins: std::collections::BTreeSet<&u64> = old.counts.keys().chain(new.counts.keys()).collect();
    let (mut below_old, mut below_new, mut distance) = (0, 0, 0.0f64);
    for bin in bins {
        below_old += old.counts.get(bin).copied().unwrap_or(0);
        below_new += new.counts.get(bin).copied().unwrap_or(0);
        let apart = below_old as f64 / old.total as f64 - below_new as f64 / new.total as f64;
        distance = distance.max(apart.abs());
    }
    let (n_old, n_new) = (old.total as f64, new.total as f64);
    let root = (n_old * n_new / (n_old + n_new)).sqrt();
    let lambda = (root + 0.12 + 0.11 / root) * distance;
    Some(KolmogorovSmirnov { name: KolmogorovSmirnov::NAME, distance, p: tail(lambda) })
}

/// The probability that Kolmogorov's statistic exceeds λ.
fn tail(lambda: f64) -> f64 {
    // Below this it is 1 to six digits, and the series converges slowly.
    if lambda < 0.27 {
        return 1.0;
    }
    let terms = (1..=100).map(|k: i32| {
        let sign = if k % 2 == 1 { 2.0 } else { -2.0 };
        sign * (-2.0 * f64::from(k * k) * lambda * lambda).exp()
    });
    terms.sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::{Distribution, FEWEST, compare, tail};

    fn of(values: impl Iterator<Item = f64>) -> Distribution {
        values.collect()
    }

    /// Percentage points of Kolmogorov's distribution, as every table of it has them.
    #[test]
    fn the_tail_has_the_tabulated_percentage_points() {
        for (lambda, p) in
            [(1.073, 0.20), (1.224, 0.10), (1.358, 0.05), (1.480, 0.025), (1.628, 0.01), (1.949, 0.001)]
        {
            assert!((tail(lambda) - p).abs() < 0.005 * p.max(0.1), "{lambda}: {}", tail(lambda));
        }
        assert_eq!(tail(0.0), 1.0);
        assert!(tail(9.0) < 1e-60);
    }

    #[test]
    fn the_same_values_are_of_one_distribution_and_others_are_not() {
        let values = || (0..400).map(|k| f64::from(k * 37 % 401));
        let same = compare(&of(values()), &of(values())).test.unwrap();
        assert_eq!((same.distance, same.p), (0.0, 1.0));
        let apart = compare(&of(values()), &of(values().map(|value| value * 1.5))).test.unwrap();
        // F(x) - F(x/1.5) of a uniform distribution is largest, a third, at its end.
        assert!((apart.distance - 1.0 / 3.0).abs() < 0.02, "{}", apart.distance);
        assert!(apart.p < 1e-9);
        let mirrored = compare(&of(values().map(|value| value * 1.5)), &of(values())).test.unwrap();
        assert_eq!(mirrored, apart);
    }

    /// Under one distribution p is uniform or larger: of 400 tests some 20 lie below 0.05.
    #[test]
    fn of_one_distribution_the_test_seldom_says_otherwise() {
        let mut random = asperity_testkit::Random::new(7);
        let mut uniform = || random.uniform(0.0, 1.0);
        let mut below = 0;
        for _ in 0..400 {
            let old = of((0..60).map(|_| uniform()));
            let new = of((0..90).map(|_| uniform()));
            below += u32::from(compare(&old, &new).test.unwrap().p < 0.05);
        }
        assert!((5..=32).contains(&below), "{below}");
    }

    #[test]
    fn few_values_are_not_tested() {
        let few = of((1..FEWEST).map(|k| k as f64));
        let many = of((1..100).map(f64::from));
        assert_eq!(compare(&few, &many).test, None);
        assert_eq!(compare(&few, &many).old_median, Some(10.0));
        assert_eq!(compare(&of(std::iter::empty()), &many).old_median, None);
    }
}
