//! Events as tables: CSV with one header line, numbers in full precision, or a JSON array.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_record::{Event, EventKind, EventPayload, Parts, SlipEvent};
use asperity_tables::{CsvRows, Spelling};
use clap::ValueEnum;

use crate::exit::Failure;
use crate::outputs::refused;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableFormat {
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
    /// One array of objects.
    Json,
}

/// Adds the row of an event.
fn add(rows: &mut CsvRows<impl Write>, kind: &EventKind, event: &Event) -> Result<(), Failure> {
    let unreadable =
        |error| Failure::Failed(format!("an event of {} cannot be read: {error}", event.topic()));
    let row = kind.cells(event).map_err(unreadable)?;
    rows.push(row).map_err(Failure::Output)
}

/// The event tables of one run, files of a set. They are discarded unless finished.
pub(crate) struct EventTables<'a> {
    files: &'a FileSet,
    tables: Vec<Table>,
}

struct Table {
    kind: EventKind,
    path: PathBuf,
    /// None once it is finished.
    rows: Option<CsvRows<BufWriter<File>>>,
}

impl<'a> EventTables<'a> {
    /// Begins the tables.
    pub(crate) fn create(
        files: &'a FileSet,
        out: &Path,
        name: &str,
        kinds: Vec<EventKind>,
    ) -> Result<EventTables<'a>, Failure> {
        let mut begun = EventTables { files, tables: Vec::new() };
        for kind in kinds {
            let path = out.join(format!("{name}.{}.csv", kind.table));
            let file = files.create(&path).map_err(|error| refused("--out", &error, false))?;
            let rows = CsvRows::new(BufWriter::new(file), &kind.columns(), Spelling::Scientific)
                .map_err(|error| not_written(&path, error))?;
            begun.tables.push(Table { kind, path, rows: Some(rows) });
        }
        Ok(begun)
    }

    /// Adds an event to its table.
    pub(crate) fn write(&mut self, event: &Event) -> Result<(), Failure> {
        match self.tables.iter_mut().find(|table| table.kind.topic == event.topic()) {
            Some(Table { kind, path, rows: Some(rows) }) => {
                add(rows, kind, event).map_err(|failure| match failure {
                    Failure::Output(error) => not_written(path, error),
                    other => not_written(path, other),
                })
            }
            _ => Ok(()),
        }
    }

    /// Finishes the tables.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        for Table { path, rows, .. } in &mut self.tables {
            rows.take()
                .map_or(Ok(()), |rows| rows.finish().map(drop))
                .map_err(|error| not_written(path, error))?;
        }
        self.tables.clear();
        Ok(())
    }
}

impl Drop for EventTables<'_> {
    fn drop(&mut self) {
        self.tables.iter().for_each(|table| self.files.discard(&table.path));
    }
}

fn not_written(path: &Path, problem: impl Display) -> Failure {
    Failure::Failed(format!("failed to write {}: {problem}", path.display()))
}

/// Prints the slip events among events, one by one.
pub(crate) enum Printed<W: Write> {
    Csv(EventKind, Box<CsvRows<W>>),
    /// With whether any has been printed.
    Json(BufWriter<W>, bool),
}

impl<W: Write> Printed<W> {
    /// Begins to print those of a run with these parts.
    pub(crate) fn begin(format: TableFormat, parts: Parts, out: W) -> Result<Printed<W>, Failure> {
        Ok(match format {
            TableFormat::Csv => {
                let kind = EventKind::of::<SlipEvent>().with(parts);
                let rows = CsvRows::new(out, &kind.columns(), Spelling::Scientific)?;
                Printed::Csv(kind, Box::new(rows))
            }
            TableFormat::Json => Printed::Json(BufWriter::new(out), false),
        })
    }

    /// Prints an event, if it is a slip event.
    pub(crate) fn event(&mut self, event: &Event) -> Result<(), Failure> {
        if event.topic() != SlipEvent::TOPIC {
            return Ok(());
        }
        match self {
            Printed::Csv(kind, rows) => add(rows, kind, event),
            Printed::Json(out, any) => {
                let before = if *any { ",\n" } else { "[\n" };
                *any = true;
                Ok(write!(out, "{before}{}", event.json())?)
            }
        }
    }

    /// Ends the table.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        match self {
            Printed::Csv(_, rows) => rows.finish()?.flush()?,
            Printed::Json(mut out, any) => {
                out.write_all(if any { b"\n]\n" } else { b"[]\n" })?;
                out.flush()?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use asperity_record::Parts;
    use asperity_run::detectors::event_kinds;

    /// Two tables of one name would overwrite each other.
    #[test]
    fn every_detector_has_a_table_of_its_own() {
        let kinds = event_kinds(Parts::ALL);
        let tables: Vec<&str> = kinds.iter().map(|kind| kind.table).collect();
        let different: BTreeSet<&str> = tables.iter().copied().collect();
        assert_eq!(different.len(), tables.len(), "{tables:?}");
    }
}
