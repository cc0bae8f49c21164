//! Samples from arrays of numbers, in a file, in memory or in a container of arrays.

use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::description::{Axis, Stream};
use crate::error::{InputFault, Place, RecordingError};
use crate::samples::{Block, Column, Samples};

/// Most bytes of arrays of a file that cannot be read piece by piece.
pub(crate) const MOST_IN_MEMORY: u64 = 1 << 30;

/// Bytes that are read at once where channels are interleaved: they stay in the cache until all channels are decoded.
const PIECE_BYTES: u64 = 1 << 18;

/// Samples that are decoded channel by channel.
const FEW: usize = 256;

const MOST_CHANNELS: u64 = 1 << 16;

/// What is wrong with a file, in our words or those of a library.
pub(crate) type Problem = Box<dyn std::error::Error>;

/// Appends numbers to a row: of the bytes, in pieces of so many each, the one that starts so far into each piece.
type Decode = fn(&[u8], usize, usize, &mut Vec<f64>);

/// Numbers as they are stored.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Numbers {
    pub(crate) bytes: u64,
    pub(crate) decode: Decode,
}

impl Numbers {
    /// Of the name that NumPy has for them: `<` or `>` (last byte first), `i`, `u` or `f`, and the number of bytes.
    pub(crate) fn of(name: &str) -> Option<Numbers> {
        macro_rules! numbers {
            ($($kind:literal: $Number:ident,)+) => {
                match (name.get(..1)?, name.get(1..)?) {
                    $(("<" | "=" | "|", $kind) => numbers!($Number, from_le_bytes),
                    (">", $kind) => numbers!($Number, from_be_bytes),)+
                    _ => None,
                }
            };
            ($Number:ident, $from:ident) => {{
                let decode: Decode = |stored, piece, at, row| {
                    const BYTES: usize = size_of::<$Number>();
                    let (numbers, first) = (stored.as_chunks::<BYTES>().0, at / BYTES);
                    let number = |stored: [u8; BYTES]| <$Number>::$from(stored) as f64;
                    match piece / BYTES {
                        1 => row.extend(numbers.iter().map(|stored| number(*stored))),
                        apart => row.extend(numbers.chunks_exact(apart).map(|piece| number(piece[first]))),
                    }
                };
                Some(Numbers { bytes: size_of::<$Number>() as u64, decode })
            }};
        }
        numbers!("i1": i8, "i2": i16, "i4": i32, "i8": i64, "u1": u8, "u2": u16, "u4": u32, "u8": u64, "f4": f32, "f8": f64,)
    }
}

impl TryFrom<String> for Numbers {
    type Error = &'static str;

    fn try_from(name: String) -> Result<Numbers, &'static str> {
        Numbers::of(&name).ok_or("accepted: < or > before i1, i2, i4, i8, u1, u2, u4, u8, f4, f8")
    }
}

/// An array of one or two dimensions.
pub(crate) trait Grid {
    /// How many samples and channels it has.
    fn sides(&self) -> [u64; 2];

    /// Appends samples of channels, numbered from 0, to rows.
    fn read(&mut self, from: u64, count: u64, channels: &[u64], rows: &mut [Vec<f64>]) -> io::Result<()>;
}

/// An array, or what is wrong with it.
pub(crate) type Opened = Result<Box<dyn Grid>, Problem>;

/// Where bytes come from.
pub trait Source: Read + Seek {}
impl<S: Read + Seek> Source for S {}

/// Samples and channels of an array, and how many numbers the next one of either is further on, with the first index
/// the slowest one. Of a single dimension all are samples.
pub(crate) fn sides(sizes: &[u64], axis: Axis) -> Result<[(u64, u64); 2], Problem> {
    let sides = match *sizes {
        [samples] => [(samples, 1), (1, samples)],
        [rows, across] if axis == Axis::ChannelsFirst => [(across, 1), (rows, across)],
        [rows, across] => [(rows, across), (across, 1)],
        _ => return Err(format!("an array of {} dimensions", sizes.len()).into()),
    };
    if sides[1].0 > MOST_CHANNELS {
        return Err(format!("{} channels; axis says which side they are", sides[1].0).into());
    }
    Ok(sides)
}

