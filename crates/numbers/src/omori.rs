//! How fast ruptures follow on large ones, and the law of Omori and Utsu, `K / (t + c)^p`.

use crate::distributions::half_band;
use crate::estimate::Estimate;
use crate::goodness::{DRAWS, Test, critical, distance};

/// Fewest aftershocks that the law is fitted to.
pub const FEWEST_AFTERSHOCKS: usize = 50;

/// How far below the largest magnitude a main shock lies at most. By the law of Båth an aftershock is smaller than its
/// main shock by 1.2 or more as a rule (Richter, Elementary Seismology, 1958).
pub const MAIN_SHOCKS_WITHIN: f64 = 1.0;

/// Logarithms of the smallest and the largest `c` over the window. At the smallest it cannot be distinguished from 0; at the
/// largest the law is hardly one of Omori, but an exponential one.
const LN_C: [f64; 2] = [-13.8, 2.3];

/// How many values of `c` are tried before the best is refined.
const TRIED: usize = 16;

/// How often the stretch that contains the best `c` shrinks, by the golden section: to half a thousandth.
const SHRUNK: usize = 17;

/// A rupture that has ended, for the stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shock {
    /// Its magnitude.
    pub magnitude: f64,
    /// Its onset, s.
    pub onset_s: f64,
    /// Its end, s.
    pub end_s: f64,
}

/// The ruptures after main shocks, all counted from the end of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Aftershocks {
    /// How many main shocks are stacked.
    pub main_shocks: usize,
    /// For how long ruptures after each are counted, s.
    pub window_s: f64,
    /// Times from the end of the main shock to the onset of each, s, ascending; above 0, and no longer than the window.
    pub times_s: Vec<f64>,
}

impl Aftershocks {
    /// The stack of a run, from ruptures by onset. Main shocks are those at most [`MAIN_SHOCKS_WITHIN`] below the largest
    /// magnitude. The window is the median time from the end of one to the onset of the next, and those with the next one
    /// within the window are left out, as is the last. `None` with fewer than two, or if most of them overlap the next.
    pub fn stacked(shocks: &[Shock]) -> Option<Aftershocks> {
        let largest = shocks.iter().map(|shock| shock.magnitude).max_by(f64::total_cmp)?;
        let is_main = |shock: &Shock| shock.magnitude >= largest - MAIN_SHOCKS_WITHIN;
        let mains: Vec<&Shock> = shocks.iter().filter(|shock| is_main(shock)).collect();
        let gap_s = |pair: &[&Shock]| pair[1].onset_s - pair[0].end_s;
        let window_s = crate::median(mains.windows(2).map(gap_s)).filter(|window_s| *window_s > 0.0)?;
        let stacked = mains.windows(2).filter(|pair| gap_s(pair) >= window_s).map(|pair| pair[0]);
        let (mut times_s, mut main_shocks) = (Vec::new(), 0);
        for main in stacked {
            main_shocks += 1;
            let later = &shocks[shocks.partition_point(|shock| shock.onset_s <= main.end_s)..];
            let others = later.iter().filter(|shock| !is_main(shock));
            let after_s = others.map(|shock| shock.onset_s - main.end_s);
            times_s.extend(after_s.take_while(|time_s| *time_s <= window_s));
        }
        times_s.sort_by(f64::total_cmp);
        Some(Aftershocks { main_shocks, window_s, times_s })
    }

    /// The test of a constant rate.
    pub fn constant(&self) -> Test {
        Test {
            statistic: distance(|time_s| 1.0 - time_s / self.window_s, &self.times_s),
            critical: half_band(self.times_s.len()),
        }
    }

    /// The law by maximum likelihood; `None` of fewer than [`FEWEST_AFTERSHOCKS`], and where its rate does not fall as
    /// some power.
    pub fn omori(&self) -> Option<Omori> {
        self.omori_with(DRAWS)
    }

