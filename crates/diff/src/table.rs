//! Slip events or ruptures of one side, column by column, from a run log or a CSV file.

use std::marker::PhantomData;
use std::path::Path;

use asperity_files::ShortLines;
use asperity_record::{BoundingBox, Cell, EventPayload, MOST_BLOCKS, Parts, Reach, Role};

use crate::column::{COUNT, Column, Columns};
use crate::error::CompareError;

/// The columns required for matching.
const NEEDED: [Column; 4] = [Column::ONSET_S, Column::END_S, Column::FIRST_BLOCK, Column::LAST_BLOCK];

/// The largest whole number up to which doubles, in which all cells are stored, are exact.
const MOST_WHOLE: u64 = 1 << 53;

/// A table of events. Cells are doubles, NaN where they are empty; columns that it lacks take no memory.
#[derive(Debug, Clone)]
pub struct Table {
    /// The columns that it has.
    pub columns: Columns,
    cells: [Vec<f64>; COUNT],
}

/// A row of a table.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    table: &'a Table,
    row: usize,
}

impl Table {
    fn new(columns: Columns) -> Table {
        Table { columns, cells: Default::default() }
    }

    /// The table of events of a run with these parts.
    pub fn of<'e, P: EventPayload>(parts: Parts, events: impl IntoIterator<Item = &'e P>) -> Table {
        let mut collected = Collected::new(parts);
        events.into_iter().for_each(|event| collected.push(event));
        collected.table
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.cells[Column::ONSET_S.place()].len()
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of its rows.
    pub fn row(&self, row: usize) -> Row<'_> {
        Row { table: self, row }
    }

    /// Its rows, in order.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = Row<'_>> {
        (0..self.len()).map(|row| self.row(row))
    }

    fn push(&mut self, column: Column, value: f64) {
        self.cells[column.place()].push(value);
    }

    /// Adds the number of a row. Rows that are numbered as they come take no memory for that.
    fn push_number(&mut self, row: usize, number: f64) {
        let numbers = &mut self.cells[Column::EVENT.place()];
        if !numbers.is_empty() || number != row as f64 {
            numbers.extend((numbers.len()..row).map(|row| row as f64));
            numbers.push(number);
        }
    }

    /// With its rows in the order of these columns.
    pub(crate) fn sort_by(&mut self, columns: &[Column]) {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| in_order(self.row(a), self.row(b), columns.iter().copied()));
        // Their numbers stay with them.
        let numbers: Vec<f64> = self.rows().map(|row| row.value(Column::EVENT)).collect();
        self.cells[Column::EVENT.place()] = numbers;
        for cells in self.cells.iter_mut().filter(|cells| !cells.is_empty()) {
            *cells = order.iter().map(|&row| cells[row]).collect();
        }
    }
}

/// The order of two rows by these columns; empty cells come last.
pub(crate) fn in_order(
    a: Row<'_>,
    b: Row<'_>,
    mut columns: impl Iterator<Item = Column>,
) -> std::cmp::Ordering {
    let order = columns
        .find_map(|column| Some(a.value(column).total_cmp(&b.value(column))).filter(|order| order.is_ne()));
    order.unwrap_or(std::cmp::Ordering::Equal)
}

impl<'a> Row<'a> {
    /// Its number in a column, NaN where the cell is empty.
    #[inline]
    pub(crate) fn value(self, column: Column) -> f64 {
        match self.table.cells[column.place()].get(self.row) {
            Some(value) => *value,
            None if column == Column::EVENT => self.row as f64,
            None => f64::NAN,
        }
    }

    fn optional(self, column: Column) -> Option<f64> {
        Some(self.value(column)).filter(|value| !value.is_nan())
    }

    /// Its cell in a column; empty if the table lacks it.
    pub fn cell(self, column: Column) -> Cell {
        column.cell(self.value(column))
    }

    /// Whether both rows have the same cell.
    #[inline]
    pub(crate) fn is_same(self, other: Row<'_>, column: Column) -> bool {
        let (a, b) = (self.value(column), other.value(column));
        a == b || a.is_nan() && b.is_nan()
    }

    /// Its number in its table.
    pub fn number(self) -> u64 {
        self.value(Column::EVENT) as u64
    }

    /// Its onset, s.
    pub fn onset_s(self) -> f64 {
        self.value(Column::ONSET_S)
    }

    /// Its end, s; `None` if the run ended before.
    pub fn end_s(self) -> Option<f64> {
        self.optional(Column::END_S)
    }

