//! Tables as NDJSON: one object per row and line, with the doubles spelled as in the log, and null for
//! empty cells.

use std::fs::File;
use std::io::{BufWriter, Write};

use asperity_record::Column;
use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::batch::Batch;
use crate::format::{Format, FormatError, TableWriter};
use crate::layout::Layout;

/// Newline-delimited JSON.
#[derive(Debug, Clone, Copy)]
pub struct Ndjson;

struct Lines {
    file: BufWriter<File>,
    columns: Vec<Column>,
}

impl Format for Ndjson {
    fn extension(&self) -> &'static str {
        "ndjson"
    }

    fn start(&self, layout: &Layout, file: File) -> Result<Box<dyn TableWriter>, FormatError> {
        Ok(Box::new(Lines { file: BufWriter::new(file), columns: layout.columns.clone() }))
    }
}

impl TableWriter for Lines {
    fn write(&mut self, batch: &Batch) -> Result<(), FormatError> {
        for row in 0..batch.rows() {
            let line = Line { columns: &self.columns, batch, row };
            serde_json::to_writer(&mut self.file, &line).map_err(std::io::Error::from)?;
            self.file.write_all(b"\n")?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>, _about: &[(String, String)]) -> Result<File, FormatError> {
        Ok(self.file.into_inner().map_err(|error| error.into_error())?)
    }
}

/// A row, as an object with the columns in their order.
struct Line<'a> {
    columns: &'a [Column],
    batch: &'a Batch,
    row: usize,
}

impl Serialize for Line<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.columns.len()))?;
        for (column, values) in self.columns.iter().zip(self.batch.columns()) {
            map.serialize_entry(&column.name, &values.cell(self.row))?;
        }
        map.end()
    }
}
