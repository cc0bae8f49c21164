//! Tables as CSV: a header line, nothing for empty cells, and doubles with as many digits as they need to
//! be read back exactly. Every table that is CSV is written by [`CsvRows`].

use std::borrow::Cow;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};

use asperity_record::{Cell, Column};

use crate::format::TableWriter;
use crate::table::Table;

/// How doubles are spelled. Both read back as the same double.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spelling {
    /// `5` and `0.0000001`: as in exported tables and those that runs are reduced to.
    Plain,
    /// `5.0` and `1e-7`: as in what `asperity events` prints and in the tables of a replay.
    Scientific,
}

/// Rows of cells as CSV, below a header line.
pub struct CsvRows<W: Write> {
    writer: csv::Writer<W>,
    spelling: Spelling,
    text: String,
}

impl<W: Write> CsvRows<W> {
    /// Writes the header line.
    ///
    /// # Errors
    /// If `out` cannot be written.
    pub fn new(out: W, columns: &[Column], spelling: Spelling) -> io::Result<CsvRows<W>> {
        CsvRows::headed(out, columns.iter().map(|column| &*column.name), spelling)
    }

    /// A writer for columns with names only.
    ///
    /// # Errors
    /// If `out` cannot be written.
    pub fn headed<'n>(
        out: W,
        names: impl Iterator<Item = &'n str>,
        spelling: Spelling,
    ) -> io::Result<CsvRows<W>> {
        // Writes the header explicitly, since it is required without rows as well.
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
        writer.write_record(names).map_err(as_io)?;
        Ok(CsvRows { writer, spelling, text: String::new() })
    }

    /// Writes a row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) -> io::Result<()> {
        if self.spelling == Spelling::Scientific {
            return self.writer.serialize(row.into_iter().collect::<Vec<Cell>>()).map_err(as_io);
        }
        for cell in row {
            self.text.clear();
            write!(self.text, "{cell}").expect("numbers and words can be written to a text");
            let is_word = matches!(cell, Cell::Word(_));
            let text = if is_word { no_formula(&self.text) } else { Cow::Borrowed(&*self.text) };
            self.writer.write_field(&*text).map_err(as_io)?;
        }
        self.writer.write_record(None::<&[u8]>).map_err(as_io)
    }

    /// Writes a row of texts.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn push_texts<T: AsRef<str>>(&mut self, row: impl IntoIterator<Item = T>) -> io::Result<()> {
        for cell in row {
            self.writer.write_field(&*no_formula(cell.as_ref())).map_err(as_io)?;
        }
        self.writer.write_record(None::<&[u8]>).map_err(as_io)
    }

    /// Flushes, and returns the underlying writer.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.writer.flush()?;
        self.writer.into_inner().map_err(|error| error.into_error())
    }
}

/// A text, behind an apostrophe if spreadsheets would compute it, such as the name `=1+1`. Numbers stay numbers.
fn no_formula(text: &str) -> Cow<'_, str> {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    if is_formula { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) }
}

/// The error of the system, which identifies a closed pipe.
fn as_io(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}

impl TableWriter for CsvRows<BufWriter<File>> {
    fn write(&mut self, table: &Table) -> io::Result<()> {
        (0..table.rows()).try_for_each(|row| self.push(table.row(row)))
    }

    fn finish(self: Box<Self>, _about: &[(String, String)]) -> io::Result<()> {
        CsvRows::finish(*self)?.flush()
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{Cell, Column, ColumnKind};

    use super::{CsvRows, Spelling};

    #[test]
    fn doubles_are_spelled_in_one_of_two_ways() {
        let columns = [
            Column::new("block", ColumnKind::Count, "The block."),
            Column::new("time_s", ColumnKind::Number, "When."),
            Column::new("end_s", ColumnKind::Number, "Until when."),
            Column::new("open", ColumnKind::Flag, "Whether it is over."),
        ];
        let written = |spelling| {
            let mut rows = CsvRows::new(Vec::new(), &columns, spelling).unwrap();
            rows.push([Cell::Count(3), Cell::Number(1e-7), Cell::Number(5.0), Cell::Flag(true)]).unwrap();
            rows.push([Cell::Count(4), Cell::Number(0.1 + 0.2), Cell::Empty, Cell::Flag(false)]).unwrap();
            String::from_utf8(rows.finish().unwrap()).unwrap()
        };
        let head = "block,time_s,end_s,open\n";
        let last = "4,0.30000000000000004,,false\n";
        assert_eq!(written(Spelling::Plain), format!("{head}3,0.0000001,5,true\n{last}"));
        assert_eq!(written(Spelling::Scientific), format!("{head}3,1e-7,5.0,true\n{last}"));
    }
    #[test]
    fn names_are_no_formulas_and_numbers_stay_numbers() {
        let mut rows = CsvRows::headed(Vec::new(), ["a", "b", "c"].into_iter(), Spelling::Plain).unwrap();
        for row in [["=1+1", "-0.5", "-1e-7"], ["@sum", "-a", "a=b"], ["+cmd", "\tx", ""]] {
            rows.push_texts(row).unwrap();
        }
        rows.push([Cell::Word("=1".into()), Cell::Number(-0.5), Cell::Empty]).unwrap();
        let written = String::from_utf8(rows.finish().unwrap()).unwrap();
        assert_eq!(written, "a,b,c\n'=1+1,-0.5,-1e-7\n'@sum,'-a,a=b\n'+cmd,'\tx,\n'=1,-0.5,\n");
    }
}
