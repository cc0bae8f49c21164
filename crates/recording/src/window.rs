//! The step statistic of a channel, and its scatter without events.
//!
//! `S_i` is the mean of the `w` samples from `i` on less that of the `w` before. Its median `b` takes out drift, and
//! `1.4826` times the median of `|S - b|`, its scatter, contains noise of low frequency.

use std::array::from_fn;
use std::ops::Range;

/// From the median of absolute deviations to the standard deviation of a normal distribution.
pub(crate) const MAD_TO_SIGMA: f64 = 1.4826;

/// Sums start anew at multiples of this, so that they do not depend on how samples were read, and rounding errors do
/// not grow.
const SUMMED: u64 = 4096;

/// Values from which the scatter follows: all of them, or blocks of so many.
const MOST_VALUES: u64 = 1 << 17;
const BLOCKS: u64 = 256;
const VALUES_OF_BLOCK: u64 = 512;

/// Windows of samples that are kept before the next step, or a candidate: a ramp begins two before it, and its
/// arrival is looked for in three before that.
const BEHIND: u64 = 6;

/// Runs over the samples of a channel, and keeps those that are still needed.
#[derive(Debug)]
pub(crate) struct Window {
    pub(crate) width: u64,
    kept: Vec<f64>,
    /// The sample that the first kept one is.
    base: u64,
    pub(crate) next: u64,
    /// Over both windows of the last step that was made.
    sums: [f64; 2],
}

impl Window {
    pub(crate) fn new(width: u64) -> Window {
        Window { width, kept: Vec::new(), base: 0, next: width, sums: [0.0; 2] }
    }

    /// Adds samples, and drops those before `needed` that no later step needs.
    pub(crate) fn extend(&mut self, samples: &[f64], needed: u64) {
        let from = needed.min(self.next).saturating_sub(BEHIND * self.width);
        let is_past = from >= self.end() + samples.len() as u64;
        // Rarely, so that the rest is seldom moved.
        if is_past || from - self.base.min(from) > self.kept.len() as u64 / 2 {
            let dropped = (from - self.base).min(self.kept.len() as u64);
            self.kept.drain(..dropped as usize);
            self.base += dropped;
        }
        if is_past {
            self.base += samples.len() as u64;
        } else {
            self.kept.extend_from_slice(samples);
        }
    }

    /// Goes on to the sums from which the step of an index ahead follows.
    pub(crate) fn skip_to(&mut self, index: u64) {
        self.next = self.next.max(index / SUMMED * SUMMED);
    }

    /// One past the last sample.
    pub(crate) fn end(&self) -> u64 {
        self.base + self.kept.len() as u64
    }

    /// Samples of a range, cut to those that are kept.
    pub(crate) fn samples(&self, range: Range<u64>) -> &[f64] {
        let at = |sample: u64| (sample.clamp(self.base, self.end()) - self.base) as usize;
        &self.kept[at(range.start)..at(range.end)]
    }
}

/// Most steps that are made at once.
const MOST_STEPS: u64 = 256;

/// Replaces steps by the next ones of windows side by side, up to an index, as far as there are samples. Returns the index
/// of the first; there are none at the end. Several windows go together, since each sum waits for the one before.
pub(crate) fn advance<const N: usize>(
    windows: [&mut Window; N],
    until: u64,
    steps: &mut Vec<[f64; N]>,
) -> u64 {
    let (w, first) = (windows[0].width, windows[0].next);
    let until = until.min((windows[0].end() + 1).saturating_sub(w));
    steps.clear();
    if first >= until {
        return first;
    }
    let restarts = first == w || first.is_multiple_of(SUMMED);
    let from = first + u64::from(restarts);
    let to = until.min((first / SUMMED + 1) * SUMMED).min(first + MOST_STEPS);
    let (width, share) = (w as f64, 1.0 / w as f64);
    let mut sums = windows.each_ref().map(|window| match restarts {
        true => [first - w, first].map(|from| window.samples(from..from + w).iter().sum()),
        false => window.sums,
    });
    let quotients = |[before, after]: [f64; 2]| after / width - before / width;
    steps.extend(restarts.then(|| sums.map(quotients)));
    let rows = windows.each_ref().map(|window| {
        [from - 1 - w, from - 1, from + w - 1].map(|first| window.samples(first..first + to - from))
    });
    // Of a power of two a product is the quotient to the bit.
    match w.is_power_of_two() {
        true => slide(rows, &mut sums, steps, |[before, after]| (after - before) * share),
        false => slide(rows, &mut sums, steps, quotients),
    }
    for (window, sums) in windows.into_iter().zip(sums) {
        (window.sums, window.next) = (sums, to);
    }
    first
}

/// Adds the steps of sums that go on: what leaves the first, crosses from the second to it, and comes.
fn slide<const N: usize>(
    rows: [[&[f64]; 3]; N],
    sums: &mut [[f64; 2]; N],
    steps: &mut Vec<[f64; N]>,
    statistic: impl Fn([f64; 2]) -> f64,
) {
    let (made, count) = (steps.len(), rows[0][0].len());
    let rows = rows.map(|of| of.map(|row| &row[..count]));
    let [mut before, mut after] = [0, 1].map(|n| sums.map(|sums| sums[n]));
    steps.resize(made + count, [0.0; N]);
    for (i, step) in steps[made..].iter_mut().enumerate() {
        for n in 0..N {
            let [leaving, crossing, coming] = [rows[n][0][i], rows[n][1][i], rows[n][2][i]];
            before[n] += crossing - leaving;
            after[n] += coming - crossing;
            step[n] = statistic([before[n], after[n]]);
        }
    }
    *sums = from_fn(|n| [before[n], after[n]]);
}