/// Reads the rest of a source, as long as there is room.
pub(crate) fn whole(source: impl Read, room: &mut u64) -> Result<Vec<u8>, Problem> {
    let mut bytes = Vec::new();
    source.take(*room + 1).read_to_end(&mut bytes)?;
    *room = room.checked_sub(bytes.len() as u64).ok_or("more than 1 GiB, which is read whole")?;
    Ok(bytes)
}

/// An array whose numbers lie together.
pub(crate) struct Stored {
    source: Box<dyn Source>,
    numbers: Numbers,
    at: u64,
    sides: [(u64, u64); 2],
    bytes: Vec<u8>,
}

impl Stored {
    /// The array from a byte of a source on, up to its end. Columns lie together if `is_fortran`.
    pub(crate) fn open(
        mut source: Box<dyn Source>,
        at: u64,
        numbers: Numbers,
        is_fortran: bool,
        mut sizes: Vec<u64>,
        mut axis: Axis,
    ) -> Opened {
        let length = source.seek(SeekFrom::End(0))?;
        let stated = sizes.iter().try_fold(numbers.bytes, |all, size| all.checked_mul(*size));
        if stated.and_then(|stated| stated.checked_add(at)) != Some(length) {
            return Err(format!("{length} bytes, which is not what its header says").into());
        }
        if is_fortran {
            (sizes, axis) = (sizes.into_iter().rev().collect(), axis.turned());
        }
        let sides = sides(&sizes, axis)?;
        Ok(Box::new(Stored { source, numbers, at, sides, bytes: Vec::new() }))
    }

    /// Reads so many numbers from one on.
    fn fetch(&mut self, from: u64, count: u64) -> io::Result<()> {
        self.bytes.resize((count * self.numbers.bytes) as usize, 0);
        self.source.seek(SeekFrom::Start(self.at + from * self.numbers.bytes))?;
        self.source.read_exact(&mut self.bytes)
    }
}

impl Grid for Stored {
    fn sides(&self) -> [u64; 2] {
        self.sides.map(|(count, _)| count)
    }

    fn read(&mut self, from: u64, count: u64, channels: &[u64], rows: &mut [Vec<f64>]) -> io::Result<()> {
        let (Numbers { bytes, decode }, [(_, apart), (_, between)]) = (self.numbers, self.sides);
        if apart == 1 {
            for (channel, row) in channels.iter().zip(rows) {
                self.fetch(channel * between + from, count)?;
                decode(&self.bytes, bytes as usize, 0, row);
            }
            return Ok(());
        }
        let piece = (PIECE_BYTES / (apart * bytes)).max(1);
        for first in (from..from + count).step_by(piece as usize) {
            self.fetch(first * apart, piece.min(from + count - first) * apart)?;
            // What stays in the fastest cache until all channels are decoded.
            for few in self.bytes.chunks((apart * bytes) as usize * FEW) {
                for (channel, row) in channels.iter().zip(&mut *rows) {
                    decode(few, (apart * bytes) as usize, (channel * bytes) as usize, row);
                }
            }
        }
        Ok(())
    }
}

/// Arrays side by side, each with the channels of it that are read.
pub(crate) struct Arrays {
    path: PathBuf,
    columns: Vec<Column>,
    grids: Vec<(Box<dyn Grid>, Vec<u64>)>,
    samples: u64,
    next: u64,
    are_complete: bool,
}

