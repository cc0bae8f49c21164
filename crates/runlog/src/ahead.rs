//! Header, scenario and end of a log, looked up before its messages are read: other programs write it
//! anywhere in a file, while our own have header and scenario first and the end last.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use mcap::records::{Record, op};

use crate::format::{
    BYTES, DESCRIPTIONS, LIBRARY, LONGEST_METADATA_BYTES, LONGEST_RECORD_BYTES, MAGIC, RECORD_HEAD_BYTES,
    RUN, RUN_END, SALVAGE,
};
use crate::parse::parse;

/// The first of each of these in a file, as far as its records can be followed.
#[derive(Debug, Default)]
pub(crate) struct Ahead {
    /// Metadata `run`.
    pub(crate) run: Option<BTreeMap<String, String>>,
    /// Metadata `salvage`.
    pub(crate) salvage: Option<BTreeMap<String, String>>,
    /// Metadata `run_end`.
    pub(crate) end: Option<BTreeMap<String, String>>,
    /// The attached scenario.
    pub(crate) scenario: Option<Vec<u8>>,
    /// The library in the MCAP header, if another program than this wrote the file.
    pub(crate) rewritten_by: Option<String>,
}

impl Ahead {
    /// Walks from record to record without reading those that hold messages. What is wrong in the file is for
    /// its reader to report.
    ///
    /// # Errors
    /// If the system refuses.
    pub(crate) fn of(path: &Path) -> io::Result<Ahead> {
        let file = asperity_files::open(path)?;
        let length = file.metadata()?.len();
        let mut file = BufReader::with_capacity(1 << 12, file);
        let mut ahead = Ahead::default();
        let mut at = MAGIC.len() as u64;
        if bytes(&mut file, MAGIC.len() as u64)? != MAGIC {
            return Ok(ahead);
        }
        let mut library = String::new();
        let mut moved = false;
        loop {
            let head = bytes(&mut file, RECORD_HEAD_BYTES as u64)?;
            let Some((&opcode, size)) = head.split_first() else { break };
            let Ok(size) = size.try_into().map(u64::from_le_bytes) else { break };
            let next = at.saturating_add(RECORD_HEAD_BYTES as u64).saturating_add(size);
            if next > length || matches!(opcode, op::DATA_END | op::FOOTER) {
                break;
            }
            let is_read = match opcode {
                op::HEADER | op::METADATA => size <= LONGEST_METADATA_BYTES as u64,
                // Checkpoints follow the scenario, and are long.
                op::ATTACHMENT => ahead.scenario.is_none() && size <= LONGEST_RECORD_BYTES as u64,
                _ => false,
            };
            if is_read {
                let body = bytes(&mut file, size)?;
                match parse(opcode, &body, at) {
                    Ok(Record::Header(header)) => library = header.library,
                    Ok(Record::Metadata(metadata)) => {
                        let place = match metadata.name.as_str() {
                            RUN => &mut ahead.run,
                            SALVAGE => &mut ahead.salvage,
                            RUN_END => &mut ahead.end,
                            _ => &mut None,
                        };
                        if metadata.name == RUN_END {
                            moved |= metadata.metadata.get(BYTES).is_some_and(|said| *said != at.to_string());
                        }
                        place.get_or_insert(metadata.metadata);
                    }
                    Ok(Record::Attachment { header, data, .. })
                        if DESCRIPTIONS.contains(&header.name.as_str()) =>
                    {
                        ahead.scenario.get_or_insert(data.into_owned());
                    }
                    _ => {}
                }
            } else {
                file.seek_relative(i64::try_from(size).unwrap_or(i64::MAX))?;
            }
            at = next;
        }
        ahead.rewritten_by = (moved || !library.starts_with(LIBRARY)).then_some(library);
        Ok(ahead)
    }
}

/// As many bytes as that, or fewer at the end of the file.
fn bytes(file: &mut BufReader<File>, count: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.by_ref().take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}
