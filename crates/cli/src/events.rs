//! `asperity events` and `asperity replay`: slip events out of a log, as they
//! were found and as the detectors find them now.

use std::io::{self, Write};
use std::path::Path;

use asperity_record::{Event, EventPayload, SlipEvent};
use asperity_runlog::{LogError, LogItem, RunReader, Topics};
use asperity_stream::{Item, StreamError};

use crate::args::{EventsArguments, ReplayArguments, TableFormat};
use crate::detectors;
use crate::exit::Failure;

pub(crate) fn command(arguments: &EventsArguments) -> Result<(), Failure> {
    let events = logged(&arguments.run).map_err(Failure::failed)?;
    print(&slip_events(&events)?, arguments.format)
}

pub(crate) fn replay_command(arguments: &ReplayArguments) -> Result<(), Failure> {
    let before = logged(&arguments.run).map_err(Failure::failed)?;
    let now = replay(&arguments.run).map_err(Failure::failed)?;
    if let Some(format) = arguments.format {
        print(&slip_events(&now)?, format)?;
    }
    let run = arguments.run.display();
    if before == now {
        if arguments.format.is_none() {
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

fn print(events: &[SlipEvent], format: TableFormat) -> Result<(), Failure> {
    let mut out = io::BufWriter::new(io::stdout().lock());
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
