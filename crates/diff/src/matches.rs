//! Every match of a comparison, identical ones too, as a row of a Parquet file.

use std::path::Path;

use asperity_files::FileSet;
use asperity_record::{BoundingBox, Cell, CellValue, Column as Described, ColumnKind};
use asperity_tables::table_files::TableFiles;
use asperity_tables::{Format, Table};

use crate::column::Column;
use crate::error::CompareError;
use crate::table::Row;
use crate::tally::Matched;

/// Rows that are in memory at a time.
const GROUP_ROWS: usize = 1 << 16;

/// The file of matches, if one was asked for.
pub(crate) struct Matches {
    file: Option<(Table, TableFiles)>,
    is_over_area: bool,
}

impl Matches {
    /// Creates the file, with columns of rows if some events are over an area.
    pub(crate) fn create(
        files: &FileSet,
        path: Option<&Path>,
        is_over_area: bool,
    ) -> Result<Matches, CompareError> {
        let begin = |path: &Path| {
            let table = Table::new("matches", columns(is_over_area));
            let files = TableFiles::at(files, vec![(path.to_owned(), Format::Parquet)], &table)?;
            Ok((table, files))
        };
        let file = path.map(begin).transpose().map_err(CompareError::NoMatchesFile)?;
        Ok(Matches { file, is_over_area })
    }

    pub(crate) fn push(&mut self, run: &str, matched: &Matched<'_>) -> Result<(), CompareError> {
        let Some((table, file)) = &mut self.file else { return Ok(()) };
        let own = [
            Cell::word(run),
            Cell::Word(matched.class.name().into()),
            matched.allowed.cell(),
            matched.shift_s.cell(),
        ];
        let sides = [&matched.group.old, &matched.group.new];
        table.push(own.into_iter().chain(sides.into_iter().flat_map(|of| side(of, self.is_over_area))));
        if table.rows() == GROUP_ROWS { file.write(table).map_err(CompareError::Matches) } else { Ok(()) }
    }

    pub(crate) fn finish(self) -> Result<(), CompareError> {
        let Some((mut table, file)) = self.file else { return Ok(()) };
        file.finish(&mut table, &[]).map(drop).map_err(CompareError::Matches)
    }
}

fn columns(is_over_area: bool) -> Vec<Described> {
    let mut columns = vec![
        Described::new("run", ColumnKind::Word, "The run."),
        Described::new("class", ColumnKind::Word, "The class of the events."),
        Described::new("allowed", ColumnKind::Flag, "Whether the policy allows it."),
        Described::new("shift_s", ColumnKind::Number, "The farther of the shifts of onset and end."),
    ];
    let of_side = [
        Described::new("events", ColumnKind::Count, "Number of events of this side."),
        Described::new("event", ColumnKind::Step, "Number of the first of them."),
        Described::new("last_event", ColumnKind::Step, "Number of the last."),
        Described::new("onset_s", ColumnKind::Number, "The earliest onset."),
        Described::new("end_s", ColumnKind::Number, "The latest end."),
        Described::new("first_block", ColumnKind::Count, "The lowest block."),
        Described::new("last_block", ColumnKind::Count, "The highest block."),
        Described::new("ft_fn_onset", ColumnKind::Number, "F_T/F_N at the earliest onset."),
        Described::new("first_across", ColumnKind::Count, "The lowest row."),
        Described::new("last_across", ColumnKind::Count, "The highest row."),
    ];
    for side in ["old", "new"] {
        let there = of_side.iter().take(if is_over_area { 10 } else { 8 });
        let named = |column: &Described| Described {
            name: format!("{side}_{}", column.name).into(),
            ..column.clone()
        };
        columns.extend(there.map(named));
    }
    columns
}

/// The cells of the events of one side.
fn side(events: &[Row<'_>], is_over_area: bool) -> impl Iterator<Item = Cell> {
    let [first, last] = [events.first(), events.last()].map(|event| event.copied());
    let reach = BoundingBox::over(events.iter().map(|event| event.bounding_box()));
    let across = first.and_then(Row::across).and(reach).map(|reach| reach.rows);
    let columns = reach.map(|reach| reach.columns);
    let load = |event: Row<'_>| Some(event.value(Column::FT_FN_ONSET)).filter(|load| !load.is_nan());
    let cells = [
        (events.len() as u32).cell(),
        first.map(Row::number).cell(),
        last.map(Row::number).cell(),
        first.map(Row::onset_s).cell(),
        last.and_then(Row::end_s).cell(),
        columns.map(|columns| columns.first).cell(),
        columns.map(|columns| columns.last).cell(),
        first.map(|event| load(event).unwrap_or(0.0)).cell(),
        across.map(|rows| rows.first).cell(),
        across.map(|rows| rows.last).cell(),
    ];
    cells.into_iter().take(if is_over_area { 10 } else { 8 })
}
