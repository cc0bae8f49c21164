//! The step statistic of channels, and its scatter without events.
//!
//! `S_i` is the mean of the `w` samples from `i` on less that of the `w` before. Its median `b` takes out drift, and
//! `1.4826` times the median of `|S - b|`, its scatter, contains noise of low frequency.

use std::array::from_fn;
use std::ops::Range;

use asperity_record::median_and_scatter;
use multiversion::multiversion;

use crate::samples::{LANES, Lanes, Rows};

/// Sums start anew at multiples of this, so that they do not depend on how samples were read, and rounding errors do
/// not grow.
pub(crate) const SUMMED: u64 = 4096;

/// Values from which the scatter follows: all of them, or blocks of so many.
const MOST_VALUES: u64 = 1 << 17;
pub(crate) const BLOCKS: u64 = 256;
const VALUES_OF_BLOCK: u64 = 512;

/// Runs over the samples of channels that lie side by side.
#[derive(Debug)]
pub(crate) struct Window {
    pub(crate) width: u64,
    pub(crate) next: u64,
    /// Over both windows of the last step that was made.
    sums: [Lanes; 2],
    /// The least and the largest of the steps that were made last.
    pub(crate) extremes: [Lanes; 2],
}

impl Window {
    /// From the first step of a part, or one behind it where sums begin anew.
    pub(crate) fn new(width: u64, from: u64) -> Window {
        Window { width, next: from.max(width), sums: [[0.0; LANES]; 2], extremes: [[0.0; LANES]; 2] }
    }

    /// Adds the steps of a range of indices, which is not behind, to values.
    pub(crate) fn take(&mut self, rows: &Rows<'_>, group: usize, of: &Range<u64>, values: &mut Vec<Lanes>) {
        self.next = self.next.max(of.start / SUMMED * SUMMED);
        let mut steps = Vec::new();
        while self.next < of.end {
            let Some(first) = self.advance(rows, group, of.end, &mut steps) else { break };
            values.extend(steps.iter().skip(of.start.saturating_sub(first) as usize));
        }
    }

    /// Replaces steps by the next ones of a group of channels, up to an index, as far as there are samples. Returns the
    /// index of the first; none at the end.
    pub(crate) fn advance(
        &mut self,
        rows: &Rows<'_>,
        group: usize,
        until: u64,
        steps: &mut Vec<Lanes>,
    ) -> Option<u64> {
        let (w, first) = (self.width, self.next);
        let until = until.min((rows.end() + 1).saturating_sub(w));
        if first >= until {
            return None;
        }
        let restarts = first == w || first.is_multiple_of(SUMMED);
        let from = first + u64::from(restarts);
        let to = until.min((first / SUMMED + 1) * SUMMED).min(first + MOST_STEPS);
        steps.resize((to - first) as usize, [0.0; LANES]);
        self.extremes = [[f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]];
        let lanes = |from: u64| rows.block.lanes(group, (from - rows.first) as usize);
        if restarts {
            let sum = |sums: Lanes, lanes: &Lanes| from_fn(|n| sums[n] + lanes[n]);
            self.sums = [first - w, first].map(|from| lanes(from).take(w as usize).fold([-0.0; LANES], sum));
            steps[0] = from_fn(|n| self.sums[1][n] / w as f64 - self.sums[0][n] / w as f64);
            self.extremes = [steps[0]; 2];
        }
        let samples = [from - 1 - w, from - 1, from + w - 1].map(lanes);
        slide(samples, &mut self.sums, &mut steps[(from - first) as usize..], w, &mut self.extremes);
        self.next = to;
        Some(first)
    }
}

/// Most steps that are made at once.
const MOST_STEPS: u64 = 256;

