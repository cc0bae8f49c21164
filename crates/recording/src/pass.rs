//! Passes over the samples of a stream, from front to back.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::description::{Channel, Column};
use crate::error::{RecordingError, Result};
use crate::recording::Recording;
use crate::resample::Resampled;
use crate::samples::{Block, Rows, Samples};
use crate::survey::BLOCK;
use crate::window::SUMMED;

/// Samples that are gone through at once: whole blocks, whose sums begin anew.
pub(crate) const PIECE: u64 = BLOCK as u64 * SUMMED / 8;

/// How far all passes over the samples have come.
pub(crate) struct Progress<'a> {
    /// Told how many samples were read, of how many; says whether to stop.
    pub(crate) watch: &'a Watch<'a>,
    pub(crate) done: AtomicU64,
    pub(crate) of: u64,
}

/// See [`Progress::watch`].
pub(crate) type Watch<'a> = dyn Fn(u64, u64) -> bool + Sync + 'a;

impl Progress<'_> {
    /// Adds samples that were read, and asks whether to stop.
    pub(crate) fn add(&self, samples: u64) -> Result<()> {
        let done = self.done.fetch_add(samples, Ordering::Relaxed) + samples;
        if (self.watch)(done, self.of) { Err(RecordingError::Interrupted) } else { Ok(()) }
    }
}

/// Samples of a part that are gone through together.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub(crate) part: usize,
    pub(crate) samples: Range<u64>,
}

/// What is made of samples: their piece, the first new one, those with some before, and whether they are the last of the
/// part. Returns whether more are wanted behind the piece.
type Visit<'a> = dyn FnMut(&Piece, u64, &Rows<'_>, bool) -> Result<bool> + 'a;

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
    pub(crate) fn rows(&mut self, part: usize, samples: &Range<u64>) -> Result<Rows<'_>> {
        let kept = self.kept.len() as u64;
        let is_apart = part != self.part || samples.start >= self.first + kept;
        // Rarely, so that the rest is seldom moved.
        if is_apart || samples.start - self.first > kept * 7 / 8 {
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
    fn read(&mut self, samples: Range<u64>) -> Result<()> {
        let Ranges { recording, stream, channels, open, part, kept, .. } = self;
        let file = recording.streams[*stream].parts[*part].file;
        if open.as_ref().is_none_or(|(opened, ..)| *opened != file) {
            *open = Some((file, recording.samples(*stream, file, channels)?, 0));
        }
        let (_, source, next) = open.as_mut().expect("it was opened");
        while *next < samples.end {
            let ahead = samples.start.saturating_sub(*next);
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
    /// The parts of a stream in order of time, in pieces of so many samples at most.
    pub(crate) fn pieces(&self, stream: usize, most: u64) -> Vec<Piece> {
        let pieces = |part: usize| {
            let all = self.streams[stream].parts[part].samples;
            let piece = move |from: u64| Piece { part, samples: from..all.min(from.saturating_add(most)) };
            (0..all).step_by(most as usize).map(piece)
        };
        (0..self.streams[stream].parts.len()).flat_map(pieces).collect()
    }

    /// Passes the samples of pieces to `visit`, block by block, with so many samples before, and behind them as long as
    /// more are wanted.
    pub(crate) fn pass(
        &self,
        stream: usize,
        channels: &[&Channel],
        before: u64,
        pieces: &[Piece],
        progress: &Progress<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<()> {
        let mut ranges = Ranges::new(self, stream, channels.to_vec());
        for piece in pieces {
            let samples = self.streams[stream].parts[piece.part].samples;
            let mut wants_more = false;
            for first in (piece.samples.start..samples).step_by(BLOCK) {
                let is_own = first < piece.samples.end;
                if !is_own && !wants_more {
                    break;
                }
                let end = samples.min(first + BLOCK as u64);
                let rows = ranges.rows(piece.part, &(first.saturating_sub(before)..end))?;
                wants_more = visit(piece, first, &rows, end == samples)?;
                progress.add(if is_own { end - first } else { 0 })?;
            }
        }
        Ok(())
    }

    fn samples(&self, stream: usize, file: usize, channels: &[&Channel]) -> Result<Box<dyn Samples>> {
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
