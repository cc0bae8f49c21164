//! The effect of changed events on the precursor table, `L_p / L` against `F_T / F_N`, by the default
//! rules: nothing merged or dropped.

use std::collections::{BTreeMap, BTreeSet};

use asperity_numbers::EventGrowth;

use crate::column::Column;
use crate::report::{PrecursorChange, PrecursorChanges};
use crate::sides::Run;
use crate::table;
use crate::tally::Matched;

/// The precursors of both runs, collected from the matches; `None` if a table lacks the number of blocks of
/// its run.
pub(crate) struct Precursors(Option<[Table; 2]>);

/// The precursor table of a run.
struct Table {
    /// Number of columns, the blocks of a single row.
    columns: u32,
    growth: EventGrowth,
    rows: Vec<Row>,
}

/// One precursor.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// Farthest block, or column, reached.
    last_block: u32,
    /// `F_T / F_N` at its onset.
    ft_fn: f64,
    /// Number of the event.
    event: u64,
}

impl Table {
    fn of(run: &Run) -> Option<Table> {
        let header = run.header()?;
        let columns = header.contacts().columns();
        Some(Table { columns, growth: EventGrowth::new(header.blocks), rows: Vec::new() })
    }

    fn watch(&mut self, events: &[table::Row<'_>]) {
        for event in events {
            if self.growth.extends(event.reach(), event.blocks_slipped()) {
                let (last_block, ft_fn) = (event.reach().last, event.value(Column::FT_FN_ONSET));
                self.rows.push(Row { last_block, ft_fn, event: event.number() });
            }
        }
    }

    fn by_length(&self) -> BTreeMap<u32, Row> {
        self.rows.iter().map(|row| (row.last_block, *row)).collect()
    }
}

impl Precursors {
    pub(crate) fn of(old: &Run, new: &Run) -> Precursors {
        Precursors(Table::of(old).zip(Table::of(new)).map(|(old, new)| [old, new]))
    }

    pub(crate) fn watch(&mut self, matched: &Matched<'_>) {
        if let Some([old, new]) = &mut self.0 {
            old.watch(&matched.group.old);
            new.watch(&matched.group.new);
        }
    }

    /// Which rows changed.
    pub(crate) fn changes(self) -> Option<PrecursorChanges> {
        let [old, new] = self.0?;
        let (old_by_length, new_by_length) = (old.by_length(), new.by_length());
        let lengths: BTreeSet<&u32> = old_by_length.keys().chain(new_by_length.keys()).collect();
        let mut changes = PrecursorChanges {
            old_rows: old.rows.len() as u64,
            new_rows: new.rows.len() as u64,
            same_rows: 0,
            rows: Vec::new(),
        };
        for length in lengths {
            let (old_row, new_row) = (old_by_length.get(length), new_by_length.get(length));
            if old_row.map(|row| row.ft_fn) == new_row.map(|row| row.ft_fn) {
                changes.same_rows += 1;
                continue;
            }
            changes.rows.push(PrecursorChange {
                lp_l: f64::from(*length) / f64::from(old.columns),
                old_ft_fn: old_row.map(|row| row.ft_fn),
                new_ft_fn: new_row.map(|row| row.ft_fn),
                old_event: old_row.map(|row| row.event),
                new_event: new_row.map(|row| row.event),
            });
        }
        Some(changes)
    }
}