/// Makes the steps of sums that go on: what leaves the first, crosses from the second to it, and comes.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2"))]
fn slide<'a>(
    [leaving, crossing, coming]: [impl Iterator<Item = &'a Lanes>; 3],
    sums: &mut [Lanes; 2],
    steps: &mut [Lanes],
    w: u64,
    extremes: &mut [Lanes; 2],
) {
    let [mut least, mut most] = *extremes;
    let (width, share) = (w as f64, 1.0 / w as f64);
    let [mut before, mut after] = *sums;
    // Of a power of two a product is the quotient to the bit.
    let is_exact = w.is_power_of_two();
    for (((step, leaving), crossing), coming) in steps.iter_mut().zip(leaving).zip(crossing).zip(coming) {
        for n in 0..LANES {
            before[n] += crossing[n] - leaving[n];
            after[n] += coming[n] - crossing[n];
        }
        *step = match is_exact {
            true => from_fn(|n| (after[n] - before[n]) * share),
            false => from_fn(|n| after[n] / width - before[n] / width),
        };
        least = from_fn(|n| lesser(least[n], step[n]));
        most = from_fn(|n| larger(most[n], step[n]));
    }
    (*sums, *extremes) = ([before, after], [least, most]);
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
    /// The scatter of values of one channel.
    pub(crate) fn of(values: &[f64]) -> Scatter {
        /// Share of values beyond three scatters, and ratio of the scatters of both halves, of dense events.
        const FAR_SHARE: f64 = 0.25;
        const HALVES_RATIO: f64 = 2.0;
        let of = |values: &[f64]| median_and_scatter(&mut values.to_vec());
        let [median, sigma] = of(values);
        let far = values.iter().filter(|value| (*value - median).abs() > 3.0 * sigma).count();
        let (first, last) = values.split_at(values.len() / 2);
        let [[_, first], [_, last]] = [first, last].map(of);
        let is_dense = far as f64 > FAR_SHARE * values.len() as f64
            || first > HALVES_RATIO * last
            || last > HALVES_RATIO * first;
        Scatter { median, sigma, is_dense: is_dense && sigma > 0.0 }
    }

    /// The noise of a sample, by the scatter of the step statistic with windows of so many.
    pub(crate) fn noise(&self, width: u64) -> f64 {
        self.sigma * (width as f64 / 2.0).sqrt()
    }
}

/// Of a part with so many samples the indices in one of [`BLOCKS`] whose values tell the scatter: all, or some.
pub(crate) fn counted(samples: u64, width: u64, block: u64) -> Range<u64> {
    let all = (samples + 1).saturating_sub(2 * width);
    let spread = if all > MOST_VALUES { all - VALUES_OF_BLOCK } else { (BLOCKS - 1) * VALUES_OF_BLOCK };
    let from = block * spread / (BLOCKS - 1);
    width + from.min(all)..width + (from + VALUES_OF_BLOCK).min(all)
}

/// The lesser and the larger of two numbers that are some, in a form for which processors have an instruction.
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::{Window, counted};
    use crate::samples::{Block, LANES, Lanes, Rows};

    /// Passes samples on in pieces, with those of two windows before.
    fn pass(samples: &[f64], width: u64, each: usize, visit: &mut dyn FnMut(&Rows<'_>)) {
        let mut block = Block::new(LANES);
        for (first, piece) in (0..).step_by(each).zip(samples.chunks(each)) {
            block.drop_first(block.len().saturating_sub(2 * width as usize));
            let kept = block.len() as u64;
            piece.iter().for_each(|sample| block.push(&[*sample; LANES]));
            visit(&Rows { first: first - kept, block: &block });
        }
    }

    fn steps(samples: &[f64], width: u64, each: usize) -> Vec<(u64, f64)> {
        let (mut window, mut found, mut steps) = (Window::new(width, 0), Vec::new(), Vec::new());
        pass(samples, width, each, &mut |rows| {
            while let Some(first) = window.advance(rows, 0, u64::MAX, &mut steps) {
                found.extend((first..).zip(&steps).map(|(index, step)| (index, step[0])));
                assert!(steps.iter().all(|step| *step == [step[0]; LANES]));
            }
        });
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
        let (mut values, mut window, count) = (Vec::new(), Window::new(24, 0), samples.len() as u64);
        pass(&samples, 24, samples.len(), &mut |rows| {
            (0..256).for_each(|block| window.take(rows, 0, &counted(count, 24, block), &mut values));
        });
        assert_eq!(values.len(), 256 * 512);
        for block in [0, 1, 100, 255] {
            let first = block * (all.len() - 512) / 255;
            let due: Vec<Lanes> = all[first..first + 512].iter().map(|(_, step)| [*step; LANES]).collect();
            assert!(values[block * 512..][..512] == due, "{block}");
        }
    }
}
