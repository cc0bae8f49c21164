//! Slip events or ruptures of one side, column by column, from a run log or a CSV file.

use std::borrow::Cow;
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
    cells: [Cells; COUNT],
}

/// The cells of a column: whole numbers in half the memory, and doubles from the first number on that is none.
#[derive(Debug, Clone, Default)]
struct Cells {
    /// [`NO_WHOLE`] where they are empty.
    whole: Vec<u32>,
    double: Vec<f64>,
}

const NO_WHOLE: u32 = u32::MAX;

fn double(whole: u32) -> f64 {
    if whole == NO_WHOLE { f64::NAN } else { whole.into() }
}

impl Cells {
    fn push(&mut self, value: f64) {
        let whole = if value.is_nan() { NO_WHOLE } else { value as u32 };
        if self.double.is_empty() && (value.is_nan() || double(whole).to_bits() == value.to_bits()) {
            self.whole.push(whole);
        } else {
            self.double.extend(std::mem::take(&mut self.whole).into_iter().map(double));
            self.double.push(value);
        }
    }

    fn get(&self, row: usize) -> Option<f64> {
        self.double.get(row).copied().or_else(|| self.whole.get(row).copied().map(double))
    }
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
        let Cells { whole, double } = &self.cells[Column::ONSET_S.place()];
        whole.len().max(double.len())
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

    /// Where its rows start, s.
    pub(crate) fn onsets_s(&self) -> Cow<'_, [f64]> {
        match &self.cells[Column::ONSET_S.place()].double[..] {
            [] => self.rows().map(Row::onset_s).collect(),
            onsets_s => onsets_s.into(),
        }
    }

    /// With its rows in the order of these columns.
    pub(crate) fn sort_by(&mut self, columns: &[Column]) {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| in_order(self.row(a), self.row(b), columns.iter().copied()));
        for Cells { whole, double } in &mut self.cells {
            *whole = order.iter().filter_map(|&row| whole.get(row).copied()).collect();
            *double = order.iter().filter_map(|&row| double.get(row).copied()).collect();
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
            Some(value) => value,
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
            self.table.push(column, cells.as_ref()[place].number().unwrap_or(f64::NAN));
        }
        if self.table.cells[Column::BLOCKS_SLIPPED.place()].get(row).is_none() {
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
        reader.row(line, &record)?;
    }
    Ok(reader.table)
}

/// A cell as a double, if it is a number, or a flag, that one is exactly.
fn number(text: &str, role: Role) -> Option<f64> {
    match role {
        _ if text.is_empty() => Some(f64::NAN),
        role if role.is_measured() => text.parse().ok().filter(|value: &f64| !value.is_nan()),
        Role::Edge => text.parse().ok().map(|flag: bool| f64::from(u8::from(flag))),
        _ => text.parse().ok().filter(|whole: &u64| *whole <= MOST_WHOLE).map(|whole| whole as f64),
    }
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

    /// Adds the row of a line.
    fn row(&mut self, line: u64, record: &csv::StringRecord) -> Result<(), CompareError> {
        let row = self.table.len();
        for n in 0..self.places.len() {
            let (column, place) = self.places[n];
            let text = record.get(place).unwrap_or_default().trim();
            let (text, accepted) = match number(text, column.role()) {
                None => (text.to_owned(), accepted(column)),
                Some(value) => match self.refuses(row, column, value) {
                    Some(accepted) => (column.cell(value).to_string(), accepted),
                    None => {
                        self.table.push(column, value);
                        continue;
                    }
                },
            };
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

#[cfg(test)]
mod tests {
    use super::Cells;

    #[test]
    fn numbers_come_back_to_the_bit_from_half_the_memory_while_they_are_whole() {
        let whole = [3.0, f64::NAN, 0.0, f64::from(u32::MAX - 1)];
        for other in [0.5, -0.0, -1.0, f64::from(u32::MAX), 1e300, f64::INFINITY] {
            let mut cells = Cells::default();
            whole.iter().for_each(|value| cells.push(*value));
            assert!(cells.double.is_empty() && cells.whole.len() == whole.len());
            cells.push(other);
            assert!(cells.whole.is_empty());
            let back = (0..6).map(|row| cells.get(row).map(f64::to_bits));
            let pushed = whole.into_iter().chain([other]).map(|value| Some(value.to_bits())).chain([None]);
            assert!(back.eq(pushed), "{other}");
        }
    }
}
