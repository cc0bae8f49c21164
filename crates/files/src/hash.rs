//! The BLAKE3 hash of a file, most of which is hashed where it is read for another purpose.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::{Arc, Mutex};

use blake3::hazmat::{ChainingValue, HasherExt, Mode, merge_subtrees_non_root, merge_subtrees_root};
use blake3::{Hash, Hasher};

use crate::at_once;

/// Bytes of a group: a subtree of the hash.
const GROUP: u64 = 1 << 18;

/// Bytes that are hashed at once, beginning at multiples of so many: fewer take longer.
const UNIT: usize = 1 << 14;

/// Groups that a thread hashes before it takes others.
const MANY: u64 = 64;

/// What is known of the hash of a file: that of its groups of bytes, by their numbers.
#[derive(Debug, Default)]
pub struct PartlyHashed(Mutex<BTreeMap<u64, ChainingValue>>);

fn begun(group: u64) -> Hasher {
    let mut hasher = Hasher::new();
    hasher.set_input_offset(group * GROUP);
    hasher
}

impl PartlyHashed {
    fn known(&self, group: u64) -> Option<ChainingValue> {
        self.0.lock().expect("no thread panics with the lock").get(&group).copied()
    }

    /// Length and hash of the file, of which what is not known yet is read on all processors.
    ///
    /// # Errors
    /// If it cannot be opened, or, by `failed`, read.
    pub fn hash<S: Read + Seek, E: Send>(
        &self,
        open: impl Fn() -> Result<S, E> + Sync,
        failed: impl Fn(io::Error) -> E + Sync,
    ) -> Result<(u64, Hash), E> {
        let length = open()?.seek(SeekFrom::End(0)).map_err(&failed)?;
        let groups = length.div_ceil(GROUP);
        if groups < 2 {
            return Ok((length, Hasher::new().update_reader(open()?).map_err(failed)?.finalize()));
        }
        let firsts: Vec<u64> = (0..groups).step_by(MANY as usize).collect();
        let all = at_once(&firsts, None, |first| {
            let mut source = open()?;
            let mut of = |group| {
                if let Some(known) = self.known(group) {
                    return Ok(known);
                }
                source.seek(SeekFrom::Start(group * GROUP))?;
                Ok(begun(group).update_reader(source.by_ref().take(GROUP))?.finalize_non_root())
            };
            let of_group = |group| of(group).map_err(&failed);
            (*first..groups.min(first + MANY)).map(of_group).collect::<Result<Vec<_>, E>>()
        });
        let all = all?.concat();
        let (left, right) = all.split_at(all.len().next_power_of_two() / 2);
        Ok((length, merge_subtrees_root(&merged(left), &merged(right), Mode::Hash)))
    }
}

fn merged(groups: &[ChainingValue]) -> ChainingValue {
    if let [group] = groups {
        return *group;
    }
    let (left, right) = groups.split_at(groups.len().next_power_of_two() / 2);
    merge_subtrees_non_root(&merged(left), &merged(right), Mode::Hash)
}

/// A source that hashes the groups that are read of it from their beginning to their end.
pub struct Hashing<S> {
    source: S,
    known: Arc<PartlyHashed>,
    at: u64,
    /// Of the group that is being read, if it is not known, and its last bytes, less than a unit.
    hasher: Option<Hasher>,
    unit: Vec<u8>,
}

impl<S> Hashing<S> {
    /// Of a source at its beginning.
    pub fn new(source: S, known: Arc<PartlyHashed>) -> Hashing<S> {
        Hashing { source, known, at: 0, hasher: None, unit: Vec::new() }
    }
}

impl<S: Read> Read for Hashing<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        let mut rest = &buffer[..count];
        while !rest.is_empty() {
            let (group, place) = (self.at / GROUP, (self.at % GROUP) as usize);
            if place == 0 {
                self.hasher = self.known.known(group).is_none().then(|| begun(group));
                self.unit.clear();
            }
            let whole = rest.len() / UNIT * UNIT;
            let is_whole = whole > 0 && place.is_multiple_of(UNIT);
            let most = if is_whole { whole } else { rest.len().min(UNIT - place % UNIT) };
            let (bytes, behind) = rest.split_at(most.min(GROUP as usize - place));
            (self.at, rest) = (self.at + bytes.len() as u64, behind);
            let Some(hasher) = &mut self.hasher else { continue };
            if is_whole {
                hasher.update(bytes);
            } else {
                self.unit.extend_from_slice(bytes);
                if self.at.is_multiple_of(UNIT as u64) {
                    hasher.update(&self.unit);
                    self.unit.clear();
                }
            }
            if self.at.is_multiple_of(GROUP) {
                let hashed = hasher.finalize_non_root();
                self.known.0.lock().expect("no thread panics with the lock").insert(group, hashed);
            }
        }
        Ok(count)
    }
}

impl<S: Seek> Seek for Hashing<S> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = self.source.seek(to)?;
        if at != self.at {
            (self.at, self.hasher) = (at, None);
        }
        Ok(at)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read, Seek, SeekFrom};
    use std::sync::Arc;

    use super::{GROUP, Hashing, PartlyHashed, UNIT};

    #[test]
    fn the_hash_is_that_of_the_file_however_it_was_read() {
        let bytes: Vec<u8> = (0..9 * GROUP as u32 + 77).map(|n| (n.wrapping_mul(n) >> 7) as u8).collect();
        let unit = UNIT as u64;
        for length in [0, 1, GROUP, GROUP + 1, 4 * GROUP, 9 * GROUP + 77] {
            let of = &bytes[..length as usize];
            for each in [unit - 1, unit, 3 * GROUP + 5, 40_000] {
                for from in [0, unit, GROUP - 3, 5 * GROUP] {
                    let known = Arc::new(PartlyHashed::default());
                    let mut source = Hashing::new(Cursor::new(of), known.clone());
                    source.seek(SeekFrom::Start(from)).unwrap();
                    while source.by_ref().take(each).read_to_end(&mut Vec::new()).unwrap() > 0 {}
                    let groups = (length.min(9 * GROUP) / GROUP).saturating_sub(from.div_ceil(GROUP));
                    assert_eq!(known.0.lock().unwrap().len() as u64, groups, "{length} {each} {from}");
                    let found = known.hash(|| Ok(Cursor::new(of)), |error| error).unwrap();
                    assert_eq!(found, (length, blake3::hash(of)), "{length} {each} {from}");
                }
            }
        }
    }

    #[test]
    fn what_is_known_is_not_read_again() {
        let known = Arc::new(PartlyHashed::default());
        let bytes = vec![7; 3 * GROUP as usize];
        Hashing::new(&bytes[..], known.clone()).read_to_end(&mut Vec::new()).unwrap();
        let other = vec![8; bytes.len()];
        assert_eq!(known.hash(|| Ok(Cursor::new(&other)), |error| error).unwrap().1, blake3::hash(&bytes));
    }
}
