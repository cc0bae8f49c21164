//! `asperity events`: the slip events of a log.

use std::path::PathBuf;

use asperity_files::FileSet;
use asperity_record::{Event, EventPayload, Observer, Parts, SlipEvent};
use asperity_run::{OpenLog, Verdict};
use clap::Args;

use crate::event_table::{Printed, TableFormat};
use crate::exit::Failure;
use crate::outputs::TableOut;
use crate::progress::Board;
use crate::terminal::Data;
use crate::verdict_exit;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity events out/mine.mcap --format csv
  asperity events out/mine.mcap -o out/events.csv
  asperity events out/mine.mcap --format json | python3 -m json.tool
  asperity events out/mine.mcap --quick

As a filter for `git diff` of run logs:
  git config diff.asperity.textconv 'asperity events'")]
pub(crate) struct EventsArguments {
    /// The run log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// How to print the table.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: TableFormat,
    /// Read only what is needed, found by the index of the file, and verify
    /// nothing: for a look at a long log.
    #[arg(long)]
    pub(crate) quick: bool,
    #[command(flatten)]
    pub(crate) to: TableOut,
}

/// Prints the events of the sound part of a log, then its verdict.
pub(crate) fn command(arguments: &EventsArguments, board: &Board) -> Result<(), Failure> {
    let skims: &[_] = if arguments.quick { &[SlipEvent::TOPIC] } else { &[] };
    let opened = OpenLog::to_skim(&arguments.run, skims);
    let parts = opened.as_ref().map_or(Parts::default(), |log| log.header().parts());
    let EventsArguments { run, format, to, .. } = arguments;
    let files = to.files([run])?;
    let mut printing = Printing { format: *format, parts, to, files: &files, printed: None };
    let checked = opened.map_or_else(|checked| *checked, |log| log.check(&mut printing));
    if checked.verdict == Verdict::NoRunLog {
        return Err(verdict_exit::failure(run, &checked));
    }
    printing.finish()?;
    to.publish(files)?;
    verdict_exit::finish(run, &checked, board)
}

/// Prints the events of a log that is read.
struct Printing<'a> {
    format: TableFormat,
    /// What the run has.
    parts: Parts,
    to: &'a TableOut,
    files: &'a FileSet,
    /// State from the first event on, or the first failure to print.
    printed: Option<Result<Printed<Data>, Failure>>,
}

impl Printing<'_> {
    fn begun(&mut self) -> &mut Result<Printed<Data>, Failure> {
        let (format, parts) = (self.format, self.parts);
        let begin = || Printed::begin(format, parts, self.to.begin(self.files)?);
        self.printed.get_or_insert_with(begin)
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.begun();
        self.printed.expect("it has just begun")?.finish()
    }
}

impl Observer for Printing<'_> {
    fn event(&mut self, event: &Event) {
        let printed = self.begun();
        if let Ok(to) = printed
            && let Err(failure) = to.event(event)
        {
            *printed = Err(failure);
        }
    }
}
