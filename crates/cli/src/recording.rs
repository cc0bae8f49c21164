//! `asperity recording`.

use std::path::PathBuf;

use asperity_files::Existing;
use asperity_record::{Arrival, EventPayload, LoadDrop, Rupture, counted};
use asperity_recording::{Description, Detected, EXAMPLE, Recording, RecordingError};
use asperity_run::stream::StreamError;
use asperity_run::write_recording;
use asperity_runlog::WriteError;
use asperity_study::Watcher;
use clap::{Args, Subcommand};

use crate::estimate::{self, EstimateArguments, SampleArguments};
use crate::exit::Failure;
use crate::outputs::{fits, refused};
use crate::progress::Board;
use crate::{interrupt, terminal};

#[derive(Debug, Subcommand)]
pub(crate) enum RecordingCommand {
    /// Print a description of a recording with every key.
    #[command(after_help = "\
Examples:
  asperity recording show > out/recording.toml")]
    Show,
    /// Check a description and its files, and say what is in them.
    #[command(after_help = "\
Examples:
  asperity recording validate out/recording.toml

Reads all files. Prints each stream with its parts, and warnings about
channels that are clipped, dead, or coarser than their noise.")]
    Validate(RecordingFile),
    /// Find steps and load drops in a recording, and write them as a log.
    #[command(after_help = "\
Examples:
  mkdir -p out
  asperity recording read out/recording.toml -o out/lab.mcap
  asperity check out/lab.mcap
  asperity events out/lab.mcap

Every sensor of the array is a block, so that all that reads the log of a run
reads this one: summary, events, catalogue, export, replay. Thresholds follow
from the noise of each channel (docs/recordings.md).")]
    Read(ReadArguments),
    /// Write a scenario with what the log of a recording tells of a model.
    #[command(after_help = "\
Examples:
  asperity recording estimate out/lab.mcap -o out/estimated.toml
  asperity run out/estimated.toml -o out/estimated.mcap

Every key that is identifiable has its value, with error and origin as a
comment; the others keep their defaults, and a comment says why
(docs/findings.md).")]
    Estimate(EstimateArguments),
    /// Record a simulated run as the instruments of a description would.
    #[command(after_help = "\
Examples:
  asperity recording sample out/mine.mcap --like out/recording.toml -o out/as
  asperity recording read out/as/recording.toml -o out/as.mcap

The run is computed again from its log, and sampled at the same rates and
places, with white noise: 0.03 N of forces, 10 nm of the load point, 3 nm of
slip, 0.01 of real contact. Streams in segments are triggered by ruptures.")]
    Sample(SampleArguments),
}

#[derive(Debug, Args)]
pub(crate) struct RecordingFile {
    /// The description; paths in it count from its folder.
    #[arg(value_name = "RECORDING.toml")]
    file: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct ReadArguments {
    #[command(flatten)]
    recording: RecordingFile,
    /// The log to write.
    #[arg(short, long, value_name = "LAB.mcap")]
    out: PathBuf,
    /// Replace an existing log.
    #[arg(long)]
    force: bool,
}

pub(crate) fn command(command: &RecordingCommand, board: &Board) -> Result<(), Failure> {
    match command {
        RecordingCommand::Show => Ok(terminal::print(EXAMPLE.as_bytes())?),
        RecordingCommand::Validate(file) => validate(file, board),
        RecordingCommand::Read(arguments) => read(arguments, board),
        RecordingCommand::Estimate(arguments) => estimate::estimate(arguments),
        RecordingCommand::Sample(arguments) => estimate::sample(arguments),
    }
}

/// Ways to go through a recording: [`Recording::detect`], or [`Recording::read`].
type Pass = fn(&Recording, &(dyn Fn(u64, u64) -> bool + Sync)) -> Result<Detected, RecordingError>;

/// Goes through all files of a recording, with a bar, and reports warnings.
pub(crate) fn detect(recording: &Recording, pass: Pass, board: &Board) -> Result<Detected, Failure> {
    interrupt::install()?;
    let name = recording.description.name.clone();
    let found = pass(recording, &|done, of| {
        board.reached(&name, done as usize, of as usize);
        interrupt::has_come()
    });
    let found = found.map_err(|error| failed(&error))?;
    found.warnings.iter().for_each(|warning| board.line(&format!("warning: {warning}")));
    Ok(found)
}

fn open(file: &RecordingFile) -> Result<Recording, Failure> {
    Description::read(&file.file).and_then(Recording::open).map_err(|error| failed(&error))
}

pub(crate) fn failed(error: &RecordingError) -> Failure {
    match (error, interrupt::code()) {
        (RecordingError::Interrupted, Some(code)) => Failure::Said(code),
        _ => Failure::BadInput(error.to_string()),
    }
}

fn validate(file: &RecordingFile, board: &Board) -> Result<(), Failure> {
    let recording = open(file)?;
    detect(&recording, Recording::detect, board)?;
    terminal::say(format_args!("{}: valid", recording.description.name))?;
    for line in recording.in_words() {
        terminal::say(format_args!("  {line}"))?;
    }
    Ok(())
}

fn read(arguments: &ReadArguments, board: &Board) -> Result<(), Failure> {
    let ReadArguments { recording: file, out, force } = arguments;
    fits("--out", out, "mcap", "a log")?;
    let recording = open(file)?;
    let mut found = detect(&recording, Recording::read, board)?;
    let recorded = recording.recorded(&mut found);
    let existing = if *force { Existing::Replace } else { Existing::Refuse };
    let records = recording.records(&mut found, &interrupt::has_come);
    let end = write_recording(recorded, out, existing, records).map_err(|error| match error {
        StreamError::Source(error) => failed(&error),
        StreamError::Sink(WriteError::File(error)) => refused("--out", &error, true),
        error => Failure::failed(error),
    })?;
    let [ruptures, arrivals, drops] =
        [(Rupture::TOPIC, "rupture"), (Arrival::TOPIC, "arrival"), (LoadDrop::TOPIC, "load drop")]
            .map(|(topic, what)| counted(end.message_counts.get(topic).copied().unwrap_or_default(), what));
    Ok(terminal::say(format_args!("{}: {ruptures}, {arrivals}, {drops}", out.display()))?)
}
