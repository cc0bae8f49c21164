//! Samples, whatever file or program they come from.

use std::ops::Range;

use crate::description::Channel;
use crate::error::Result;
use crate::survey::BLOCK;

/// Channels that lie side by side and are gone through together: as many numbers as the widest vector of a processor has.
pub(crate) const LANES: usize = 8;

/// A sample of channels that lie side by side.
pub(crate) type Lanes = [f64; LANES];

/// The next samples of some channels: one sample of all channels, then the next one. Behind the last channel lanes are
/// filled with zeros.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    channels: usize,
    /// Those of the samples from this place on, with room behind them. It begins a line of the processor's cache, so that
    /// the lanes of a group lie in one.
    numbers: Vec<f64>,
    from: usize,
    samples: usize,
}

impl Block {
    /// Without samples.
    pub(crate) fn new(channels: usize) -> Block {
        Block { channels, numbers: Vec::new(), from: 0, samples: 0 }
    }

    /// How many samples each channel has.
    pub(crate) fn len(&self) -> usize {
        self.samples
    }

    /// How many times [`LANES`] channels lie side by side.
    pub(crate) fn groups(&self) -> usize {
        self.channels.div_ceil(LANES).max(1)
    }

    /// Numbers from one sample of a channel to the next.
    pub(crate) fn stride(&self) -> usize {
        self.groups() * LANES
    }

    /// All numbers, those of a sample side by side.
    pub(crate) fn numbers(&mut self) -> &mut [f64] {
        let numbers = self.samples * self.stride();
        &mut self.numbers[self.from..][..numbers]
    }

    /// Changes the number of samples; new ones have any numbers until they are written.
    pub(crate) fn resize(&mut self, samples: usize) {
        let numbers = samples * self.stride();
        if numbers > self.numbers.len() - self.from {
            let mut room = vec![0.0; numbers.next_power_of_two() + LANES];
            let from = room.as_ptr().align_offset(size_of::<Lanes>()).min(LANES);
            room[from..][..self.samples * self.stride()].copy_from_slice(self.numbers());
            (self.numbers, self.from) = (room, from);
        }
        self.samples = samples;
    }

    /// A sample of all channels.
    pub(crate) fn sample(&self, sample: usize) -> &[f64] {
        &self.numbers[self.from + sample * self.stride()..][..self.channels]
    }

    /// Adds a sample, of as many channels as there are, the first ones of those that are given.
    pub(crate) fn push(&mut self, sample: &[f64]) {
        self.resize(self.len() + 1);
        let (channels, stride) = (self.channels, self.stride());
        let last = self.numbers().rchunks_exact_mut(stride).next().expect("it was added");
        last[..channels].copy_from_slice(&sample[..channels]);
    }

    /// A channel from a sample on.
    pub(crate) fn row(&self, channel: usize, from: usize) -> impl ExactSizeIterator<Item = f64> + Clone {
        self.lanes(channel / LANES, from).map(move |lanes| lanes[channel % LANES])
    }

    /// A group of channels from a sample on.
    pub(crate) fn lanes(&self, group: usize, from: usize) -> impl ExactSizeIterator<Item = &Lanes> + Clone {
        let lanes = self.numbers[self.from..].as_chunks().0;
        let samples = from * self.groups()..self.samples * self.groups();
        lanes[samples].chunks_exact(self.groups()).map(move |lanes| &lanes[group])
    }

    /// Leaves out the first samples.
    pub(crate) fn drop_first(&mut self, samples: usize) {
        let (dropped, stride) = (samples.min(self.samples), self.stride());
        self.numbers().copy_within(dropped * stride.., 0);
        self.samples -= dropped;
    }
}

/// Samples of a part, the first of them at this place of it.
pub(crate) struct Rows<'a> {
    pub(crate) first: u64,
    pub(crate) block: &'a Block,
}

impl Rows<'_> {
    /// One past the last sample.
    pub(crate) fn end(&self) -> u64 {
        self.first + self.block.len() as u64
    }

    /// A range of samples of a channel, cut to those that are there.
    pub(crate) fn of(&self, channel: usize, samples: Range<u64>) -> impl ExactSizeIterator<Item = f64> {
        let [from, to] = [samples.start, samples.end].map(|place| place.clamp(self.first, self.end()));
        self.block.row(channel, (from - self.first) as usize).take(to.saturating_sub(from) as usize)
    }

    /// The same in SI units.
    pub(crate) fn si(&self, n: usize, channel: &Channel, samples: Range<u64>) -> impl Iterator<Item = f64> {
        self.of(n, samples).map(|stored| channel.si(stored))
    }
}

/// Samples of some channels, read once from front to back. Files are one source of them; an array in memory is
/// another.
pub(crate) trait Samples {
    /// Adds the next samples to a block. Returns how many: fewer only at the end.
    ///
    /// # Errors
    /// If the source cannot be read, or holds something other than numbers.
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize>;

    /// Passes over so many samples, for which it may use room behind those of the block. Returns as [`Samples::next`] does.
    ///
    /// # Errors
    /// As that.
    fn skip(&mut self, most: usize, block: &mut Block) -> Result<usize> {
        let (before, mut passed) = (block.len(), 0);
        while let count @ 1.. = self.next(BLOCK.min(most - passed), block)? {
            block.resize(before);
            passed += count;
        }
        Ok(passed)
    }

    /// Where a sample stands, for messages.
    fn place(&self, sample: u64) -> String {
        format!(": sample {sample}")
    }

    /// The unit of a channel, from 0, if the source itself states it, and where.
    fn unit(&self, _channel: usize) -> Option<(String, String)> {
        None
    }
}
