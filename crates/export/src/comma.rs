//! Tables as CSV: a header line, nothing for what is empty, and doubles with as
//! many digits as it takes to read the same double back, spelled as in the
//! tables that runs are reduced to.

use std::fmt::Write as _;
use std::fs::File;
use std::io::BufWriter;

use crate::batch::{Batch, Cell};
use crate::format::{About, Format, FormatError, TableWriter};
use crate::layout::Layout;

/// Comma-separated values.
#[derive(Debug, Clone, Copy)]
pub struct Csv;

struct CsvTable {
    writer: csv::Writer<BufWriter<File>>,
    cell: String,
}

impl Format for Csv {
    fn extension(&self) -> &'static str {
        "csv"
    }

    fn start(&self, layout: &Layout, file: File) -> Result<Box<dyn TableWriter>, FormatError> {
        let mut writer = csv::Writer::from_writer(BufWriter::new(file));
        writer.write_record(layout.columns.iter().map(|column| column.name)).map_err(refused)?;
        Ok(Box::new(CsvTable { writer, cell: String::new() }))
    }
}

impl TableWriter for CsvTable {
    fn write(&mut self, batch: &Batch) -> Result<(), FormatError> {
        for row in 0..batch.rows() {
            for values in batch.columns() {
                self.cell.clear();
                match values.cell(row) {
                    Cell::Empty => Ok(()),
                    Cell::Count(value) => write!(self.cell, "{value}"),
                    Cell::Step(value) => write!(self.cell, "{value}"),
                    Cell::Number(value) => write!(self.cell, "{value}"),
                    Cell::Flag(value) => write!(self.cell, "{value}"),
                    Cell::Word(value) => write!(self.cell, "{value}"),
                }
                .expect("numbers and words can be written to a text");
                self.writer.write_field(&self.cell).map_err(refused)?;
            }
            self.writer.write_record(None::<&[u8]>).map_err(refused)?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>, _about: &About) -> Result<File, FormatError> {
        let buffer = self.writer.into_inner().map_err(|error| FormatError::Library(error.to_string()))?;
        Ok(buffer.into_inner().map_err(|error| error.into_error())?)
    }
}

fn refused(error: csv::Error) -> FormatError {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error.into(),
        other => FormatError::Library(format!("{other:?}")),
    }
}
