//! Candidates for steps in the samples of a channel, and the ramps of those that are.

use std::collections::VecDeque;
use std::mem;

use crate::noise::OfPart;
use crate::pass::Piece;
use crate::ramp::Ramp;
use crate::samples::{LANES, Lanes, Rows};
use crate::window::Window;

/// A candidate ends before so many windows behind its first index.
const LONGEST: u64 = 8;

/// Windows of samples that are needed before new ones: a candidate of ten is not yet over, a ramp begins two before it, and
/// its arrival is looked for in three before that.
pub(crate) const BEHIND: u64 = 16;

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
    pub(crate) noise: OfPart,
    /// Least size of a step, as stored.
    pub(crate) least: f64,
    /// Of a step, as stored.
    pub(crate) sign: f64,
    /// Whether samples lose the trend of the part before ramps are fitted, and small ramps stay, as those of `F_T`.
    pub(crate) is_force: bool,
}

/// What is found of a channel while its samples come.
#[derive(Debug)]
struct Finder {
    search: Search,
    open: Option<Candidate>,
    closed: VecDeque<Candidate>,
    /// Of this sign and the other: the last index beyond the threshold, and whether it belongs to this piece.
    last: [(Option<u64>, bool); 2],
    /// From this index on a candidate begins in the next piece; the last one of a part has none so far.
    until: u64,
    /// Candidates of the other sign.
    others: u64,
}

impl Finder {
    /// The next step statistic, the one at this index.
    fn step(&mut self, i: u64, step: f64) {
        let Search { noise: OfPart { width, scatter, .. }, least, sign, .. } = self.search;
        let size = sign * (step - scatter.median);
        if size.abs() <= least {
            return;
        }
        let (last, is_own) = &mut self.last[usize::from(size < 0.0)];
        // What goes on from the piece before belongs to that.
        let is_new = last.replace(i).is_none_or(|last| i > last + width);
        *is_own = if is_new { i < self.until } else { *is_own };
        if *is_own && size > 0.0 {
            let is_over = |open: &mut Candidate| i > open.last + width || i >= open.first + LONGEST * width;
            self.closed.extend(self.open.take_if(is_over));
            let open = self.open.get_or_insert(Candidate { first: i, last: i, best: i, most: size });
            open.last = i;
            if size > open.most {
                (open.best, open.most) = (i, size);
            }
        } else {
            self.others += u64::from(*is_own && is_new);
        }
    }

    /// Whether all of its candidates have begun, are over and found, given the next index.
    fn is_done(&self, next: u64) -> bool {
        next >= self.until && self.open.is_none() && self.closed.is_empty()
    }

    fn ramp(&self, rows: &Rows<'_>, channel: usize, best: u64) -> Option<Ramp> {
        let Search { noise: OfPart { width, scatter, .. }, least, sign, is_force } = self.search;
        let first = best.saturating_sub(2 * width);
        let trend = if is_force { scatter.median / width as f64 } else { 0.0 };
        let samples = rows.of(channel, first..best + 2 * width).enumerate();
        let samples: Vec<f64> = samples.map(|(n, y)| y - trend * n as f64).collect();
        let ramp = Ramp::fit(&samples, first, best, width, sign)?;
        Some(ramp).filter(|ramp| is_force || ramp.size.abs() >= least)
    }
}

/// Finds the ramps of channels of a part, by windows of one width, while their samples come.
#[derive(Debug)]
pub(crate) struct Finders {
    window: Window,
    of: Vec<Finder>,
    steps: Vec<Lanes>,
}

impl Finders {
    /// Of channels that lie side by side, in a piece of a part.
    pub(crate) fn new(searches: &[Search], Piece { samples, .. }: &Piece) -> Finders {
        let width = searches[0].noise.width;
        let last = [(samples.start.checked_sub(1), false); 2];
        let finder = |search: &Search| {
            let (open, closed, until) = (None, VecDeque::new(), samples.end + width);
            Finder { search: *search, open, closed, last, until, others: 0 }
        };
        let of = searches.iter().map(finder).collect();
        Finders { window: Window::new(width, samples.start), of, steps: Vec::new() }
    }

    /// How many candidates of the other sign there were since this was asked.
    pub(crate) fn take_others(&mut self) -> u64 {
        self.of.iter_mut().map(|finder| mem::take(&mut finder.others)).sum()
    }

    /// Goes on through the samples of a group of channels, and passes on the ramps of candidates that are over, with their
    /// channel. Returns whether more samples may show more of them.
    pub(crate) fn extend(
        &mut self,
        rows: &Rows<'_>,
        group: usize,
        is_last: bool,
        found: &mut dyn FnMut(usize, Ramp),
    ) -> bool {
        let Finders { window, of, steps } = self;
        while let Some(first) = window.advance(rows, group, u64::MAX, steps) {
            // Of all together first, since most have none.
            let [least, most] = window.extremes;
            for (n, finder) in of.iter_mut().enumerate() {
                // A little less than the threshold, as rounding differs.
                let Search { noise: OfPart { scatter, .. }, least: size, .. } = finder.search;
                let off = size - 1e-12 * (size + scatter.median.abs());
                let is_beyond = |step: f64| step < scatter.median - off || step > scatter.median + off;
                if is_beyond(least[n]) || is_beyond(most[n]) {
                    let beyond = (first..).zip(&*steps).filter(|(_, step)| is_beyond(step[n]));
                    beyond.for_each(|(i, step)| finder.step(i, step[n]));
                }
            }
        }
        for (n, finder) in of.iter_mut().enumerate() {
            let (width, next, end, channel) = (window.width, window.next, rows.end(), group * LANES + n);
            finder.closed.extend(finder.open.take_if(|open| is_last || next > open.last + width + 1));
            let is_over = |closed: &mut Candidate| is_last || closed.best + 2 * width <= end;
            while let Some(candidate) = finder.closed.pop_front_if(is_over) {
                if let Some(ramp) = finder.ramp(rows, channel, candidate.best) {
                    found(channel, ramp);
                }
            }
        }
        !self.of.iter().all(|finder| finder.is_done(self.window.next))
    }
}
