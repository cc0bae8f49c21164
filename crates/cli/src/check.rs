//! `asperity check`.

use std::path::PathBuf;

use asperity_run::{Checked, check, check_again};
use clap::Args;

use crate::exit::{self, Code, Failure};
use crate::{note, terminal, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity check out/mine.mcap
  asperity check out/chapter5/runs/*.mcap
  asperity check out/doubted.mcap --again

Reads every byte. Checks the structure and checksums of the file, every message
against its schema, and the order and times of steps; that all numbers are
finite, that switches fit the state of their blocks, that the events follow from
the step records, and that counts and digests agree with those at the end of the
log.

If this version of the program made the log, its header and topics must also
follow from its scenario. Its records are not compared with that scenario:
someone who recomputes all checksums can change any record. --again detects
this: it repeats the run and compares every record, which takes as long as the
run.")]
pub(crate) struct CheckArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Repeat runs that this version of the program made, and compare every record.
    #[arg(long)]
    pub(crate) again: bool,
}

pub(crate) fn command(arguments: &CheckArguments) -> Result<(), Failure> {
    let mut codes = Vec::new();
    for run in &arguments.runs {
        let checked: Checked = if arguments.again { check_again(run) } else { check(run) };
        let what = verdict_exit::words(run, &checked);
        terminal::say(format_args!("{}: {}", run.display(), exit::shortened(&what)))?;
        note::show(run)?;
        codes.push(Code::from(checked.verdict));
    }
    Code::worst(codes).said()
}
