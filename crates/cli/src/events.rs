//! `asperity events`: the slip events of a log, or the rows of a Parquet table.

use asperity_record::{Event, Observer, Parts, RunHeader};
use asperity_run::{Verdict, check_seen};
#[cfg(feature = "analysis")]
use asperity_tables::table_file::{self, PrintError};

use crate::args::{EventsArguments, TableFormat};
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
    let mut printing = Printing { format: arguments.format, parts: Parts::default(), printed: None };
    let checked = check_seen(&arguments.run, &mut printing);
    if checked.verdict == Verdict::NoRunLog {
        return Err(verdict_exit::failure(&arguments.run, &checked));
    }
    printing.finish()?;
    verdict_exit::finish(&arguments.run, &checked, board)
}

/// Prints the events of a log that is read.
struct Printing {
    format: TableFormat,
    /// What the run has.
    parts: Parts,
    /// State from the first event on, or the first failure to print.
    printed: Option<Result<Printed<terminal::Data>, Failure>>,
}

impl Printing {
    fn finish(self) -> Result<(), Failure> {
        self.printed.unwrap_or_else(|| Printed::begin(self.format, self.parts, terminal::data()))?.finish()
    }
}

impl Observer for Printing {
    fn begins(&mut self, header: &RunHeader, _scenario_toml: &str) {
        self.parts = header.parts();
    }

    fn event(&mut self, event: &Event) {
        let begin = || Printed::begin(self.format, self.parts, terminal::data());
        let printed = self.printed.get_or_insert_with(begin);
        if let Ok(to) = printed
            && let Err(failure) = to.event(event)
        {
            *printed = Err(failure);
        }
    }
}

/// Prints a Parquet table, of slip events or others, as CSV.
#[cfg(feature = "analysis")]
fn print_table(arguments: &EventsArguments) -> Result<(), Failure> {
    if arguments.format != TableFormat::Csv {
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
