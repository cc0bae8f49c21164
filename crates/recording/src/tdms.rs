//! Channels of TDMS, the format of National Instruments: segments, each with what has changed in the list of channels,
//! then their values in chunks. The lists are read once, and then only the values that are asked for.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use crate::array::{Grid, Numbers, Opened, Problem, ReadGrid};

const DAQMX: &str = "values of DAQmx, which need its scales: save them as numbers of their channels";

/// What NumPy calls the first types, and the type of texts.
const NUMBERS: [&str; 11] = ["", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"];
const TEXT: u64 = 0x20;

const MOST_RUNS: usize = 1 << 20;

/// A channel's values in the chunks of a segment, of which a row of bytes has one of this channel.
#[derive(Clone, Copy)]
struct Run {
    first: u64,
    at: u64,
    values: u64,
    chunk_bytes: u64,
    row_bytes: u64,
    place_in_row: u64,
    numbers: Numbers,
}

/// A channel: the type of its values, how many a chunk has of them, and in how many bytes.
#[derive(Default)]
pub(crate) struct Channel {
    name: String,
    is_listed: bool,
    kind: u64,
    values: u64,
    bytes: u64,
    samples: u64,
    runs: Vec<Run>,
}

/// The numbers of a type; behind 0x18 are those with a unit.
fn numbers(kind: u64, is_big_endian: bool) -> Option<Numbers> {
    let name = NUMBERS.get(if kind > 0x18 { kind - 0x10 } else { kind } as usize)?;
    Numbers::of(&format!("{}{name}", if is_big_endian { '>' } else { '<' }))
}

/// How many bytes a value of a type has, except a text.
fn size(kind: u64) -> Option<u64> {
    match kind {
        0x21 => Some(1),
        11 | 0x1b | 0x44 | 0x10_000d => Some(16),
        _ => numbers(kind, false).map(|numbers| numbers.bytes),
    }
}

/// Reads headers.
struct Reader<'a> {
    file: BufReader<&'a File>,
    at: u64,
    is_big_endian: bool,
}

impl Reader<'_> {
    fn fault<T>(&self, problem: &str) -> Result<T, Problem> {
        Err(format!("byte {}: {problem}", self.at).into())
    }

    /// A number of so many bytes, eight at most.
    fn next(&mut self, count: usize) -> Result<u64, Problem> {
        let mut bytes = [0; 8];
        if self.file.read_exact(&mut bytes[..count]).is_err() {
            return self.fault("it ends in a header");
        }
        self.at += count as u64;
        let (bytes, number) = (&bytes[..count], |number, byte: &u8| number << 8 | u64::from(*byte));
        Ok(if self.is_big_endian { bytes.iter().fold(0, number) } else { bytes.iter().rfold(0, number) })
    }

    fn text(&mut self) -> Result<String, Problem> {
        let count = self.next(4)?;
        if count > u16::MAX.into() {
            return self.fault("a text that is too long");
        }
        let bytes = (0..count).map(|_| self.next(1).map(|byte| byte as u8));
        Ok(String::from_utf8_lossy(&bytes.collect::<Result<Vec<u8>, _>>()?).into_owned())
    }

    /// What a list says of a channel's part in each chunk. Returns whether it has one.
    fn layout(&mut self, channel: &mut Channel) -> Result<bool, Problem> {
        match self.next(4)? {
            0xffff_ffff => return Ok(false),
            0 if channel.values > 0 => return Ok(true),
            0 => return self.fault("a layout as before, where there is none"),
            0x1269 | 0x126a | 0x1369 => return self.fault(DAQMX),
            _ => {}
        }
        let (kind, _dimensions, values) = (self.next(4)?, self.next(4)?, self.next(8)?);
        let bytes =
            if kind == TEXT { Some(self.next(8)?) } else { size(kind).and_then(|of| of.checked_mul(values)) };
        match bytes.filter(|bytes| *bytes >= values && (channel.samples == 0 || kind == channel.kind)) {
            Some(bytes) => (channel.kind, channel.values, channel.bytes) = (kind, values, bytes),
            None => return self.fault(&format!("{values} values of a type {kind:#x}")),
        }
        Ok(values > 0)
    }
}

