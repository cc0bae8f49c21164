//! A table: columns with name, unit and meaning, and cells by columns. Of a table that is written while a log is
//! read it holds the rows that are in memory at a time, which become a row group of a Parquet file.

use std::borrow::Cow;

use asperity_record::{Cell, Column, ColumnKind};

use crate::layout::Cells;

/// The cells of one column; cells may be empty.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Of a [`ColumnKind::Count`].
    Counts(Vec<Option<u32>>),
    /// Of a [`ColumnKind::Step`].
    Steps(Vec<Option<u64>>),
    /// Of a [`ColumnKind::Number`].
    Numbers(Vec<Option<f64>>),
    /// Of a [`ColumnKind::Flag`].
    Flags(Vec<Option<bool>>),
    /// Of a [`ColumnKind::Word`].
    Words(Vec<Option<Cow<'static, str>>>),
}

impl Values {
    fn new(kind: ColumnKind) -> Values {
        match kind {
            ColumnKind::Count => Values::Counts(Vec::new()),
            ColumnKind::Step => Values::Steps(Vec::new()),
            ColumnKind::Number => Values::Numbers(Vec::new()),
            ColumnKind::Flag => Values::Flags(Vec::new()),
            ColumnKind::Word => Values::Words(Vec::new()),
        }
    }

    fn push(&mut self, cell: Cell) {
        match (self, cell) {
            (Values::Counts(values), Cell::Count(value)) => values.push(Some(value)),
            (Values::Steps(values), Cell::Step(value)) => values.push(Some(value)),
            (Values::Numbers(values), Cell::Number(value)) => values.push(Some(value)),
            (Values::Flags(values), Cell::Flag(value)) => values.push(Some(value)),
            (Values::Words(values), Cell::Word(value)) => values.push(Some(value)),
            (Values::Counts(values), Cell::Empty) => values.push(None),
            (Values::Steps(values), Cell::Empty) => values.push(None),
            (Values::Numbers(values), Cell::Empty) => values.push(None),
            (Values::Flags(values), Cell::Empty) => values.push(None),
            (Values::Words(values), Cell::Empty) => values.push(None),
            (values, cell) => panic!("the cell {cell:?} in a column of {values:?}"),
        }
    }

    /// The cell in a row.
    pub fn cell(&self, row: usize) -> Cell {
        match self {
            Values::Counts(values) => values[row].map_or(Cell::Empty, Cell::Count),
            Values::Steps(values) => values[row].map_or(Cell::Empty, Cell::Step),
            Values::Numbers(values) => values[row].map_or(Cell::Empty, Cell::Number),
            Values::Flags(values) => values[row].map_or(Cell::Empty, Cell::Flag),
            Values::Words(values) => values[row].clone().map_or(Cell::Empty, Cell::Word),
        }
    }
}

/// A column, and its cell of an item.
pub type ColumnOf<'a, T> = (Column, &'a dyn Fn(&T) -> Cell);

/// Columns and rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Its name: of a table of a log that of the topic.
    pub name: Cow<'static, str>,
    /// Its columns, in order.
    pub columns: Vec<Column>,
    values: Vec<Values>,
    rows: usize,
}

impl Table {
    /// No rows of these columns.
    pub fn new(name: impl Into<Cow<'static, str>>, columns: Vec<Column>) -> Table {
        let values = columns.iter().map(|column| Values::new(column.kind)).collect();
        Table { name: name.into(), columns, values, rows: 0 }
    }

    /// A row for each item: columns, each with the cell of an item.
    pub fn of<T>(name: impl Into<Cow<'static, str>>, items: &[T], columns: &[ColumnOf<'_, T>]) -> Table {
        let mut table = Table::new(name, columns.iter().map(|(column, _)| column.clone()).collect());
        items.iter().for_each(|item| table.push(columns.iter().map(|(_, cell)| cell(item))));
        table
    }

    /// The rows of tables with the same columns, one table after the other; None of no table.
    pub fn joined<'t>(tables: impl IntoIterator<Item = &'t Table>) -> Option<Table> {
        let mut tables = tables.into_iter();
        let mut joined = tables.next()?.clone();
        for table in tables {
            (0..table.rows).for_each(|row| joined.push(table.row(row)));
        }
        Some(joined)
    }

    /// Adds a row.
    ///
    /// # Panics
    /// If its cells are not those of the columns.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        let mut cells = row.into_iter();
        let pushed = self.values.iter_mut().zip(&mut cells).map(|(values, cell)| values.push(cell)).count();
        let all = pushed + cells.count();
        assert_eq!(all, self.columns.len(), "cells of a row against columns of its table");
        self.rows += 1;
    }

    /// Adds several rows, given by the cells of each column.
    ///
    /// # Panics
    /// If there are not as many columns as in the table.
    pub(crate) fn push_columns<'a>(&mut self, rows: usize, columns: impl Iterator<Item = Cells<'a>>) {
        let pushed =
            columns.zip(&mut self.values).map(|(cells, values)| cells.for_each(|cell| values.push(cell)));
        assert_eq!(pushed.count(), self.columns.len(), "columns of rows against those of their table");
        self.rows += rows;
    }

    /// The cells of the columns.
    pub fn values(&self) -> &[Values] {
        &self.values
    }

    /// The cells of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = Cell> {
        self.values.iter().map(move |values| values.cell(row))
    }

    /// The cells of a column, by its name.
    pub fn column(&self, name: &str) -> Option<&Values> {
        self.columns.iter().position(|column| column.name == name).map(|place| &self.values[place])
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        *self = Table::new(std::mem::take(&mut self.name), std::mem::take(&mut self.columns));
    }

    /// The topic of a log as part of a file name: `step`, `events.slip`.
    pub fn file_part(&self) -> String {
        self.name.trim_start_matches('/').replace('/', ".")
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{EventPayload, GlobalSlip};

    use super::{Cell, Table};

    #[test]
    fn rows_come_back() {
        let mut table = Table::new(GlobalSlip::TOPIC, GlobalSlip::COLUMNS.to_vec());
        assert_eq!(table.file_part(), "events.global");
        let row = |global: u64, recurrence: Cell| {
            let number = || Cell::Number(0.1 + 0.2);
            [Cell::Step(global), Cell::Step(7), number(), number(), recurrence, number(), Cell::Empty]
        };
        table.push(row(0, Cell::Empty));
        table.push(row(1, Cell::Number(2.5)));
        assert_eq!(table.rows(), 2);
        assert!(table.row(0).eq(row(0, Cell::Empty)));
        assert!(table.row(1).eq(row(1, Cell::Number(2.5))));
        table.clear();
        assert_eq!(table.rows(), 0);
        table.push(row(2, Cell::Empty));
        assert_eq!(table.values()[0].cell(0), Cell::Step(2));
    }

    #[test]
    #[should_panic(expected = "columns of its table")]
    fn rows_with_other_cells_than_columns_are_refused() {
        Table::new("global", GlobalSlip::COLUMNS.to_vec()).push([Cell::Step(1)]);
    }
}
