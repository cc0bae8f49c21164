//! Samples of which those with a missing number are left out.

use std::path::PathBuf;

use crate::error::{InputFault, Place, RecordingError};
use crate::samples::{Block, Samples};

/// Most parts of a stream.
pub(crate) const MOST_PARTS: usize = 100_000;

/// Samples that are missing.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    /// How many samples before it are not.
    pub at: u64,
    /// How many are missing.
    pub missing: u64,
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
    /// Of so many rows it passes on as many as are asked for, the first ones.
    pub(crate) fn new(samples: Box<dyn Samples>, path: PathBuf, all: usize) -> Gapless {
        Gapless { samples, path, block: vec![Vec::new(); all], gaps: Vec::new(), kept: 0 }
    }
}

impl Samples for Gapless {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        block.iter_mut().for_each(Vec::clear);
        while block[0].len() < most {
            let count = self.samples.next(most - block[0].len(), &mut self.block)?;
            if count == 0 {
                break;
            }
            for n in 0..count {
                if self.block.iter().all(|row| row[n].is_finite()) {
                    block.iter_mut().zip(&self.block).for_each(|(to, from)| to.push(from[n]));
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
                return Err(InputFault::new(&self.path, Place::File, "too many gaps", accepted).into());
            }
        }
        Ok(block[0].len())
    }

    fn place(&self, sample: u64) -> Place {
        self.samples.place(sample)
    }

    fn unit(&self, channel: usize) -> Option<String> {
        self.samples.unit(channel)
    }

    fn gaps(&self) -> &[Gap] {
        &self.gaps
    }
}
