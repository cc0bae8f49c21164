//! Arguments of commands that read run logs: numbers, tables and verdicts.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableFormat {
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
    /// One array of objects.
    Json,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SummaryFormat {
    /// For people, six digits: all numbers of one run, the first of several.
    Text,
    /// Comma-separated, one header line, one row for each run, numbers in full precision.
    Csv,
    /// An object; an array of them if several runs are named.
    Json,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity summary out/mine.mcap
  asperity summary out/chapter5/runs/*.mcap
  asperity summary out/chapter5/runs/*.mcap --format csv > out/summary.csv
  asperity summary out/mine.mcap --format json | python3 -m json.tool
  asperity summary --schema > out/summary.schema.json

Numbers describe ruptures: sets of detachments that a front connects, whatever
slides elsewhere at the same time. Numbers of raw slip events have `event` in
their names. A precursor is a rupture that includes block 1, does not reach
every block, and reaches farther than every earlier rupture that includes
block 1. If the log of an older version has no ruptures, they are found in its
step records. Units are SI. docs/outputs.md and the schema explain every key.

Exit codes; for several logs, that of the worst:
  0  the summary covers all of every run
  1  failure
  2  a file is not a run log
  3, 4, 5, 7  a log is incomplete, damaged, salvaged with gaps, or its run was
              stopped; its summary covers only the sound part (see asperity
              check)")]
pub(crate) struct SummaryArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required_unless_present = "schema")]
    pub(crate) runs: Vec<PathBuf>,
    /// How to print it.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: SummaryFormat,
    /// Print the JSON schema of a summary: each key with its meaning and unit.
    #[arg(long, conflicts_with_all = ["runs", "format"])]
    pub(crate) schema: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity events out/mine.mcap --format csv
  asperity events out/mine.mcap --format json | python3 -m json.tool
  asperity events out/chapter5/tables/default.events.parquet

As a filter for `git diff` of run logs and Parquet tables:
  git config diff.asperity.textconv 'asperity events'

Exit codes:
  0  all events of the run were printed
  1  failure
  2  the file is not a run log
  3, 4, 5, 7  the log is incomplete, damaged, salvaged with gaps, or its run was
              stopped; the events of its sound part were printed (see asperity
              check)")]
pub(crate) struct EventsArguments {
    /// The run log; or a Parquet table, which is printed as CSV.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// How to print the table.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: TableFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CatalogueFormat {
    /// Comma-separated, one header line, one row for each rupture, numbers in full precision.
    Csv,
    /// QuakeML 1.2: origin, moment magnitude, scalar moment and duration of each rupture.
    Quakeml,
    /// For people: the law of Gutenberg and Richter and the times between ruptures, each with a test.
    Statistics,
}

/// Parses a finite number.
fn finite(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|number| number.is_finite()).ok_or_else(|| "accepted: a finite number".to_owned())
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity catalogue out/mine.mcap > out/mine.csv
  asperity catalogue out/chapter5/runs/*.mcap --format quakeml > out/all.xml
  asperity catalogue out/mine.mcap --format statistics
  asperity catalogue out/precursors --format statistics

Each rupture that has ended is an earthquake. Its magnitude is the moment
magnitude, (2/3) (log10 M_0 - 9.1). Simulated time 0 is the beginning of 1970,
and the slider lies on the equator, eastwards from longitude 0. docs/outputs.md
explains the columns and the tests.

Exit codes; for several logs, that of the worst:
  0  all ruptures of every run that have ended were printed
  1  failure, also of runs of a study
  2  a file is not a run log, or a study keeps no ruptures
  3, 4, 5, 7  a study or a log is incomplete, or a log is damaged, salvaged with
              gaps, or of a run that was stopped; what there is was printed (see
              asperity check)")]
pub(crate) struct CatalogueArguments {
    /// Run logs, and folders of studies, whose runs keep ruptures.
    #[arg(value_name = "RUN.mcap|STUDY", required = true)]
    pub(crate) paths: Vec<PathBuf>,
    /// How to print it.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: CatalogueFormat,
    /// The magnitude above which statistics are made [default: the one above which the law of Gutenberg and
    /// Richter fits best].
    #[arg(long, value_name = "MAGNITUDE", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) completeness: Option<f64>,
}

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
run.

Exit codes, from best to worst; for several logs, that of the worst:
  0  whole: all of its run, by this program with its detectors
  6  by other code or detectors: all of its run, made by another version of the
     program, or with additional or missing detectors
  1  unreadable: the system failed to read it
  3  incomplete: sound up to where it ends
  7  stopped: all there is of a run that could not continue, with the reason;
     usually its time step was too long
  5  salvaged with gaps: what asperity salvage recovered from a damaged log
  2  not a run log
  4  damaged")]
pub(crate) struct CheckArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Repeat runs that this version of the program made, and compare every record.
    #[arg(long)]
    pub(crate) again: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity note out/mine.mcap author='A. Name' comment='before the new springs'
  asperity note out/mine.mcap

A note stays when keys are added; KEY= removes one. Nothing else of the log
changes: not its verdict, its events or any number. check, summary and report
show the note.

Exit codes:
  0  the note was changed, and printed
  1  failure
  2  the file is not a run log
  3, 4, 5  the log is incomplete, damaged or salvaged, and was left alone")]
pub(crate) struct NoteArguments {
    /// The finished log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// What to note; without any, the note is printed.
    #[arg(value_name = "KEY=VALUE")]
    pub(crate) notes: Vec<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity salvage damaged.mcap -o out/salvaged.mcap
  asperity check out/salvaged.mcap

Keeps every record, before and after the damage, that an independent checksum
or schema confirms: chunks and attachments by their checksums, the header by
the scenario, each message by its schema, each step by its complete switches.
Prints the losses: bytes, messages of each topic, steps. The new log is marked
as salvaged with gaps, so no command mistakes it for a whole one. To finish an
unfinished run, use asperity run --resume. If the scenario of a damaged log is
known, it is better to repeat the run.

Exit codes:
  0  salvaged; or nothing to salvage: the log has all there is of its run
  1  failure
  2  the file is not a run log, or the output exists
  3, 4  the log is incomplete or damaged, and nothing can be recovered")]
pub(crate) struct SalvageArguments {
    /// The damaged log.
    #[arg(value_name = "DAMAGED.mcap")]
    pub(crate) run: PathBuf,
    /// The log to write; must not exist.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity replay out/mine.mcap
  asperity replay out/mine.mcap --format csv > out/replayed.csv
  asperity replay out/chapter5/runs/*.mcap -o out/replayed
  asperity replay out/mine.mcap --detectors settings.toml -o out/merged

A settings file lists what differs from a live run; every line is optional:
  detectors = [\"onset\", \"extent\"]  # which detectors to run
  merge_gap_s = 1e-4               # events no farther apart count as one
  min_blocks = 2                   # leave out events of fewer distinct blocks
  link_time_ratio = 30             # link ruptures by this many sqrt(m/k)
Other settings give other events, which are not compared. --out writes
NAME.onsets.csv, NAME.events.csv, NAME.global-slips.csv, NAME.ruptures.csv and
NAME.arrivals.csv for each run, and replay.json with the settings and the logs
that were replayed.

Exit codes:
  0  all events are the same as logged, or nothing was compared
  1  other events, or a failure
  2  bad input; a file is not a run log
  3, 4, 5, 7  a log is incomplete, damaged, salvaged with gaps, or its run was
              stopped; it was left out (see asperity check)")]
pub(crate) struct ReplayArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// Print the slip events instead of the verdict; for a single run.
    #[arg(long, value_enum)]
    pub(crate) format: Option<TableFormat>,
    /// Folder for tables of each run's events; must be new or empty.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Which detectors to run, with which settings [default: those of a live run].
    #[arg(long, value_name = "SETTINGS.toml")]
    pub(crate) detectors: Option<PathBuf>,
    /// How many runs to replay at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// Columns with types and units, compressed.
    #[cfg(feature = "analysis")]
    Parquet,
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
    /// One JSON object per row, each on its own line.
    Ndjson,
    /// All nodes and all contacts at the times of --nodes-at-s, for ParaView and VTK.
    Vtk,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity export out/mine.mcap --to parquet -o out/tables
  asperity export out/mine.mcap --to csv --topic /step -o out/tables
  asperity export out/mine.mcap --to ndjson --from-s 0.5 --to-s 0.6 -o out/part
  asperity export out/chapter5/runs/*.mcap --to parquet -o out/tables
  asperity export out/slab.mcap --to csv --nodes-at-s 0.2 -o out/nodes
  asperity export out/body.mcap --to vtk --nodes-at-s 0.2 -o out/images

Writes one file per topic (NAME.step.parquet for /step of NAME.mcap), and
NAME.FORMAT.export.json with the header and scenario of the run, the columns
with their units, and the number of rows of each file. Tables are long: states
of all blocks (/fields, /window) have one row per block. The whole log is read
and checked, even if only a part is exported. No log contains all nodes of a
slab, a sheet or a body: they are computed by repeating steps of the run, which
takes the version of the program that made the log.

--to vtk writes images instead of tables: for each time of --nodes-at-s,
NAME.nodes.STEP.vti of all nodes and NAME.contacts.STEP.vti of the contacts.
NAME.nodes.pvd and NAME.contacts.pvd list them with their times; ParaView opens
these.

Exit codes:
  0  all of every log is exported
  1  failure
  2  bad input; a file is not a run log
  3  a log is incomplete, and exported up to its end
  4  a log is damaged, and exported up to the damage
  5  a log is salvaged with gaps, and exported around them
  7  the run of a log was stopped, and the log is exported up to there")]
pub(crate) struct ExportArguments {
    /// The run logs.
    #[arg(value_name = "RUN.mcap", required = true)]
    pub(crate) runs: Vec<PathBuf>,
    /// The format of the files.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) to: ExportFormat,
    /// Folder for the files.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Only this topic. May be repeated [default: all].
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Vec<String>,
    /// Only what happened at this time or later; events count by their onset.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) from_s: Option<f64>,
    /// Only what happened before this time.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) to_s: Option<f64>,
    /// Also export all nodes of a slab, a sheet or a body at this time, as NAME.nodes. May be repeated.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) nodes_at_s: Vec<f64>,
    /// Replace existing files.
    #[arg(long, alias = "replace")]
    pub(crate) force: bool,
    /// How many runs to export at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
}
