//! Samples from arrays of numbers, in a file, in memory or in a container of arrays.

use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use multiversion::multiversion;
use serde::Deserialize;

use crate::description::{Axis, Column, Stream};
use crate::error::{InputFault, Result};
use crate::samples::{Block, LANES, Samples};

/// Most bytes of arrays of a file that cannot be read piece by piece.
pub(crate) const MOST_IN_MEMORY: u64 = 1 << 30;

/// Bytes that are read at once where channels are interleaved: they stay in the cache until all channels are decoded.
const PIECE_BYTES: u64 = 1 << 18;

/// Samples that stay in the fastest cache until all channels are decoded, where each lies by itself.
const FEW: u64 = 64;

const MOST_CHANNELS: u64 = 1 << 16;

/// What is wrong with a file, in our words or those of a library.
pub(crate) type Problem = Box<dyn std::error::Error>;

/// Decodes bytes in pieces of so many numbers: of each the numbers in a range, to the beginning of each row of so many.
type Decode = fn(&[u8], usize, Range<usize>, &mut [f64], usize);

/// Numbers as they are stored.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Numbers {
    pub(crate) bytes: u64,
    /// Whether each is finite.
    pub(crate) are_integers: bool,
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
                #[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2"))]
                fn decode(bytes: &[u8], piece: usize, wanted: Range<usize>, to: &mut [f64], apart: usize) {
                    let numbers = bytes.as_chunks().0;
                    let number = |stored: &[u8; size_of::<$Number>()]| <$Number>::$from(*stored) as f64;
                    let write = |from: &[[u8; size_of::<$Number>()]], to: &mut [f64]| {
                        to.iter_mut().zip(from).for_each(|(to, from)| *to = number(from));
                    };
                    if wanted.len() == 1 {
                        let of = numbers.iter().skip(wanted.start).step_by(piece);
                        return to.iter_mut().step_by(apart).zip(of).for_each(|(to, from)| *to = number(from));
                    }
                    for (piece, row) in numbers.chunks_exact(piece).zip(to.chunks_mut(apart)) {
                        let (many, rest) = piece[wanted.clone()].as_chunks::<LANES>();
                        let (to_many, to_rest) = row[..wanted.len()].as_chunks_mut::<LANES>();
                        to_many.iter_mut().zip(many).for_each(|(to, from)| write(from, to));
                        write(rest, to_rest);
                    }
                }
                Some(Numbers { bytes: size_of::<$Number>() as u64, are_integers: !name.contains('f'), decode })
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

/// Reads samples of channels, numbered from 0, to the beginning of each row of so many numbers.
pub(crate) type ReadGrid = dyn FnMut(Range<u64>, &[u64], &mut [f64], usize) -> io::Result<()>;

/// An array of one or two dimensions.
pub(crate) struct Grid {
    pub(crate) samples: u64,
    pub(crate) channels: u64,
    /// Whether it holds finite numbers only.
    pub(crate) is_finite: bool,
    pub(crate) read: Box<ReadGrid>,
}

/// An array, or what is wrong with it.
pub(crate) type Opened = Result<Grid, Problem>;

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

/// The array whose numbers lie together from a byte of a source on, up to its end; columns do if `is_fortran`.
pub(crate) fn stored(
    mut source: Box<dyn Source>,
    at: u64,
    numbers: Numbers,
    is_fortran: bool,
    mut sizes: Vec<u64>,
    mut axis: Axis,
) -> Opened {
    let Numbers { bytes, are_integers, decode } = numbers;
    let length = source.seek(SeekFrom::End(0))?;
    let stated = sizes.iter().try_fold(bytes, |all, size| all.checked_mul(*size));
    if stated.and_then(|stated| stated.checked_add(at)) != Some(length) {
        return Err(format!("{length} bytes, which is not what its header says").into());
    }
    if is_fortran {
        (sizes, axis) = (sizes.into_iter().rev().collect(), axis.turned());
    }
    let [(samples, piece), (channels, between)] = sides(&sizes, axis)?;
    let mut held = Vec::new();
    // Reads so many numbers from one on, behind so many that are held.
    let mut fetch = move |held: &mut Vec<u8>, before: u64, from: u64, count: u64| -> io::Result<()> {
        let [before, count] = [before, count].map(|numbers| (numbers * bytes) as usize);
        held.resize(before + count, 0);
        source.seek(SeekFrom::Start(at + from * bytes))?;
        source.read_exact(&mut held[before..])
    };
    let read: Box<ReadGrid> = Box::new(move |samples, channels, to, apart| {
        let count = samples.end - samples.start;
        if piece == 1 {
            for (n, channel) in (0..).zip(channels) {
                fetch(&mut held, n * count, channel * between + samples.start, count)?;
            }
            for first in (0..count).step_by(FEW as usize) {
                for (n, row) in held.chunks_exact((count * bytes) as usize).enumerate() {
                    let few = first * bytes..count.min(first + FEW) * bytes;
                    let few = &row[few.start as usize..few.end as usize];
                    decode(few, 1, 0..1, &mut to[first as usize * apart + n..], apart);
                }
            }
            return Ok(());
        }
        let at_once = (PIECE_BYTES / (piece * bytes)).max(1);
        for first in samples.clone().step_by(at_once as usize) {
            fetch(&mut held, 0, first * piece, at_once.min(samples.end - first) * piece)?;
            let mut at = (first - samples.start) as usize * apart;
            for neighbours in channels.chunk_by(|a, b| a + 1 == *b) {
                let wanted = neighbours[0] as usize..neighbours[0] as usize + neighbours.len();
                decode(&held, piece as usize, wanted, &mut to[at..], apart);
                at += neighbours.len();
            }
        }
        Ok(())
    });
    Ok(Grid { samples, channels, is_finite: are_integers, read })
}

