//! Checks the stated sizes of a Parquet file before polars reads it.
//!
//! A few bytes of Parquet can represent any number of rows: a run of equal values is a value and a count,
//! and compressed data may decompress to any size. polars allocates whatever footer and page headers state.
//! Therefore every count and size in them is compared with the length of the file first. Tables of runs are
//! far within the bounds: their doubles need some bytes each, whatever the compression.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::ops::Range;

use polars_parquet_format::thrift::protocol::TCompactInputProtocol;
use polars_parquet_format::{ColumnChunk, FileMetaData, PageHeader, RowGroup};

/// Allowance for any table, however short its file.
const ANY: u64 = 1_000_000;

/// Cells for each byte of the file, beyond [`ANY`].
const CELLS_PER_BYTE: u64 = 1;

/// Bytes of unpacked pages for each byte of the file and for each of [`ANY`].
const UNPACKED_PER_BYTE: u64 = 8;

/// Bytes of all texts that are printed, in the same way.
const TEXT_PER_BYTE: u64 = 8;

/// Columns; our widest table has some twenty.
const MOST_COLUMNS: usize = 1000;

/// Bytes of the file per row group, beyond the first thousand.
const BYTES_PER_ROW_GROUP: u64 = 4096;

/// The footer's share of the file, beyond [`ANY`] bytes; ours are a few hundred bytes for each
/// sixty thousand rows.
const FOOTER_SHARE: u64 = 16;

/// Bound on the memory of a footer per byte, beyond [`ANY`]; five bytes are usual.
const FOOTER_IN_MEMORY: usize = 32;

/// No header of a page is longer: it has a few numbers, and a least and a greatest value.
const LONGEST_PAGE_HEADER: u64 = 1 << 16;

/// The bytes at the beginning and end of a file.
const MAGIC: &[u8; 4] = b"PAR1";

/// Sizes found in a file that is within bounds.
pub(crate) struct Bounds {
    /// The rows of each row group.
    pub(crate) rows: Vec<usize>,
    /// Bytes that its texts may have, all cells together.
    pub(crate) most_text: u64,
    /// The footer.
    pub(crate) footer: FileMetaData,
}

/// Looks at footer and page headers.
///
/// # Errors
/// In words, if they do not fit each other or the file, or are out of bounds.
pub(crate) fn check(file: &mut File) -> Result<Bounds, String> {
    let length = file.metadata().map_err(|error| error.to_string())?.len();
    let footer = footer(file, length)?;
    let columns = footer.schema.iter().filter(|element| element.num_children.is_none()).count();
    // The root and its columns: none of our tables has lists or structures in its cells.
    if footer.schema.len() != columns + 1 || columns == 0 || columns > MOST_COLUMNS {
        return Err(format!(
            "a table of {columns} columns, {} elements of its schema in all (accepted: from 1 to {MOST_COLUMNS} \
             columns of plain values)",
            footer.schema.len()
        ));
    }
    let (groups, most) = (footer.row_groups.len() as u64, 1000 + length / BYTES_PER_ROW_GROUP);
    if groups > most {
        return Err(format!(
            "{groups} row groups (accepted: {most}, a thousand and one for each {BYTES_PER_ROW_GROUP} bytes of the file)"
        ));
    }
    let mut rows = Vec::new();
    let mut unpacked = 0;
    let mut packed = 0;
    for (number, group) in footer.row_groups.iter().enumerate() {
        let wrong = |problem: String| format!("row group {number}: {problem}");
        let count = count(group.num_rows).map_err(wrong)?;
        rows.push(count as usize);
        if group.columns.len() != columns {
            return Err(wrong(format!("{} columns of a table that has {columns}", group.columns.len())));
        }
        for chunk in &group.columns {
            let range = range(chunk, length).map_err(wrong)?;
            packed += range.end - range.start;
            unpacked +=
                pages(file, range, group, chunk, left(UNPACKED_PER_BYTE, length, unpacked)).map_err(wrong)?;
        }
    }
    let all: u64 = rows.iter().map(|rows| *rows as u64).fold(0, u64::saturating_add);
    if i128::from(footer.num_rows) != i128::from(all) {
        return Err(format!("{all} rows in its row groups, {} in its footer", footer.num_rows));
    }
    let most = ANY + CELLS_PER_BYTE * length;
    if all.saturating_mul(columns as u64) > most {
        return Err(format!(
            "{all} rows of {columns} columns in a file of {length} bytes (accepted: {most} cells, a million and one \
             for each byte)"
        ));
    }
    if packed > length {
        return Err("its column chunks overlap".to_owned());
    }
    Ok(Bounds { rows, most_text: TEXT_PER_BYTE * (ANY + length), footer })
}

/// The rest of a budget of `per_byte` bytes for each byte of the file.
fn left(per_byte: u64, length: u64, spent: u64) -> u64 {
    (per_byte * (ANY + length)).saturating_sub(spent)
}

