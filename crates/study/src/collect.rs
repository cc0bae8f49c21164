//! Makes the tables of a study: its runs, their slip events and their ruptures, each with a column
//! for every key that varies.
//!
//! Rows are in the order of the runs, and in files in groups of a fixed number, so the files do not depend on
//! the order in which results were computed. Memory is bounded by one run, and one group per table.

use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_model::scenario::keys;
use asperity_numbers::Summary;
use asperity_record::{Cell, Column, ColumnKind, EventKind, Rupture, SlipEvent};
use asperity_tables::table_files::TableFiles;
use asperity_tables::{Format, Table};

use crate::axis;
use crate::error::StudyError;
use crate::file::Keep;
use crate::plan::Plan;
use crate::results::Results;

/// Rows per group.
const GROUP_ROWS: usize = 20_000;

/// Receives the rows of tables as they are made: those of a run's events, then that of the run.
pub trait RowSink {
    /// The start of a table: `runs`, `events` or `ruptures`.
    ///
    /// # Errors
    /// If it cannot be written.
    fn begin(&mut self, table: &'static str, columns: &[Column]) -> Result<(), StudyError>;

    /// A row of it.
    ///
    /// # Errors
    /// Likewise.
    fn row(&mut self, table: &'static str, cells: &[Cell]) -> Result<(), StudyError>;
}

/// The name of the table of runs.
pub const RUNS: &str = "runs";

/// Makes the tables of the runs over axes.
///
/// # Errors
/// If results contradict the plan or each other, or one cannot be read, or the sink fails.
pub fn collect(plan: &Plan, results: &Results, sink: &mut dyn RowSink) -> Result<(), StudyError> {
    results.check()?;
    let is_key = |name: &str| plan.common.keys.iter().any(|key| key == name);
    let summary_columns: Vec<usize> = (0..Summary::KEYS.len())
        .filter(|n| {
            let name = Summary::KEYS[*n].column.name.as_ref();
            name != "run" && name != "status" && !is_key(name)
        })
        .collect();
    let run = Column::new("run", ColumnKind::Step, "The run's number in its plan, from 1.");
    let keys = plan.common.keys.iter();
    let keys = keys.filter_map(|path| keys::named(path.as_str()));
    let common_columns: Vec<Column> = std::iter::once(run).chain(keys.map(axis::column)).collect();
    let mut columns = common_columns.clone();
    columns.extend([
        Column::new("status", ColumnKind::Word, "`done`, `failed`, `refused` or `missing`."),
        Column::new("reason", ColumnKind::Word, "Why the run failed or was refused."),
        Column::new("run_id", ColumnKind::Word, "Id of the run, as in its log."),
        Column::new("ended", ColumnKind::Word, "How the run ended, see `status` of a summary."),
    ]);
    columns.extend(summary_columns.iter().map(|n| Summary::KEYS[*n].column.clone()));
    sink.begin(RUNS, &columns)?;
    let parts = plan.parts();
    let keeps = |keep: Keep| plan.common.keep.contains(&keep);
    let slips = keeps(Keep::Events).then(|| EventKind::of::<SlipEvent>().with(parts));
    let ruptures = keeps(Keep::Ruptures).then(|| EventKind::of::<Rupture>().with(parts));
    for kind in slips.iter().chain(&ruptures) {
        sink.begin(kind.table, &[&common_columns[..], &kind.columns()].concat())?;
    }
    for row in &plan.rows[..plan.numbered() as usize] {
        let mut cells = [&[Cell::Step(row.run)], &*row.values].concat();
        let (made, reason) = match results.outcome(plan, row.run)? {
            Some(Ok(made)) => (Some(made), String::new()),
            Some(Err(reason)) => (None, reason),
            None => (None, row.refused.clone().unwrap_or_default()),
        };
        let (mut ended, mut values) = (String::new(), Vec::new());
        if let Some(made) = made {
            if let Some(kind) = &slips {
                for slip in &made.slips {
                    sink.row(kind.table, &[&cells[..], &kind.cells_of(slip)].concat())?;
                }
            }
            if let Some(kind) = &ruptures {
                for rupture in &made.ruptures {
                    sink.row(kind.table, &[&cells[..], &kind.cells_of(rupture)].concat())?;
                }
            }
            values = made.summary.values();
            ended = made.summary.status;
        }
        let word = |text: &str| if text.is_empty() { Cell::Empty } else { Cell::word(text) };
        cells.push(Cell::Word(results.state(row.run).word().into()));
        cells.extend([&reason, row.id.as_deref().unwrap_or_default(), &ended].map(word));
        cells.extend(summary_columns.iter().map(|n| {
            let cell = values.get(*n).and_then(|value| Cell::of_json(Summary::KEYS[*n].column.kind, value));
            cell.unwrap_or(Cell::Empty)
        }));
        sink.row(RUNS, &cells)?;
    }
    Ok(())
}

/// Tables in progress, as files of a set in some formats.
pub(crate) struct TablesInProgress<'a> {
    pub(crate) files: &'a FileSet,
    pub(crate) folder: &'a Path,
    pub(crate) formats: &'a [Format],
    pub(crate) tables: Vec<(Table, TableFiles)>,
}

impl RowSink for TablesInProgress<'_> {
    fn begin(&mut self, name: &'static str, columns: &[Column]) -> Result<(), StudyError> {
        let table = Table::new(name, columns.to_vec());
        let files = TableFiles::begin(self.files, self.folder, name, self.formats, &table)?;
        self.tables.push((table, files));
        Ok(())
    }

    fn row(&mut self, name: &'static str, cells: &[Cell]) -> Result<(), StudyError> {
        let table = self.tables.iter_mut().find(|(table, _)| table.name == name);
        let (table, files) = table.expect("a table begins before its rows");
        table.push(cells.iter().cloned());
        if table.rows() == GROUP_ROWS { Ok(files.write(table)?) } else { Ok(()) }
    }
}

impl TablesInProgress<'_> {
    /// Completes the files, which say of which plan they are.
    pub(crate) fn finish(self, plan: &Plan) -> Result<Vec<PathBuf>, StudyError> {
        let about = [
            ("asperity:title".to_owned(), plan.common.title.clone()),
            ("asperity:plan".to_owned(), plan.hash.clone()),
            ("asperity:code_version".to_owned(), plan.common.code_version.clone()),
        ];
        let mut paths = Vec::new();
        for (mut table, files) in self.tables {
            paths.extend(files.finish(&mut table, &about)?);
        }
        Ok(paths)
    }
}