    /// First and last block, or column.
    pub fn reach(self) -> Reach {
        let [first, last] = [Column::FIRST_BLOCK, Column::LAST_BLOCK].map(|column| self.value(column) as u32);
        Reach { first, last }
    }

    /// Its first and last row, over an area.
    pub fn across(self) -> Option<Reach> {
        let [first, last] = [Column::FIRST_ACROSS, Column::LAST_ACROSS].map(|column| self.optional(column));
        first.zip(last).map(|(first, last)| Reach { first: first as u32, last: last as u32 })
    }

    /// First and last block, and row.
    pub fn bounding_box(self) -> BoundingBox {
        let across = self.across();
        BoundingBox::new(self.reach(), across.map(|rows| rows.first), across.map(|rows| rows.last))
    }

    /// How many blocks slid; as many as it reached, if the table does not say.
    pub fn blocks_slipped(self) -> u32 {
        self.optional(Column::BLOCKS_SLIPPED).map_or(self.reach().count(), |blocks| blocks as u32)
    }

    /// Whether the end of the run truncated it, so that only columns known at its onset count.
    pub fn is_cut(self) -> bool {
        self.end_s().is_none() || self.value(Column::OPEN) == 1.0
    }
}

/// Collects events of a type as a table: the columns that they share with the event table.
#[derive(Debug, Clone)]
pub struct Collected<P> {
    /// The rows so far.
    pub table: Table,
    /// Columns of the events, and of the table.
    places: Vec<(usize, Column)>,
    of: PhantomData<fn(P)>,
}

impl<P: EventPayload> Collected<P> {
    /// Begins with no events of a run with these parts. Ruptures have a number of their own, and slid in all
    /// blocks that they reached, or in so many `contacts`.
    pub fn new(parts: Parts) -> Collected<P> {
        let own = |column: &asperity_record::Column| match column.role {
            Some(Role::Number) => Some(Column::EVENT),
            _ if column.name == "contacts" => Some(Column::BLOCKS_SLIPPED),
            _ => Column::named(&column.name),
        };
        let there = P::COLUMNS.iter().enumerate();
        let there = there.filter(|(_, column)| column.only.is_none_or(|part| parts.has(part)));
        let places: Vec<(usize, Column)> =
            there.filter_map(|(place, column)| Some((place, own(column)?))).collect();
        let columns =
            places.iter().map(|(_, column)| *column).collect::<Columns>().with(Column::BLOCKS_SLIPPED);
        Collected { table: Table::new(columns), places, of: PhantomData }
    }

    /// Adds an event.
    pub fn push(&mut self, event: &P) {
        let (cells, row) = (event.cells(), self.table.len());
        for &(place, column) in &self.places {
            match cells.as_ref()[place].number().unwrap_or(f64::NAN) {
                number if column == Column::EVENT => self.table.push_number(row, number),
                value => self.table.push(column, value),
            }
        }
        if self.table.cells[Column::BLOCKS_SLIPPED.place()].len() == row {
            let blocks = self.table.row(row).reach().count();
            self.table.push(Column::BLOCKS_SLIPPED, blocks.into());
        }
    }
}

/// Reads a CSV file.
///
/// # Errors
/// If it cannot be read, its heading is no event table's, or a cell is not accepted.
pub(crate) fn read(path: &Path) -> Result<Table, CompareError> {
    let refused =
        |problem: &dyn std::fmt::Display| CompareError::Input(format!("{}: {problem}", path.display()));
    let file = asperity_files::open(path).map_err(|error| refused(&error))?;
    let mut rows = csv::Reader::from_reader(ShortLines::of(file));
    let mut reader = Reader::new(path, rows.headers().map_err(|error| refused(&error))?.iter())?;
    let mut record = csv::StringRecord::new();
    while rows.read_record(&mut record).map_err(|error| refused(&error))? {
        let line = record.position().map_or(0, csv::Position::line);
        reader.row(line, |place, column| {
            let text = record.get(place).unwrap_or_default().trim();
            let read = match column.role() {
                _ if text.is_empty() => Some(f64::NAN),
                role if role.is_measured() => text.parse().ok().filter(|value: &f64| !value.is_nan()),
                Role::Edge => text.parse().ok().map(|flag: bool| f64::from(u8::from(flag))),
                _ => text.parse().ok().and_then(exact),
            };
            read.ok_or_else(|| text.to_owned())
        })?;
    }
    Ok(reader.finish())
}

/// A whole number as a double, if that is exact.
fn exact(whole: u64) -> Option<f64> {
    (whole <= MOST_WHOLE).then_some(whole as f64)
}

