//! Distributions of sizes and of times between events: the empirical distribution, its confidence band, and
//! fits.
//!
//! The empirical distribution is the share of values that are at least as large as each of them. With 95 %
//! probability the share in a sample of any size differs from the true one, everywhere at once, by less
//! than `sqrt(ln(2 / 0.05) / (2 n))`: Dvoretzky, Kiefer and Wolfowitz, Ann. Math. Statist. 27, 642 (1956),
//! with the constant of Massart, Ann. Probab. 18, 1269 (1990). This requires independent values, and those
//! of one run are not quite independent.
//!
//! Fits are by maximum likelihood, with the standard error that follows from the Fisher information.
//! It is one only if the sample is from the law, which [`crate::goodness`] tests.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::estimate::Estimate;

/// Fewest values that anything is fitted to.
pub const FEWEST: usize = 5;

/// Each value once, in ascending order, and the share of values at least as large.
pub fn survival(values: &[f64]) -> Vec<(f64, f64)> {
    let mut ascending = values.to_vec();
    ascending.sort_by(f64::total_cmp);
    let count = ascending.len() as f64;
    let mut shares = Vec::new();
    let mut smaller = 0;
    for equal in ascending.chunk_by(|a, b| a == b) {
        shares.push((equal[0], 1.0 - smaller as f64 / count));
        smaller += equal.len();
    }
    shares
}

/// Half the width of the 95 % confidence band about the empirical distribution of `count` values.
pub fn half_band(count: usize) -> f64 {
    ((2.0 / 0.05f64).ln() / (2.0 * count as f64)).sqrt()
}

/// What is fitted to sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SizeLaw {
    /// Sizes of `s` blocks are as frequent as `s^−α`.
    #[default]
    PowerLaw,
    /// Sizes of `s` blocks are as frequent as `exp(−s/ξ)`.
    Exponential,
    /// Nothing is fitted.
    None,
}

/// A law for whole sizes between two bounds, fitted to some: size `s` has the probability
/// `exp(-theta T(s))` over its sum from the smallest to the largest, with `T = ln s` for a power law
/// and `T = s` for an exponential one. So the likelihood is largest where the mean of `T` is that of
/// the values, and the standard error of `theta` is `1 / sqrt(n var T)`.
#[derive(Debug, Clone, PartialEq)]
pub struct SizeFit {
    /// The exponent, or one over the length in blocks.
    pub theta: Estimate,
    smallest: u32,
    statistics: Vec<f64>,
}

impl SizeFit {
    /// That of sizes from `smallest` to `largest`, others left out; None of too few of them, or where
    /// all are the same.
    pub fn of(sizes: &[u32], law: SizeLaw, smallest: u32, largest: u32) -> Option<SizeFit> {
        let statistic = |size: u32| match law {
            SizeLaw::PowerLaw => Some(f64::from(size).ln()),
            SizeLaw::Exponential => Some(f64::from(size)),
            SizeLaw::None => None,
        };
        let statistics: Vec<f64> = (smallest..=largest).map_while(statistic).collect();
        let values: Vec<f64> = sizes
            .iter()
            .filter(|size| (smallest..=largest).contains(size))
            .copied()
            .map_while(statistic)
            .collect();
        if values.len() < FEWEST || statistics.len() < 2 || values.iter().all(|value| *value == values[0]) {
            return None;
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        // The mean falls with theta; beyond these bounds nearly all sizes are the smallest or the
        // largest.
        let scale = statistics[1] - statistics[0];
        let ends = [-700.0 / scale, 700.0 / scale];
        let middle = |low: f64, high: f64| 0.5 * (low + high);
        let value = bisected(ends, middle, |theta| moments(&statistics, theta).0 > mean);
        let variance = moments(&statistics, value).1;
        let error = 1.0 / (values.len() as f64 * variance).sqrt();
        Some(SizeFit { theta: Estimate { value, error }, smallest, statistics })
    }

    /// Each size, and the probability of one at least as large.
    pub fn survival(&self) -> Vec<(f64, f64)> {
        let weights = weights(&self.statistics, self.theta.value);
        let total: f64 = weights.iter().sum();
        let mut left = total;
        let size = |n: usize| f64::from(self.smallest) + n as f64;
        let mut shares = Vec::new();
        for (n, weight) in weights.iter().enumerate() {
            shares.push((size(n), left / total));
            left -= weight;
        }
        shares
    }
}

/// Proportional to the probabilities, the largest 1.
fn weights(statistics: &[f64], theta: f64) -> Vec<f64> {
    let largest = statistics.iter().map(|statistic| -theta * statistic).fold(f64::NEG_INFINITY, f64::max);
    statistics.iter().map(|statistic| (-theta * statistic - largest).exp()).collect()
}

/// Mean and variance of the statistic.
fn moments(statistics: &[f64], theta: f64) -> (f64, f64) {
    let weights = weights(statistics, theta);
    let total: f64 = weights.iter().sum();
    let mean = weights.iter().zip(statistics).map(|(weight, t)| weight * t).sum::<f64>() / total;
    let squares = weights.iter().zip(statistics).map(|(weight, t)| weight * (t - mean).powi(2)).sum::<f64>();
    (mean, squares / total)
}

/// What is fitted to times between events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TimeLaw {
    /// A time longer than `t` has the probability `exp(−(t/T)^κ)`: with κ = 1 events come at
    /// random, with a large κ nearly evenly.
    #[default]
    Weibull,
    /// The logarithm of the time is normally distributed.
    LogNormal,
    /// Events come at random, `exp(−t/T)`.
    Exponential,
    /// Nothing is fitted.
    None,
}

