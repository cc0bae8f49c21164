//! Passes over the samples of a stream, from front to back.

use std::mem;
use std::ops::Range;
use std::sync::mpsc;
use std::thread;

use crate::description::Channel;
use crate::error::RecordingError;
use crate::recording::Recording;
use crate::resample::Resampled;
use crate::samples::{Block, Column, Rows, Samples};
use crate::survey::BLOCK;

/// Bytes of samples that are read while those before them are visited.
const AHEAD_BYTES: usize = 1 << 20;

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
        if is_apart || samples.start - self.first > kept / 2 {
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

    /// Takes samples with a range of a part out, and goes on in `room` with those from one on.
    fn take(
        &mut self,
        part: usize,
        samples: &Range<u64>,
        kept: u64,
        mut room: Block,
    ) -> Result<(u64, Block), RecordingError> {
        let first = self.rows(part, samples)?.first;
        room.copy(&self.kept, (kept - first) as usize);
        self.first = kept;
        Ok((first, mem::replace(&mut self.kept, room)))
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
    /// there, so many before that, and whether they are its last. The next ones are read meanwhile.
    pub(crate) fn pass(
        &self,
        stream: usize,
        channels: &[&Channel],
        before: u64,
        progress: &mut Progress<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), RecordingError> {
        let numbers = Block::new(channels.len()).stride() * BLOCK;
        let blocks = (AHEAD_BYTES / (numbers * size_of::<f64>())).max(before as usize / BLOCK).max(1);
        let parts = &self.streams[stream].parts;
        thread::scope(|scope| {
            let (give, read) = mpsc::sync_channel(1);
            let (give_back, visited) = mpsc::channel();
            scope.spawn(move || {
                let mut ranges = Ranges::new(self, stream, channels.to_vec());
                for part in self.order(stream) {
                    for first in (0..parts[part].samples).step_by(blocks * BLOCK) {
                        let end = parts[part].samples.min(first + (blocks * BLOCK) as u64);
                        let [from, kept] = [first, end].map(|sample| sample.saturating_sub(before));
                        let room = visited.try_recv().unwrap_or_else(|_| Block::new(channels.len()));
                        let rows = ranges.take(part, &(from..end), kept, room);
                        let is_last = rows.is_err();
                        // Whoever visits may have enough.
                        if give.send(rows.map(|rows| (part, first..end, rows))).is_err() || is_last {
                            return;
                        }
                    }
                }
            });
            for rows in read {
                let (part, samples, (from, mut block)) = rows?;
                for first in samples.clone().step_by(BLOCK) {
                    let end = samples.end.min(first + BLOCK as u64);
                    block.resize((end - from) as usize);
                    visit(part, first, &Rows { first: from, block: &block }, end == parts[part].samples)?;
                    progress.add(end - first)?;
                }
                drop(give_back.send(block));
            }
            Ok(())
        })
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