impl Arrays {
    /// Opens columns of a stream. Those with a number are channels of the array `dataset`, a name is that of an array,
    /// in place of a `*` in `dataset`. `find` opens an array by its name.
    pub(crate) fn open(
        shown: &Path,
        stream: &Stream,
        columns: &[Column],
        find: &mut dyn FnMut(&str) -> Opened,
    ) -> Result<Arrays, RecordingError> {
        let mut grids: Vec<(Box<dyn Grid>, Vec<u64>)> = Vec::new();
        let mut opened = None;
        for column in columns {
            let refused = |problem: Problem| {
                let accepted = "arrays of integers or floating-point numbers, of one or two dimensions";
                InputFault::new(shown, Place::File, problem.to_string(), accepted).of(column)
            };
            let dataset = stream.dataset.as_deref().unwrap_or("*");
            let (name, number) = match column {
                Column::Name(name) => (dataset.replace('*', name), None),
                Column::Number(number) => (dataset.replace('*', ""), Some(*number)),
            };
            if opened.as_ref() != Some(&name) {
                grids.push((find(&name).map_err(refused)?, Vec::new()));
                opened = Some(name);
            }
            let (grid, channels) = grids.last_mut().expect("it was opened");
            let count = grid.sides()[1];
            let channel = number.unwrap_or(if count == 1 { 1 } else { 0 });
            if !(1..=count).contains(&channel) {
                return Err(refused(format!("no such channel; there are {count}").into()).into());
            }
            channels.push(channel - 1);
        }
        let lengths: Vec<u64> = grids.iter().map(|(grid, _)| grid.sides()[0]).collect();
        if !lengths.iter().all(|length| *length == lengths[0]) {
            let problem = format!("arrays of {lengths:?} samples");
            return Err(InputFault::new(shown, Place::File, problem, "arrays of equal length").into());
        }
        let (path, columns) = (shown.to_owned(), columns.to_vec());
        let are_complete = stream.missing.is_none();
        Ok(Arrays { path, columns, grids, samples: lengths[0], next: 0, are_complete })
    }
}

impl Samples for Arrays {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        let count = (most as u64).min(self.samples - self.next);
        block.iter_mut().for_each(Vec::clear);
        let mut rows = &mut block[..];
        for (grid, channels) in &mut self.grids {
            let (of_grid, others) = rows.split_at_mut(channels.len());
            grid.read(self.next, count, channels, of_grid).map_err(|error| {
                let problem = match error.kind() {
                    io::ErrorKind::UnexpectedEof => "it ends here".to_owned(),
                    _ => error.to_string(),
                };
                let accepted = "a sound file that does not change while it is read";
                InputFault::new(&self.path, Place::Sample(self.next), problem, accepted)
            })?;
            rows = others;
        }
        for (row, column) in block.iter().zip(&self.columns).filter(|_| self.are_complete) {
            // Several at a time first, since most have none.
            let has_any = |few: &[f64]| few.iter().fold(false, |any, value| any | !value.is_finite());
            if row.chunks(64).any(has_any)
                && let Some(at) = row.iter().position(|value| !value.is_finite())
            {
                let place = Place::Sample(self.next + at as u64);
                let fault = InputFault::new(&self.path, place, "not a finite number", "a finite number");
                return Err(fault.of(column).with(Some(row[at].to_string())).into());
            }
        }
        self.next += count;
        Ok(count as usize)
    }

    fn skip(&mut self, most: usize, _block: &mut Block) -> Result<usize, RecordingError> {
        let count = (most as u64).min(self.samples - self.next);
        self.next += count;
        Ok(count as usize)
    }

    fn known_length(&self) -> Option<u64> {
        Some(self.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::{Numbers, whole};

    #[test]
    fn what_has_no_room_is_refused() {
        let mut room = 10;
        assert_eq!(whole(&[7; 8][..], &mut room).unwrap(), [7; 8]);
        let error = whole(&[7; 3][..], &mut room).unwrap_err().to_string();
        assert!(error.contains("1 GiB") && room == 2, "{error}");
    }

    #[test]
    fn numbers_of_any_kind_are_decoded() {
        let mut row = Vec::new();
        for (name, stored) in [
            ("<i2", &[0xfe, 0xff, 1, 0][..]),
            (">u2", &[0xff, 0xfe, 0, 1]),
            ("|i1", &[0x80, 1]),
            ("<f4", &[0, 0, 0xc0, 0x3f, 0, 0, 0x80, 0x3f]),
            ("=u8", &[0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
        ] {
            let Numbers { bytes, decode } = Numbers::of(name).unwrap();
            // The first of two, as of interleaved channels, then the second.
            decode(stored, 2 * bytes as usize, 0, &mut row);
            decode(stored, 2 * bytes as usize, bytes as usize, &mut row);
        }
        assert_eq!(row, [-2.0, 1.0, 65534.0, 1.0, -128.0, 1.0, 1.5, 1.0, 4_294_967_296.0, 1.0]);
        assert!(["<f2", "i2", "<c8", "<i3", "é", ""].iter().all(|name| Numbers::of(name).is_none()));
    }
}
