//! Interface of the rows that a diff matches: slip events and ruptures. Both have times, blocks, and
//! columns of the event table.

use asperity_record::{BoundingBox, Reach, Rupture, SlipEvent};

use crate::column::{Column, Columns, Value, slip_event_cell};

/// A row of a table, matched by the times and blocks of slip.
pub trait Row: Clone {
    /// The columns that such rows have.
    const COLUMNS: Columns;

    /// Its number in its table.
    fn number(&self) -> u64;

    /// Its onset, s.
    fn onset_s(&self) -> f64;

    /// Its end, s; `None` if the run ended before.
    fn end_s(&self) -> Option<f64>;

    /// First and last block, and row.
    fn bounding_box(&self) -> BoundingBox;

    /// First and last block, or column.
    fn reach(&self) -> Reach {
        self.bounding_box().columns
    }

    /// How many blocks slid.
    fn blocks_slipped(&self) -> u32;

    /// Whether the run may have ended before the event.
    fn is_open(&self) -> bool;

    /// Its cell in a column; empty if such rows lack the column.
    fn cell(&self, column: Column) -> Value;

    /// Whether the end of the run truncated it, so that only columns known at its onset count.
    fn is_cut(&self) -> bool {
        self.is_open() || self.end_s().is_none()
    }
}

impl Row for SlipEvent {
    const COLUMNS: Columns = Columns::ALL;

    fn number(&self) -> u64 {
        self.event
    }

    fn onset_s(&self) -> f64 {
        self.onset_s
    }

    fn end_s(&self) -> Option<f64> {
        self.end_s
    }

    fn bounding_box(&self) -> BoundingBox {
        self.bounding_box()
    }

    fn blocks_slipped(&self) -> u32 {
        self.blocks_slipped
    }

    fn is_open(&self) -> bool {
        self.open
    }

    #[inline]
    fn cell(&self, column: Column) -> Value {
        slip_event_cell(self, column)
    }
}

impl Row for Rupture {
    const COLUMNS: Columns = Columns::ALL
        .without(Column::MaxSliding)
        .without(Column::FtFnMin)
        .without(Column::FtFnMax)
        .without(Column::BreaksOnset)
        .without(Column::BreaksEnd)
        .without(Column::RepinsOnset)
        .without(Column::RepinsEnd)
        .without(Column::PeakVelocity);

    fn number(&self) -> u64 {
        self.rupture
    }

    fn onset_s(&self) -> f64 {
        self.onset_s
    }

    fn end_s(&self) -> Option<f64> {
        self.end_s
    }

    fn bounding_box(&self) -> BoundingBox {
        self.bounding_box()
    }

    fn blocks_slipped(&self) -> u32 {
        self.slipped()
    }

    fn is_open(&self) -> bool {
        self.open
    }

    fn cell(&self, column: Column) -> Value {
        match column {
            Column::OnsetS => self.onset_s.into(),
            Column::EndS => self.end_s.into(),
            Column::FirstBlock => self.first_block.into(),
            Column::LastBlock => self.last_block.into(),
            Column::FtFnOnset => self.ft_fn_onset.into(),
            Column::FtFnEnd => self.ft_fn_end.into(),
            Column::Event => self.rupture.into(),
            Column::OnsetStep => self.onset_step.into(),
            Column::EndStep => self.end_step.into(),
            Column::BlocksSlipped => self.blocks_slipped().into(),
            Column::NucleationBlock => self.nucleation_block.into(),
            Column::Open => self.open.into(),
            Column::FirstAcross => self.first_across.into(),
            Column::LastAcross => self.last_across.into(),
            Column::MaxSliding
            | Column::FtFnMin
            | Column::FtFnMax
            | Column::BreaksOnset
            | Column::BreaksEnd
            | Column::RepinsOnset
            | Column::RepinsEnd
            | Column::PeakVelocity => Value::Empty,
        }
    }
}
