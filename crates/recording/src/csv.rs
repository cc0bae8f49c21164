//! Reads tables of text, one block after the other.

use std::fs::File;
use std::io::{BufRead, BufReader, Chain, Cursor, Read};
use std::path::{Path, PathBuf};

use asperity_files::ShortLines;
use csv::{ByteRecord, ReaderBuilder};

use crate::description::{Column, Stream};
use crate::error::{InputFault, RecordingError, Result};
use crate::samples::{Block, Samples};

/// Of these the first that a heading contains separates its cells, if no other is given.
const DELIMITERS: [u8; 3] = [b'\t', b';', b','];

/// The heading, and what is behind it.
type Text = Chain<Cursor<Vec<u8>>, BufReader<ShortLines<File>>>;

/// A table with a heading, and with a row of units behind it if so described.
pub(crate) struct Csv {
    reader: csv::Reader<Text>,
    path: PathBuf,
    heading: Vec<String>,
    units: Vec<String>,
    /// The wanted columns, from 0.
    columns: Vec<usize>,
    record: ByteRecord,
    /// Lines before those of the reader, and the line of the first sample.
    lines_before: u64,
    first_line: u64,
    /// The decimal mark of all numbers; not known before the first that has one.
    mark: Option<u8>,
    /// Whether numbers may have a decimal comma.
    may_have_commas: bool,
    is_complete: bool,
}