    fn omori_with(&self, draws: usize) -> Option<Omori> {
        if self.times_s.len() < FEWEST_AFTERSHOCKS {
            return None;
        }
        let times: Vec<f64> = self.times_s.iter().map(|time_s| time_s / self.window_s).collect();
        let law = Law::of(&times);
        if law.ln_c >= LN_C[1] - 1e-3 || law.p() <= 0.0 {
            return None;
        }
        let [c_error, p_error] = law.errors(&times)?;
        let c = libm::exp(law.ln_c);
        let count = times.len() as f64;
        let statistic = distance(|time| law.survival(time), &times);
        let critical = critical(times.len(), draws, |count, random| {
            let drawn: Vec<f64> = (0..count).map(|_| law.time(random.share())).collect();
            let fit = Law::of(&drawn);
            distance(|time| fit.survival(time), &drawn)
        });
        // The integral of (t + c)^-p over the window, in seconds.
        let integral =
            libm::exp((1.0 - law.p()) * (self.window_s.ln() + law.ln_c) + ln_growth(law.w)) * law.width();
        Some(Omori {
            p: Estimate { value: law.p(), error: p_error },
            c_s: Estimate { value: c * self.window_s, error: c * c_error * self.window_s },
            k: count / self.main_shocks as f64 / integral,
            test: Test { statistic, critical },
        })
    }
}

/// The law `K / (t + c)^p` for the rate of ruptures after a main shock.
#[derive(Debug, Clone, PartialEq)]
pub struct Omori {
    /// `p`. Its standard error is one only if the test does not reject the law.
    pub p: Estimate,
    /// `c`, s; with an error of 0 where it cannot be distinguished from 0.
    pub c_s: Estimate,
    /// `K`, in s to the power `p - 1`, for each main shock.
    pub k: f64,
    /// The test of the law.
    pub test: Test,
}

/// The law for times over the window, from 0 to 1. Of `z = ln(t + c)` it is exponential between two bounds, growing by
/// `e^w` from the one to the other.
#[derive(Debug, Clone, Copy)]
struct Law {
    ln_c: f64,
    w: f64,
}

/// `ln((e^w - 1) / w)`.
fn ln_growth(w: f64) -> f64 {
    let size = w.abs();
    let even = if size < 1e-3 { size * size / 24.0 } else { (-libm::expm1(-size) / size).ln() + size / 2.0 };
    w / 2.0 + even
}

/// The mean of that exponential law, as a share of the way between its bounds: the derivative of [`ln_growth`].
fn mean_share(w: f64) -> f64 {
    if w.abs() < 1e-3 { 0.5 + w / 12.0 } else { -1.0 / libm::expm1(-w) - 1.0 / w }
}

