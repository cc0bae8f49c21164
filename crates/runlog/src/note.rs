//! The note of a finished log: who made it, where, why, as keys with values in the metadata record `note` behind all
//! others. Nothing else of the log changes but its index, so verdict, digests and numbers stay.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use asperity_files::{Existing, FileError, FileSet, Inputs};
use mcap::records::{Record, op};

use crate::format::{LONGEST_METADATA_BYTES, LONGEST_RECORD_BYTES, MAGIC, NOTE, RECORD_HEAD_BYTES};
use crate::parse::parse;

/// Bytes of the record at the end of the data, and of the footer and the magic behind it.
const DATA_END_BYTES: u64 = RECORD_HEAD_BYTES as u64 + 4;
const FOOTER_BYTES: usize = RECORD_HEAD_BYTES + 8 + 8 + 4 + MAGIC.len();

/// The note of a log; empty if it has none, or its index cannot be read.
pub fn note(log: &Path) -> BTreeMap<String, String> {
    // A pipe can be read only once.
    let file = log.is_file().then(|| asperity_files::open(log).and_then(Indexed::of).ok()).flatten();
    file.map(|indexed| indexed.note).unwrap_or_default()
}

/// Changes the note of a whole log: keys with an empty value are removed. Returns the note. The log is replaced once
/// the new one is complete.
///
/// # Errors
/// If its index is not that of a whole MCAP file, the note becomes too long, or the system refuses.
pub fn annotate(log: &Path, changes: &[(String, String)]) -> Result<BTreeMap<String, String>, FileError> {
    // The target of a link is replaced, not the link.
    let failed = |error| FileError::Io { path: log.to_owned(), error };
    let log = &log.canonicalize().map_err(failed)?;
    let Indexed { file, end, mut groups, mut note } =
        asperity_files::open(log).and_then(Indexed::of).map_err(failed)?;
    for (key, value) in changes {
        match value.as_str() {
            "" => note.remove(key),
            _ => note.insert(key.clone(), value.clone()),
        };
    }
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let map: Vec<u8> = note.iter().flat_map(|(key, value)| [text(key), text(value)].concat()).collect();
    let body = [text(NOTE), (map.len() as u32).to_le_bytes().to_vec(), map].concat();
    if body.len() > LONGEST_METADATA_BYTES {
        let what = format!("a note of {} bytes (accepted: up to {LONGEST_METADATA_BYTES})", body.len());
        return Err(failed(io::Error::other(what)));
    }
    let added = if note.is_empty() { Vec::new() } else { record(op::METADATA, &body) };
    if !note.is_empty() {
        let places = [end.to_le_bytes(), (added.len() as u64).to_le_bytes()].concat();
        group(&mut groups, op::METADATA_INDEX)
            .extend(record(op::METADATA_INDEX, &[places, text(NOTE)].concat()));
        count(&mut groups, 1);
    }

    let files = FileSet::new(Existing::Replace, Inputs::default());
    let mut out =
        BufWriter::new(Summed { file: files.create(log)?, crc: crc32fast::Hasher::new(), bytes: 0 });
    let mut write = || -> io::Result<()> {
        (&file).rewind()?;
        io::copy(&mut (&file).take(end), &mut out)?;
        out.write_all(&added)?;
        out.flush()?;
        let crc = std::mem::take(&mut out.get_mut().crc).finalize();
        out.write_all(&record(op::DATA_END, &crc.to_le_bytes()))?;
        out.flush()?;
        let start = out.get_ref().bytes;
        out.get_mut().crc = crc32fast::Hasher::new();
        let (mut at, mut offsets) = (start, Vec::new());
        for (opcode, records) in &groups {
            let place = [at.to_le_bytes(), (records.len() as u64).to_le_bytes()].concat();
            offsets.extend(record(op::SUMMARY_OFFSET, &[&[*opcode][..], &place].concat()));
            out.write_all(records)?;
            at += records.len() as u64;
        }
        out.write_all(&offsets)?;
        let footer = record(op::FOOTER, &[start.to_le_bytes(), at.to_le_bytes(), [0; 8]].concat()[..20]);
        out.write_all(&footer[..footer.len() - 4])?;
        out.flush()?;
        let crc = out.get_ref().crc.clone().finalize();
        out.write_all(&[&crc.to_le_bytes(), MAGIC].concat())?;
        out.flush()
    };
    write().map_err(failed)?;
    files.publish()?;
    Ok(note)
}

