//! Writes the tables of a study: its runs, their slip events and their ruptures, each with a column
//! for every key that varies.
//!
//! Rows are in the order of the runs, in groups of a fixed number, so the files do not depend on the order
//! in which results were computed. Memory is bounded by one group per table.

use std::collections::BTreeSet;
use std::fmt;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use asperity_files::{FileError, FileSet};
use asperity_model::keys::{KEYS, Key};
use asperity_numbers::Summary;
use asperity_record::{Cell, Column, ColumnKind};
use asperity_tables::batch::Batch;
use asperity_tables::format::{Format, FormatError, TableWriter};
use asperity_tables::layout::Layout;

use crate::axis::{self, Value};
use crate::plan::{Plan, Row};
use crate::results::{Counts, Fault, Results, Spot, State, WHAT_TO_DO};
use crate::stored::{Stored, kept_events, reason};

/// Rows per group.
const GROUP_ROWS: usize = 20_000;

/// Why tables cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// Results contradict the plan or each other.
    #[error("{}", Faults(.0))]
    Faults(Vec<Fault>),
    /// A segment cannot be read.
    #[error("{spot}: run {run}: {error}")]
    Io {
        /// Its position.
        spot: Spot,
        /// The run of the result.
        run: u64,
        /// The error.
        error: io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The format cannot represent it.
    #[error("{}: {error}", path.display())]
    Format {
        /// The table.
        path: PathBuf,
        /// The reason.
        error: FormatError,
    },
}

/// Formats one line per fault, and the remedy.
struct Faults<'a>(&'a [Fault]);

impl fmt::Display for Faults<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|fault| writeln!(f, "{fault}"))?;
        f.write_str(WHAT_TO_DO)
    }
}

