//! The effect of changed events on the precursor table, `L_p / L` against `F_T / F_N`, by the default
//! rules: nothing merged or dropped.

use std::collections::{BTreeMap, BTreeSet};

use asperity_numbers::EventGrowth;

use crate::column::Column;
use crate::report::{PrecursorChange, PrecursorChanges};
use crate::sides::Run;
use crate::table::Row;

/// The precursors of a run, collected from its matches.
pub(crate) struct Precursors {
    /// Number of columns, the blocks of a single row.
    columns: u32,
    growth: EventGrowth,
    /// How many there are.
    count: u64,
    /// The `F_T / F_N` at the onset, and the number, of the last one to each block, or column.
    rows: BTreeMap<u32, (f64, u64)>,
}

impl Precursors {
    /// None if the number of blocks of a run is not known, and of a recording, whose sensors are no shares of the slider.
    pub(crate) fn of(run: &Run) -> Option<Precursors> {
        let header = run.header().filter(|header| header.sensors.is_none())?;
        let (columns, growth) = (header.contacts().columns(), EventGrowth::new(header.blocks));
        Some(Precursors { columns, growth, count: 0, rows: BTreeMap::new() })
    }

    pub(crate) fn watch(&mut self, events: &[Row<'_>]) {
        for event in events {
            if self.growth.extends(event.reach(), event.blocks_slipped()) {
                self.count += 1;
                self.rows.insert(event.reach().last, (event.value(Column::FT_FN_ONSET), event.number()));
            }
        }
    }

    /// Which rows changed.
    pub(crate) fn changes([old, new]: [Precursors; 2]) -> PrecursorChanges {
        let lengths: BTreeSet<u32> = old.rows.keys().chain(new.rows.keys()).copied().collect();
        let (old_rows, new_rows) = (old.count, new.count);
        let mut changes = PrecursorChanges { old_rows, new_rows, same_rows: 0, rows: Vec::new() };
        for length in lengths {
            let [old_row, new_row] = [&old, &new].map(|side| side.rows.get(&length).copied().unzip());
            if old_row.0 == new_row.0 {
                changes.same_rows += 1;
                continue;
            }
            changes.rows.push(PrecursorChange {
                lp_l: f64::from(length) / f64::from(old.columns),
                old_ft_fn: old_row.0,
                new_ft_fn: new_row.0,
                old_event: old_row.1,
                new_event: new_row.1,
            });
        }
        changes
    }
}
