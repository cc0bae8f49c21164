//! Tables as NDJSON: one object per row and line, with the doubles spelled as in the log, and null for
//! empty cells.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use serde::{Serialize, Serializer};

use crate::format::TableWriter;
use crate::table::Table;

/// Newline-delimited JSON that is being written.
pub(crate) struct Lines(pub(crate) BufWriter<File>);

impl TableWriter for Lines {
    fn write(&mut self, table: &Table) -> io::Result<()> {
        for row in 0..table.rows() {
            serde_json::to_writer(&mut self.0, &Line(table, row))?;
            self.0.write_all(b"\n")?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>, _about: &[(String, String)]) -> io::Result<()> {
        self.0.flush()
    }
}

/// A row, as an object with the columns in their order.
struct Line<'a>(&'a Table, usize);

impl Serialize for Line<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.columns.iter().map(|column| &column.name).zip(self.0.row(self.1)))
    }
}
