//! Arrays of MATLAB before v7.3: numbers behind short headers, each array compressed by itself.
//!
//! The library for this format unpacks all arrays without a limit, and prints what is wrong.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};

use flate2::read::ZlibDecoder;

use crate::array::{Grid, Numbers, Stored, whole};
use crate::description::Axis;

/// Kinds of elements, with what NumPy calls the numbers in them.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const NUMBERS: [(u32, &str); 10] = [
    (1, "i1"),
    (2, "u1"),
    (3, "i2"),
    (4, "u2"),
    (5, "i4"),
    (6, "u4"),
    (7, "f4"),
    (9, "f8"),
    (12, "i8"),
    (13, "u8"),
];

/// Classes of arrays that hold numbers, and the mark of complex ones.
const CLASSES: std::ops::RangeInclusive<u32> = 6..=15;
const COMPLEX: u32 = 0x800;

/// Bytes of the header, whose last two tell the order of bytes.
const HEADER_BYTES: u64 = 128;

/// Where the superblock of a file of v7.3 is.
const HDF5_AT: usize = 512;

/// Whether a file is one of v7.3, which is HDF5.
pub(crate) fn is_hdf5(file: &mut File) -> io::Result<bool> {
    let mut head = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.take(HDF5_AT as u64 + 8).read_to_end(&mut head)?;
    Ok(head.get(HDF5_AT..) == Some(b"\x89HDF\r\n\x1a\n"))
}

/// Words of a file, in its order of bytes.
#[derive(Clone, Copy)]
struct Order {
    is_big_endian: bool,
}

impl Order {
    fn words(self, bytes: &[u8]) -> Vec<u32> {
        let word = |bytes: &[u8; 4]| {
            if self.is_big_endian { u32::from_be_bytes(*bytes) } else { u32::from_le_bytes(*bytes) }
        };
        bytes.chunks(4).filter_map(|bytes| bytes.first_chunk().map(word)).collect()
    }

    /// Kind and content of the next element, as long as there is room; a short one shares its words with its content.
    fn element(self, from: &mut dyn Read, room: &mut u64) -> Result<(u32, Vec<u8>), String> {
        let mut tag = [0; 8];
        from.read_exact(&mut tag).map_err(|_| "an array that ends in its header")?;
        let words = self.words(&tag);
        let (short, kind) = (words[0] >> 16, words[0] & 0xffff);
        if short > 0 {
            return Ok((kind, tag[4..].iter().copied().take(short as usize).collect()));
        }
        let content = whole(from.take(words[1].into()), room)?;
        let padding = (words[1] as u64).next_multiple_of(8) - u64::from(words[1]);
        io::copy(&mut from.take(padding), &mut io::sink()).map_err(|error| error.to_string())?;
        Ok((kind, content))
    }
}

/// The array of a name, as long as there is room. Vectors have a side of 1.
pub(crate) fn array(
    file: &mut File,
    name: &str,
    axis: Axis,
    room: &mut u64,
) -> Result<Box<dyn Grid>, String> {
    let io = |error: io::Error| error.to_string();
    let mut head = [0; HEADER_BYTES as usize];
    file.seek(SeekFrom::Start(0))
        .and_then(|_| file.read_exact(&mut head))
        .map_err(|_| "not a file of MATLAB")?;
    let order = match &head[124..] {
        [0, 1, b'I', b'M'] => Order { is_big_endian: false },
        [1, 0, b'M', b'I'] => Order { is_big_endian: true },
        _ => return Err("not a file of MATLAB".to_owned()),
    };
    let (mut at, mut names) = (HEADER_BYTES, Vec::new());
    loop {
        let mut tag = [0; 8];
        file.seek(SeekFrom::Start(at)).map_err(io)?;
        if file.read_exact(&mut tag).is_err() {
            return Err(format!("no array {name:?}; there are {}", names.join(", ")));
        }
        let (kind, bytes) = match order.words(&tag)[..] {
            [kind, bytes] => (kind, u64::from(bytes)),
            _ => (0, 0),
        };
        at += 8 + bytes;
        let mut inside: Box<dyn Read> = match kind {
            MATRIX => Box::new((&*file).take(bytes)),
            COMPRESSED => {
                let mut unpacked = ZlibDecoder::new((&*file).take(bytes));
                unpacked.read_exact(&mut tag).map_err(io)?;
                Box::new(unpacked)
            }
            _ => continue,
        };
        let (_, flags) = order.element(&mut inside, room)?;
        let (_, sizes) = order.element(&mut inside, room)?;
        let (_, found) = order.element(&mut inside, room)?;
        if found != name.as_bytes() {
            names.push(String::from_utf8_lossy(&found).into_owned());
            continue;
        }
        let flags = order.words(&flags).first().copied().unwrap_or_default();
        if !CLASSES.contains(&(flags & 0xff)) || flags & COMPLEX != 0 {
            return Err("not an array of real numbers".to_owned());
        }
        let (kind, content) = order.element(&mut inside, room)?;
        let named = NUMBERS.iter().find(|(known, _)| *known == kind).map(|(_, named)| *named);
        let numbers = named.and_then(|named| {
            Numbers::of(&format!("{}{named}", if order.is_big_endian { '>' } else { '<' }))
        });
        let mut sizes: Vec<u64> = order.words(&sizes).into_iter().map(u64::from).collect();
        if sizes.len() == 2 && sizes.contains(&1) {
            sizes = vec![sizes[0] * sizes[1]];
        }
        return Stored::new(
            Box::new(Cursor::new(content)),
            0,
            numbers.ok_or("no numbers")?,
            true,
            sizes,
            axis,
        );
    }
}
