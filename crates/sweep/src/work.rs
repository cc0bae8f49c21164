//! A run of a plan, made: from its row to what is kept of it.

use std::cell::RefCell;
use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::create_folder;
use asperity_model::Scenario;
use asperity_record::{Event, EventPayload, Record, RunEnd, Rupture, SlipEvent, SolverReport};
use asperity_run::{Begin, LogTo, RunError, Task, Watch, run};
use asperity_runlog::Existing;
use asperity_summary::{RupturesFrom, Slider, Summarizer, Summary};
use zstd::bulk::Compressor;

use crate::plan::{Plan, Row};
use crate::sweep::Keep;

/// The folder of run logs, in that of the plan.
pub const LOGS: &str = "logs";

/// What became of a run.
#[derive(Debug)]
pub enum Made {
    /// It is done.
    Done {
        /// What is kept of it, packed.
        content: Vec<u8>,
        /// How many slip events it had.
        events: u64,
    },
    /// It cannot be made, now or later, and why.
    Failed(String),
    /// It was stopped from outside.
    Stopped,
}

/// Where the log of a run stands.
pub fn log(folder: &Path, run: u64) -> PathBuf {
    folder.join(LOGS).join(format!("{run}.mcap"))
}

/// Makes a run. `slider` says what the summary needs to know of a scenario.
///
/// # Errors
/// If the system refuses something, which says nothing of the run.
pub fn make(
    plan: &Plan,
    row: &Row,
    folder: &Path,
    slider: fn(&Scenario) -> Slider,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Made, String> {
    let (scenario, header) = match plan.scenario(row) {
        Ok(planned) => planned,
        Err(reason) => return Err(format!("run {}: {reason}", row.run)),
    };
    let keep = &plan.common.keep;
    // The other cores have runs of their own.
    let mut task = Task::new(&scenario).on_one_thread();
    let log = log(folder, row.run);
    if keep.contains(&Keep::Log) {
        create_folder(&folder.join(LOGS)).map_err(|error| error.to_string())?;
        task = task.log_to(LogTo { existing: Existing::Replace, ..LogTo::new(&log) });
    }
    let steps = header.steps;
    let mut kept = Kept {
        events: keep.contains(&Keep::Events),
        ruptures: keep.contains(&Keep::Ruptures),
        summarizer: Summarizer::new(&row.run.to_string(), &header, slider(&scenario)),
        lines: String::new(),
    };
    // What an earlier try left is not gone on with, so that all tries give the same.
    let outcome = match run(task, Begin::Anew, stop, &mut kept) {
        Ok(outcome) => outcome,
        Err(RunError::Stopped { .. }) => return Ok(Made::Stopped),
        Err(RunError::Simulation { error, .. }) => return Ok(Made::Failed(error.to_string())),
        Err(error) => return Err(format!("run {}: {error}", row.run)),
    };
    let end = outcome.end.unwrap_or_else(|| RunEnd {
        status: outcome.status,
        stopped: None,
        last_step: steps,
        message_counts: Default::default(),
        switches: outcome.counters.switches,
        energy: None,
        digest: String::new(),
        topic_digests: Default::default(),
        solver: SolverReport { counts: outcome.counters.by_name(), fallbacks: Vec::new() },
    });
    let Kept { summarizer, lines, .. } = kept;
    let summary = summarizer.finish(RupturesFrom::Log, Some(&end));
    let content = pack(&summary, &lines).map_err(|error| error.to_string())?;
    Ok(Made::Done { content, events: summary.event_count })
}

/// Looks on at a run, for what is kept of it.
struct Kept {
    events: bool,
    ruptures: bool,
    summarizer: Summarizer,
    lines: String,
}

impl Watch for Kept {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.summarizer.record(record);
        }
    }

    fn event(&mut self, event: &Event) {
        self.summarizer.event(event).expect("a detector of this program emits what its topic promises");
        let is_kept = match event.topic.as_str() {
            SlipEvent::TOPIC => self.events,
            Rupture::TOPIC => self.ruptures,
            _ => false,
        };
        if is_kept {
            writeln!(self.lines, "{}\t{}", event.topic, event.payload).expect("texts can be written to");
        }
    }
}

/// What was kept of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Its numbers.
    pub summary: Summary,
    /// Its events, in order.
    pub events: Vec<Event>,
}

/// The level of compression: higher ones take more time than a short run.
const LEVEL: i32 = 1;

/// Most bytes that a run's results may have: as many as fit a number of 32 bits.
const MOST_BYTES: usize = u32::MAX as usize;

/// A line with the summary, and one for each event with its topic before it, compressed.
fn pack(summary: &Summary, lines: &str) -> io::Result<Vec<u8>> {
    let mut text = serde_json::to_string(summary)?;
    text.push('\n');
    text.push_str(lines);
    thread_local! {
        /// Its tables take longer to make than a short run's results to pack.
        static PACKER: RefCell<Option<Compressor<'static>>> = const { RefCell::new(None) };
    }
    PACKER.with_borrow_mut(|packer| {
        let packer = match packer {
            Some(packer) => packer,
            none => none.insert(Compressor::new(LEVEL)?),
        };
        packer.compress(text.as_bytes())
    })
}

/// What was packed.
///
/// # Errors
/// If it is none of it, which the checksum of its frame should have told.
pub fn unpack(content: &[u8]) -> io::Result<Outcome> {
    let mut text = String::new();
    let decoder = zstd::stream::read::Decoder::new(content)?;
    io::Read::read_to_string(&mut io::Read::take(decoder, MOST_BYTES as u64), &mut text)?;
    let mut lines = text.lines();
    let summary = serde_json::from_str(lines.next().unwrap_or_default())?;
    let event = |line: &str| {
        let (topic, payload) = line.split_once('\t')?;
        Some(Event { topic: topic.to_owned(), payload: payload.to_owned() })
    };
    let events = lines.map(event).collect::<Option<Vec<_>>>();
    let events = events.ok_or_else(|| io::Error::other("an event without its topic"))?;
    Ok(Outcome { summary, events })
}