impl Csv {
    /// Opens columns of a table that is described by a stream.
    pub(crate) fn open(file: File, shown: &Path, stream: &Stream, columns: &[Column]) -> Result<Csv> {
        let io = RecordingError::io(shown);
        let mut source = BufReader::new(ShortLines::of(file));
        let mut lines = 0;
        let mut line = || -> Result<Vec<u8>> {
            let mut line = Vec::new();
            lines += u64::from(source.read_until(b'\n', &mut line).map_err(&io)? > 0);
            Ok(line)
        };
        for _ in 0..stream.skip_rows {
            line()?;
        }
        let (mut comment, mut heading) = (None, line()?);
        // Spreadsheets mark a text as Unicode.
        heading.drain(..if heading.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 });
        if heading.starts_with(b"\xff\xfe") || heading.starts_with(b"\xfe\xff") {
            let fault = InputFault::new(shown, ":1", "a text in UTF-16", "a text in UTF-8");
            return Err(fault.into());
        }
        while let Some(text) = heading.strip_prefix(b"#") {
            comment = Some(text.to_owned());
            heading = line()?;
        }
        let delimiter = |heading: &[u8]| {
            let found = || DELIMITERS.into_iter().find(|known| heading.contains(known));
            stream.delimiter.map(|given| given as u8).or_else(found).unwrap_or(b',')
        };
        // NumPy writes the heading as a comment.
        let is_number = |cell: &[u8]| fast_float2::parse::<f64, _>(cell.trim_ascii()).is_ok();
        let first = heading.split(|byte| *byte == delimiter(&heading)).next().unwrap_or_default();
        if let Some(comment) = comment.filter(|_| is_number(first)) {
            heading = [comment, heading].concat();
        }
        let of_heading = heading.split_inclusive(|byte| *byte == b'\n');
        let delimiter = delimiter(of_heading.clone().next().unwrap_or_default());
        let lines_before = lines - of_heading.count() as u64;
        let (mut record, mut reader) = (ByteRecord::new(), ReaderBuilder::new());
        let reader = reader.has_headers(false).flexible(true).comment(Some(b'#')).delimiter(delimiter);
        let mut reader = reader.from_reader(Cursor::new(heading).chain(source));
        let mut texts = || -> Result<Vec<String>> {
            reader.read_byte_record(&mut record).map_err(|error| io(error.into()))?;
            Ok(record.iter().map(|cell| String::from_utf8_lossy(cell).trim().to_owned()).collect())
        };
        let heading = texts()?;
        let units = if stream.units_row { texts()? } else { Vec::new() };
        let found = columns.iter().map(|column| {
            let place = match column {
                Column::Name(name) => heading.iter().position(|known| known == name),
                Column::Number(number) => Some(*number as usize - 1),
            };
            place.filter(|place| *place < heading.len()).ok_or_else(|| {
                let problem = format!("no such column; there are {}", heading.join(", "));
                let place = format!(":{}", lines_before + 1);
                InputFault::new(shown, place, problem, "a column of the heading").of(column, None)
            })
        });
        Ok(Csv {
            columns: found.collect::<Result<_, InputFault>>()?,
            path: shown.to_owned(),
            first_line: lines_before + reader.position().line(),
            reader,
            heading,
            units,
            record,
            lines_before,
            mark: None,
            may_have_commas: delimiter != b',',
            is_complete: stream.missing.is_none(),
        })
    }

    /// Reads the next row; false at the end.
    fn advance(&mut self) -> Result<bool> {
        let read = self.reader.read_byte_record(&mut self.record);
        read.map_err(|error| RecordingError::io(&self.path)(error.into()))
    }

    /// What is wrong in the current row.
    fn fault(&self, problem: String, accepted: &'static str) -> InputFault {
        let line = self.lines_before + self.record.position().map_or(0, csv::Position::line);
        InputFault::new(&self.path, format!(":{line}"), problem, accepted)
    }

    /// The number in a cell of the current row, with a decimal comma where all have one.
    fn number(&mut self, column: usize) -> Result<f64, InputFault> {
        let cell = self.record.get(column).unwrap_or_default().trim_ascii();
        let marks = || cell.iter().copied().find(|byte| b".,".contains(byte));
        let mark = if self.may_have_commas { marks() } else { None };
        let with_point = |byte: &u8| if *byte == b',' { b'.' } else { *byte };
        let parsed = match mark {
            Some(b',') => fast_float2::parse(cell.iter().map(with_point).collect::<Vec<u8>>()),
            _ => fast_float2::parse::<f64, _>(cell),
        };
        let is_other = mark.is_some_and(|mark| *self.mark.get_or_insert(mark) != mark);
        let problem = match parsed {
            Ok(_) if is_other => "another decimal mark than before",
            Ok(number) if number.is_finite() => return Ok(number),
            Ok(_) if !self.is_complete => return Ok(f64::NAN),
            Err(_) if !self.is_complete && cell.is_empty() => return Ok(f64::NAN),
            Ok(_) => "not a finite number",
            Err(_) if cell.is_empty() => "empty cell",
            Err(_) => "not a number",
        };
        let value = String::from_utf8_lossy(cell);
        let value = Some(&*value).filter(|text| !text.is_empty());
        Err(self.fault(problem.to_owned(), "a finite number").of(&self.heading[column], value))
    }
}

impl Samples for Csv {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize> {
        let mut row = vec![0.0; self.columns.len()];
        for count in 0..most {
            if !self.advance()? {
                return Ok(count);
            }
            let (found, expected) = (self.record.len(), self.heading.len());
            if found != expected {
                let problem = format!("{found} cells where the heading has {expected}");
                return Err(self.fault(problem, "a cell for every column").into());
            }
            for (n, number) in row.iter_mut().enumerate() {
                *number = self.number(self.columns[n])?;
            }
            block.push(&row);
        }
        Ok(most)
    }

    fn skip(&mut self, most: usize, _block: &mut Block) -> Result<usize> {
        for count in 0..most {
            if !self.advance()? {
                return Ok(count);
            }
        }
        Ok(most)
    }

    fn place(&self, sample: u64) -> String {
        format!(":{}", self.first_line + sample)
    }

    fn unit(&self, channel: usize) -> Option<(String, String)> {
        Some((self.units.get(self.columns[channel])?.clone(), format!(":{}", self.first_line - 1)))
    }
}