/// A log as its index gives it, without its note.
struct Indexed {
    file: File,
    /// Where the data end, and the note would stand.
    end: u64,
    /// The records of the summary by kind, without the places of these groups.
    groups: Vec<(u8, Vec<u8>)>,
    note: BTreeMap<String, String>,
}

impl Indexed {
    fn of(mut file: File) -> io::Result<Indexed> {
        let wrong = || io::Error::other("it has no index as this program writes it");
        let length = file.metadata()?.len();
        let footer_at = length.checked_sub(FOOTER_BYTES as u64).ok_or_else(wrong)?;
        let footer = bytes(&mut file, footer_at, FOOTER_BYTES)?;
        let start =
            footer[RECORD_HEAD_BYTES..][..8].try_into().map(u64::from_le_bytes).map_err(|_| wrong())?;
        let mut end = start.checked_sub(DATA_END_BYTES).ok_or_else(wrong)?;
        let summary = footer_at.checked_sub(start).and_then(|bytes| usize::try_from(bytes).ok());
        let summary = summary.filter(|bytes| *bytes <= LONGEST_RECORD_BYTES).ok_or_else(wrong)?;
        let summary = bytes(&mut file, start, summary)?;
        let (mut groups, mut note) = (Vec::new(), BTreeMap::new());
        let mut had_note = false;
        let mut rest = summary.as_slice();
        while let Some((head, after)) = rest.split_at_checked(RECORD_HEAD_BYTES) {
            let length =
                head[1..].try_into().map(u64::from_le_bytes).ok().and_then(|n| usize::try_from(n).ok());
            let body = length.and_then(|length| after.get(..length)).ok_or_else(wrong)?;
            rest = &after[body.len()..];
            match parse(head[0], body, start).map_err(io::Error::other)? {
                Record::SummaryOffset(_) => continue,
                Record::MetadataIndex(index)
                    if index.name == NOTE && index.offset.checked_add(index.length) == Some(end) =>
                {
                    let length = (index.length as usize).min(LONGEST_METADATA_BYTES);
                    let record = bytes(&mut file, index.offset, length)?;
                    let body = record.get(RECORD_HEAD_BYTES..).ok_or_else(wrong)?;
                    if let Record::Metadata(found) =
                        parse(op::METADATA, body, index.offset).map_err(io::Error::other)?
                    {
                        (note, end, had_note) = (found.metadata, index.offset, true);
                    }
                }
                _ => group(&mut groups, head[0]).extend([head, body].concat()),
            }
        }
        if had_note {
            count(&mut groups, u32::MAX);
        }
        Ok(Indexed { file, end, groups, note })
    }
}

/// Adds to the number of metadata records in the statistics.
fn count(groups: &mut Vec<(u8, Vec<u8>)>, more: u32) {
    const AT: usize = RECORD_HEAD_BYTES + 8 + 2 + 4 + 4;
    if let Some(place) = group(groups, op::STATISTICS).get_mut(AT..AT + 4) {
        let counted = u32::from_le_bytes([place[0], place[1], place[2], place[3]]).wrapping_add(more);
        place.copy_from_slice(&counted.to_le_bytes());
    }
}

/// The records of one kind, in the order of the file.
fn group(groups: &mut Vec<(u8, Vec<u8>)>, opcode: u8) -> &mut Vec<u8> {
    let place = groups.iter().position(|(of, _)| *of == opcode).unwrap_or_else(|| {
        groups.push((opcode, Vec::new()));
        groups.len() - 1
    });
    &mut groups[place].1
}

fn bytes(file: &mut File, at: u64, length: usize) -> io::Result<Vec<u8>> {
    let mut bytes = vec![0; length];
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// Counts and sums what is written.
struct Summed {
    file: File,
    crc: crc32fast::Hasher,
    bytes: u64,
}

impl Write for Summed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.crc.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
