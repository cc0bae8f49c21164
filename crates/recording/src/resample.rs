//! Samples at equal intervals, by linear interpolation between those that are not.

use crate::error::RecordingError;
use crate::samples::{Block, Samples};

/// Samples whose first row is their time.
pub(crate) struct Resampled {
    samples: Box<dyn Samples>,
    interval: f64,
    /// Samples that are read and still needed, with their times.
    read: Block,
    block: Block,
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
        let (read, block) = (vec![Vec::new(); rows + 1], vec![Vec::new(); rows + 1]);
        Resampled { samples, interval, read, block, first: None, next: 0 }
    }

    /// Reads on; false at the end.
    fn more(&mut self, most: usize) -> Result<bool, RecordingError> {
        let count = self.samples.next(most, &mut self.block)?;
        for (row, new) in self.read.iter_mut().zip(&self.block) {
            row.extend(new);
        }
        Ok(count > 0)
    }
}

impl Samples for Resampled {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        block.iter_mut().for_each(Vec::clear);
        if self.first.is_none() {
            self.more(most)?;
            self.first = self.read[0].first().copied();
        }
        let Some(first) = self.first else { return Ok(0) };
        let mut behind = 0;
        for count in 0..most {
            let time = first + self.next as f64 * self.interval;
            loop {
                behind += self.read[0][behind..].iter().take_while(|known| **known < time).count();
                if behind < self.read[0].len() || !self.more(most)? {
                    break;
                }
            }
            let times = &self.read[0];
            // The last sample may be late by rounding.
            let at = behind.min(times.len() - 1);
            if time - times[at] > self.interval * ROUNDING {
                self.read.iter_mut().for_each(|row| drop(row.drain(..at)));
                return Ok(count);
            }
            for (row, from) in block.iter_mut().zip(&self.read[1..]) {
                row.push(match at {
                    0 => from[0],
                    _ => {
                        let share = (time - times[at - 1]) / (times[at] - times[at - 1]);
                        from[at - 1] + share * (from[at] - from[at - 1])
                    }
                });
            }
            self.next += 1;
        }
        let kept_from = behind.saturating_sub(1);
        self.read.iter_mut().for_each(|row| drop(row.drain(..kept_from)));
        Ok(most)
    }
}
