//! Parses records from bytes. The lengths inside a record are checked before it is parsed: the MCAP
//! library would allocate four thousand million bytes for a text because the record states that
//! length, and panics at an attachment too short for its checksum.

use mcap::records::{Record, op};

use crate::format::LONGEST_METADATA_BYTES;
use crate::problem::{LogProblem, most};

/// Parses a record after checking all its lengths against its bytes.
///
/// # Errors
/// If it is malformed; `at` is the offset of the record, or of its chunk, in the file.
pub(crate) fn parse(opcode: u8, body: &[u8], at: u64) -> Result<Record<'_>, LogProblem> {
    if !fit(opcode, body) {
        return Err(LogProblem::Unsound { at, what: "it holds a length that reaches over its end" });
    }
    if opcode == op::METADATA {
        most("bytes of metadata in one record", body.len(), LONGEST_METADATA_BYTES)?;
    }
    mcap::parse_record(opcode, body).map_err(|error| LogProblem::Record { at, error })
}

/// The layout of a record's fields, as far as lengths matter.
#[derive(Debug, Clone, Copy)]
enum Field {
    /// That many bytes.
    Fixed(usize),
    /// A length of four bytes, and that many bytes.
    Bytes,
    /// A length of four bytes, and that many bytes of pairs of [`Field::Bytes`].
    Pairs,
    /// A length of eight bytes, and that many bytes.
    LongBytes,
}

use Field::{Bytes, Fixed, LongBytes, Pairs};

/// The fields of the records that logs contain; other records are not parsed.
fn fields(opcode: u8) -> &'static [Field] {
    match opcode {
        op::HEADER => &[Bytes, Bytes],
        op::FOOTER => &[Fixed(20)],
        op::SCHEMA => &[Fixed(2), Bytes, Bytes, Bytes],
        op::CHANNEL => &[Fixed(4), Bytes, Bytes, Pairs],
        op::MESSAGE => &[Fixed(22)],
        op::CHUNK => &[Fixed(28), Bytes, LongBytes],
        op::MESSAGE_INDEX => &[Fixed(2), Bytes],
        op::CHUNK_INDEX => &[Fixed(32), Bytes, Fixed(8), Bytes, Fixed(16)],
        op::ATTACHMENT => &[Fixed(16), Bytes, Bytes, LongBytes, Fixed(4)],
        op::ATTACHMENT_INDEX => &[Fixed(40), Bytes, Bytes],
        op::STATISTICS => &[Fixed(42), Bytes],
        op::METADATA => &[Bytes, Pairs],
        op::METADATA_INDEX => &[Fixed(16), Bytes],
        op::SUMMARY_OFFSET => &[Fixed(17)],
        op::DATA_END => &[Fixed(4)],
        _ => &[],
    }
}

/// Whether a record's fields fit into its bytes. Extensions of MCAP may append others.
fn fit(opcode: u8, body: &[u8]) -> bool {
    let mut rest = body;
    fields(opcode).iter().all(|field| skip(*field, &mut rest))
}

/// Skips a field; false if it does not fit.
fn skip(field: Field, rest: &mut &[u8]) -> bool {
    let taken = match field {
        Fixed(length) => take(length, rest),
        Bytes | Pairs => number(4, rest).and_then(|length| take(length, rest)),
        LongBytes => number(8, rest).and_then(|length| take(length, rest)),
    };
    match (field, taken) {
        (_, None) => false,
        (Pairs, Some(mut inside)) => {
            while !inside.is_empty() {
                if !skip(Bytes, &mut inside) || !skip(Bytes, &mut inside) {
                    return false;
                }
            }
            true
        }
        _ => true,
    }
}

/// Reads a length of four or eight bytes.
fn number(bytes: usize, rest: &mut &[u8]) -> Option<usize> {
    let mut number = [0; 8];
    number[..bytes].copy_from_slice(take(bytes, rest)?);
    usize::try_from(u64::from_le_bytes(number)).ok()
}

fn take<'a>(length: usize, rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (taken, after) = rest.split_at_checked(length)?;
    *rest = after;
    Some(taken)
}

#[cfg(test)]
mod tests {
    use mcap::records::op;

    use super::fit;

    #[test]
    fn no_length_inside_a_record_reaches_over_its_end() {
        let pair = [&1u32.to_le_bytes()[..], b"k", &1u32.to_le_bytes(), b"v"].concat();
        let map = [&(pair.len() as u32).to_le_bytes()[..], &pair].concat();
        let metadata = [&3u32.to_le_bytes()[..], b"run", &map].concat();
        assert!(fit(op::METADATA, &metadata));
        // Extensions of the format append fields.
        assert!(fit(op::METADATA, &[&metadata[..], b"more"].concat()));
        for length in 0..metadata.len() {
            assert!(!fit(op::METADATA, &metadata[..length]), "cut to {length} bytes");
        }
        for at in (0..metadata.len()).filter(|at| ![4, 5, 6, 15, 20].contains(at)) {
            let mut longer = metadata.clone();
            longer[at] |= 0x80;
            assert!(!fit(op::METADATA, &longer), "byte {at}");
        }
    }

    /// The library panics at these: it reads the checksum before the data.
    #[test]
    fn an_attachment_has_room_for_its_checksum() {
        let body = [&[0; 16][..], &0u32.to_le_bytes(), &0u32.to_le_bytes(), &0u64.to_le_bytes()].concat();
        assert!(!fit(op::ATTACHMENT, &body));
        assert!(fit(op::ATTACHMENT, &[&body[..], &[0; 4]].concat()));
    }
}
