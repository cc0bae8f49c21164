//! Arrays of NumPy.
//!
//! The libraries for this format parse its header, a Python dictionary of three known keys, with a grammar whose tools
//! build C code; the header is therefore read here.

use std::fs::File;
use std::io::{Cursor, SeekFrom};

use zip::ZipArchive;

use crate::array::{Numbers, Opened, Source, stored, whole};
use crate::description::Axis;

/// The longest header that is read.
const LONGEST_HEADER_BYTES: u64 = 1 << 16;

/// What stands before the numbers in a file of format 1.0, given their name, whether columns lie together, and the shape,
/// all as NumPy writes them: a multiple of 64 bytes.
///
/// # Panics
/// At a shape of thousands of dimensions.
pub fn head(numbers: &str, is_fortran: bool, shape: &str) -> Vec<u8> {
    let order = if is_fortran { "True" } else { "False" };
    let text = format!("{{'descr': '{numbers}', 'fortran_order': {order}, 'shape': {shape}, }}");
    // With the ten bytes before and the end of the line.
    let length = (text.len() + 11).next_multiple_of(64) - 10;
    let bytes = u16::try_from(length).expect("it is short").to_le_bytes();
    [b"\x93NUMPY\x01\x00", &bytes[..], format!("{text:<width$}\n", width = length - 1).as_bytes()].concat()
}

/// The array of a file.
pub(crate) fn array(mut source: Box<dyn Source>, axis: Axis) -> Opened {
    let mut head = [0; 12];
    let read = source.seek(SeekFrom::Start(0)).and_then(|_| source.read_exact(&mut head));
    let (at, bytes) = match (&head[..6], head[6], head) {
        (b"\x93NUMPY", 1, [.., a, b, _, _]) if read.is_ok() => (10, u64::from(u16::from_le_bytes([a, b]))),
        (b"\x93NUMPY", 2 | 3, [.., a, b, c, d]) => (12, u32::from_le_bytes([a, b, c, d]).into()),
        _ => return Err("not an array of NumPy".into()),
    };
    if bytes > LONGEST_HEADER_BYTES {
        return Err("its header is too long".into());
    }
    let mut header = vec![0; bytes as usize];
    let read = source.seek(SeekFrom::Start(at)).and_then(|_| source.read_exact(&mut header));
    read.map_err(|_| "it ends in its header")?;
    let (numbers, is_fortran, sizes) =
        parsed(&String::from_utf8_lossy(&header)).ok_or("a header of another kind")?;
    stored(source, at + bytes, numbers, is_fortran, sizes, axis)
}

/// What the header of an array says: numbers, whether columns lie together, and sizes.
fn parsed(header: &str) -> Option<(Numbers, bool, Vec<u64>)> {
    let behind = |key: &str| header.split_once(key)?.1.trim_start().strip_prefix(':').map(str::trim_start);
    let numbers = Numbers::of(behind("'descr'")?.strip_prefix('\'')?.split('\'').next()?)?;
    let is_fortran = behind("'fortran_order'")?.starts_with("True");
    let shape = behind("'shape'")?.strip_prefix('(')?.split(')').next()?;
    let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
    Some((numbers, is_fortran, sizes.map(|size| size.parse().ok()).collect::<Option<_>>()?))
}

/// An array of an archive of them, as long as there is room.
pub(crate) fn member(archive: &mut ZipArchive<File>, name: &str, axis: Axis, room: &mut u64) -> Opened {
    let names: Vec<_> = archive.file_names().flatten().collect();
    let names = names.join(", ").replace(".npy", "");
    let file = archive.by_name(&format!("{name}.npy"));
    let bytes = whole(file.map_err(|error| format!("{name:?}: {error}; there are {names}"))?, room)?;
    array(Box::new(Cursor::new(bytes)), axis)
}
