//! `asperity replay`: logged records through the detectors again, by the rules of the live run
//! or by others.
//!
//! A replay reads a log once, from its first byte to its last, and holds no more of it than is
//! under way: what the log says of events and what the detectors find are held against each
//! other as they come, and tables are written row by row.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use asperity_export::whole::WholeFile;
use asperity_record::{EventPayload, RunHeader, SlipEvent};
use asperity_runlog::{LogError, LogItem, LogProblem, RunReader, Topics};
use asperity_stream::{Given, Item, StreamError};
use serde::Serialize;

use crate::args::ReplayArguments;
use crate::at_once::at_once;
use crate::detectors::Settings;
use crate::event_table::{EventTables, Printed};
use crate::exit::{self, Code, Failure};
use crate::held::{Difference, Held};
use crate::progress::Board;
use crate::run::CODE_VERSION;

/// What is written beside the tables of a replay: by which settings they were made, of what.
const RECORD: &str = "replay.json";

/// The layout of [`Replayed`].
const RECORD_VERSION: u32 = 1;

pub(crate) fn command(arguments: &ReplayArguments) -> Result<(), Failure> {
    if let (Some(_), [_, other, ..]) = (arguments.format, &arguments.runs[..]) {
        return Err(Failure::BadInput(format!(
            "--format prints the events of one run, and {} is another (accepted: one run, or --out FOLDER)",
            other.display()
        )));
    }
    let settings = match &arguments.detectors {
        Some(file) => Settings::read(file)?,
        None => Settings::default(),
    };
    if let Some(out) = &arguments.out {
        none_is_taken(&arguments.runs, out)?;
        fs::create_dir_all(out)
            .map_err(|error| Failure::Failed(format!("failed to create {}: {error}", out.display())))?;
    }
    let board = Board::new();
    let replay = Replay { arguments, settings, board };
    let replayed: Mutex<Vec<ReplayedRun>> = Mutex::default();
    let failures = AtomicUsize::new(0);
    at_once(&arguments.runs, arguments.jobs, |run| {
        match replay.one(run) {
            Ok(one) => replayed.lock().expect("no one panics with it").push(one),
            // Of many, the others are replayed all the same.
            Err(Failure::Failed(problem)) if arguments.runs.len() > 1 => {
                failures.fetch_add(1, Ordering::Relaxed);
                exit::report(&Failure::Failed(problem));
            }
            Err(other) => return Err(other),
        }
        Ok(())
    })?;
    let mut runs = replayed.into_inner().expect("no one panics with it");
    let differing = runs.iter().filter(|run| run.same_as_logged == Some(false)).count();
    if let Some(out) = &arguments.out {
        runs.sort_by(|a, b| a.log.cmp(&b.log));
        replay.write_record(out, &runs)?;
    }
    if failures.into_inner() + differing > 0 { Err(Failure::Said(Code::Failed)) } else { Ok(()) }
}

/// The name of a run's tables: that of its log.
fn name(run: &Path) -> String {
    run.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Makes sure that no file would be written over another.
fn none_is_taken(runs: &[PathBuf], out: &Path) -> Result<(), Failure> {
    let mut names: Vec<String> = Vec::new();
    for run in runs {
        let name = name(run);
        if names.contains(&name) {
            return Err(Failure::BadInput(format!(
                "{} is the second run of the name {name}, and its tables would be written over those of the first \
                 (accepted: runs of different names)",
                run.display()
            )));
        }
        names.push(name);
    }
    let is_taken = match fs::read_dir(out) {
        Ok(mut entries) => entries.next().is_some(),
        Err(error) => error.kind() != io::ErrorKind::NotFound,
    };
    if is_taken {
        return Err(Failure::BadInput(format!(
            "--out {} exists already and is not an empty folder (accepted: a new or empty folder)",
            out.display()
        )));
    }
    Ok(())
}

/// What is said of a replay beside its tables.
#[derive(Debug, Serialize)]
struct Replayed<'a> {
    format: &'static str,
    version: u32,
    /// Of the program whose detectors found the events.
    code_version: &'static str,
    settings: &'a Settings,
    runs: &'a [ReplayedRun],
}

/// One run of it.
#[derive(Debug, Serialize)]
struct ReplayedRun {
    log: PathBuf,
    run_id: String,
    scenario_hash: String,
    /// Of the program that made the run.
    code_version: String,
    /// Of the log's messages.
    digest: String,
    slip_events: u64,
    /// Whether the events are those of the log; null where other settings were asked for.
    same_as_logged: Option<bool>,
}

