//! Events as tables: CSV with one header line, numbers in full precision, or a JSON array.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use asperity_export::whole::WholeFile;
use asperity_record::{Event, EventPayload, GlobalSlip, Onset, SlipEvent};

use crate::args::TableFormat;
use crate::exit::Failure;

/// A kind of events that makes a table.
pub(crate) struct TableKind {
    /// The events' topic.
    topic: &'static str,
    /// What the table's file is called, behind the run's name.
    suffix: &'static str,
    columns: &'static [&'static str],
    write: fn(&Event, &mut csv::Writer<BufWriter<File>>) -> Result<(), Failure>,
}

/// All tables; a new detector's is a line here.
const KINDS: [TableKind; 3] = [
    TableKind { topic: Onset::TOPIC, suffix: "onsets", columns: &Onset::COLUMNS, write: row::<Onset, _> },
    TableKind {
        topic: SlipEvent::TOPIC,
        suffix: "events",
        columns: &SlipEvent::COLUMNS,
        write: row::<SlipEvent, _>,
    },
    TableKind {
        topic: GlobalSlip::TOPIC,
        suffix: "global-slips",
        columns: &GlobalSlip::COLUMNS,
        write: row::<GlobalSlip, _>,
    },
];

fn row<P: EventPayload, W: Write>(event: &Event, table: &mut csv::Writer<W>) -> Result<(), Failure> {
    match event.decode::<P>() {
        Some(payload) => {
            table.serialize(payload.map_err(|error| unreadable(event, &error))?).map_err(as_output)
        }
        None => Ok(()),
    }
}

fn unreadable(event: &Event, error: &serde_json::Error) -> Failure {
    Failure::Failed(format!("an event of {} cannot be read: {error}", event.topic))
}

/// The tables of one run, each in a file that bears its name only once it is whole.
pub(crate) struct EventTables {
    tables: Vec<(&'static TableKind, WholeFile, csv::Writer<BufWriter<File>>)>,
}

impl EventTables {
    /// Where the tables of a run of that name go, for events of those topics.
    pub(crate) fn paths(out: &Path, name: &str, topics: &[&str]) -> Vec<PathBuf> {
        let kinds = KINDS.iter().filter(|kind| topics.contains(&kind.topic));
        kinds.map(|kind| out.join(format!("{name}.{}.csv", kind.suffix))).collect()
    }

    /// Begins them.
    pub(crate) fn create(out: &Path, name: &str, topics: &[&str]) -> Result<EventTables, Failure> {
        let kinds = KINDS.iter().filter(|kind| topics.contains(&kind.topic));
        let paths = EventTables::paths(out, name, topics);
        let tables = kinds.zip(paths).map(|(kind, path)| {
            let (whole, file) =
                WholeFile::create(&path).map_err(|error| not_written(&path, &Failure::Output(error)))?;
            // The header by hand: it must stand there without events as well.
            let mut table = csv::WriterBuilder::new().has_headers(false).from_writer(BufWriter::new(file));
            table.write_record(kind.columns).map_err(|error| not_written(&path, &as_output(error)))?;
            Ok((kind, whole, table))
        });
        Ok(EventTables { tables: tables.collect::<Result<_, Failure>>()? })
    }

    /// Adds an event to its table.
    pub(crate) fn write(&mut self, event: &Event) -> Result<(), Failure> {
        let table = self.tables.iter_mut().find(|(kind, ..)| kind.topic == event.topic);
        match table {
            Some((kind, whole, table)) => {
                (kind.write)(event, table).map_err(|failure| not_written(whole.path(), &failure))
            }
            None => Ok(()),
        }
    }

    /// Gives the tables their names.
    pub(crate) fn publish(self) -> Result<(), Failure> {
        for (_, whole, mut table) in self.tables {
            let path = whole.path().to_owned();
            let written = table.flush().and_then(|()| whole.publish());
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
    Csv(Box<csv::Writer<W>>),
    /// With whether any has been printed.
    Json(BufWriter<W>, bool),
}

impl<W: Write> Printed<W> {
    /// Begins to print.
    pub(crate) fn begin(format: TableFormat, out: W) -> Result<Printed<W>, Failure> {
        Ok(match format {
            TableFormat::Csv => {
                let mut table = csv::WriterBuilder::new().has_headers(false).from_writer(out);
                table.write_record(SlipEvent::COLUMNS).map_err(as_output)?;
                Printed::Csv(Box::new(table))
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
            Printed::Csv(table) => row::<SlipEvent, _>(event, table),
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
            Printed::Csv(mut table) => table.flush()?,
            Printed::Json(mut out, any) => {
                out.write_all(if any { b"\n]\n" } else { b"[]\n" })?;
                out.flush()?;
            }
        }
        Ok(())
    }
}

fn as_output(error: csv::Error) -> Failure {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => Failure::Output(error),
        other => Failure::Failed(format!("failed to write the table: {other:?}")),
    }
}
