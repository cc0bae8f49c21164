//! Samples at equal intervals, by linear interpolation between those that are not.

use crate::error::Result;
use crate::samples::{Block, Samples};

/// Samples whose first row is their time.
pub(crate) struct Resampled {
    samples: Box<dyn Samples>,
    interval: f64,
    /// Samples that are read and still needed, with their times.
    read: Block,
    /// The time of the first sample.
    first: Option<f64>,
    next: u64,
}

/// Part of an interval by which the last sample may be late, by rounding.
const ROUNDING: f64 = 1e-9;

impl Resampled {
    /// How many samples lie in a time.
    pub(crate) fn length(span: f64, interval: f64) -> u64 {
        (span / interval + ROUNDING).floor() as u64 + 1
    }

    /// Resamples all rows but the first, which has the times, in the unit of the interval.
    pub(crate) fn new(samples: Box<dyn Samples>, rows: usize, interval: f64) -> Resampled {
        Resampled { samples, interval, read: Block::new(rows + 1), first: None, next: 0 }
    }
}

impl Samples for Resampled {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize> {
        if self.first.is_none() {
            self.samples.next(most, &mut self.read)?;
            self.first = self.read.row(0, 0).next();
        }
        let Some(first) = self.first else { return Ok(0) };
        let mut behind = 0;
        for count in 0..most {
            let time = first + self.next as f64 * self.interval;
            loop {
                behind += self.read.row(0, behind).take_while(|known| *known < time).count();
                if behind < self.read.len() || self.samples.next(most, &mut self.read)? == 0 {
                    break;
                }
            }
            // The last sample may be late by rounding.
            let at = behind.min(self.read.len() - 1);
            let (before, next) = (self.read.sample(at.saturating_sub(1)), self.read.sample(at));
            if time - next[0] > self.interval * ROUNDING {
                self.read.drop_first(at);
                return Ok(count);
            }
            let share = if at == 0 { 0.0 } else { (time - before[0]) / (next[0] - before[0]) };
            let between =
                before.iter().zip(next).skip(1).map(|(before, next)| before + share * (next - before));
            block.push(&between.collect::<Vec<f64>>());
            self.next += 1;
        }
        let kept_from = behind.saturating_sub(1);
        self.read.drop_first(kept_from);
        Ok(most)
    }
}