/// The footer, at the end of the file.
fn footer(file: &mut File, length: u64) -> Result<FileMetaData, String> {
    let mut end = [0; 8];
    let mut read_at = |at: u64, bytes: &mut [u8]| {
        file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(bytes)).map_err(|error| error.to_string())
    };
    let end_at = length.checked_sub(8).filter(|at| *at >= 4).ok_or("too short for a Parquet file")?;
    read_at(end_at, &mut end)?;
    let [l0, l1, l2, l3, magic @ ..] = end;
    if magic != *MAGIC {
        return Err("it does not end as a Parquet file does: it was cut off, or is none".to_owned());
    }
    let footer_length = u64::from(u32::from_le_bytes([l0, l1, l2, l3]));
    let at = end_at.checked_sub(footer_length).filter(|at| *at >= 4);
    let at = at.ok_or_else(|| format!("a footer of {footer_length} bytes in a file of {length}"))?;
    let most = ANY + length / FOOTER_SHARE;
    if footer_length > most {
        return Err(format!(
            "a footer of {footer_length} bytes (accepted: {most}, a million and a sixteenth of the file)"
        ));
    }
    let mut bytes = vec![0; footer_length as usize];
    read_at(at, &mut bytes)?;
    let room = ANY as usize + FOOTER_IN_MEMORY * bytes.len();
    let mut protocol = TCompactInputProtocol::new(Cursor::new(&bytes[..]), room);
    FileMetaData::read_from_in_protocol(&mut protocol)
        .map_err(|error| format!("its footer cannot be read: {error}"))
}

/// Checks a count: not negative, and at most what polars can count.
fn count(rows: i64) -> Result<u64, String> {
    match u64::try_from(rows) {
        Ok(rows) if rows < u64::from(u32::MAX) => Ok(rows),
        _ => Err(format!("{rows} rows (accepted: from 0 to {})", u32::MAX - 1)),
    }
}

/// Position of a column's pages in the file.
fn range(chunk: &ColumnChunk, length: u64) -> Result<Range<u64>, String> {
    let column = chunk.meta_data.as_ref().ok_or("a column chunk that says nothing of itself")?;
    let start = column.dictionary_page_offset.unwrap_or(column.data_page_offset);
    let range = u64::try_from(start).ok().zip(u64::try_from(column.total_compressed_size).ok());
    let range = range.and_then(|(start, bytes)| Some(start..start.checked_add(bytes)?));
    range.filter(|range| range.end <= length).ok_or_else(|| {
        format!(
            "column chunk {}: {} bytes from byte {start} on, of a file of {length}",
            column.path_in_schema.join("."),
            column.total_compressed_size
        )
    })
}

/// Reads the headers of a column's pages, and returns their total decompressed size in bytes.
fn pages(
    file: &mut File,
    range: Range<u64>,
    group: &RowGroup,
    chunk: &ColumnChunk,
    most: u64,
) -> Result<u64, String> {
    let Some(column) = &chunk.meta_data else { return Ok(0) };
    let wrong = |problem: String| format!("column {}: {problem}", column.path_in_schema.join("."));
    if column.num_values != group.num_rows {
        return Err(wrong(format!("{} values in {} rows", column.num_values, group.num_rows)));
    }
    let (mut at, mut values, mut unpacked) = (range.start, 0, 0);
    let mut head = Vec::new();
    while at < range.end {
        head.clear();
        file.seek(SeekFrom::Start(at)).map_err(|error| error.to_string())?;
        let room = LONGEST_PAGE_HEADER.min(range.end - at);
        // Most headers are short; more bytes are read only for longer ones.
        let mut look = room.min(256);
        let (header, header_bytes) = loop {
            file.by_ref()
                .take(look - head.len() as u64)
                .read_to_end(&mut head)
                .map_err(|error| error.to_string())?;
            let mut cursor = Cursor::new(&head[..]);
            let mut protocol = TCompactInputProtocol::new(&mut cursor, LONGEST_PAGE_HEADER as usize);
            match PageHeader::read_from_in_protocol(&mut protocol) {
                Ok(header) => break (header, cursor.position()),
                Err(_) if look < room => look = room,
                Err(error) => return Err(wrong(format!("the page at byte {at} cannot be read: {error}"))),
            }
        };
        let bytes = |size: i32| u64::try_from(size).map_err(|_| wrong(format!("a page of {size} bytes")));
        let (packed, page) = (bytes(header.compressed_page_size)?, bytes(header.uncompressed_page_size)?);
        unpacked += page;
        if unpacked > most {
            return Err(wrong(format!(
                "its pages unpack to {unpacked} bytes and more (accepted: {UNPACKED_PER_BYTE} for each byte of the \
                 file and {} in all, for all columns)",
                UNPACKED_PER_BYTE * ANY
            )));
        }
        let dictionary = header.dictionary_page_header.map_or(0, |header| header.num_values);
        if i64::from(dictionary) > page as i64 || dictionary < 0 {
            return Err(wrong(format!("a dictionary of {dictionary} values in {page} bytes")));
        }
        let of_page = header.data_page_header.map(|header| header.num_values);
        values +=
            i64::from(of_page.or(header.data_page_header_v2.map(|header| header.num_values)).unwrap_or(0));
        at = at.saturating_add(header_bytes).saturating_add(packed);
        if at > range.end {
            return Err(wrong(format!("a page reaches up to byte {at}, over the end of its column")));
        }
    }
    if values != column.num_values {
        return Err(wrong(format!("{values} values in its pages, {} in the footer", column.num_values)));
    }
    Ok(unpacked)
}
