//! Arrays of MATLAB before v7.3: numbers behind short headers, each array compressed by itself.
//!
//! The library for this format unpacks all arrays without a limit, and prints what is wrong.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};

use flate2::read::ZlibDecoder;

use crate::array::{Numbers, Opened, Problem, stored, whole};
use crate::description::Axis;

/// Kinds of elements, with what NumPy calls the numbers in them.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const NUMBERS: [&str; 14] = ["", "i1", "u1", "i2", "u2", "i4", "u4", "f4", "", "f8", "", "", "i8", "u8"];

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

/// The words in some bytes.
fn words(bytes: &[u8], is_big_endian: bool) -> Vec<u32> {
    let word = if is_big_endian { u32::from_be_bytes } else { u32::from_le_bytes };
    bytes.chunks(4).filter_map(|bytes| bytes.first_chunk().copied().map(word)).collect()
}

/// Kind and content of the next element, as long as there is room; a short one shares its words with its content.
fn element(from: &mut dyn Read, is_big_endian: bool, room: &mut u64) -> Result<(usize, Vec<u8>), Problem> {
    let mut tag = [0; 8];
    from.read_exact(&mut tag).map_err(|_| "an array that ends in its header")?;
    let [kind, bytes] = words(&tag, is_big_endian)[..] else { unreachable!("eight bytes are two words") };
    if kind >> 16 > 0 {
        let short = ((kind >> 16) as usize).min(4);
        return Ok(((kind & 0xffff) as usize, tag[4..4 + short].to_vec()));
    }
    let content = whole(from.take(bytes.into()), room)?;
    let padding = bytes.wrapping_neg() % 8;
    io::copy(&mut from.take(padding.into()), &mut io::sink())?;
    Ok((kind as usize, content))
}

/// The array of a name, as long as there is room. Vectors have a side of 1.
pub(crate) fn array(file: &mut File, name: &str, axis: Axis, room: &mut u64) -> Opened {
    let mut head = [0; HEADER_BYTES as usize];
    file.seek(SeekFrom::Start(0))
        .and_then(|_| file.read_exact(&mut head))
        .map_err(|_| "not a file of MATLAB")?;
    let is_big_endian = match &head[124..] {
        [0, 1, b'I', b'M'] => false,
        [1, 0, b'M', b'I'] => true,
        _ => return Err("not a file of MATLAB before v7.3".into()),
    };
    let (mut at, mut names) = (HEADER_BYTES, Vec::new());
    loop {
        let mut tag = [0; 8];
        file.seek(SeekFrom::Start(at))?;
        if file.read_exact(&mut tag).is_err() {
            return Err(format!("no array {name:?}; there are {}", names.join(", ")).into());
        }
        let [kind, bytes] = words(&tag, is_big_endian)[..] else { unreachable!("eight bytes are two words") };
        at += 8 + u64::from(bytes);
        let content = (&*file).take(bytes.into());
        let mut inside: Box<dyn Read> = match kind {
            MATRIX => Box::new(content),
            COMPRESSED => {
                let mut unpacked = ZlibDecoder::new(content);
                unpacked.read_exact(&mut tag)?;
                Box::new(unpacked)
            }
            _ => continue,
        };
        let mut next = || element(&mut inside, is_big_endian, room);
        let (flags, sizes, found) = (next()?.1, next()?.1, next()?.1);
        if found != name.as_bytes() {
            names.push(String::from_utf8_lossy(&found).into_owned());
            continue;
        }
        let flags = words(&flags, is_big_endian).first().copied().unwrap_or_default();
        if !CLASSES.contains(&(flags & 0xff)) || flags & COMPLEX != 0 {
            return Err("not an array of real numbers".into());
        }
        let (kind, content) = next()?;
        let order = if is_big_endian { '>' } else { '<' };
        let numbers = NUMBERS.get(kind).and_then(|named| Numbers::of(&format!("{order}{named}")));
        let mut sizes: Vec<u64> = words(&sizes, is_big_endian).into_iter().map(u64::from).collect();
        if sizes.len() == 2 && sizes.contains(&1) {
            sizes = vec![sizes[0] * sizes[1]];
        }
        let source = Box::new(Cursor::new(content));
        return stored(source, 0, numbers.ok_or("no numbers")?, true, sizes, axis);
    }
}
