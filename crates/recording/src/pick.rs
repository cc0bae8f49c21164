//! Candidates for steps in the samples of a channel, and the ramps of those that are.

use std::collections::VecDeque;

use crate::ramp::Ramp;
use crate::window::{Scatter, Window};

/// A candidate ends before so many windows behind its first index.
const LONGEST: u64 = 8;

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

    /// Adds samples, and passes on the ramps of candidates that are over, with the samples about them.
    pub(crate) fn extend(&mut self, samples: &[f64], is_last: bool, found: &mut dyn FnMut(&Window, Ramp)) {
        let Search { width, scatter, least, sign, .. } = self.search;
        let needed = self.closed.front().or(self.open.as_ref()).map_or(u64::MAX, |candidate| candidate.first);
        self.window.extend(samples, needed);
        let Finder { window, open, closed, others, last_other, .. } = self;
        // A little less, as rounding differs.
        let (middle, off) = (scatter.median, least - 1e-12 * (least + scatter.median.abs()));
        window.steps(u64::MAX, [middle - off, middle + off], |i, step| {
            let size = sign * (step - scatter.median);
            if size > least {
                closed
                    .extend(open.take_if(|open| i > open.last + width || i >= open.first + LONGEST * width));
                let open = open.get_or_insert(Candidate { first: i, last: i, best: i, most: size });
                open.last = i;
                if size > open.most {
                    (open.best, open.most) = (i, size);
                }
            } else if size < -least {
                *others += u64::from(*last_other == 0 || i > *last_other + width);
                *last_other = i;
            }
        });
        closed.extend(open.take_if(|open| window.next > open.last + width + 1));
        if is_last {
            self.closed.extend(self.open.take());
        }
        let end = self.window.end();
        while let Some(candidate) =
            self.closed.pop_front_if(|closed| is_last || closed.best + 2 * width <= end)
        {
            if let Some(ramp) = self.ramp(candidate.best) {
                found(&self.window, ramp);
            }
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