/// Whether all numbers are finite, without a branch at each.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2"))]
fn are_finite(numbers: &[f64]) -> bool {
    numbers.iter().fold(true, |all, number| all & number.is_finite())
}

/// Arrays side by side, each with the channels of it that are read.
pub(crate) struct Arrays {
    path: PathBuf,
    columns: Vec<Column>,
    grids: Vec<(Grid, Vec<u64>)>,
    samples: u64,
    next: u64,
    /// Whether numbers may not be finite, and must.
    are_judged: bool,
}

impl Arrays {
    /// Opens columns of a stream. Those with a number are channels of the array `dataset`, a name is that of an array,
    /// in place of a `*` in `dataset`. `find` opens an array by its name.
    pub(crate) fn open(
        shown: &Path,
        stream: &Stream,
        columns: &[Column],
        find: &mut dyn FnMut(&str) -> Opened,
    ) -> Result<Arrays> {
        let mut grids: Vec<(Grid, Vec<u64>)> = Vec::new();
        let mut opened = None;
        for column in columns {
            let refused = |problem: Problem| {
                let accepted = "arrays of integers or floating-point numbers, of one or two dimensions";
                InputFault::new(shown, "", problem.to_string(), accepted).of(column, None)
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
            let count = grid.channels;
            let channel = number.unwrap_or(if count == 1 { 1 } else { 0 });
            if !(1..=count).contains(&channel) {
                return Err(refused(format!("no such channel; there are {count}").into()).into());
            }
            channels.push(channel - 1);
        }
        let lengths: Vec<u64> = grids.iter().map(|(grid, _)| grid.samples).collect();
        if !lengths.iter().all(|length| *length == lengths[0]) {
            let problem = format!("arrays of {lengths:?} samples");
            return Err(InputFault::new(shown, "", problem, "arrays of equal length").into());
        }
        let (path, columns) = (shown.to_owned(), columns.to_vec());
        let are_judged = stream.missing.is_none() && !grids.iter().all(|(grid, _)| grid.is_finite);
        Ok(Arrays { path, columns, grids, samples: lengths[0], next: 0, are_judged })
    }
}

impl Samples for Arrays {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize> {
        let count = (most as u64).min(self.samples - self.next);
        let (apart, before) = (block.stride(), block.len());
        block.resize(before + count as usize);
        let read = &mut block.numbers()[before * apart..];
        let mut place = 0;
        for (grid, channels) in self.grids.iter_mut().filter(|_| count > 0) {
            let fault = |error: io::Error| {
                let ends = error.kind() == io::ErrorKind::UnexpectedEof;
                let problem = if ends { "it ends here".to_owned() } else { error.to_string() };
                let accepted = "a sound file that does not change while it is read";
                InputFault::new(&self.path, format!(": sample {}", self.next), problem, accepted)
            };
            let samples = self.next..self.next + count;
            (grid.read)(samples, channels, &mut read[place..], apart).map_err(fault)?;
            place += channels.len();
        }
        if self.are_judged
            && !are_finite(read)
            && let Some(at) = read.iter().position(|value| !value.is_finite())
        {
            let (place, value) = (self.place(self.next + (at / apart) as u64), read[at]);
            let fault = InputFault::new(&self.path, place, "not a finite number", "a finite number");
            return Err(fault.of(&self.columns[at % apart], Some(&value.to_string())).into());
        }
        self.next += count;
        Ok(count as usize)
    }

    fn skip(&mut self, most: usize, _block: &mut Block) -> Result<usize> {
        let count = (most as u64).min(self.samples - self.next);
        self.next += count;
        Ok(count as usize)
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
        let mut row = [0.0; 10];
        for (n, (name, stored)) in [
            ("<i2", &[0xfe, 0xff, 1, 0][..]),
            (">u2", &[0xff, 0xfe, 0, 1]),
            ("|i1", &[0x80, 1]),
            ("<f4", &[0, 0, 0xc0, 0x3f, 0, 0, 0x80, 0x3f]),
            ("=u8", &[0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
        ]
        .into_iter()
        .enumerate()
        {
            // The first of two, as of interleaved channels, and both.
            let Numbers { decode, are_integers, .. } = Numbers::of(name).unwrap();
            decode(stored, 2, 0..2, &mut row[2 * n..], 2);
            let mut second = [0.0];
            decode(stored, 2, 1..2, &mut second, 1);
            assert!(second[0] == row[2 * n + 1] && are_integers != name.contains('f'), "{name}");
        }
        assert_eq!(row, [-2.0, 1.0, 65534.0, 1.0, -128.0, 1.0, 1.5, 1.0, 4_294_967_296.0, 1.0]);
        assert!(["<f2", "i2", "<c8", "<i3", "é", ""].iter().all(|name| Numbers::of(name).is_none()));
    }
}