/// A law fitted to times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeFit {
    /// [`TimeLaw::Weibull`].
    Weibull {
        /// Its shape.
        shape: Estimate,
        /// Its scale, s.
        scale_s: Estimate,
    },
    /// [`TimeLaw::LogNormal`].
    LogNormal {
        /// The median, s.
        median_s: Estimate,
        /// Standard deviation of the logarithm.
        spread: Estimate,
    },
    /// [`TimeLaw::Exponential`].
    Exponential {
        /// The mean, s.
        mean_s: Estimate,
    },
}

impl TimeFit {
    /// Fits some times; None if there are too few, all are equal, or one is zero.
    pub fn of(times_s: &[f64], law: TimeLaw) -> Option<TimeFit> {
        let apart = times_s.iter().any(|time| *time != times_s[0]);
        if times_s.len() < FEWEST || !apart || times_s.iter().any(|time| *time <= 0.0) {
            return None;
        }
        let count = times_s.len() as f64;
        let logs: Vec<f64> = times_s.iter().map(|time| time.ln()).collect();
        let mean_log = logs.iter().sum::<f64>() / count;
        match law {
            TimeLaw::None => None,
            TimeLaw::Exponential => {
                let mean = times_s.iter().sum::<f64>() / count;
                Some(TimeFit::Exponential { mean_s: Estimate { value: mean, error: mean / count.sqrt() } })
            }
            TimeLaw::LogNormal => {
                let spread = (logs.iter().map(|log| (log - mean_log).powi(2)).sum::<f64>() / count).sqrt();
                let median = mean_log.exp();
                Some(TimeFit::LogNormal {
                    median_s: Estimate { value: median, error: median * spread / count.sqrt() },
                    spread: Estimate { value: spread, error: spread / (2.0 * count).sqrt() },
                })
            }
            TimeLaw::Weibull => Some(weibull(&logs, mean_log)),
        }
    }

    /// The probability of a longer time.
    pub fn survival(&self, time_s: f64) -> f64 {
        match self {
            TimeFit::Weibull { shape, scale_s } => (-(time_s / scale_s.value).powf(shape.value)).exp(),
            TimeFit::LogNormal { median_s, spread } => {
                0.5 * libm::erfc((time_s / median_s.value).ln() / (spread.value * std::f64::consts::SQRT_2))
            }
            TimeFit::Exponential { mean_s } => (-time_s / mean_s.value).exp(),
        }
    }
}

