//! Reads tables of text, one block after the other.

use std::fs::File;
use std::path::{Path, PathBuf};

use asperity_files::ShortLines;
use csv::{ByteRecord, ReaderBuilder};

use crate::error::{InputFault, Place, RecordingError};
use crate::samples::{Block, Column, Samples};

/// A table with a heading, and with a row of units behind it if so described.
pub(crate) struct Csv {
    reader: csv::Reader<ShortLines<File>>,
    path: PathBuf,
    heading: Vec<String>,
    units: Option<Vec<String>>,
    /// The wanted columns, from 0.
    columns: Vec<usize>,
    record: ByteRecord,
}

impl Csv {
    pub(crate) fn open(
        path: &Path,
        shown: &Path,
        has_units: bool,
        columns: &[Column],
    ) -> Result<Csv, RecordingError> {
        let file = asperity_files::open(path).map_err(RecordingError::io(shown))?;
        let reader = ReaderBuilder::new().has_headers(false).flexible(true).from_reader(ShortLines::of(file));
        let mut table = Csv {
            reader,
            path: shown.to_owned(),
            heading: Vec::new(),
            units: None,
            columns: Vec::new(),
            record: ByteRecord::new(),
        };
        table.heading = table.row_of_text()?;
        if has_units {
            table.units = Some(table.row_of_text()?);
        }
        let found = columns.iter().map(|column| {
            let place = match column {
                Column::Name(name) => table.heading.iter().position(|known| known == name),
                Column::Number(number) => {
                    usize::try_from(*number).ok().and_then(|number| number.checked_sub(1))
                }
            };
            place.filter(|place| *place < table.heading.len()).ok_or_else(|| {
                let problem = format!("no such column; there are {}", table.heading.join(", "));
                let fault = InputFault::new(shown, Place::Line(1), problem, "a column of the heading");
                RecordingError::from(fault.of(column))
            })
        });
        table.columns = found.collect::<Result<_, RecordingError>>()?;
        Ok(table)
    }

    fn row_of_text(&mut self) -> Result<Vec<String>, RecordingError> {
        self.advance()?;
        Ok(self.record.iter().map(|cell| String::from_utf8_lossy(cell).trim().to_owned()).collect())
    }

    /// Reads the next row; false at the end.
    fn advance(&mut self) -> Result<bool, RecordingError> {
        let error = match self.reader.read_byte_record(&mut self.record) {
            Ok(is_there) => return Ok(is_there),
            Err(error) => error,
        };
        Err(RecordingError::io(&self.path)(error.into()))
    }

    /// The line of the current row.
    fn line(&self) -> Place {
        Place::Line(self.record.position().map_or(0, csv::Position::line))
    }

    fn number(&self, column: usize) -> Result<f64, Box<InputFault>> {
        let cell = self.record.get(column).unwrap_or_default().trim_ascii();
        let problem = match fast_float2::parse::<f64, _>(cell) {
            Ok(number) if number.is_finite() => return Ok(number),
            Ok(_) => "not a finite number",
            Err(_) if cell.is_empty() => "empty cell",
            Err(_) => "not a number",
        };
        let value = Some(String::from_utf8_lossy(cell).into_owned()).filter(|text| !text.is_empty());
        let fault = InputFault::new(&self.path, self.line(), problem, "a finite number");
        Err(fault.of(&self.heading[column]).with(value))
    }
}

impl Samples for Csv {
    fn next(&mut self, most: usize, block: &mut Block) -> Result<usize, RecordingError> {
        block.iter_mut().for_each(Vec::clear);
        for count in 0..most {
            if !self.advance()? {
                return Ok(count);
            }
            let (found, expected) = (self.record.len(), self.heading.len());
            if found != expected {
                let problem = format!("{found} cells where the heading has {expected}");
                return Err(
                    InputFault::new(&self.path, self.line(), problem, "a cell for every column").into()
                );
            }
            for (row, column) in block.iter_mut().zip(&self.columns) {
                row.push(self.number(*column)?);
            }
        }
        Ok(most)
    }

    fn known_length(&self) -> Option<u64> {
        None
    }

    fn place(&self, sample: u64) -> Place {
        Place::Line(sample + 2 + u64::from(self.units.is_some()))
    }

    fn units(&self) -> Vec<Option<String>> {
        let unit = |column: &usize| self.units.as_ref().and_then(|units| units.get(*column).cloned());
        self.columns.iter().map(unit).collect()
    }
}
