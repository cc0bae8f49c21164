//! `asperity events` and `asperity replay`: slip events out of a log, as they
//! were found and as the detectors find them now.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

#[cfg(feature = "analysis")]
use asperity_analysis::table_file;
use asperity_record::{Event, EventPayload, SlipEvent};
use asperity_runlog::{LogError, LogItem, RunReader, Topics};
use asperity_stream::{Item, StreamError};

use crate::args::{EventsArguments, ReplayArguments, TableFormat};
use crate::at_once::at_once;
use crate::detectors;
use crate::exit::{self, Code, Failure};

pub(crate) fn command(arguments: &EventsArguments) -> Result<(), Failure> {
    // What cannot be read is told when it is read as a log.
    #[cfg(feature = "analysis")]
    if table_file::is_parquet(&arguments.run).unwrap_or(false) {
        return print_table(arguments);
    }
    let events = logged(&arguments.run).map_err(Failure::failed)?;
    write(&slip_events(&events)?, arguments.format, io::stdout().lock())
}

/// A Parquet table, of slip events or any other, as the CSV file beside it reads.
#[cfg(feature = "analysis")]
fn print_table(arguments: &EventsArguments) -> Result<(), Failure> {
    if arguments.format != TableFormat::Csv {
        return Err(Failure::BadInput(format!(
            "--format json of {}, which is a Parquet table (accepted: csv; json of a run log)",
            arguments.run.display()
        )));
    }
    let table = table_file::read_parquet(&arguments.run).map_err(Failure::failed)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    table_file::write_csv(&mut out, &table)?;
    Ok(out.flush()?)
}

pub(crate) fn replay_command(arguments: &ReplayArguments) -> Result<(), Failure> {
    if let (Some(_), [_, other, ..]) = (arguments.format, &arguments.runs[..]) {
        return Err(Failure::BadInput(format!(
            "--format prints the events of one run, and {} is another (accepted: one run, or --out FOLDER)",
            other.display()
        )));
    }
    let tables = match &arguments.out {
        Some(out) => table_paths(&arguments.runs, out)?,
        None => Vec::new(),
    };
    let jobs: Vec<(usize, &PathBuf)> = arguments.runs.iter().enumerate().collect();
    let differing = AtomicUsize::new(0);
    at_once(&jobs, arguments.jobs, |&(number, run)| {
        match replay_one(run, arguments.format, tables.get(number).map(PathBuf::as_path)) {
            // Of many, the others are replayed all the same.
            Err(Failure::Failed(problem)) if jobs.len() > 1 => {
                differing.fetch_add(1, Ordering::Relaxed);
                exit::report(&Failure::Failed(problem));
                Ok(())
            }
            outcome => outcome,
        }
    })?;
    if differing.into_inner() > 0 { Err(Failure::Said(Code::Failed)) } else { Ok(()) }
}

/// Where the events of each run go: `NAME.events.csv`, each name once.
fn table_paths(runs: &[PathBuf], out: &Path) -> Result<Vec<PathBuf>, Failure> {
    std::fs::create_dir_all(out)
        .map_err(|error| Failure::Failed(format!("failed to create {}: {error}", out.display())))?;
    let mut paths: Vec<PathBuf> = Vec::new();
    for run in runs {
        let name = run.file_stem().unwrap_or_default().to_string_lossy();
        let path = out.join(format!("{name}.events.csv"));
        if path.exists() || paths.contains(&path) {
            return Err(Failure::BadInput(format!(
                "{} would be written twice (accepted: an empty folder, runs of different names)",
                path.display()
            )));
        }
        paths.push(path);
    }
    Ok(paths)
}

fn replay_one(run: &Path, format: Option<TableFormat>, table: Option<&Path>) -> Result<(), Failure> {
    let before = logged(run).map_err(Failure::failed)?;
    let now = replay(run).map_err(Failure::failed)?;
    if let Some(path) = table {
        // Under its name only when it is whole.
        let partial = path.with_extension("csv.partial");
        let written = File::create(&partial).map_err(Failure::Output).and_then(|file| {
            write(&slip_events(&now)?, TableFormat::Csv, file)?;
            Ok(std::fs::rename(&partial, path)?)
        });
        written.map_err(|error| Failure::Failed(format!("failed to write {}: {error}", path.display())))?;
    }
    if let Some(format) = format {
        write(&slip_events(&now)?, format, io::stdout().lock())?;
    }
    let run = run.display();
    if before == now {
        if format.is_none() {
            let events = slip_events(&now)?.len();
            writeln!(io::stdout().lock(), "{run}: {events} slip events, the same as logged")?;
        }
        return Ok(());
    }
    let same = before.iter().zip(&now).take_while(|(before, now)| before == now).count();
    let payload = |events: &[Event]| {
        events.get(same).map_or("nothing".to_owned(), |event| format!("{} {}", event.topic, event.payload))
    };
    Err(Failure::Failed(format!(
        "{run}: the replay gives other events from number {same} on\n  logged:   {}\n  replayed: {}",
        payload(&before),
        payload(&now)
    )))
}

/// The events that a log holds.
fn logged(path: &Path) -> Result<Vec<Event>, LogError> {
    let mut reader = RunReader::open(path, Topics::EVENTS)?;
    let mut events = Vec::new();
    while let Some(item) = reader.next_item()? {
        if let LogItem::Event(event) = item {
            events.push(event);
        }
    }
    Ok(events)
}

/// The events that today's detectors find in a log's step records.
fn replay(path: &Path) -> Result<Vec<Event>, LogError> {
    let mut reader = RunReader::open(path, Topics::STEPS)?;
    let detectors = detectors::all(reader.header());
    let mut events = Vec::new();
    let outcome = asperity_stream::run(
        || {
            Ok(reader.next_item()?.map(|item| match item {
                LogItem::Record(record) => record,
                LogItem::Event(_) => unreachable!("only step records were asked for"),
            }))
        },
        detectors,
        |item| {
            if let Item::Event(event) = item {
                events.push(event);
            }
            Ok::<(), std::convert::Infallible>(())
        },
    );
    match outcome {
        Ok(()) => Ok(events),
        Err(StreamError::Source(error)) => Err(error),
        Err(StreamError::Sink(never)) => match never {},
    }
}

fn slip_events(events: &[Event]) -> Result<Vec<SlipEvent>, Failure> {
    let slips: Result<Vec<SlipEvent>, _> = events.iter().filter_map(Event::decode).collect();
    slips
        .map_err(|error| Failure::Failed(format!("an event of {} cannot be read: {error}", SlipEvent::TOPIC)))
}

fn write(events: &[SlipEvent], format: TableFormat, out: impl Write) -> Result<(), Failure> {
    let mut out = io::BufWriter::new(out);
    match format {
        TableFormat::Csv => {
            // The header by hand: it must stand there without events as well.
            let mut table = csv::WriterBuilder::new().has_headers(false).from_writer(&mut out);
            table.write_record(SlipEvent::COLUMNS).map_err(as_output)?;
            for event in events {
                table.serialize(event).map_err(as_output)?;
            }
            table.flush()?;
        }
        TableFormat::Json => {
            serde_json::to_writer_pretty(&mut out, events).map_err(|error| Failure::Output(error.into()))?;
            writeln!(out)?;
        }
    }
    out.flush()?;
    Ok(())
}

fn as_output(error: csv::Error) -> Failure {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => Failure::Output(error),
        other => Failure::Failed(format!("failed to write the table: {other:?}")),
    }
}
