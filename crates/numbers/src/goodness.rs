//! Whether a sample can be from the law that was fitted to it: the test of Kolmogorov and Smirnov
//! with the critical value for estimated parameters.
//!
//! The statistic is the largest distance between the shares found and the law. A law whose
//! parameters are estimated from the sample lies closer to it than the true one does, so that the
//! tabulated critical values, and [`crate::distributions::half_band`], reject far too rarely
//! (Lilliefors, J. Am. Stat. Assoc. 62, 399 (1967)). The critical value here is that of a parametric
//! bootstrap: samples of the same size are drawn from the fitted law and fitted again, and 5 % of
//! them are farther from their own fits (Stute, Gonzalez Manteiga and Presedo Quindimil, Metrika 40,
//! 243 (1993); for power laws Clauset, Shalizi and Newman, SIAM Rev. 51, 661 (2009), section 4.1).
//! The draws are the same every time and on every machine.
//!
//! The test assumes independent values. Rejected values may follow the law but be correlated; either way
//! the standard error of the fit is invalid.

use std::sync::OnceLock;

use asperity_model::mixed;

use crate::distributions::{SizeFit, SizeLaw, TimeFit, TimeLaw};

/// The share of samples from the law that is rejected.
pub(crate) const LEVEL: f64 = 0.05;

/// How many samples are drawn for a critical value: its own level is then 5.0 ± 0.7 %.
pub(crate) const DRAWS: usize = 999;

/// The largest sample that is drawn. For larger ones the critical value falls as `1 / sqrt(n)`,
/// which it does within a per cent from some hundred values on (Stephens, J. Am. Stat. Assoc. 69,
/// 730 (1974)).
const LARGEST: usize = 400;

/// The fit of a law to its sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Test {
    /// The largest distance between the shares found and those of the law.
    pub statistic: f64,
    /// The distance that 5 % of the samples from such a law exceed.
    pub critical: f64,
}

impl Test {
    /// That of a fit to sizes, over the sizes included in the fit.
    pub fn of_sizes(fit: &SizeFit, sizes: &[u32], law: SizeLaw) -> Test {
        Test::of_sizes_with(fit, sizes, law, DRAWS)
    }

    fn of_sizes_with(fit: &SizeFit, sizes: &[u32], law: SizeLaw, draws: usize) -> Test {
        let shares = fit.survival();
        let smallest = shares[0].0 as u32;
        let largest = smallest + shares.len() as u32 - 1;
        let counted = sizes.iter().filter(|size| (smallest..=largest).contains(size));
        let sizes: Vec<u32> = counted.copied().collect();
        let critical = critical(sizes.len(), draws, |count, random| {
            let draw = |share: f64| smallest + shares.partition_point(|(_, p)| *p > share) as u32 - 1;
            let drawn: Vec<u32> = (0..count).map(|_| draw(random.share())).collect();
            // A sample of one size is fitted without any distance.
            SizeFit::of(&drawn, law, smallest, largest).map_or(0.0, |fit| from_sizes(&fit, &drawn))
        });
        Test { statistic: from_sizes(fit, &sizes), critical }
    }

    /// That of a fit to times. Draws are from the law with scale and spread 1: a fit moves with the
    /// logarithms of its sample, so that the distances do not depend on the parameters.
    pub fn of_times(fit: &TimeFit, times_s: &[f64], law: TimeLaw) -> Test {
        Test { statistic: from_times(fit, times_s), critical: critical_of_times(times_s.len(), law) }
    }

    /// Whether the sample is not from the law.
    pub fn rejects(&self) -> bool {
        // A law of two sizes fits every sample up to rounding.
        self.statistic > self.critical + 1e-9
    }

    /// Both numbers.
    pub fn words(&self) -> String {
        let sign = if self.rejects() { ">" } else { "≤" };
        format!("KS {:.3} {sign} {:.3}", self.statistic, self.critical)
    }
}

/// The critical value for a sample of that size, given how far a drawn one is from its own fit.
pub(crate) fn critical(count: usize, draws: usize, distance: impl Fn(usize, &mut Random) -> f64) -> f64 {
    let drawn = count.min(LARGEST);
    let mut random = Random(0);
    let mut distances: Vec<f64> = (0..draws).map(|_| distance(drawn, &mut random)).collect();
    distances.sort_by(f64::total_cmp);
    let rank = ((1.0 - LEVEL) * (draws + 1) as f64).round() as usize;
    distances[rank - 1] * (drawn as f64 / count as f64).sqrt()
}

