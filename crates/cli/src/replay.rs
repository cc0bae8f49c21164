//! `asperity replay`: sends logged records through the detectors again, with the rules of the live
//! run or others, and writes tables row by row as events are found.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use asperity_files::{Existing, FileSet, Inputs};
use asperity_record::{Event, counted};
use asperity_run::detectors::Settings;
use asperity_run::{CODE_VERSION, Checked, Comparison, Observer, ReplayError, Replayed, check};
use clap::Args;
use serde::Serialize;

use crate::event_table::{EventTables, Printed, TableFormat};
use crate::exit::{self, Code, Failure};
use crate::outputs::{A_FOLDER, fits, must_be_new, refused};
use crate::progress::{Board, RunProgress};
use crate::terminal::{self, Data};
use crate::{summary, verdict_exit};

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
that were replayed.")]
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
    pub(crate) jobs: Option<NonZeroUsize>,
}

/// The record beside the tables: their settings and sources.
const RECORD: &str = "replay.json";

/// The layout of [`ReplayFile`].
const RECORD_VERSION: u32 = 1;

pub(crate) fn command(arguments: &ReplayArguments, board: Board) -> Result<(), Failure> {
    if let (Some(_), [_, other, ..]) = (arguments.format, &arguments.runs[..]) {
        return Err(Failure::BadInput(format!(
            "--format prints the events of one run; {} is a second run (accepted: one run, or --out FOLDER)",
            other.display()
        )));
    }
    let settings = match &arguments.detectors {
        Some(file) => {
            Settings::read(file).map_err(|error| Failure::BadInput(format!("--detectors {error}")))?
        }
        None => Settings::default(),
    };
    let inputs = Inputs::of(arguments.runs.iter().chain(&arguments.detectors));
    let files = FileSet::new(Existing::Refuse, inputs);
    if let Some(out) = &arguments.out {
        fits("--out", out, "", A_FOLDER)?;
        none_is_taken(&arguments.runs, out)?;
        files.folder(out).map_err(|error| refused("--out", &error, false))?;
    }
    let replay = Replay { arguments, settings, files, board };
    let replayed = exit::each_of(&arguments.runs, arguments.jobs, |run| replay.one(run))?;
    let codes: Vec<Code> = replayed
        .iter()
        .map(|run| match run {
            Ok(run) if run.same_as_logged == Some(false) => Code::Failed,
            Ok(_) => Code::Success,
            Err(code) => *code,
        })
        .collect();
    let mut runs: Vec<ReplayedRun> = replayed.into_iter().flatten().collect();
    if let Some(out) = arguments.out.as_ref().filter(|_| !runs.is_empty()) {
        runs.sort_by(|a, b| a.log.cmp(&b.log));
        replay.publish(out, &runs)?;
    }
    Code::worst(codes).said()
}

/// Checks that no output would overwrite another file.
fn none_is_taken(runs: &[PathBuf], out: &Path) -> Result<(), Failure> {
    let mut names: Vec<String> = Vec::new();
    for run in runs {
        let name = summary::name(run);
        if names.contains(&name) {
            return Err(Failure::BadInput(format!(
                "{} is the second run with the name {name}, and its tables would overwrite the tables of \
                 the first (accepted: runs of different names)",
                run.display()
            )));
        }
        names.push(name);
    }
    must_be_new(out)
}

/// The record of a replay.
#[derive(Debug, Serialize)]
struct ReplayFile<'a> {
    format: &'static str,
    version: u32,
    /// Code version of the program whose detectors found the events.
    code_version: &'static str,
    settings: &'a Settings,
    runs: &'a [ReplayedRun],
}

/// One run of it.
#[derive(Debug, Serialize)]
struct ReplayedRun {
    /// As text, with U+FFFD for invalid UTF-8.
    log: String,
    run_id: String,
    scenario_hash: String,
    /// Of the program that made the run.
    code_version: String,
    /// Of the log's messages.
    digest: String,
    slip_events: u64,
    /// Whether the events are those of the log; null with other settings.
    same_as_logged: Option<bool>,
}

struct Replay<'a> {
    arguments: &'a ReplayArguments,
    settings: Settings,
    /// The tables of all runs, and the record.
    files: FileSet,
    board: Board,
}

/// The outputs of a replay in progress: tables, printed events, progress. A failed write stops the
/// replay.
struct Output<'a, 'f> {
    tables: Option<EventTables<'a>>,
    printed: Option<Printed<Data>>,
    progress: RunProgress,
    failed: &'f OnceLock<Failure>,
}