impl Law {
    /// By maximum likelihood: for each `c` the best `w`, and of these the best `c`.
    fn of(times: &[f64]) -> Law {
        let at = |ln_c: f64| {
            let law = Law { ln_c, w: 0.0 };
            let mean = times.iter().map(|time| law.share(*time)).sum::<f64>() / times.len() as f64;
            // The likelihood in w has one maximum, where the mean is that of the law; w = width is p = 0.
            let (mut low, mut high) = (-200.0, law.width());
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if mean_share(middle) < mean { low = middle } else { high = middle }
            }
            let law = Law { w: 0.5 * (low + high), ..law };
            (law.likelihood_of_mean(mean), law)
        };
        let step = (LN_C[1] - LN_C[0]) / TRIED as f64;
        let tried = (0..=TRIED).map(|n| at(LN_C[0] + step * n as f64));
        let best = tried.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(LN_C[0], |(_, law)| law.ln_c);
        let (mut low, mut high) = ((best - step).max(LN_C[0]), (best + step).min(LN_C[1]));
        let shrink = 0.5 * (5f64.sqrt() - 1.0);
        let mut left = at(high - shrink * (high - low));
        let mut right = at(low + shrink * (high - low));
        for _ in 0..SHRUNK {
            if left.0 > right.0 {
                (high, right) = (right.1.ln_c, left);
                left = at(high - shrink * (high - low));
            } else {
                (low, left) = (left.1.ln_c, right);
                right = at(low + shrink * (high - low));
            }
        }
        if left.0 > right.0 { left.1 } else { right.1 }
    }

    /// The width between the bounds of `z`.
    fn width(self) -> f64 {
        libm::log1p(libm::exp(-self.ln_c))
    }

    fn p(self) -> f64 {
        1.0 - self.w / self.width()
    }

    /// How far `z` of a time has come from the one bound to the other.
    fn share(self, time: f64) -> f64 {
        libm::log1p(time * libm::exp(-self.ln_c)) / self.width()
    }

    /// The logarithm of the likelihood of a time, on average, from the mean of its shares.
    fn likelihood_of_mean(self, mean: f64) -> f64 {
        // The density of z, over t + c.
        self.w * mean - ln_growth(self.w) - self.width().ln() - (mean * self.width() + self.ln_c)
    }

    fn likelihood(self, times: &[f64]) -> f64 {
        let mean = times.iter().map(|time| self.share(*time)).sum::<f64>() / times.len() as f64;
        self.likelihood_of_mean(mean) * times.len() as f64
    }

    fn survival(self, time: f64) -> f64 {
        let grown = |share: f64| if self.w.abs() < 1e-9 { share } else { libm::expm1(self.w * share) };
        1.0 - grown(self.share(time)) / grown(1.0)
    }

    /// The time before which this share of times lies.
    fn time(self, share: f64) -> f64 {
        let along = match self.w.abs() < 1e-9 {
            true => share,
            false => libm::log1p(share * libm::expm1(self.w)) / self.w,
        };
        libm::exp(self.ln_c) * libm::expm1(along * self.width())
    }

    /// Standard errors of `ln c` and `p`, by the curvature of the likelihood. Where `c` is the smallest, that of `p` for
    /// this `c`. `None` where the likelihood has no peak.
    fn errors(self, times: &[f64]) -> Option<[f64; 2]> {
        let by = [1e-2, 1e-2];
        let at = |n: f64, m: f64| {
            let moved = Law { ln_c: self.ln_c + n * by[0], w: 0.0 };
            let p = self.p() + m * by[1];
            Law { w: (1.0 - p) * moved.width(), ..moved }.likelihood(times)
        };
        let peak = at(0.0, 0.0);
        let pp = (2.0 * peak - at(0.0, 1.0) - at(0.0, -1.0)) / (by[1] * by[1]);
        if self.ln_c <= LN_C[0] + 1e-3 {
            return (pp > 0.0).then(|| [0.0, 1.0 / pp.sqrt()]);
        }
        let cc = (2.0 * peak - at(1.0, 0.0) - at(-1.0, 0.0)) / (by[0] * by[0]);
        let cp = -(at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * by[0] * by[1]);
        let determinant = cc * pp - cp * cp;
        (determinant > 0.0 && cc > 0.0).then(|| [(pp / determinant).sqrt(), (cc / determinant).sqrt()])
    }
}

#[cfg(test)]
mod tests {
    use asperity_testkit::Random;

    use super::{Aftershocks, Law, Shock};

    /// Aftershocks of many main shocks, at random by the law.
    fn drawn(seed: u64, p: f64, c: f64, count: usize) -> Aftershocks {
        let mut law = Law { ln_c: c.ln(), w: 0.0 };
        law.w = (1.0 - p) * law.width();
        let mut random = Random::new(seed);
        let mut times_s: Vec<f64> = (0..count).map(|_| 3.0 * law.time(random.uniform(0.0, 1.0))).collect();
        times_s.sort_by(f64::total_cmp);
        Aftershocks { main_shocks: 10, window_s: 3.0, times_s }
    }

    #[test]
    fn p_c_and_k_are_found_again_within_their_errors() {
        found_again(4);
    }

    /// Calibration of errors and tests with many samples.
    mod in_ci {
        use super::*;

        #[test]
        #[ignore = "seconds: cargo xtask ci"]
        fn p_c_and_k_of_many_samples_are_found_again_within_their_errors() {
            found_again(20);
        }

