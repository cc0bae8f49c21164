//! `asperity events`: the slip events of a log, or the rows of a Parquet table.

#[cfg(feature = "analysis")]
use asperity_analysis::table_file::{self, PrintError};
use asperity_runlog::{LogItem, RunReader, Topics};

use crate::args::EventsArguments;
use crate::event_table::Printed;
use crate::exit::Failure;
use crate::progress::Board;
use crate::terminal;
use crate::verdict_exit;

/// Prints the events of the sound part of a log, then its verdict.
pub(crate) fn command(arguments: &EventsArguments, board: &Board) -> Result<(), Failure> {
    // If it cannot be read, reading it as a log reports that.
    #[cfg(feature = "analysis")]
    if table_file::is_parquet(&arguments.run).unwrap_or(false) {
        return print_table(arguments);
    }
    let checked = verdict_exit::readable(&arguments.run)?;
    let mut printed = Printed::begin(arguments.format, terminal::data())?;
    if let Ok(mut reader) = RunReader::open(&arguments.run, Topics::EVENTS) {
        for _ in 0..checked.seen.events {
            // The verdict reports where the log cannot be read.
            let Ok(Some(LogItem::Event(event))) = reader.next_item() else { break };
            printed.event(&event)?;
        }
    }
    printed.finish()?;
    verdict_exit::finish(&arguments.run, &checked, board)
}

/// Prints a Parquet table, of slip events or others, as CSV.
#[cfg(feature = "analysis")]
fn print_table(arguments: &EventsArguments) -> Result<(), Failure> {
    if arguments.format != crate::args::TableFormat::Csv {
        return Err(Failure::BadInput(format!(
            "--format json of {}, which is a Parquet table (accepted: csv; json of a run log)",
            arguments.run.display()
        )));
    }
    let mut out = std::io::BufWriter::new(terminal::data());
    let printed = table_file::print_parquet(&mut out, &arguments.run);
    std::io::Write::flush(&mut out)?;
    printed.map_err(|error| match error {
        PrintError::Table(error) => Failure::failed(error),
        PrintError::Output(error) => Failure::Output(error),
    })
}
