//! Reads arrays of NumPy, one block after the other.
//!
//! The libraries for this format parse its header, a Python dictionary of three known keys, with a grammar whose tools
//! build C code; the header is therefore read here.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::error::{InputFault, Place, RecordingError};
use crate::samples::{Block, Column, Samples};

/// The longest header that is read.
const LONGEST_HEADER_BYTES: usize = 1 << 16;

const ACCEPTED: &str = "an array of NumPy of integers or floating-point numbers, of one or two dimensions";

/// Numbers as they are stored: kind (`i`, `u`, `f`), bytes, whether the last byte comes first.
#[derive(Debug, Clone, Copy)]
struct Numbers {
    kind: u8,
    bytes: usize,
    is_big_endian: bool,
}

impl Numbers {
    fn of(word: &str) -> Option<Numbers> {
        let [order, kind, bytes] = *word.as_bytes() else { return None };
        let bytes = usize::from(bytes.checked_sub(b'0')?);
        let is_known = matches!((kind, bytes), (b'i' | b'u', 1 | 2 | 4 | 8) | (b'f', 4 | 8));
        let is_ordered = matches!(order, b'<' | b'>' | b'|' | b'=');
        (is_known && is_ordered).then_some(Numbers { kind, bytes, is_big_endian: order == b'>' })
    }

    fn read(self, stored: &[u8]) -> f64 {
        let mut bytes = [0; 8];
        bytes[..self.bytes].copy_from_slice(stored);
        if self.is_big_endian {
            bytes[..self.bytes].reverse();
        }
        let (whole, unused) = (u64::from_le_bytes(bytes), 64 - 8 * self.bytes as u32);
        match (self.kind, self.bytes) {
            (b'f', 4) => f64::from(f32::from_bits(whole as u32)),
            (b'f', _) => f64::from_bits(whole),
            // Shifted up and back, so that the sign is repeated.
            (b'i', _) => ((whole << unused) as i64 >> unused) as f64,
            _ => whole as f64,
        }
    }
}

/// A file of one array: `channels` times `samples` numbers, of one channel `stride` numbers apart.
pub(crate) struct Npy {
    file: File,
    path: PathBuf,
    numbers: Numbers,
    data_at: u64,
    samples: u64,
    /// How many numbers the next sample of a channel, and the next channel, are further on.
    strides: [u64; 2],
    /// Numbers of the wanted channels, from 0.
    channels: Vec<u64>,
    next: u64,
    bytes: Vec<u8>,
}