/// The critical value for a number of times. It depends on nothing else, so each is computed once in a process.
fn critical_of_times(count: usize, law: TimeLaw) -> f64 {
    static FOUND: [[OnceLock<f64>; LARGEST + 1]; 4] = [const { [const { OnceLock::new() }; LARGEST + 1] }; 4];
    let drawn = count.min(LARGEST);
    let found = FOUND[law as usize][drawn].get_or_init(|| {
        critical(drawn, DRAWS, |count, random| {
            let drawn: Vec<f64> = (0..count).map(|_| random.time(law)).collect();
            TimeFit::of(&drawn, law).map_or(0.0, |fit| from_times(&fit, &drawn))
        })
    });
    found * (drawn as f64 / count as f64).sqrt()
}

/// Pseudo-random numbers, a function of their index.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// From 0 up to 1, without 1.
    pub(crate) fn share(&mut self) -> f64 {
        self.0 += 1;
        (mixed(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn time(&mut self, law: TimeLaw) -> f64 {
        // Of 1 less a share there is a logarithm.
        let exponential = -(1.0 - self.share()).ln();
        match law {
            // Box and Muller, Ann. Math. Statist. 29, 610 (1958).
            TimeLaw::LogNormal => {
                ((2.0 * exponential).sqrt() * (std::f64::consts::TAU * self.share()).cos()).exp()
            }
            _ => exponential,
        }
    }
}

fn from_sizes(fit: &SizeFit, sizes: &[u32]) -> f64 {
    let mut ascending = sizes.to_vec();
    ascending.sort_unstable();
    let distance = |(size, p): (f64, f64)| {
        let smaller = ascending.partition_point(|found| f64::from(*found) < size);
        (1.0 - smaller as f64 / ascending.len() as f64 - p).abs()
    };
    fit.survival().into_iter().map(distance).fold(0.0, f64::max)
}

fn from_times(fit: &TimeFit, times_s: &[f64]) -> f64 {
    distance(|time_s| fit.survival(time_s), times_s)
}

/// The largest distance of a law, given by the share above each value, from the shares of a sample.
pub(crate) fn distance(survival: impl Fn(f64) -> f64, values: &[f64]) -> f64 {
    let mut ascending = values.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    let count = ascending.len() as f64;
    // The share found falls at each value, from the one to the other.
    let distance = |(n, value): (usize, &f64)| {
        let p = survival(*value);
        (1.0 - n as f64 / count - p).abs().max((1.0 - (n + 1) as f64 / count - p).abs())
    };
    ascending.iter().enumerate().map(distance).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use asperity_testkit::Random;

    use super::{LARGEST, SizeFit, SizeLaw, Test, TimeFit, TimeLaw, from_times};
    use crate::distributions::half_band;

    const SAMPLES: usize = 400;

    fn test_of_times(times_s: &[f64], law: TimeLaw) -> Test {
        Test::of_times(&TimeFit::of(times_s, law).unwrap(), times_s, law)
    }

    /// How many samples are rejected. The critical value is that of their number alone.
    fn times_rejected(law: TimeLaw, mut sample: impl FnMut(&mut Random) -> Vec<f64>) -> usize {
        let mut random = Random::new(1);
        let critical = test_of_times(&sample(&mut random), law).critical;
        let is_rejected = |times_s: Vec<f64>| {
            let statistic = from_times(&TimeFit::of(&times_s, law).unwrap(), &times_s);
            Test { statistic, critical }.rejects()
        };
        (0..SAMPLES).filter(|_| is_rejected(sample(&mut random))).count()
    }

    /// As for times, with fewer draws, since each sample has its own critical value.
    fn sizes_rejected(
        samples: usize,
        law: SizeLaw,
        mut sample: impl FnMut(&mut Random) -> Vec<u32>,
    ) -> usize {
        let mut random = Random::new(1);
        let is_rejected = |sizes: Vec<u32>| {
            Test::of_sizes_with(&SizeFit::of(&sizes, law, 1, 60).unwrap(), &sizes, law, 99).rejects()
        };
        (0..samples).filter(|_| is_rejected(sample(&mut random))).count()
    }

    fn weibull(random: &mut Random, shape: f64) -> f64 {
        0.2 * (-random.uniform(1e-12, 1.0).ln()).powf(1.0 / shape)
    }

    /// A size from 1 to 60, distributed according to the weights.
    fn size(random: &mut Random, weight: impl Fn(f64) -> f64) -> u32 {
        let total: f64 = (1..=60).map(|size| weight(f64::from(size))).sum();
        let mut left = random.uniform(0.0, total);
        let larger = |size: &u32| {
            left -= weight(f64::from(*size));
            left > 0.0
        };
        (1..60).take_while(larger).count() as u32 + 1
    }

    /// Calibration with thousands of samples.
    mod in_ci {
        use super::*;

        /// The level is 5 %; 7 to 33 of 400 are within three standard deviations.
        #[test]
        #[ignore = "half a minute of drawing samples: cargo xtask ci"]
        fn samples_from_the_law_are_rejected_as_often_as_the_level_says() {
            let is_level = |law: &str, count: usize| assert!((7..=33).contains(&count), "{law}: {count}");
            for count in [10, 40] {
                for (law, shape) in [(TimeLaw::Weibull, 7.0), (TimeLaw::Exponential, 1.0)] {
                    let sample = |random: &mut Random| -> Vec<f64> {
                        (0..count).map(|_| weibull(random, shape)).collect()
                    };
                    let found = times_rejected(law, sample);
                    is_level(&format!("{law:?} of {count}"), found);
                }
                let normal = |random: &mut Random| (0..12).map(|_| random.uniform(-0.5, 0.5)).sum::<f64>();
                let found = times_rejected(TimeLaw::LogNormal, |random| {
                    (0..count).map(|_| (0.5 * normal(random)).exp()).collect()
                });
                is_level(&format!("log-normal of {count}"), found);
            }
            for (law, weight) in [
                (SizeLaw::PowerLaw, (|s: f64| s.powf(-0.7)) as fn(f64) -> f64),
                (SizeLaw::Exponential, |s| (-s / 8.0).exp()),
            ] {
                let found =
                    sizes_rejected(SAMPLES, law, |random| (0..80).map(|_| size(random, weight)).collect());
                is_level(&format!("{law:?}"), found);
            }
        }
    }

    #[test]
    fn samples_of_another_law_are_rejected() {
        // Two thirds come every 0.2 s and the rest at 0.05 s, as while a slider settles.
        let settles = |random: &mut Random| -> Vec<f64> {
            let center = |n: usize| if n.is_multiple_of(3) { 0.05 } else { 0.2 };
            (0..24).map(|n| center(n) * random.uniform(0.97, 1.03)).collect()
        };
        for law in [TimeLaw::Weibull, TimeLaw::LogNormal, TimeLaw::Exponential] {
            let found = times_rejected(law, settles);
            assert!(found > SAMPLES * 95 / 100, "{law:?}: {found}");
        }
        // Half of each of two exponents.
        let mixed = |random: &mut Random| -> Vec<u32> {
            (0..400).map(|n| size(random, |s| s.powf(if n < 200 { -2.5 } else { 0.5 }))).collect()
        };
        for law in [SizeLaw::PowerLaw, SizeLaw::Exponential] {
            assert!(sizes_rejected(20, law, mixed) > 18, "{law:?}");
        }
    }

    /// At 5 % and for 25 values: exponential 0.211 (Lilliefors, J. Am. Stat. Assoc. 64, 387 (1969)),
    /// normal 0.173 (Dallal and Wilkinson, Am. Stat. 40, 294 (1986)), Weibull 0.874 / sqrt(n) for
    /// many (Chandra, Singpurwalla and Stephens, J. Am. Stat. Assoc. 76, 729 (1981)). For known
    /// parameters it is nearly the half width of the band.
    #[test]
    fn critical_values_are_those_of_the_tables() {
        let times: Vec<f64> = (1..=25).map(f64::from).collect();
        for (law, table) in
            [(TimeLaw::Exponential, 0.211), (TimeLaw::LogNormal, 0.173), (TimeLaw::Weibull, 0.874 / 5.0)]
        {
            let test = test_of_times(&times, law);
            assert!((test.critical / table - 1.0).abs() < 0.05, "{law:?}: {test:?}");
            assert!(test.critical < 0.85 * half_band(25) && test == test_of_times(&times, law), "{law:?}");
        }
    }

    #[test]
    fn large_samples_are_scaled() {
        let times: Vec<f64> = (1..=LARGEST as u32 * 4).map(f64::from).collect();
        let of = |times: &[f64]| test_of_times(times, TimeLaw::Exponential);
        let [large, small] = [&times[..], &times[..LARGEST]].map(of);
        assert!((small.critical / large.critical - 2.0).abs() < 1e-9, "{small:?} {large:?}");
    }
}
