//! `asperity check`.

use std::path::{Path, PathBuf};

use asperity_recording::{Description, Recording};
use asperity_run::{Checked, OpenLog, check_recording};
use clap::Args;

use crate::exit::{self, Code, Failure};
use crate::progress::Board;
use crate::{note, recording, terminal, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity check out/mine.mcap
  asperity check out/chapter5/runs/*.mcap
  asperity check out/doubted.mcap --again
  asperity check out/lab.mcap --again --inputs fixtures/recordings/slip

Reads every byte. Checks the structure and checksums of the file, every message
against its schema, and the order and times of steps; that all numbers are
finite, that switches fit the state of their blocks, that the events follow from
the step records, and that counts and digests agree with those at the end of the
log.

If this version of the program made the log, its header and topics must also
follow from its scenario. Its records are not compared with that scenario:
someone who recomputes all checksums can change any record. --again detects
this: it repeats the run and compares every record, which takes as long as the
run. A recording is read again from the files in --inputs FOLDER that its log
names; only regular files inside that folder are opened.")]
pub(crate) struct CheckArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Repeat runs that this version of the program made, and compare every record.
    #[arg(long)]
    pub(crate) again: bool,
    /// The folder of a recording's files, which --again reads again.
    #[arg(long, value_name = "FOLDER", requires = "again")]
    pub(crate) inputs: Option<PathBuf>,
}

pub(crate) fn command(arguments: &CheckArguments, board: &Board) -> Result<(), Failure> {
    let mut codes = Vec::new();
    for run in &arguments.runs {
        let checked = match OpenLog::open(run) {
            Err(checked) => *checked,
            Ok(log) if !arguments.again => log.check(&mut ()),
            Ok(log) if log.header().sensors.is_none() => log.check_again(&mut ()),
            Ok(log) => match &arguments.inputs {
                Some(folder) => recorded_again(log, folder, board)?,
                None => {
                    let problem = "a recording is read again from its files (accepted: --inputs FOLDER)";
                    return Err(Failure::BadInput(format!("{}: {problem}", run.display())));
                }
            },
        };
        let what = verdict_exit::words(run, &checked);
        terminal::say(format_args!("{}: {}", run.display(), exit::shortened(&what)))?;
        note::show(run)?;
        codes.push(Code::from(checked.verdict));
    }
    Code::worst(codes).said()
}

/// Checks the log of a recording against the files of a folder.
fn recorded_again(log: OpenLog, folder: &Path, board: &Board) -> Result<Checked, Failure> {
    let open =
        Description::parse(&folder.join("recording.toml"), log.scenario_toml()).and_then(Recording::open);
    let recording = open.map_err(|error| recording::failed(&error))?;
    let mut found = recording::detect(&recording, Recording::read, board)?;
    let recorded = recording.recorded(&mut found);
    Ok(check_recording(recorded, log, recording.records(&mut found, &|| false)))
}