/// Where values cease to be too small, between two ends.
fn bisected(
    [mut low, mut high]: [f64; 2],
    middle: fn(f64, f64) -> f64,
    is_small: impl Fn(f64) -> bool,
) -> f64 {
    for _ in 0..200 {
        let middle = middle(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if is_small(middle) { low = middle } else { high = middle }
    }
    middle(low, high)
}

/// The shape solves `sum t^k ln t / sum t^k - 1 / k = mean ln t`, whose left side rises with it; the
/// errors are those of large samples, `0.7797 k / sqrt(n)` and `1.0529 T / (k sqrt(n))`: Cohen,
/// Technometrics 7, 579 (1965).
fn weibull(logs: &[f64], mean_log: f64) -> TimeFit {
    let count = logs.len() as f64;
    // Over the longest time, so that no power is infinite.
    let longest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let powers = |shape: f64| -> (f64, f64) {
        let power = |log: f64| (shape * (log - longest)).exp();
        (logs.iter().map(|log| power(*log)).sum(), logs.iter().map(|log| power(*log) * log).sum())
    };
    let excess = |shape: f64| {
        let (sum, weighted) = powers(shape);
        weighted / sum - 1.0 / shape - mean_log
    };
    let middle = |low: f64, high: f64| (low * high).sqrt();
    let shape = bisected([1e-9, 1e9], middle, |shape| excess(shape) < 0.0);
    let scale = (longest + (powers(shape).0 / count).ln() / shape).exp();
    TimeFit::Weibull {
        shape: Estimate { value: shape, error: 0.7797 * shape / count.sqrt() },
        scale_s: Estimate { value: scale, error: 1.0529 * scale / (shape * count.sqrt()) },
    }
}

#[cfg(test)]
mod tests {
    use super::{SizeFit, SizeLaw, TimeFit, TimeLaw, half_band, survival};
    use crate::estimate::Estimate;

    #[test]
    fn shares_are_of_values_at_least_as_large() {
        assert_eq!(survival(&[2.0, 1.0, 2.0, 5.0]), [(1.0, 1.0), (2.0, 0.75), (5.0, 0.25)]);
        assert!((half_band(100) - 0.135_810_152).abs() < 1e-8);
    }

    /// On two sizes a law is one probability, which the share of values gives.
    #[test]
    fn fits_of_two_sizes_are_worked_out_by_hand() {
        let sizes = [1, 1, 1, 1, 1, 1, 2, 2, 9];
        let fit = SizeFit::of(&sizes, SizeLaw::PowerLaw, 1, 2).unwrap();
        // 2^-alpha = 2/6; var ln s = (3/4)(1/4) ln^2 2 of eight.
        assert!((fit.theta.value - 3f64.log2()).abs() < 1e-9, "{fit:?}");
        let error = 1.0 / ((8.0 * 3.0 / 16.0f64).sqrt() * 2f64.ln());
        assert!((fit.theta.error - error).abs() < 1e-9, "{fit:?}");
        let exponential = SizeFit::of(&sizes, SizeLaw::Exponential, 1, 2).unwrap();
        assert!((exponential.theta.value - 3f64.ln()).abs() < 1e-9);
        let shares = exponential.survival();
        assert!(shares[0] == (1.0, 1.0) && (shares[1].1 - 0.25).abs() < 1e-9, "{shares:?}");
        // More large than small ones.
        let rising = SizeFit::of(&[1, 2, 2, 2, 2], SizeLaw::PowerLaw, 1, 2).unwrap();
        assert!((rising.theta.value + 2.0).abs() < 1e-9);
        for (sizes, law) in [(&[1, 2, 2, 1][..], SizeLaw::PowerLaw), (&[2; 9], SizeLaw::PowerLaw)] {
            assert_eq!(SizeFit::of(sizes, law, 1, 2), None);
        }
        assert_eq!(SizeFit::of(&sizes, SizeLaw::None, 1, 2), None);
    }

    /// Sizes as often as a power law has them give its exponent back.
    #[test]
    fn a_power_law_is_found_again() {
        let sizes: Vec<u32> = (1..=60u32)
            .flat_map(|size| {
                let times = (1e6 * f64::from(size).powf(-1.5)).round() as usize;
                std::iter::repeat_n(size, times)
            })
            .collect();
        let fit = SizeFit::of(&sizes, SizeLaw::PowerLaw, 2, 60).unwrap();
        assert!((fit.theta.value - 1.5).abs() < 1e-4, "{:?}", fit.theta);
        assert!(fit.theta.error < 2e-3);
    }

    fn near(found: Estimate, value: f64, error: f64) {
        assert!((found.value / value - 1.0).abs() < 2e-3, "{found:?} is not {value}");
        assert!((found.error / error - 1.0).abs() < 2e-3, "{found:?} is not ± {error}");
    }

    /// Times at equal steps of probability give the law that they are from.
    #[test]
    fn laws_of_times_are_found_again() {
        let count = 200_000;
        let shares = || (0..count).map(|n| (f64::from(n) + 0.5) / f64::from(count));
        let root = f64::from(count).sqrt();
        let times: Vec<f64> = shares().map(|share| 0.2 * (-share.ln()).powf(1.0 / 3.0)).collect();
        let fit = TimeFit::of(&times, TimeLaw::Weibull).unwrap();
        let TimeFit::Weibull { shape, scale_s } = fit else { panic!("{fit:?}") };
        near(shape, 3.0, 0.7797 * 3.0 / root);
        near(scale_s, 0.2, 1.0529 * 0.2 / (3.0 * root));
        assert!((fit.survival(0.2) - (-1f64).exp()).abs() < 1e-3);

        let times: Vec<f64> = shares().map(|share| -0.2 * share.ln()).collect();
        let fit = TimeFit::of(&times, TimeLaw::Exponential).unwrap();
        let TimeFit::Exponential { mean_s } = fit else { panic!("{fit:?}") };
        near(mean_s, 0.2, 0.2 / root);
        assert!((fit.survival(0.4) - (-2f64).exp()).abs() < 1e-3);

        // Two values lie one spread from their median.
        let times = [[1.0; 3], [4.0; 3]].concat();
        let fit = TimeFit::of(&times, TimeLaw::LogNormal).unwrap();
        let TimeFit::LogNormal { median_s, spread } = fit else { panic!("{fit:?}") };
        near(median_s, 2.0, 2.0 * 2f64.ln() / 6f64.sqrt());
        near(spread, 2f64.ln(), 2f64.ln() / 12f64.sqrt());
        assert!((fit.survival(2.0) - 0.5).abs() < 1e-12 && (fit.survival(4.0) - 0.158_655).abs() < 1e-5);

        assert_eq!(TimeFit::of(&[1.0; 9], TimeLaw::Weibull), None);
        assert_eq!(TimeFit::of(&[1.0, 2.0, 3.0, 4.0], TimeLaw::Weibull), None);
        assert_eq!(TimeFit::of(&times, TimeLaw::None), None);
    }
}