/// A table that is being read.
struct Reader<'a> {
    path: &'a Path,
    /// Columns and their places in the rows of the file, in the order of the event table: an onset comes
    /// before the end that is compared with it.
    places: Vec<(Column, usize)>,
    table: Table,
}

impl<'a> Reader<'a> {
    fn new<'n>(path: &'a Path, names: impl Iterator<Item = &'n str>) -> Result<Reader<'a>, CompareError> {
        let problem = |problem: String| {
            let needed = NEEDED.map(Column::name).join(", ");
            let path = path.display();
            CompareError::Input(format!("{path}:1: {problem} (accepted: a table with at least {needed})"))
        };
        let mut places: Vec<(Column, usize)> = Vec::new();
        for (place, name) in names.enumerate() {
            // Columns that others added are theirs.
            let Some(column) = Column::named(name.trim()) else { continue };
            if places.iter().any(|(other, _)| *other == column) {
                return Err(problem(format!("there are two columns {column}")));
            }
            places.push((column, place));
        }
        let columns: Columns = places.iter().map(|(column, _)| *column).collect();
        if let Some(column) = NEEDED.into_iter().find(|column| !columns.has(*column)) {
            return Err(problem(format!("there is no column {column}")));
        }
        places.sort_unstable();
        Ok(Reader { path, places, table: Table::new(columns) })
    }

    /// Adds a row. `cell` returns the number in a place, or the text that is none.
    fn row(
        &mut self,
        line: u64,
        cell: impl Fn(usize, Column) -> Result<f64, String>,
    ) -> Result<(), CompareError> {
        let row = self.table.len();
        for n in 0..self.places.len() {
            let (column, place) = self.places[n];
            let value = cell(place, column);
            let accepted = match &value {
                Err(_) => accepted(column),
                Ok(value) => match self.refuses(row, column, *value) {
                    None if column == Column::EVENT => {
                        self.table.push_number(row, *value);
                        continue;
                    }
                    None => {
                        self.table.push(column, *value);
                        continue;
                    }
                    Some(accepted) => accepted,
                },
            };
            let text = value.map_or_else(|text| text, |value| column.cell(value).to_string());
            return Err(CompareError::Input(format!(
                "{}:{line}: {column}: {text:?} is not accepted (accepted: {accepted})",
                self.path.display()
            )));
        }
        Ok(())
    }

    /// What is accepted instead of this value, if it is not.
    fn refuses(&self, row: usize, column: Column, value: f64) -> Option<String> {
        let (name, role) = (column.name(), column.role());
        let is_there = |column: Column| self.table.row(row).optional(column);
        if value.is_nan() {
            // A box has two ends.
            let is_half = column == Column::LAST_ACROSS && is_there(Column::FIRST_ACROSS).is_some();
            return (!column.about().is_optional || is_half).then(|| accepted(column));
        }
        let is_accepted = match role {
            Role::Edge => value == 0.0 || value == 1.0,
            Role::Place => value.fract() == 0.0 && (1.0..=MOST_BLOCKS as f64).contains(&value),
            Role::Step | Role::Total | Role::Number => value.fract() == 0.0 && value >= 0.0,
            Role::Time | Role::Load | Role::Speed => value.is_finite(),
        };
        if !is_accepted {
            return Some(accepted(column));
        }
        let begin = match column {
            Column::END_S => Column::ONSET_S,
            Column::LAST_BLOCK => Column::FIRST_BLOCK,
            Column::LAST_ACROSS => Column::FIRST_ACROSS,
            _ => return None,
        };
        let from = is_there(begin);
        let is_after = from.is_some_and(|from| value >= from);
        let kind = if role == Role::Time { "number" } else { "whole number" };
        (!is_after).then(|| format!("a {kind} from {begin}{}", or_nothing(name, column)))
    }

    fn finish(self) -> Table {
        self.table
    }
}

/// Accepted values of a column, in words.
fn accepted(column: Column) -> String {
    let kind = match column.role() {
        Role::Edge => "true or false".to_owned(),
        Role::Place => format!("a whole number from 1 to {MOST_BLOCKS}"),
        role if role.is_measured() => "a number".to_owned(),
        _ => format!("a whole number up to {MOST_WHOLE}"),
    };
    format!("{kind}{}", or_nothing(column.name(), column))
}

/// Where a cell may be empty, that it may.
fn or_nothing(name: &str, column: Column) -> &'static str {
    match column.about().is_optional {
        false => "",
        true if name.contains("end") => ", or nothing where the run ended before",
        true => ", or nothing",
    }
}
