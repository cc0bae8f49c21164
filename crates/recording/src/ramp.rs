//! The least-squares ramp of a step: level, then a rise from one time to another, then level.

/// A ramp; places and times in samples of the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ramp {
    /// Where it begins, and where it ends.
    pub(crate) begin: f64,
    pub(crate) end: f64,
    /// The level before.
    pub(crate) before: f64,
    /// How much it rises.
    pub(crate) size: f64,
}

/// Samples about a step, less their mean, with the sums from which the score of any ramp between samples follows.
struct Sums {
    mean: f64,
    samples: Vec<f64>,
    /// Sums of the samples before a place, and of those times their place.
    sums: Vec<[f64; 2]>,
}

impl Sums {
    fn of(samples: &[f64]) -> Sums {
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let samples: Vec<f64> = samples.iter().map(|sample| sample - mean).collect();
        let mut last = [0.0; 2];
        let running = samples.iter().enumerate().map(|(n, sample)| {
            last = [last[0] + sample, last[1] + n as f64 * sample];
            last
        });
        let sums = [[0.0; 2]].into_iter().chain(running).collect();
        Sums { mean, samples, sums }
    }

    /// Sums of deviations of the unit ramp between two samples: times the samples, and squared.
    fn products(&self, begin: usize, end: usize) -> [f64; 2] {
        let (count, rise) = (self.samples.len() as f64, (end - begin) as f64);
        let (from, to) = (self.sums[begin], self.sums[end]);
        let rising = ((to[1] - from[1]) - begin as f64 * (to[0] - from[0])) / rise;
        let behind = count - end as f64;
        let sum = (rise - 1.0) / 2.0 + behind;
        let squares = (rise - 1.0) * (2.0 * rise - 1.0) / (6.0 * rise) + behind;
        [rising + self.sums[self.samples.len()][0] - to[0], squares - sum * sum / count]
    }

    /// The same of any ramp, and the sum of the ramp itself.
    fn products_between(&self, begin: f64, end: f64) -> [f64; 3] {
        let unit = |n: usize| ((n as f64 - begin) / (end - begin)).clamp(0.0, 1.0);
        let mut sums = [0.0; 3];
        for (n, sample) in self.samples.iter().enumerate() {
            let unit = unit(n);
            sums = [sums[0] + unit * sample, sums[1] + unit * unit, sums[2] + unit];
        }
        [sums[0], sums[1] - sums[2] * sums[2] / self.samples.len() as f64, sums[2]]
    }

    fn score(&self, begin: f64, end: f64) -> f64 {
        let [product, squares, _] = self.products_between(begin, end);
        product * product / squares
    }
}

/// How far the top of a parabola through three scores is from the middle one; 0 if it is more than half a sample.
fn shift([before, middle, after]: [f64; 3]) -> f64 {
    let bend = before - 2.0 * middle + after;
    let shift = (before - after) / (2.0 * bend);
    if bend < 0.0 && shift.abs() <= 0.5 { shift } else { 0.0 }
}

impl Ramp {
    /// The best ramp of this sign through samples, the first at `first`, about a candidate; none if no ramp has that
    /// sign. Ramps lie two windows of `width` samples about it at most.
    pub(crate) fn fit(samples: &[f64], first: u64, candidate: u64, width: u64, sign: f64) -> Option<Ramp> {
        let (middle, step) = ((candidate - first) as usize, (width as usize / 16).max(1));
        // From the second sample to the last but one.
        let last = samples.len().checked_sub(2)?;
        let (latest_begin, earliest_end) = (middle + step, middle.saturating_sub(step));
        let sums = Sums::of(samples);
        let mut best: Option<(f64, usize, usize)> = None;
        let consider = |best: &mut Option<(f64, usize, usize)>, begin: usize, end: usize| {
            let [product, squares] = sums.products(begin, end);
            let score = product * product / squares;
            if sign * product > 0.0 && best.is_none_or(|(most, ..)| score > most) {
                *best = Some((score, begin, end));
            }
        };
        for begin in (1..=latest_begin.min(last)).step_by(step) {
            for end in (begin + step..=last).step_by(step).filter(|end| *end >= earliest_end) {
                consider(&mut best, begin, end);
            }
        }
        let (_, begin, end) = best?;
        let near = |place: usize, least: usize, most: usize| {
            place.saturating_sub(step).max(least)..=(place + step).min(most)
        };
        for near_begin in near(begin, 1, latest_begin.min(last)) {
            for near_end in near(end, earliest_end.max(near_begin + 1), last) {
                consider(&mut best, near_begin, near_end);
            }
        }
        let (_, begin, end) = best?;
        let (mut begin, mut end) = (begin as f64, end as f64);
        if begin + 1.0 < end {
            begin += shift([-1.0, 0.0, 1.0].map(|by| sums.score(begin + by, end)));
        }
        if begin < end - 1.0 {
            end += shift([-1.0, 0.0, 1.0].map(|by| sums.score(begin, end + by)));
        }
        let [product, squares, sum] = sums.products_between(begin, end);
        let size = product / squares;
        let before = sums.mean - size * sum / samples.len() as f64;
        let first = first as f64;
        Some(Ramp { begin: first + begin, end: first + end, before, size })
    }
}

#[cfg(test)]
mod tests {
    use super::{Ramp, Sums};

    fn ramp(begin: f64, end: f64, size: f64) -> Vec<f64> {
        (0..128).map(|n| 5.0 + size * ((f64::from(n) - begin) / (end - begin)).clamp(0.0, 1.0)).collect()
    }

    #[test]
    fn a_ramp_is_found_between_samples() {
        for (begin, end, size) in [(50.0, 61.0, 2.0), (44.3, 70.9, -3.0), (63.0, 64.0, 1.0)] {
            let middle = 100 + f64::midpoint(begin, end).ceil() as u64;
            let found = Ramp::fit(&ramp(begin, end, size), 100, middle, 32, size.signum()).unwrap();
            // A parabola through three scores is not exact.
            assert!(
                (found.begin - 100.0 - begin).abs() < 0.1 && (found.end - 100.0 - end).abs() < 0.1,
                "{found:?}"
            );
            assert!((found.size / size - 1.0).abs() < 0.01 && (found.before - 5.0).abs() < 0.02, "{found:?}");
            let other = Ramp::fit(&ramp(begin, end, size), 100, middle, 32, -size.signum());
            assert_eq!(other, None);
        }
    }

    #[test]
    fn sums_give_the_score_of_the_ramp_itself() {
        let samples: Vec<f64> = (0..40).map(|n| f64::from(n * n % 17)).collect();
        let sums = Sums::of(&samples);
        for (begin, end) in [(1, 2), (3, 20), (30, 38)] {
            let [product, squares] = sums.products(begin, end);
            let [expected, of_squares, _] = sums.products_between(begin as f64, end as f64);
            assert!((product - expected).abs() < 1e-10 && (squares - of_squares).abs() < 1e-10);
        }
    }
}
