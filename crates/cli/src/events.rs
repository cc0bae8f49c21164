//! `asperity events`: the slip events of a log.

use std::path::PathBuf;

use asperity_record::{Event, EventPayload, Observer, Parts, SlipEvent};
use asperity_run::{OpenLog, Verdict};
use clap::Args;

use crate::event_table::{Printed, TableFormat};
use crate::exit::Failure;
use crate::progress::Board;
use crate::{terminal, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity events out/mine.mcap --format csv
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
}

/// Prints the events of the sound part of a log, then its verdict.
pub(crate) fn command(arguments: &EventsArguments, board: &Board) -> Result<(), Failure> {
    let skims: &[_] = if arguments.quick { &[SlipEvent::TOPIC] } else { &[] };
    let opened = OpenLog::to_skim(&arguments.run, skims);
    let parts = opened.as_ref().map_or(Parts::default(), |log| log.header().parts());
    let mut printing = Printing { format: arguments.format, parts, printed: None };
    let checked = opened.map_or_else(|checked| *checked, |log| log.check(&mut printing));
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
