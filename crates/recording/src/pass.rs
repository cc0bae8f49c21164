//! Passes over the samples of a stream, from front to back.

use std::ops::Range;

use crate::description::Channel;
use crate::error::RecordingError;
use crate::recording::Recording;
use crate::resample::Resampled;
use crate::samples::{Block, Column, Rows, Samples};
use crate::survey::BLOCK;

/// How far all passes over the samples have come.
pub(crate) struct Progress<'a> {
    /// Told how many samples were read, of how many; says whether to stop.
    pub(crate) watch: &'a mut dyn FnMut(u64, u64) -> bool,
    pub(crate) done: u64,
    pub(crate) of: u64,
}

impl Progress<'_> {
    /// Adds samples that were read, and asks whether to stop.
    pub(crate) fn add(&mut self, samples: u64) -> Result<(), RecordingError> {
        self.done += samples;
        if (self.watch)(self.done, self.of) { Err(RecordingError::Interrupted) } else { Ok(()) }
    }
}

/// What is made of samples: their part, the first new one there, those with some before, and whether they are its last.
type Visit<'a> = dyn FnMut(usize, u64, &Rows<'_>, bool) -> Result<(), RecordingError> + 'a;

/// Reads ranges of samples of a stream, whose beginnings ascend in the parts of a file.
pub(crate) struct Ranges<'a> {
    recording: &'a Recording,
    stream: usize,
    channels: Vec<&'a Channel>,
    /// The file that is open, and its next sample.
    open: Option<(usize, Box<dyn Samples>, u64)>,
    part: usize,
    first: u64,
    kept: Block,
}

impl<'a> Ranges<'a> {
    pub(crate) fn new(recording: &'a Recording, stream: usize, channels: Vec<&'a Channel>) -> Ranges<'a> {
        let kept = Block::new(channels.len());
        Ranges { recording, stream, channels, open: None, part: 0, first: 0, kept }
    }

    /// Samples with a range of a part.
    pub(crate) fn rows(&mut self, part: usize, samples: &Range<u64>) -> Result<Rows<'_>, RecordingError> {
        let kept = self.kept.len() as u64;
        let is_apart = part != self.part || samples.start >= self.first + kept;
        // Rarely, so that the rest is seldom moved.
        if is_apart || samples.start - self.first > kept * 3 / 4 {
            let dropped = if is_apart { kept } else { samples.start - self.first };
            self.kept.drop_first(dropped as usize);
            (self.part, self.first) = (part, samples.start);
        }
        let end = self.first + self.kept.len() as u64;
        if samples.end > end {
            let of = &self.recording.streams[self.stream].parts[part];
            self.read(of.from + end..of.from + samples.end.max(end + BLOCK as u64).min(of.samples))?;
        }
        Ok(Rows { first: self.first, block: &self.kept })
    }

    /// Adds samples of the file of the part, which do not lie before those read last.
    fn read(&mut self, samples: Range<u64>) -> Result<(), RecordingError> {
        let Ranges { recording, stream, channels, open, part, kept, .. } = self;
        let file = recording.streams[*stream].parts[*part].file;
        if open.as_ref().is_none_or(|(opened, ..)| *opened != file) {
            *open = Some((file, recording.samples(*stream, file, channels)?, 0));
        }
        let (_, source, next) = open.as_mut().expect("it was opened");
        while *next < samples.end {
            let ahead = samples.start.saturating_sub(*next).min(BLOCK as u64);
            let wanted = if ahead > 0 { ahead } else { samples.end - samples.start } as usize;
            let count = if ahead > 0 { source.skip(wanted, kept) } else { source.next(wanted, kept) }?;
            if count < wanted {
                let problem = format!("{} samples fewer than before", wanted - count);
                let accepted = "a file that does not change while it is read";
                return Err(recording.fault(*stream, *part, channels[0], None, problem, accepted).into());
            }
            *next += count as u64;
        }
        Ok(())
    }
}

impl Recording {
    /// Passes the samples of some channels to `visit`, block by block in order of time, with their part, the first of them
    /// there, so many before that, and whether they are its last.
    pub(crate) fn pass(
        &self,
        stream: usize,
        channels: &[&Channel],
        before: u64,
        progress: &mut Progress<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), RecordingError> {
        let mut ranges = Ranges::new(self, stream, channels.to_vec());
        for part in self.order(stream) {
            let samples = self.streams[stream].parts[part].samples;
            for first in (0..samples).step_by(BLOCK) {
                let end = samples.min(first + BLOCK as u64);
                let rows = ranges.rows(part, &(first.saturating_sub(before)..end))?;
                visit(part, first, &rows, end == samples)?;
                progress.add(end - first)?;
            }
        }
        Ok(())
    }

    fn samples(
        &self,
        stream: usize,
        file: usize,
        channels: &[&Channel],
    ) -> Result<Box<dyn Samples>, RecordingError> {
        let (stream, surveyed) = (&self.description.streams[stream], &self.streams[stream]);
        let columns = channels.iter().map(|channel| channel.column.clone());
        match &stream.time {
            Some(time) if stream.resample.is_some() => {
                let columns: Vec<Column> = [time.column.clone()].into_iter().chain(columns).collect();
                let samples = self.folder.open(stream, &surveyed.files[file], &columns)?;
                let stated = samples.unit(0).map(|(unit, _)| unit);
                let unit_s = time.unit_or(stated.as_deref()).map_or(1.0, |unit| unit.scale);
                Ok(Box::new(Resampled::new(samples, channels.len(), surveyed.interval_s / unit_s)))
            }
            _ => self.folder.open(stream, &surveyed.files[file], &columns.collect::<Vec<_>>()),
        }
    }
}
