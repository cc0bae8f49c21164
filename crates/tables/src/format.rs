//! The formats of tables in files, and the state of the log that their rows come from.

use std::fs::File;
use std::io::{self, BufWriter};

use crate::comma::{CsvRows, Spelling};
use crate::lines::Lines;
use crate::parquet::Parquet;
use crate::table::Table;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// Newline-delimited JSON.
    Ndjson,
    /// Columns with types, units and meanings, compressed.
    Parquet,
}

impl Format {
    /// How its files' names end, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Csv => "csv",
            Format::Ndjson => "ndjson",
            Format::Parquet => "parquet",
        }
    }

    /// Starts the file of a table with these columns.
    pub(crate) fn start(self, table: &Table, file: File) -> io::Result<Box<dyn TableWriter>> {
        Ok(match self {
            Format::Csv => Box::new(CsvRows::new(BufWriter::new(file), &table.columns, Spelling::Plain)?),
            Format::Ndjson => Box::new(Lines(BufWriter::new(file))),
            Format::Parquet => Box::new(Parquet::start(table, file)?),
        })
    }
}

/// A table's file that is being written.
pub(crate) trait TableWriter {
    /// Adds the rows of a table.
    fn write(&mut self, table: &Table) -> io::Result<()>;

    /// Ends a group of rows, in a format that has such groups.
    fn end_group(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Ends the file. `about` describes the source of the rows, as names and texts, for formats that have a place
    /// for it.
    fn finish(self: Box<Self>, about: &[(String, String)]) -> io::Result<()>;
}

/// The state of a damaged log: everything after the damage is left out of its tables.
pub const DAMAGED: &str = "damaged";