/// Reads the lists of all segments.
pub(crate) fn open(file: &File) -> Result<Vec<Channel>, Problem> {
    let length = file.metadata()?.len();
    let (mut channels, mut places): (Vec<Channel>, HashMap<String, usize>) = Default::default();
    let (mut listed, mut runs): (Vec<usize>, usize) = Default::default();
    let mut from = Reader { file: BufReader::new(file), at: 0, is_big_endian: false };
    while from.at < length {
        from.is_big_endian = false;
        let (tag, flags) = (from.next(4)?, from.next(4)?);
        let [has_list, is_new, has_values, is_interleaved, is_big_endian, is_daqmx] =
            [1, 2, 3, 5, 6, 7].map(|bit| flags >> bit & 1 == 1);
        from.is_big_endian = is_big_endian;
        if tag != u64::from(u32::from_le_bytes(*b"TDSm")) || is_daqmx {
            return from.fault(if is_daqmx { DAQMX } else { "no segment of TDMS" });
        }
        let (_version, next, list) = (from.next(4)?, from.next(8)?, from.next(8)?);
        // A program that was stopped has left the length of its last segment open.
        let end = if next == u64::MAX { Some(length) } else { from.at.checked_add(next) };
        let at = from.at.checked_add(list).filter(|at| end >= Some(*at));
        let (Some(end), Some(at)) = (end.filter(|end| *end <= length), at) else {
            return from.fault(&format!("a segment that is longer than the file, {length} bytes"));
        };
        if is_new {
            listed.drain(..).for_each(|n: usize| channels[n].is_listed = false);
        }
        for _ in 0..if has_list { from.next(4)? } else { 0 } {
            // As /'group'/'channel', with quotes doubled.
            let path = from.text()?;
            let path = path.strip_prefix("/'").and_then(|path| path.strip_suffix('\'')).unwrap_or_default();
            let name = path.replacen("'/'", "/", 1).replace("''", "'");
            let n = *places.entry(name.clone()).or_insert(channels.len());
            if n == channels.len() {
                channels.push(Channel { name, ..Channel::default() });
            }
            let of = &mut channels[n];
            let is_listed = from.layout(of)?;
            match (std::mem::replace(&mut of.is_listed, is_listed), is_listed) {
                (false, true) => listed.push(n),
                (true, false) => listed.retain(|of| *of != n),
                _ => {}
            }
            for _ in 0..from.next(4)? {
                let (_name, kind) = (from.text()?, from.next(4)?);
                let bytes = if kind == TEXT { Some(from.next(4)?) } else { size(kind) };
                let Some(bytes) = bytes else {
                    return from.fault(&format!("a property of a type {kind:#x}"));
                };
                from.file.seek_relative(bytes as i64)?;
                from.at += bytes;
            }
            if from.at > at {
                return from.fault("a list that is longer than it says");
            }
        }
        let chunk_bytes = listed.iter().fold(0, |all: u64, n| all.saturating_add(channels[*n].bytes));
        let chunks = if has_values { (end - at).checked_div(chunk_bytes).unwrap_or_default() } else { 0 };
        let is_whole = !has_values || next == u64::MAX || chunks.checked_mul(chunk_bytes) == Some(end - at);
        let values = listed.first().map_or(0, |n| channels[*n].values);
        let is_even = !is_interleaved || listed.iter().all(|n| channels[*n].values == values);
        runs += if chunks > 0 { listed.len() } else { 0 };
        if !is_whole || !is_even || runs > MOST_RUNS {
            return from.fault("values that are no chunks of the channels listed, or in too many parts");
        }
        let mut before = 0;
        for n in listed.iter().filter(|_| chunks > 0) {
            let of = &mut channels[*n];
            let (at, row_bytes, place_in_row) = match is_interleaved {
                true => (at, chunk_bytes / values, before / values),
                false => (at + before, of.bytes / of.values, 0),
            };
            let (first, values) = (of.samples, of.values);
            let run = |numbers| Run { first, at, values, chunk_bytes, row_bytes, place_in_row, numbers };
            of.runs.extend(numbers(of.kind, is_big_endian).map(run));
            (before, of.samples) = (before + of.bytes, first + values * chunks);
        }
        from.at = from.file.seek(SeekFrom::Start(end))?;
    }
    channels.retain(|channel| channel.samples > 0);
    Ok(channels)
}

/// The channel of a name, `GROUP/CHANNEL`, or all of a group.
pub(crate) fn array(file: &File, channels: &[Channel], name: &str) -> Opened {
    let is_in = |rest: &str| name.is_empty() || rest.is_empty() || rest.starts_with('/');
    let found: Vec<_> = channels.iter().filter(|of| of.name.strip_prefix(name).is_some_and(is_in)).collect();
    let Some(Channel { samples, .. }) = found.first() else {
        let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
        return Err(format!("no channel {name:?}; there are {}", names.join(", ")).into());
    };
    if let Some(other) = found.iter().find(|of| of.samples != *samples || of.runs.is_empty()) {
        return Err(format!("{}: {} values, no numbers or not {samples}", other.name, other.samples).into());
    }
    let is_finite = found.iter().flat_map(|of| &of.runs).all(|run| run.numbers.are_integers);
    let of: Vec<Vec<Run>> = found.iter().map(|of| of.runs.clone()).collect();
    let (mut file, mut bytes, mut held) = (file.try_clone()?, Vec::new(), 0..0);
    let (samples, channels) = (*samples, of.len() as u64);
    let read: Box<ReadGrid> = Box::new(move |samples, channels, to, apart| {
        for (n, channel) in channels.iter().enumerate() {
            let (runs, mut at) = (&of[*channel as usize], samples.start);
            while at < samples.end {
                let run = runs[runs.partition_point(|run| run.first <= at) - 1];
                let (chunk, value) = ((at - run.first) / run.values, (at - run.first) % run.values);
                let count = (run.values - value).min(samples.end - at);
                let from = run.at + chunk * run.chunk_bytes + value * run.row_bytes;
                let rows = from..from + count * run.row_bytes;
                // Channels that are interleaved have the same rows.
                if held != rows {
                    bytes.resize((rows.end - rows.start) as usize, 0);
                    file.seek(SeekFrom::Start(from))?;
                    file.read_exact(&mut bytes)?;
                    held = rows;
                }
                let its = run.place_in_row as usize..(run.place_in_row + run.numbers.bytes) as usize;
                let values = bytes.chunks_exact(run.row_bytes as usize).flat_map(|row| &row[its.clone()]);
                let to = &mut to[(at - samples.start) as usize * apart + n..];
                (run.numbers.decode)(&values.copied().collect::<Vec<u8>>(), 1, 0..1, to, apart);
                at += count;
            }
        }
        Ok(())
    });
    Ok(Grid { samples, channels, is_finite, read })
}
