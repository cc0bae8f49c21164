//! A batch of rows of a table, by columns: the part in memory at a time, which becomes a row group of a
//! Parquet file.

use std::borrow::Cow;

use asperity_record::{Cell, Column, ColumnKind};

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

    fn clear(&mut self) {
        match self {
            Values::Counts(values) => values.clear(),
            Values::Steps(values) => values.clear(),
            Values::Numbers(values) => values.clear(),
            Values::Flags(values) => values.clear(),
            Values::Words(values) => values.clear(),
        }
    }
}

/// Some rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    columns: Vec<Values>,
    rows: usize,
}

impl Batch {
    /// No rows of these columns.
    pub fn new(columns: &[Column]) -> Batch {
        Batch { columns: columns.iter().map(|column| Values::new(column.kind)).collect(), rows: 0 }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// If its cells are not those of the layout.
    pub fn push(&mut self, row: &[Cell]) {
        assert_eq!(row.len(), self.columns.len(), "cells of a row against columns of its table");
        self.columns.iter_mut().zip(row).for_each(|(values, cell)| values.push(cell.clone()));
        self.rows += 1;
    }

    /// The columns, each with as many cells as there are rows.
    pub fn columns(&self) -> &[Values] {
        &self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        self.columns.iter_mut().for_each(Values::clear);
        self.rows = 0;
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{EventPayload, GlobalSlip};

    use super::{Batch, Cell};

    #[test]
    fn rows_come_back_by_columns() {
        let mut batch = Batch::new(GlobalSlip::COLUMNS);
        let row = |global: u64, recurrence: Cell| {
            let number = || Cell::Number(0.1 + 0.2);
            [Cell::Step(global), Cell::Step(7), number(), number(), recurrence, number(), Cell::Empty]
        };
        batch.push(&row(0, Cell::Empty));
        batch.push(&row(1, Cell::Number(2.5)));
        assert_eq!(batch.rows(), 2);
        let read = |row: usize| batch.columns().iter().map(|values| values.cell(row)).collect::<Vec<_>>();
        assert_eq!(read(0), row(0, Cell::Empty));
        assert_eq!(read(1), row(1, Cell::Number(2.5)));
        batch.clear();
        assert_eq!(batch.rows(), 0);
        batch.push(&row(2, Cell::Empty));
        assert_eq!(batch.columns()[0].cell(0), Cell::Step(2));
    }

    #[test]
    #[should_panic(expected = "columns of its table")]
    fn rows_with_other_cells_than_columns_are_refused() {
        Batch::new(GlobalSlip::COLUMNS).push(&[Cell::Step(1)]);
    }
}
