//! Events as tables: CSV with one header line, numbers in full precision, or a JSON array.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use asperity_export::{CsvRows, Spelling};
use asperity_record::{Event, EventKind, EventPayload, SlipEvent};
use asperity_runlog::WholeFile;

use crate::args::TableFormat;
use crate::exit::Failure;

/// The row of an event, as its kind reads it.
fn add(rows: &mut CsvRows<impl Write>, kind: &EventKind, event: &Event) -> Result<(), Failure> {
    let unreadable = |error| Failure::Failed(format!("an event of {} cannot be read: {error}", event.topic));
    let row = kind.cells(&event.payload).map_err(unreadable)?;
    rows.push(&row).map_err(Failure::Output)
}

/// The tables of one run, each in a file that bears its name only once it is whole.
pub(crate) struct EventTables {
    tables: Vec<(EventKind, WholeFile, CsvRows<BufWriter<File>>)>,
}

impl EventTables {
    /// Where the table of a run of that name goes, for events of a kind.
    fn path(out: &Path, name: &str, kind: &EventKind) -> PathBuf {
        out.join(format!("{name}.{}.csv", kind.table))
    }

    /// Begins them.
    pub(crate) fn create(out: &Path, name: &str, kinds: Vec<EventKind>) -> Result<EventTables, Failure> {
        let tables = kinds.into_iter().map(|kind| {
            let path = EventTables::path(out, name, &kind);
            let at = |error: io::Error| not_written(&path, &Failure::Output(error));
            let (whole, file) = WholeFile::create(&path).map_err(at)?;
            let rows = CsvRows::new(BufWriter::new(file), kind.columns, Spelling::Scientific).map_err(at)?;
            Ok((kind, whole, rows))
        });
        Ok(EventTables { tables: tables.collect::<Result<_, Failure>>()? })
    }

    /// Adds an event to its table.
    pub(crate) fn write(&mut self, event: &Event) -> Result<(), Failure> {
        let table = self.tables.iter_mut().find(|(kind, ..)| kind.topic == event.topic);
        match table {
            Some((kind, whole, rows)) => {
                add(rows, kind, event).map_err(|failure| not_written(whole.path(), &failure))
            }
            None => Ok(()),
        }
    }

    /// Gives the tables their names.
    pub(crate) fn publish(self) -> Result<(), Failure> {
        for (_, whole, rows) in self.tables {
            let path = whole.path().to_owned();
            let written = rows.finish().and_then(|_file| whole.publish());
            written.map_err(|error| not_written(&path, &Failure::Output(error)))?;
        }
        Ok(())
    }
}

fn not_written(path: &Path, failure: &Failure) -> Failure {
    let problem = match failure {
        Failure::Output(error) => error.to_string(),
        other => other.to_string(),
    };
    Failure::Failed(format!("failed to write {}: {problem}", path.display()))
}

/// The slip events among events, printed one by one.
pub(crate) enum Printed<W: Write> {
    Csv(EventKind, Box<CsvRows<W>>),
    /// With whether any has been printed.
    Json(BufWriter<W>, bool),
}

impl<W: Write> Printed<W> {
    /// Begins to print.
    pub(crate) fn begin(format: TableFormat, out: W) -> Result<Printed<W>, Failure> {
        Ok(match format {
            TableFormat::Csv => {
                let rows = CsvRows::new(out, SlipEvent::COLUMNS, Spelling::Scientific)?;
                Printed::Csv(EventKind::of::<SlipEvent>(), Box::new(rows))
            }
            TableFormat::Json => Printed::Json(BufWriter::new(out), false),
        })
    }

    /// Prints an event, if it is a slip event.
    pub(crate) fn event(&mut self, event: &Event) -> Result<(), Failure> {
        if event.topic != SlipEvent::TOPIC {
            return Ok(());
        }
        match self {
            Printed::Csv(kind, rows) => add(rows, kind, event),
            Printed::Json(out, any) => {
                let before = if *any { ",\n" } else { "[\n" };
                *any = true;
                Ok(write!(out, "{before}{}", event.payload)?)
            }
        }
    }

    /// Ends the table.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        match self {
            Printed::Csv(_, rows) => drop(rows.finish()?),
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

    use asperity_run::detectors::event_kinds;

    /// Two tables of one name would be written over each other.
    #[test]
    fn every_detector_has_a_table_of_its_own() {
        let kinds = event_kinds();
        let tables: Vec<&str> = kinds.iter().map(|kind| kind.table).collect();
        let different: BTreeSet<&str> = tables.iter().copied().collect();
        assert_eq!(different.len(), tables.len(), "{tables:?}");
    }
}
