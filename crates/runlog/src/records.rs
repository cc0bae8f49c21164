//! Iterates over the MCAP records of a log, including those in chunks: checks every checksum and
//! the order of records, in memory bounded by a chunk.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::ahead::Ahead;
use crate::chunk::Chunk;
use crate::format::{LONGEST_READ_BYTES, LONGEST_RECORD_BYTES, MAGIC, PROFILE, RECORD_HEAD_BYTES};
use crate::layout::Layout;
use crate::parse::parse;
use crate::problem::{LogProblem, NoRunLog};

/// Reads the records of one file.
pub(crate) struct Records {
    source: BufReader<File>,
    reader: LinearReader,
    /// The offsets of the next record and of the current one.
    next_at: u64,
    at: u64,
    /// The rest of the current chunk.
    chunk: Chunk,
    layout: Layout,
    /// Why the file is no run log, by its first bytes.
    foreign: Option<NoRunLog>,
    has_other_profile: bool,
}

impl Records {
    /// Opens a file with this header, scenario and end.
    ///
    /// # Errors
    /// If it does not exist or the system refuses.
    pub(crate) fn open(path: &Path, ahead: &Ahead) -> io::Result<Records> {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(LONGEST_RECORD_BYTES);
        let mut source = BufReader::with_capacity(1 << 16, asperity_files::open(path)?);
        asperity_files::fill(&mut source)?;
        Ok(Records {
            foreign: foreign(source.buffer()),
            source,
            reader: LinearReader::new_with_options(options),
            next_at: MAGIC.len() as u64,
            at: 0,
            chunk: Chunk::default(),
            layout: Layout::new(ahead),
            has_other_profile: false,
        })
    }

    /// The records seen so far.
    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Why the file does not begin as run logs do, if so: it is empty, torn, or of another program. The MCAP header
    /// is read for its library.
    pub(crate) fn foreign(&mut self) -> Result<Option<NoRunLog>, LogProblem> {
        match self.foreign {
            Some(NoRunLog::OtherProgram { .. }) => match self.read() {
                Err(problem @ LogProblem::Io(_)) => Err(problem),
                // Other errors in it do not matter.
                _ => Ok(self.foreign.clone()),
            },
            _ => Ok(self.foreign.clone()),
        }
    }

    /// The error for a missing header: the file is damaged, or of another program.
    pub(crate) fn no_header(&self) -> LogProblem {
        let foreign = self.foreign.clone().filter(|_| self.has_other_profile);
        foreign.map_or(LogProblem::NoHeader, LogProblem::from)
    }

    /// Returns the next record; None after the last one.
    ///
    /// # Errors
    /// If it cannot be read, or is not allowed there.
    pub(crate) fn next(&mut self) -> Result<Option<Record<'static>>, LogProblem> {
        match self.read() {
            Err(problem @ LogProblem::Io(_)) => Err(problem),
            // A file of another program is not a run log, whatever its errors, nor if it has none.
            Err(_) | Ok(None) if self.has_other_profile && !self.layout.has_run() => Err(self.no_header()),
            read => read,
        }
    }

    fn read(&mut self) -> Result<Option<Record<'static>>, LogProblem> {
        loop {
            if let Some((opcode, body)) = self.chunk.next_record().map_err(|problem| problem.at(self.at))? {
                let record = parse(opcode, body, self.at)?.into_owned();
                self.layout.inner(self.at, &record)?;
                return Ok(Some(record));
            }
            let record = match self.reader.next_event() {
                None if read_some(&mut self.source, &mut [0])? > 0 => {
                    return Err(LogProblem::Misplaced("there is something after the end of the MCAP file"));
                }
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let buffer = self.reader.insert(wanted.min(LONGEST_READ_BYTES));
                    let read = read_some(&mut self.source, buffer)?;
                    self.reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.at = self.next_at;
                    self.next_at += (RECORD_HEAD_BYTES + data.len()) as u64;
                    let record = parse(opcode, data, self.at)?;
                    self.layout.take(self.at, &record, data)?;
                    record.into_owned()
                }
                Some(Err(McapError::UnexpectedEof)) => return Err(self.early_end()),
                Some(Err(McapError::BadMagic)) if !self.layout.has_begun() => {
                    return Err(self.foreign.clone().unwrap_or(NoRunLog::NotMcap).into());
                }
                Some(Err(error)) => return Err(LogProblem::from(error).at(self.next_at)),
            };
            match record {
                Record::Chunk { header, data } => {
                    self.chunk = Chunk::open(&header, &data).map_err(|problem| problem.at(self.at))?;
                }
                Record::Header(header) => {
                    self.has_other_profile = header.profile != PROFILE;
                    if let Some(NoRunLog::OtherProgram { library }) = &mut self.foreign {
                        library.clone_from(&header.library);
                    }
                    return Ok(Some(Record::Header(header)));
                }
                record => return Ok(Some(record)),
            }
        }
    }

    /// The error for a file that ends inside a record: it was truncated, or the record's length is
    /// wrong. A truncated file has no proper ending.
    fn early_end(&mut self) -> LogProblem {
        let mut last = [0; MAGIC.len()];
        let back = SeekFrom::End(-(last.len() as i64));
        let read = self.source.seek(back).and_then(|at| self.source.read_exact(&mut last).map(|()| at));
        match read {
            Ok(at) if at > self.next_at && last == *MAGIC => LogProblem::Overlong(self.next_at),
            _ => match self.foreign.clone().filter(|_| !self.layout.has_begun()) {
                Some(foreign) => foreign.into(),
                None => McapError::UnexpectedEof.into(),
            },
        }
    }
}

/// Why a file with these first bytes is no run log; None if it begins as one, however short it is.
fn foreign(start: &[u8]) -> Option<NoRunLog> {
    /// Where the length of the MCAP header stands, which depends on its library, and where the profile ends.
    const LENGTH_AT: usize = MAGIC.len() + 1;
    const PROFILE_AT: usize = LENGTH_AT + 8 + 4;
    // That length fits in its first byte, and includes profile and library with their lengths.
    const SHORTEST: u8 = 4 + PROFILE.len() as u8 + 4;
    let profile_bytes = (PROFILE.len() as u32).to_le_bytes();
    let ours = [MAGIC, &[op::HEADER], &[0; 8], &profile_bytes, PROFILE.as_bytes()].concat();
    let is_ours = |(at, byte): (usize, &u8)| match at {
        LENGTH_AT => *byte >= SHORTEST,
        _ => *byte == ours[at],
    };
    let start = &start[..start.len().min(ours.len())];
    let differs = match start.iter().enumerate().position(|at| !is_ours(at)) {
        None if start.is_empty() => return Some(NoRunLog::Empty),
        None => return None,
        Some(differs) => differs,
    };
    // The header of another program may have an empty profile, and end there.
    let may_be_another = differs > LENGTH_AT && start.len() <= PROFILE_AT;
    Some(if start[differs..].iter().all(|byte| *byte == 0) && !may_be_another {
        NoRunLog::Torn
    } else if start.starts_with(MAGIC) {
        NoRunLog::OtherProgram { library: String::new() }
    } else {
        NoRunLog::NotMcap
    })
}

/// Reads some bytes, again if a signal interrupts it.
fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
