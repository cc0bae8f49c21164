//! `asperity events`: the slip events that a log holds.

use std::io;

use asperity_runlog::{LogItem, RunReader, Topics};

use crate::args::EventsArguments;
use crate::event_table::Printed;
use crate::exit::Failure;

/// Prints them up to where the log is sound; if that is not its end, the command fails.
pub(crate) fn command(arguments: &EventsArguments) -> Result<(), Failure> {
    let mut reader = RunReader::open(&arguments.run, Topics::EVENTS).map_err(Failure::failed)?;
    let mut printed = Printed::begin(arguments.format, io::stdout().lock())?;
    let outcome = loop {
        match reader.next_item() {
            Ok(Some(LogItem::Event(event))) => printed.event(&event)?,
            Ok(Some(LogItem::Record(_))) => unreachable!("only events were asked for"),
            Ok(None) => break Ok(()),
            Err(error) => break Err(Failure::failed(error)),
        }
    };
    printed.finish()?;
    outcome
}