        #[test]
        #[ignore = "seconds: cargo xtask ci"]
        fn constant_rates_and_rising_ones_have_no_p() {
            no_p(20);
        }
    }

    fn found_again(samples: u64) {
        for (p, c) in [(1.0, 1e-2), (0.8, 1e-3), (1.4, 5e-2)] {
            let (mut inside, mut rejected) = (0, 0);
            for seed in 1..=samples {
                let stack = drawn(seed, p, c, 600);
                let law = stack.omori_with(99).expect("there are enough");
                let of_p = ((law.p.value - p) / law.p.error).abs();
                let of_c = ((law.c_s.value - 3.0 * c) / law.c_s.error).abs();
                inside += u64::from(of_p < 2.0 && of_c < 2.0);
                rejected += u64::from(law.test.rejects());
                assert!(of_p < 4.0 && law.p.error < 0.2, "{p} {c}: {law:?}");
                assert!(stack.constant().rejects());
                // The integral of the rate over the window is the number of aftershocks.
                let (p, c_s) = (law.p.value, law.c_s.value);
                let integral = ((3.0 + c_s).powf(1.0 - p) - c_s.powf(1.0 - p)) / (1.0 - p);
                assert!((law.k * integral / 60.0 - 1.0).abs() < 1e-6, "{law:?}");
            }
            assert!(
                inside >= samples * 4 / 5 && rejected <= samples.div_ceil(5),
                "{p} {c}: {inside} within two errors, {rejected} rejected"
            );
        }
    }

    #[test]
    fn a_constant_rate_and_a_rising_one_have_no_p() {
        no_p(3);
    }

    fn no_p(samples: u64) {
        for seed in 1..=samples {
            let constant = drawn(seed, 0.0, 1.0, 400);
            assert!(constant.constant().statistic < 0.1, "{:?}", constant.constant());
            let mut rising = constant.clone();
            rising.times_s.iter_mut().for_each(|time_s| *time_s = (time_s.powi(2) * 3.0).cbrt());
            assert!(rising.constant().rejects());
            assert!(
                rising.omori_with(99).is_none_or(|law| law.test.rejects()),
                "{:?}",
                rising.omori_with(99)
            );
        }
        let rejected = (1..=100).filter(|seed| drawn(*seed, 0.0, 1.0, 400).constant().rejects()).count();
        assert!(rejected <= 13, "{rejected} of 100 at a level of 5 %");
        // Two rates, one after the other, are no power of time.
        let mut two = drawn(1, 0.0, 1.0, 600);
        two.times_s.iter_mut().step_by(2).for_each(|time_s| *time_s = 1.0 + *time_s / 30.0);
        two.times_s.sort_by(f64::total_cmp);
        assert!(two.constant().rejects() && two.omori_with(99).is_none_or(|law| law.test.rejects()));
        assert_eq!(drawn(1, 1.0, 0.01, 49).omori(), None);
    }

    #[test]
    fn main_shocks_are_stacked_over_one_window() {
        let shock = |magnitude: f64, onset_s: f64| Shock { magnitude, onset_s, end_s: onset_s + 0.5 };
        // Gaps of 9.5, 3.5 and 19.5 s: the window is 9.5 s, and the second main shock has too little time.
        let all = [
            shock(5.0, 0.0),
            shock(3.0, 0.4), // before its end
            shock(3.0, 1.0),
            shock(3.9, 9.0),
            shock(4.5, 10.0),
            shock(3.0, 11.0),
            shock(4.0, 14.0),
            shock(2.0, 16.0),
            shock(2.0, 24.0), // at the end of the window
            shock(2.0, 33.0), // after the window
            shock(4.8, 34.0),
            shock(3.0, 35.0), // the last
        ];
        let stack = Aftershocks::stacked(&all).expect("there are four main shocks");
        assert_eq!((stack.main_shocks, stack.window_s), (2, 9.5));
        assert_eq!(stack.times_s, [0.5, 1.5, 8.5, 9.5]);
        assert_eq!(Aftershocks::stacked(&all[..3]), None);
    }
}
