//! Records put together to a file again.

use mcap::records::op;

use super::parts::Part;

/// How a log is put together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packing {
    /// Most records in a chunk; 0 for none in chunks.
    pub per_chunk: usize,
    /// Whether the checksum of all data is given.
    pub data_crc: bool,
}

impl Packing {
    /// As logs are, except for compression and summary, which add nothing.
    pub const USUAL: Packing = Packing { per_chunk: 1000, data_crc: true };
}

/// A file of these records, with messages in chunks; without a summary.
pub fn put_together(parts: &[Part], packing: Packing) -> Vec<u8> {
    let mut out = mcap::MAGIC.to_vec();
    chunked(parts, packing.per_chunk).iter().for_each(|part| part.put(&mut out));
    let crc = if packing.data_crc { crc32fast::hash(&out) } else { 0 };
    Part::new(op::DATA_END, crc.to_le_bytes()).put(&mut out);
    Part::new(op::FOOTER, [0; 20]).put(&mut out);
    out.extend(mcap::MAGIC);
    out
}

/// Packs the records that belong there into chunks of `per_chunk`.
fn chunked(parts: &[Part], per_chunk: usize) -> Vec<Part> {
    let belongs = |part: &Part| matches!(part.opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE);
    let mut all = Vec::new();
    for group in parts.chunk_by(|a, b| belongs(a) == belongs(b)) {
        if per_chunk > 0 && belongs(&group[0]) {
            all.extend(group.chunks(per_chunk).map(Part::chunk));
        } else {
            all.extend_from_slice(group);
        }
    }
    all
}
