//! Reads the rows of CSV files that users write, as spreadsheets and people do: with a byte order mark, with quoted
//! cells, with blanks around commas, with any ends of lines.

use std::fmt;

/// Most characters of a row that messages show.
const MOST_SHOWN: usize = 80;

/// The rows of a text from its heading on, without those that are blank.
pub struct Rows<'a> {
    text: &'a str,
    reader: csv::Reader<&'a [u8]>,
}

/// The cells of a row, without blanks and quotes around them. Displays as without these, in short.
#[derive(Debug, Default)]
pub struct Row {
    /// The line of the text in which it begins, from 1; 0 of the heading of an empty text.
    pub line: usize,
    /// Its cells; rows may have any number of them.
    pub cells: csv::StringRecord,
}

impl<'a> Rows<'a> {
    /// Reads a text.
    pub fn of(text: &'a str) -> Rows<'a> {
        // A program that marks what is marked leaves several.
        let text = text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new();
        let reader = reader.has_headers(false).flexible(true).trim(csv::Trim::All);
        Rows { text, reader: reader.from_reader(text.as_bytes()) }
    }
}

impl Iterator for Rows<'_> {
    type Item = Row;

    fn next(&mut self) -> Option<Row> {
        let mut cells = csv::StringRecord::new();
        while self.reader.read_record(&mut cells).expect("cells of a text in memory are text, in any number")
        {
            if cells.len() == 1 && cells[0].is_empty() {
                continue;
            }
            // Where it was read from may be a line break, or several, before it.
            let from = cells.position().expect("it has been read");
            let before =
                self.text.as_bytes()[from.byte() as usize..].iter().take_while(|b| b"\r\n".contains(b));
            let line = from.line() as usize + before.filter(|byte| **byte == b'\n').count();
            // Behind a blank, csv takes quotes for a part of the cell.
            let quoted = |cell: &str| Some(cell.strip_prefix('"')?.strip_suffix('"')?.trim().to_owned());
            if cells.iter().any(|cell| quoted(cell).is_some()) {
                cells = cells.iter().map(|cell| quoted(cell).unwrap_or_else(|| cell.to_owned())).collect();
            }
            return Some(Row { line, cells });
        }
        None
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = self.cells.iter().collect::<Vec<_>>().join(",");
        match shown.char_indices().nth(MOST_SHOWN) {
            None => f.write_str(&shown),
            Some((at, _)) => write!(f, "{}...", &shown[..at]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Rows;

    #[test]
    fn cells_are_those_that_spreadsheets_and_people_mean() {
        for text in [
            "a,b\n0,0.2\n\n1,0.1",
            "\u{feff}a,b\r\n0,0.2\r\n\r\n1,0.1\r\n",
            "\u{feff}\"a\",\"b\"\n\"0\",\"0.2\"\n  \n\"1\",\"0.1\"\n",
            "\u{feff}\u{feff} \"a\" , \"b\"\n 0 ,\t0.2\r\n\r\n\" 1\", \" 0.1 \"",
        ] {
            let rows = Rows::of(text).map(|row| (row.line, row.to_string()));
            let expected = [(1, "a,b"), (2, "0,0.2"), (4, "1,0.1")].map(|(n, cells)| (n, cells.to_owned()));
            assert!(rows.eq(expected), "{text:?}");
        }
        let endless = format!("\"{}", "\u{b5},".repeat(1000));
        assert_eq!(Rows::of(&endless).next().expect("it has one").to_string().chars().count(), 83);
    }
}