impl Output<'_, '_> {
    fn write(&mut self, event: &Event) -> Result<(), Failure> {
        if let Some(tables) = &mut self.tables {
            tables.write(event)?;
        }
        if let Some(printed) = &mut self.printed {
            printed.event(event)?;
        }
        Ok(())
    }

    fn finish(self) -> Result<(), Failure> {
        drop(self.progress);
        if let Some(tables) = self.tables {
            tables.finish()?;
        }
        if let Some(printed) = self.printed {
            printed.finish()?;
        }
        Ok(())
    }
}

impl Observer for Output<'_, '_> {
    fn event(&mut self, event: &Event) {
        if self.failed.get().is_none()
            && let Err(failure) = self.write(event)
        {
            self.failed.get_or_init(|| failure);
        }
    }

    fn reached(&mut self, step: u64) {
        self.progress.advance(step);
    }
}

impl Replay<'_> {
    fn one(&self, run: &Path) -> Result<ReplayedRun, Failure> {
        // Printed rows cannot be withdrawn, unlike tables, which are published once the log that is
        // replayed while it is checked proves whole. So a log to print is checked beforehand as well.
        if self.arguments.format.is_some() {
            verdict_exit::must_hold_all(run, &check(run))?;
        }
        let refused = |checked: Box<Checked>| verdict_exit::failure(run, &checked);
        let replay = asperity_run::Replay::open(run, &self.settings).map_err(refused)?;
        let header = replay.header().clone();
        let duration_s = header.time_grid().time_s(header.steps);
        let failed = OnceLock::new();
        let mut output = Output {
            tables: match &self.arguments.out {
                Some(out) => {
                    Some(EventTables::create(&self.files, out, &summary::name(run), replay.kinds())?)
                }
                None => None,
            },
            printed: match self.arguments.format {
                Some(format) => Some(Printed::begin(format, header.parts(), terminal::data())?),
                None => None,
            },
            progress: self.board.steps(&summary::name(run), header.steps, duration_s),
            failed: &failed,
        };
        let replayed = match replay.run(&|| failed.get().is_some(), &mut output) {
            Ok(replayed) if failed.get().is_none() => replayed,
            outcome => {
                let Output { progress, tables, printed, .. } = output;
                drop(progress);
                drop((tables, printed));
                // A failed write precedes any other error.
                return Err(match (failed.into_inner(), outcome) {
                    (Some(failure), _) => failure,
                    (None, Err(ReplayError::Log(checked))) => refused(checked),
                    (None, Err(error)) => Failure::failed(error),
                    (None, Ok(_)) => unreachable!("only what could not be written is left"),
                });
            }
        };
        output.finish()?;
        self.tell(run, &replayed)?;
        let Replayed { checked, slip_events, comparison } = replayed;
        verdict_exit::finish(run, &checked, &self.board)?;
        let end = checked.seen.end.expect("a log that holds all of its run has an end");
        Ok(ReplayedRun {
            log: run.to_string_lossy().into_owned(),
            run_id: header.run_id,
            scenario_hash: header.scenario_hash,
            code_version: header.code_version,
            digest: end.digest,
            slip_events,
            same_as_logged: comparison.map(|comparison| comparison.difference.is_none()),
        })
    }

    fn tell(&self, run: &Path, replayed: &Replayed) -> Result<(), Failure> {
        let name = run.display();
        let verdict = match &replayed.comparison {
            Some(Comparison { difference: Some(difference), .. }) => {
                exit::report(&Failure::Failed(format!("{name}: the replay gives {difference}")));
                return Ok(());
            }
            Some(Comparison { other_detectors, .. }) if other_detectors.is_none() => {
                "the same as logged".to_owned()
            }
            Some(Comparison { other_detectors, .. }) => format!("the same as logged {other_detectors}"),
            None => "by the settings given".to_owned(),
        };
        if self.arguments.format.is_none() {
            let slip_events = counted(replayed.slip_events, "slip event");
            terminal::say(format_args!("{name}: {slip_events}, {verdict}"))?;
        }
        Ok(())
    }

    /// Publishes the tables together with their record.
    fn publish(self, out: &Path, runs: &[ReplayedRun]) -> Result<(), Failure> {
        let record = ReplayFile {
            format: "asperity-replay",
            version: RECORD_VERSION,
            code_version: CODE_VERSION,
            settings: &self.settings,
            runs,
        };
        let text = serde_json::to_string_pretty(&record).expect("texts and numbers are JSON");
        let written = self.files.write_record(&out.join(RECORD), text + "\n");
        written.and_then(|()| self.files.publish()).map_err(|error| refused("--out", &error, false))
    }
}