struct Replay<'a> {
    arguments: &'a ReplayArguments,
    settings: Settings,
    board: Board,
}

impl Replay<'_> {
    fn one(&self, run: &Path) -> Result<ReplayedRun, Failure> {
        // By other settings other events are found, and are no contradiction.
        let compares = self.settings == Settings::default();
        let topics = Topics { events: compares, ..Topics::STEPS };
        let mut reader = RunReader::open(run, topics).map_err(Failure::failed)?;
        let header: RunHeader = reader.header().clone();
        let detectors = self.settings.start(&header);
        let emitted = detectors.iter().map(|detector| detector.emits()).collect();
        let mut tables = match &self.arguments.out {
            Some(out) => Some(EventTables::create(out, &name(run), emitted)?),
            None => None,
        };
        let mut printed = match self.arguments.format {
            Some(format) => Some(Printed::begin(format, io::stdout().lock())?),
            None => None,
        };
        let duration_s = header.time_grid().time_s(header.steps);
        let mut progress = self.board.steps(&name(run), header.steps, duration_s);
        // None once they have parted, and where nothing is compared.
        let held = Mutex::new(compares.then(Held::default));
        let mut difference: Option<Difference> = None;
        let mut slip_events = 0;
        let outcome = asperity_stream::run(
            || loop {
                let item = reader.next_item()?;
                if reader.has_gap() {
                    // What is missing may have been the beginning of an event.
                    return Err(LogError { path: run.to_owned(), problem: LogProblem::Salvaged });
                }
                match item {
                    None => return Ok(None),
                    Some(LogItem::Record(record)) => return Ok(Some(Given::Record(record))),
                    Some(LogItem::Event(event)) => {
                        if let Some(held) = &mut *held.lock().expect("no one panics with it") {
                            held.logged(event);
                        }
                    }
                }
            },
            detectors,
            |item| {
                let event = match item {
                    Item::Event(event) => event,
                    Item::Record(record) => {
                        progress.reached(record.step());
                        return Ok(());
                    }
                    Item::Checkpoint(_) => return Ok(()),
                };
                slip_events += u64::from(event.topic == SlipEvent::TOPIC);
                if let Some(tables) = &mut tables {
                    tables.write(&event)?;
                }
                if let Some(printed) = &mut printed {
                    printed.event(&event)?;
                }
                let mut held = held.lock().expect("no one panics with it");
                if let Some(both) = &mut *held {
                    both.found(event);
                    difference = both.compare().err();
                }
                if difference.is_some() {
                    *held = None;
                }
                Ok(())
            },
        );
        progress.clear();
        match outcome {
            Ok(()) => {}
            Err(StreamError::Source(error)) => return Err(Failure::failed(error)),
            Err(StreamError::Sink(failure)) => return Err(failure),
        }
        if let Some(held) = held.into_inner().expect("no one panics with it") {
            difference = held.finish().err();
        }
        if let Some(tables) = tables {
            tables.publish()?;
        }
        if let Some(printed) = printed {
            printed.finish()?;
        }
        let run_name = run.display();
        match &difference {
            Some(difference) => {
                exit::report(&Failure::Failed(format!("{run_name}: the replay gives {difference}")))
            }
            None if self.arguments.format.is_some() => {}
            None => {
                let verdict = if compares { "the same as logged" } else { "by the settings given" };
                writeln!(io::stdout().lock(), "{run_name}: {slip_events} slip events, {verdict}")?;
            }
        }
        let end = reader.end().expect("the log was read to its end");
        Ok(ReplayedRun {
            log: run.to_owned(),
            run_id: header.run_id,
            scenario_hash: header.scenario_hash,
            code_version: header.code_version,
            digest: end.digest.clone(),
            slip_events,
            same_as_logged: compares.then_some(difference.is_none()),
        })
    }

    fn write_record(&self, out: &Path, runs: &[ReplayedRun]) -> Result<(), Failure> {
        let record = Replayed {
            format: "asperity-replay",
            version: RECORD_VERSION,
            code_version: CODE_VERSION,
            settings: &self.settings,
            runs,
        };
        let path = out.join(RECORD);
        let text = serde_json::to_string_pretty(&record).expect("paths and numbers are JSON");
        WholeFile::write(&path, text + "\n")
            .map_err(|error| Failure::Failed(format!("failed to write {}: {error}", path.display())))
    }
}
