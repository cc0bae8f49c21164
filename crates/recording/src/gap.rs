//! Samples of which those with a missing number are left out.

use std::path::PathBuf;

use crate::error::{InputFault, RecordingError};
use crate::samples::{Block, Samples};

/// Most parts of a stream.
pub(crate) const MOST_PARTS: usize = 100_000;

/// Samples that are missing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// How many samples before it are not.
    pub(crate) at: u64,
    /// How many are missing.
    pub(crate) missing: u64,
}

/// Samples without those in which a row has no number.
pub(crate) struct Gapless {
    samples: Box<dyn Samples>,
    path: PathBuf,
    block: Block,
    gaps: Vec<Gap>,
    kept: u64,
}

impl Gapless {
    /// Of so many channels it passes on as many as are asked for, the first ones.
    pub(crate) fn new(samples: Box<dyn Samples>, path: PathBuf, all: usize) -> Gapless {
        Gapless { samples, path, block: Block::new(all), gaps: Vec::new(), kept: 0 }
    }
}

impl Samples for Gapless {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        let before = block.len();
        while block.len() < before + most {
            self.block.resize(0);
            let count = self.samples.next(before + most - block.len(), &mut self.block)?;
            if count == 0 {
                break;
            }
            for n in 0..count {
                if self.block.sample(n).iter().all(|number| number.is_finite()) {
                    block.push(self.block.sample(n));
                    self.kept += 1;
                    continue;
                }
                match self.gaps.last_mut().filter(|gap| gap.at == self.kept) {
                    Some(gap) => gap.missing += 1,
                    None => self.gaps.push(Gap { at: self.kept, missing: 1 }),
                }
            }
            if self.gaps.len() > MOST_PARTS {
                let accepted = "100000 gaps, or a file for each stream";
                return Err(InputFault::new(&self.path, "", "too many gaps", accepted).into());
            }
        }
        Ok(block.len() - before)
    }

    fn place(&self, sample: u64) -> String {
        self.samples.place(sample)
    }

    fn unit(&self, channel: usize) -> Option<(String, String)> {
        self.samples.unit(channel)
    }

    fn gaps(&self) -> &[Gap] {
        &self.gaps
    }
}
