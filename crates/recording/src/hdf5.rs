//! Arrays of HDF5, and so of what is based on it: MATLAB's v7.3, Elsys' TPC5.

use std::fs::File;
use std::io;
use std::sync::Arc;

use hdf5_reader::error::{ByteOrder, Error};
use hdf5_reader::{Datatype, FileStorage, H5Type, Hdf5File, SliceInfo, SliceInfoElem};

use crate::array::{Grid, Numbers, Opened, Problem, ReadGrid, sides};
use crate::description::Axis;

/// Most bytes of a chunk, of the chunks that are kept, and of what is read at once.
const MOST_BYTES: usize = 1 << 26;

/// By at most so much compression makes numbers shorter: what claims more is no recording.
const LARGEST_RATIO: u64 = 1100;

/// Numbers at once.
const PIECE: u64 = 1 << 20;

/// A number of any kind.
#[derive(Clone)]
struct Number(f64);

fn numbers(kind: &Datatype) -> Option<Numbers> {
    let (size, letter, order) = match kind {
        Datatype::FixedPoint { size, signed, byte_order } => {
            (size, if *signed { 'i' } else { 'u' }, byte_order)
        }
        Datatype::FloatingPoint { size, byte_order } => (size, 'f', byte_order),
        _ => return None,
    };
    let order = if *order == ByteOrder::BigEndian { '>' } else { '<' };
    Numbers::of(&format!("{order}{letter}{size}"))
}

impl H5Type for Number {
    fn hdf5_type() -> Datatype {
        f64::hdf5_type()
    }

    /// Of a kind that is not decoded many at once.
    fn from_bytes(_: &[u8], kind: &Datatype) -> Result<Number, Error> {
        Err(Error::InvalidData(format!("{kind:?} is no number")))
    }

    fn element_size(kind: &Datatype) -> usize {
        numbers(kind).map_or(1, |numbers| numbers.bytes as usize)
    }

    fn decode_vec(raw: &[u8], kind: &Datatype, count: usize) -> Option<Result<Vec<Number>, Error>> {
        let mut row = vec![0.0; count];
        (numbers(kind)?.decode)(raw, count, 0..count, &mut row, count);
        Some(Ok(row.into_iter().map(Number).collect()))
    }
}

/// Opens a file; what is linked from it stays closed.
pub(crate) fn open(file: File) -> Result<Hdf5File, Problem> {
    let options = hdf5_reader::OpenOptions::default()
        .with_max_chunk_bytes(MOST_BYTES)
        .with_chunk_cache_bytes(MOST_BYTES)
        .with_max_read_bytes(MOST_BYTES);
    let storage = FileStorage::from_file(file)?;
    Ok(Hdf5File::from_storage_with_options(Arc::new(storage), options)?)
}

/// An array of a file. As MATLAB shows it, it is turned, and a vector has a side of 1.
pub(crate) fn array(file: &Hdf5File, name: &str, axis: Axis, is_matlab: bool) -> Opened {
    let dataset = file.dataset(name).map_err(|error| {
        let names = file.root_group().and_then(|root| root.member_names());
        let names = names.map_or(String::new(), |(_, arrays)| format!("; there are {}", arrays.join(", ")));
        format!("{name:?}: {error}{names}")
    })?;
    let Numbers { bytes, are_integers, .. } = numbers(dataset.dtype()).ok_or("no numbers")?;
    let sizes = dataset.shape().to_vec();
    let all = sizes.iter().try_fold(bytes, |all, size| all.checked_mul(*size));
    let length = file.storage().len();
    if all.is_none_or(|all| all > length.saturating_mul(LARGEST_RATIO)) {
        return Err(format!("it claims {sizes:?} numbers in a file of {length} bytes").into());
    }
    let axis = match (is_matlab, &sizes[..]) {
        (true, [1, _]) => Axis::ChannelsFirst,
        (true, [_, 1]) => Axis::SamplesFirst,
        (true, _) => axis.turned(),
        (false, _) => axis,
    };
    let [(samples, _), (channels, _)] = sides(&sizes, axis)?;
    let read: Box<ReadGrid> = Box::new(move |samples, channels, to, apart| {
        let first = channels.iter().copied().min().unwrap_or_default();
        let across = channels.iter().map(|channel| channel + 1 - first).max().unwrap_or(1);
        let range = |start, count| SliceInfoElem::Slice { start, end: start + count, step: 1 };
        let piece = (PIECE / across).max(1);
        for from in samples.clone().step_by(piece as usize) {
            let count = piece.min(samples.end - from);
            let (of_samples, of_channels) = (range(from, count), range(first, across));
            let (selections, next, between) = match axis {
                _ if dataset.ndim() == 1 => (vec![of_samples], 1, 0),
                Axis::ChannelsFirst => (vec![of_channels, of_samples], 1, count),
                Axis::SamplesFirst => (vec![of_samples, of_channels], across, 1),
            };
            let read = dataset.read_slice::<Number>(&SliceInfo { selections });
            let read = read.map_err(io::Error::other)?;
            let to = &mut to[(from - samples.start) as usize * apart..];
            for (n, channel) in channels.iter().enumerate() {
                let of_channel =
                    read.iter().skip(((channel - first) * between) as usize).step_by(next as usize);
                let cells = to[n..].iter_mut().step_by(apart).take(count as usize);
                cells.zip(of_channel).for_each(|(to, number)| *to = number.0);
            }
        }
        Ok(())
    });
    Ok(Grid { samples, channels, is_finite: are_integers, read })
}
