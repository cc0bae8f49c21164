//! Candidates for steps in the samples of a channel, and the ramps of those that are.

use std::array::from_mut;
use std::collections::VecDeque;

use crate::ramp::Ramp;
use crate::window::{Scatter, Window, advance, larger, lesser};

/// A candidate ends before so many windows behind its first index.
const LONGEST: u64 = 8;

/// Finders whose samples are gone through together.
const TOGETHER: usize = 4;

/// Indices at which the step statistic is beyond the threshold.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    first: u64,
    last: u64,
    best: u64,
    most: f64,
}

/// What is looked for in a channel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search {
    /// Samples per window.
    pub(crate) width: u64,
    /// As stored.
    pub(crate) scatter: Scatter,
    /// Least size of a step, as stored.
    pub(crate) least: f64,
    /// Of a step, as stored.
    pub(crate) sign: f64,
    /// Whether samples lose the trend of the part before ramps are fitted, and small ramps stay, as those of `F_T`.
    pub(crate) is_force: bool,
}

/// Finds the ramps of a channel of a part while its samples come.
#[derive(Debug)]
pub(crate) struct Finder {
    search: Search,
    pub(crate) window: Window,
    open: Option<Candidate>,
    closed: VecDeque<Candidate>,
    /// Candidates of the other sign, and the last index of them.
    pub(crate) others: u64,
    last_other: u64,
}

impl Finder {
    pub(crate) fn new(search: Search) -> Finder {
        let window = Window::new(search.width);
        Finder { search, window, open: None, closed: VecDeque::new(), others: 0, last_other: 0 }
    }

    /// The next step statistic, the one at this index.
    fn step(&mut self, i: u64, step: f64) {
        let Search { width, scatter, least, sign, .. } = self.search;
        let size = sign * (step - scatter.median);
        if size > least {
            let is_over = |open: &mut Candidate| i > open.last + width || i >= open.first + LONGEST * width;
            self.closed.extend(self.open.take_if(is_over));
            let open = self.open.get_or_insert(Candidate { first: i, last: i, best: i, most: size });
            open.last = i;
            if size > open.most {
                (open.best, open.most) = (i, size);
            }
        } else if size < -least {
            self.others += u64::from(self.last_other == 0 || i > self.last_other + width);
            self.last_other = i;
        }
    }

    fn ramp(&self, best: u64) -> Option<Ramp> {
        let Search { width, scatter, least, sign, is_force } = self.search;
        let first = best.saturating_sub(2 * width);
        let samples = self.window.samples(first..best + 2 * width);
        if !is_force {
            let ramp = Ramp::fit(samples, first, best, width, sign)?;
            return Some(ramp).filter(|ramp| ramp.size.abs() >= least);
        }
        let trend = scatter.median / width as f64;
        let level: Vec<f64> = samples.iter().enumerate().map(|(n, y)| y - trend * n as f64).collect();
        Ramp::fit(&level, first, best, width, sign)
    }
}

/// Adds samples to finders, a row each, and passes on the ramps of candidates that are over, with the finder's number and
/// the samples about them.
pub(crate) fn extend(
    finders: &mut [Finder],
    rows: &[impl AsRef<[f64]>],
    is_last: bool,
    found: &mut dyn FnMut(usize, &Window, Ramp),
) {
    let (together, alone) = finders.as_chunks_mut::<TOGETHER>();
    let mut rows = rows.iter();
    let mut first = 0;
    for finders in together {
        extend_by(finders, &mut rows, is_last, &mut |n, window, ramp| found(first + n, window, ramp));
        first += TOGETHER;
    }
    for finder in alone {
        extend_by(from_mut(finder), &mut rows, is_last, &mut |_, window, ramp| found(first, window, ramp));
        first += 1;
    }
}

fn extend_by<'a, const N: usize>(
    finders: &mut [Finder; N],
    rows: &mut impl Iterator<Item = &'a (impl AsRef<[f64]> + 'a)>,
    is_last: bool,
    found: &mut dyn FnMut(usize, &Window, Ramp),
) {
    for (finder, row) in finders.iter_mut().zip(rows) {
        let candidates = finder.closed.front().or(finder.open.as_ref());
        finder.window.extend(row.as_ref(), candidates.map_or(u64::MAX, |candidate| candidate.first));
    }
    // A little less than the threshold, as rounding differs.
    let limits = finders.each_ref().map(|Finder { search: Search { scatter, least, .. }, .. }| {
        let off = least - 1e-12 * (least + scatter.median.abs());
        [scatter.median - off, scatter.median + off]
    });
    let mut steps = Vec::new();
    loop {
        let first = advance(finders.each_mut().map(|finder| &mut finder.window), u64::MAX, &mut steps);
        if steps.is_empty() {
            break;
        }
        // Of all together first, since most have none.
        let (mut least, mut most) = ([f64::INFINITY; N], [f64::NEG_INFINITY; N]);
        for step in &steps {
            for n in 0..N {
                least[n] = lesser(least[n], step[n]);
                most[n] = larger(most[n], step[n]);
            }
        }
        for (n, (finder, [low, high])) in finders.iter_mut().zip(limits).enumerate() {
            if least[n] < low || most[n] > high {
                let beyond = (first..).zip(&steps).filter(|(_, step)| step[n] < low || step[n] > high);
                beyond.for_each(|(i, step)| finder.step(i, step[n]));
            }
        }
    }
    for (n, finder) in finders.iter_mut().enumerate() {
        let (width, next, end) = (finder.search.width, finder.window.next, finder.window.end());
        finder.closed.extend(finder.open.take_if(|open| is_last || next > open.last + width + 1));
        let is_over = |closed: &mut Candidate| is_last || closed.best + 2 * width <= end;
        while let Some(candidate) = finder.closed.pop_front_if(is_over) {
            if let Some(ramp) = finder.ramp(candidate.best) {
                found(n, &finder.window, ramp);
            }
        }
    }
}