impl Npy {
    pub(crate) fn open(
        path: &Path,
        shown: &Path,
        channels_first: bool,
        columns: &[Column],
    ) -> Result<Npy, RecordingError> {
        let io = RecordingError::io(shown);
        let mut file = asperity_files::open(path).map_err(&io)?;
        let length = file.metadata().map_err(&io)?.len();
        let refused =
            |problem: &str| RecordingError::from(InputFault::new(shown, Place::File, problem, ACCEPTED));
        let mut head = [0; 12];
        file.read_exact(&mut head).map_err(|_| refused("not an array of NumPy"))?;
        let (header_at, header_bytes) = match (&head[..6], head[6]) {
            (b"\x93NUMPY", 1) => (10, usize::from(u16::from_le_bytes([head[8], head[9]]))),
            (b"\x93NUMPY", 2 | 3) => {
                (12, u32::from_le_bytes([head[8], head[9], head[10], head[11]]) as usize)
            }
            _ => return Err(refused("not an array of NumPy")),
        };
        if header_bytes > LONGEST_HEADER_BYTES {
            return Err(refused("its header is too long"));
        }
        let mut header = vec![0; header_bytes];
        file.seek(SeekFrom::Start(header_at)).map_err(&io)?;
        file.read_exact(&mut header).map_err(|_| refused("it ends in its header"))?;
        let (numbers, is_fortran, shape) =
            parsed(&String::from_utf8_lossy(&header)).ok_or_else(|| refused("a header of another kind"))?;
        let (rows, across) = match *shape {
            [samples] => (samples, 1),
            [rows, columns] => (rows, columns),
            _ => return Err(refused("an array of other dimensions")),
        };
        let strides = if is_fortran { [1, rows] } else { [across, 1] };
        // Of a single dimension these are samples.
        let is_turned = channels_first && shape.len() == 2;
        let (samples, count) = if is_turned { (across, rows) } else { (rows, across) };
        let data_at = header_at + header_bytes as u64;
        let stated = rows
            .checked_mul(across)
            .and_then(|all| all.checked_mul(numbers.bytes as u64)?.checked_add(data_at));
        if stated != Some(length) {
            return Err(refused(&format!("{length} bytes, which is not what its header says")));
        }
        let channels = columns.iter().map(|column| match column {
            Column::Number(number) if (1..=count).contains(number) => Ok(number - 1),
            _ => {
                let problem = format!("no such channel; there are {count}");
                let fault = InputFault::new(shown, Place::File, problem, "the number of a channel, from 1");
                Err(fault.of(column).into())
            }
        });
        Ok(Npy {
            channels: channels.collect::<Result<_, RecordingError>>()?,
            strides: if is_turned { [strides[1], strides[0]] } else { strides },
            path: shown.to_owned(),
            file,
            numbers,
            data_at,
            samples,
            next: 0,
            bytes: Vec::new(),
        })
    }

    /// Reads so many numbers from one on into the buffer.
    fn fetch(&mut self, from: u64, count: u64) -> Result<(), RecordingError> {
        let size = self.numbers.bytes as u64;
        self.bytes.resize((count * size) as usize, 0);
        let at = SeekFrom::Start(self.data_at + from * size);
        let read = self.file.seek(at).and_then(|_| self.file.read_exact(&mut self.bytes));
        read.map_err(RecordingError::io(&self.path))
    }
}

/// What the header of an array says: numbers, whether columns lie together, and shape.
fn parsed(header: &str) -> Option<(Numbers, bool, Vec<u64>)> {
    let behind = |key: &str| header.split_once(key)?.1.trim_start().strip_prefix(':').map(str::trim_start);
    let numbers = Numbers::of(behind("'descr'")?.strip_prefix('\'')?.split('\'').next()?)?;
    let is_fortran = behind("'fortran_order'")?.starts_with("True");
    let shape = behind("'shape'")?.strip_prefix('(')?.split(')').next()?;
    let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
    Some((numbers, is_fortran, sizes.map(|size| size.parse().ok()).collect::<Option<_>>()?))
}

impl Samples for Npy {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        let (from, [stride, between]) = (self.next, self.strides);
        let count = (most as u64).min(self.samples - from);
        let (numbers, size) = (self.numbers, self.numbers.bytes);
        // Samples of a channel lie together, or those of all channels do.
        let is_interleaved = stride != 1;
        if is_interleaved {
            self.fetch(from * stride, count * stride)?;
        }
        for (n, row) in block.iter_mut().enumerate() {
            let channel = self.channels[n];
            if !is_interleaved {
                self.fetch(from + channel * between, count)?;
            }
            let first = if is_interleaved { channel as usize * size } else { 0 };
            let stored = self.bytes.get(first..).unwrap_or_default().chunks(stride as usize * size);
            row.clear();
            row.extend(stored.map(|stored| numbers.read(&stored[..size])));
            if let Some(at) = row.iter().position(|value| !value.is_finite()) {
                let place = Place::Sample(from + at as u64);
                let fault = InputFault::new(&self.path, place, "not a finite number", "a finite number");
                return Err(fault.of(channel + 1).with(Some(row[at].to_string())).into());
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

    fn place(&self, sample: u64) -> Place {
        Place::Sample(sample)
    }

    fn units(&self) -> Vec<Option<String>> {
        vec![None; self.channels.len()]
    }
}