/// Chooses the values from which the scatter follows.
#[derive(Debug)]
pub(crate) struct Values {
    /// Where blocks of values begin that count; none if all do.
    starts: Vec<u64>,
    block: usize,
    values: Vec<f64>,
    steps: Vec<[f64; 1]>,
}

/// Median and scatter of the step statistic, in units as stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scatter {
    pub(crate) median: f64,
    pub(crate) sigma: f64,
    /// Whether events are too dense for the window: many values are far off, or the halves differ.
    pub(crate) is_dense: bool,
}

impl Scatter {
    /// The noise of a sample, by the scatter of the step statistic with windows of so many.
    pub(crate) fn noise(&self, width: u64) -> f64 {
        self.sigma * (width as f64 / 2.0).sqrt()
    }
}

impl Values {
    /// Of a part with so many samples.
    pub(crate) fn of(samples: u64, width: u64) -> Values {
        let all = (samples + 1).saturating_sub(2 * width);
        let spread = if all > MOST_VALUES { all - VALUES_OF_BLOCK } else { 0 };
        let blocks = if spread > 0 { BLOCKS } else { 0 };
        let starts = (0..blocks).map(|block| width + block * spread / (BLOCKS - 1)).collect();
        Values { starts, block: 0, values: Vec::new(), steps: Vec::new() }
    }

    /// Adds the values that count of what a window gives.
    pub(crate) fn take(&mut self, window: &mut Window) {
        loop {
            let start = self.starts.get(self.block).copied();
            let end = start.map_or(u64::MAX, |start| start + VALUES_OF_BLOCK);
            if self.block > 0 && start.is_none() {
                // All blocks are there: no sample is needed any more.
                window.next = u64::MAX / 2;
                return;
            }
            window.skip_to(start.unwrap_or_default());
            loop {
                let first = advance([window], end, &mut self.steps);
                if self.steps.is_empty() {
                    break;
                }
                let unneeded = start.unwrap_or_default().saturating_sub(first) as usize;
                self.values.extend(self.steps.iter().skip(unneeded).flatten());
            }
            if window.next < end {
                return;
            }
            self.block += 1;
        }
    }

    pub(crate) fn scatter(self) -> Scatter {
        /// Share of values beyond three scatters, and ratio of the scatters of both halves, of dense events.
        const FAR_SHARE: f64 = 0.25;
        const HALVES_RATIO: f64 = 2.0;
        let Values { values, .. } = self;
        let of = |values: &[f64], median: f64| {
            let mut off: Vec<f64> = values.iter().map(|value| (value - median).abs()).collect();
            MAD_TO_SIGMA * self::median(&mut off)
        };
        let median = self::median(&mut values.clone());
        let sigma = of(&values, median);
        let far = values.iter().filter(|value| (*value - median).abs() > 3.0 * sigma).count();
        let (first, last) = values.split_at(values.len() / 2);
        let (first, last) = (of(first, median), of(last, median));
        let is_dense = far as f64 > FAR_SHARE * values.len() as f64
            || first > HALVES_RATIO * last
            || last > HALVES_RATIO * first;
        Scatter { median, sigma, is_dense: is_dense && sigma > 0.0 }
    }
}

/// The lesser and the larger of two numbers that are some, in a form for which processors have an instruction.
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The median; NaN of nothing.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return f64::NAN;
    }
    let is_odd = values.len() % 2 == 1;
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).unwrap_or(*upper);
    if is_odd { *upper } else { (lower + *upper) / 2.0 }
}

#[cfg(test)]
mod tests {
    use super::{Values, Window, advance, median};

    fn steps(samples: &[f64], width: u64, each: usize) -> Vec<(u64, f64)> {
        let mut windows = [Window::new(width), Window::new(width)];
        let (mut found, mut steps) = (Vec::new(), Vec::new());
        for block in samples.chunks(each) {
            windows.iter_mut().for_each(|window| window.extend(block, u64::MAX));
            loop {
                let first = advance(windows.each_mut(), u64::MAX, &mut steps);
                found.extend((first..).zip(&steps).map(|(index, [step, _])| (index, *step)));
                assert!(steps.iter().all(|[one, other]| one == other));
                if steps.is_empty() {
                    break;
                }
            }
        }
        found
    }

    #[test]
    fn a_step_is_the_same_to_the_bit_however_samples_are_read() {
        let samples: Vec<f64> = (0..20_000).map(|n| f64::from(n * n % 1009) * 0.1).collect();
        let whole = steps(&samples, 8, samples.len());
        assert_eq!(whole.len(), 20_000 - 15);
        for each in [1, 7, 4096] {
            assert_eq!(steps(&samples, 8, each), whole);
        }
        let step: Vec<f64> = (0..40).map(|n| if n < 20 { 1.0 } else { 4.0 }).collect();
        let largest = steps(&step, 4, 40).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert_eq!(largest, (20, 3.0));
    }

    #[test]
    fn of_a_long_part_256_blocks_count() {
        let samples: Vec<f64> = (0..(1 << 20) + 12_345).map(|n: u64| (n * n % 1009) as f64 * 0.1).collect();
        let all = steps(&samples, 24, samples.len());
        let (mut values, mut window) = (Values::of(samples.len() as u64, 24), Window::new(24));
        for block in samples.chunks(1000) {
            window.extend(block, u64::MAX);
            values.take(&mut window);
            assert!(window.kept.len() < 6000);
        }
        assert_eq!(values.values.len(), 256 * 512);
        for block in [0, 1, 100, 255] {
            let first = block * (all.len() - 512) / 255;
            let due: Vec<f64> = all[first..first + 512].iter().map(|(_, step)| *step).collect();
            assert!(values.values[block * 512..][..512] == due, "{block}");
        }
    }

    #[test]
    fn the_median_of_an_even_number_lies_between_two() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
    }
}