/// Observes the rows of the tables as they are made: those of a run's events, then that of the run.
pub trait Observer {
    /// The start of a table: `runs`, `events` or `ruptures`.
    fn begin(&mut self, table: &'static str, columns: &[Column]);

    /// A row of it.
    fn row(&mut self, table: &'static str, cells: &[Cell]);
}

/// The name of the table of runs.
pub const RUNS: &str = "runs";

/// Writes the tables into a folder, as files of a set, in these formats; without formats only
/// `observer` receives the rows.
///
/// # Errors
/// If results contradict the plan or each other, a result cannot be read, or a table cannot be
/// written.
pub fn collect(
    plan: &Plan,
    results: &Results,
    files: &FileSet,
    folder: &Path,
    formats: &[&dyn Format],
    observer: &mut dyn Observer,
) -> Result<(Counts, Vec<PathBuf>), CollectError> {
    if !results.faults.is_empty() {
        return Err(CollectError::Faults(results.faults.clone()));
    }
    let keys: Vec<&Key> = plan
        .common
        .keys
        .iter()
        .filter_map(|path| KEYS.iter().find(|key| key.path == path.as_str()))
        .collect();
    let kept = kept_events(plan);
    let summary_columns: Vec<usize> = (0..Summary::KEYS.len())
        .filter(|n| {
            let name = Summary::KEYS[*n].column.name.as_ref();
            name != "run" && name != "status" && !plan.common.keys.iter().any(|key| key == name)
        })
        .collect();
    let common_columns = common_columns(&keys);
    let mut columns = common_columns.clone();
    columns.extend([
        Column::new("status", ColumnKind::Word, "`done`, `failed`, `refused` or `missing`."),
        Column::new("reason", ColumnKind::Word, "Why the run failed or was refused."),
        Column::new("run_id", ColumnKind::Word, "Id of the run, as in its log."),
        Column::new("ended", ColumnKind::Word, "How the run ended, see `status` of a summary."),
    ]);
    columns.extend(summary_columns.iter().map(|n| Summary::KEYS[*n].column.clone()));
    observer.begin(RUNS, &columns);
    let mut runs = Tables::begin(files, folder, RUNS, columns, formats)?;
    let mut of_events = Vec::new();
    for kind in kept.iter().map(|events| &events.kind) {
        let mut columns = common_columns.clone();
        columns.extend(kind.columns.iter().cloned());
        observer.begin(kind.table, &columns);
        of_events.push((kind, Tables::begin(files, folder, kind.table, columns, formats)?));
    }
    for row in &plan.rows[..plan.numbered() as usize] {
        let state = results.state(row.run);
        let common = common_cells(row, &common_columns);
        let opened = |place| {
            let (spot, run) = (results.spot(place), row.run);
            results.content(place).map_err(|error| CollectError::Io { spot, run, error })
        };
        let stray = |place, problem| {
            let (spot, run) = (results.spot(place), row.run);
            CollectError::Faults(vec![Fault::Stray { spot, run, problem }])
        };
        let mut cells = common.clone();
        let word = |text: &str| if text.is_empty() { Cell::Empty } else { interned(text) };
        let mut reason_of = row.refused.clone().unwrap_or_default();
        let mut summary = None;
        match state {
            State::Done(place) => {
                let stray = |problem| stray(place, problem);
                let stored = Stored::open(opened(place)?, &plan.common, row, &kept);
                let mut stored = stored.map_err(stray)?;
                while let Some((index, of_event)) = stored.next_event().map_err(stray)? {
                    let (kind, tables) = &mut of_events[index];
                    let mut cells = common.clone();
                    cells.extend(of_event);
                    observer.row(kind.table, &cells);
                    tables.push(&cells)?;
                }
                summary = Some(stored.summary);
            }
            State::Failed(place) => {
                reason_of = reason(opened(place)?).map_err(|problem| stray(place, problem))?;
            }
            State::Missing | State::Refused | State::Contradicted | State::Logged => {}
        }
        cells.extend([
            Cell::Word(state.word()),
            word(&reason_of),
            word(row.id.as_deref().unwrap_or_default()),
            word(summary.as_ref().map_or("", |summary| &summary.status)),
        ]);
        let values = summary.map_or_else(Vec::new, |summary| summary.values());
        cells.extend(summary_columns.iter().map(|n| {
            let value = values.get(*n).unwrap_or(&serde_json::Value::Null);
            cell(value, Summary::KEYS[*n].column.kind)
        }));
        observer.row(RUNS, &cells);
        runs.push(&cells)?;
    }
    let about = [
        ("asperity:title".to_owned(), plan.common.title.clone()),
        ("asperity:plan".to_owned(), plan.hash.clone()),
        ("asperity:code_version".to_owned(), plan.common.code_version.clone()),
    ];
    let mut paths = runs.finish(&about)?;
    for (_, tables) in of_events {
        paths.extend(tables.finish(&about)?);
    }
    Ok((results.counts(), paths))
}

fn common_columns(keys: &[&Key]) -> Vec<Column> {
    let run = Column::new("run", ColumnKind::Step, "The run's number in its plan, from 1.");
    std::iter::once(run).chain(keys.iter().map(|key| axis::column(key))).collect()
}

fn common_cells(row: &Row, columns: &[Column]) -> Vec<Cell> {
    let value = |(column, value): (&Column, &Value)| match (column.kind, value) {
        (ColumnKind::Number, Value::Whole(number)) => Cell::Number(*number as f64),
        (_, Value::Whole(number)) => Cell::Step(number.unsigned_abs()),
        (_, Value::Number(number)) => Cell::Number(*number),
        (_, Value::Flag(flag)) => Cell::Flag(*flag),
        (_, Value::Text(text)) => interned(text),
    };
    std::iter::once(Cell::Step(row.run)).chain(columns[1..].iter().zip(&row.values).map(value)).collect()
}

fn cell(value: &serde_json::Value, kind: ColumnKind) -> Cell {
    match kind {
        ColumnKind::Count => {
            value.as_u64().and_then(|count| u32::try_from(count).ok()).map_or(Cell::Empty, Cell::Count)
        }
        ColumnKind::Step => value.as_u64().map_or(Cell::Empty, Cell::Step),
        ColumnKind::Number => value.as_f64().map_or(Cell::Empty, Cell::Number),
        ColumnKind::Flag => value.as_bool().map_or(Cell::Empty, Cell::Flag),
        ColumnKind::Word => value.as_str().map_or(Cell::Empty, interned),
    }
}

/// A word as a cell, kept as long as the program lives, but once, however often tables are made.
fn interned(text: &str) -> Cell {
    static WORDS: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut words = WORDS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = words.get(text) {
        return Cell::Word(known);
    }
    let word: &'static str = Box::leak(text.to_owned().into_boxed_str());
    words.insert(word);
    Cell::Word(word)
}

/// A table in progress, in every format.
struct Tables {
    batch: Batch,
    writers: Vec<(PathBuf, Box<dyn TableWriter>)>,
}

impl Tables {
    fn begin(
        files: &FileSet,
        folder: &Path,
        name: &str,
        columns: Vec<Column>,
        formats: &[&dyn Format],
    ) -> Result<Tables, CollectError> {
        let batch = Batch::new(&columns);
        let layout = Layout { topic: name.to_owned().into(), columns };
        let writers = formats
            .iter()
            .map(|format| {
                let path = folder.join(format!("{name}.{}", format.extension()));
                let file: File = files.create(&path)?;
                match format.start(&layout, file) {
                    Ok(writer) => Ok((path, writer)),
                    Err(error) => Err(CollectError::Format { path, error }),
                }
            })
            .collect::<Result<_, _>>()?;
        Ok(Tables { batch, writers })
    }

    fn push(&mut self, cells: &[Cell]) -> Result<(), CollectError> {
        self.batch.push(cells);
        if self.batch.rows() == GROUP_ROWS { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), CollectError> {
        for (path, writer) in &mut self.writers {
            let written = writer.write(&self.batch);
            written.map_err(|error| CollectError::Format { path: path.clone(), error })?;
        }
        self.batch.clear();
        Ok(())
    }

    fn finish(mut self, about: &[(String, String)]) -> Result<Vec<PathBuf>, CollectError> {
        if self.batch.rows() > 0 {
            self.flush()?;
        }
        let mut paths = Vec::new();
        for (path, writer) in self.writers {
            writer.finish(about).map_err(|error| CollectError::Format { path: path.clone(), error })?;
            paths.push(path);
        }
        Ok(paths)
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::Cell;

    use super::interned;

    /// Fuzzing found that every table of a study left its words behind.
    #[test]
    fn a_word_is_kept_once() {
        let [Cell::Word(one), Cell::Word(other)] = [interned("own"), interned("own")] else {
            panic!("no words")
        };
        assert!(std::ptr::eq(one, other));
    }
}
