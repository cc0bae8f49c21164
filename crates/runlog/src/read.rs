//! Reads a run log front to back, checking every checksum, in memory bounded by a chunk.

mod skim;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};

use asperity_record::bounds::check_toml;
use asperity_record::{
    Direction, Energy, Event, JunctionTotals, Record, RowKind, RunEnd, RunHeader, RunStatus, StepRecord,
};
use mcap::records::{MessageHeader, Record as Raw};

use crate::agree;
use crate::ahead::Ahead;
use crate::digest::Digests;
use crate::format::{
    CHECKPOINT, EVENTS, FIELDS, INPUTS, MOST_SCHEMA_BYTES, RUN_END, SIGNAL, STEP, SWITCH, TRACES, WINDOW,
};
use crate::messages::{Message, SwitchMessage, may_be_as_long};
use crate::metadata;
use crate::problem::{LogError, LogProblem};
use crate::records::Records;

/// The messages to decode. All messages are read and checked in any case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topics {
    /// Step records with their switches.
    pub steps: bool,
    /// States of all blocks.
    pub fields: bool,
    /// Dense windows, samples of recordings, and rows of topics of their own.
    pub windows: bool,
    /// Events.
    pub events: bool,
}

impl Topics {
    /// Everything.
    pub const ALL: Topics = Topics { steps: true, fields: true, windows: true, events: true };
    /// The input of detectors, but for the states from which the stress drops of ruptures follow.
    pub const STEPS: Topics = Topics { steps: true, fields: false, windows: false, events: false };
    /// Nothing: only checks the log and finds its last checkpoint.
    pub const NONE: Topics = Topics { steps: false, fields: false, windows: false, events: false };
    /// The output of solvers.
    pub const RECORDS: Topics = Topics { steps: true, fields: true, windows: true, events: false };
    /// The output of detectors.
    pub const EVENTS: Topics = Topics { steps: false, fields: false, windows: false, events: true };
}

/// An item of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum LogItem {
    /// A record of the solver.
    Record(Record),
    /// An event of a detector.
    Event(Event),
}

/// Reads one run log.
pub struct RunReader {
    path: PathBuf,
    records: Records,
    topics: Topics,
    header: Option<RunHeader>,
    scenario_toml: String,
    /// The files of a recording.
    inputs: BTreeMap<String, String>,
    checkpoint: Option<String>,
    /// The parts that may be missing from a salvaged log.
    salvage: Option<Gaps>,
    end: Option<RunEnd>,
    /// A step record whose switches are still being read, and the number that it states.
    open_step: Option<(StepRecord, u32)>,
    detached: Vec<bool>,
    detached_count: u32,
    last_step: u64,
    /// Energies of the last step.
    energy: Option<Energy>,
    /// Totals of junctions in the last step record.
    junctions: Option<JunctionTotals>,
    /// The step of the last record of any kind.
    record_step: u64,
    /// Items that have been read and not yet returned.
    ready: VecDeque<LogItem>,
    counts: BTreeMap<String, u64>,
    /// JSON schemas by their number in the file, up to the bound on their size.
    schemas: BTreeMap<u16, String>,
    schema_bytes: usize,
    /// The topics that channels announce or `run_end` counts, with the number of their schema.
    announced: BTreeMap<String, u16>,
    /// The library of another program that wrote the file.
    rewritten_by: Option<String>,
    switches: u64,
    digests: Digests,
    progress: Progress,
    /// The topics whose messages alone are read, without verifying the log; none for all.
    skimmed: &'static [&'static str],
}

/// The gaps that a salvaged log states. Its messages keep their numbers.
struct Gaps {
    /// The time of the first message after the first one.
    first_ns: u64,
    /// Whether it states that messages were lost or may have been.
    says_lost: bool,
    /// Whether there was a gap before the current message.
    is_passed: bool,
}

/// The progress of reading a log.
enum Progress {
    /// There may be more.
    Reading,
    /// Read to its end: the log is whole.
    Whole,
    /// Read up to an error.
    Failed(LogProblem),
}

impl RunReader {
    /// Opens a log and reads its header and scenario.
    ///
    /// # Errors
    /// If the file cannot be read or is not a run log of this version of the format.
    pub fn open(path: &Path, topics: Topics) -> Result<RunReader, LogError> {
        let (reader, read) = RunReader::begin(path, topics)?;
        read.and_then(|()| reader.header.as_ref().map(|_| ()).ok_or_else(|| reader.records.no_header()))
            .map_err(|problem| LogError { path: path.to_owned(), problem })?;
        Ok(reader)
    }

    /// The resolved scenario of a log, as TOML, of which nothing more may be left; empty if it is lost.
    ///
    /// # Errors
    /// If neither it nor what follows it can be read.
    pub fn scenario_of(path: &Path) -> Result<String, LogError> {
        let (reader, read) = RunReader::begin(path, Topics::NONE)?;
        match read {
            Err(problem) if reader.scenario_toml.is_empty() => {
                Err(LogError { path: path.to_owned(), problem })
            }
            _ => Ok(reader.scenario_toml),
        }
    }

    /// The header and the scenario of an unfinished log; none if it ends before them.
    pub(crate) fn head_of(path: &Path) -> Result<Option<(RunHeader, String)>, LogError> {
        let (reader, read) = RunReader::begin(path, Topics::NONE)?;
        let head = reader.header.zip(Some(reader.scenario_toml).filter(|toml| !toml.is_empty()));
        match read {
            Err(problem) if head.is_none() && !problem.is_early_end() => {
                Err(LogError { path: path.to_owned(), problem })
            }
            _ => Ok(head),
        }
    }

    /// Opens a log and reads up to its first channel, or an error.
    fn begin(path: &Path, topics: Topics) -> Result<(RunReader, Result<(), LogProblem>), LogError> {
        let at = |problem: LogProblem| LogError { path: path.to_owned(), problem };
        let ahead = Ahead::of(path).map_err(|error| at(error.into()))?;
        let records = Records::open(path, &ahead).map_err(|error| at(error.into()))?;
        let mut reader = RunReader {
            path: path.to_owned(),
            records,
            topics,
            header: None,
            scenario_toml: String::new(),
            inputs: BTreeMap::new(),
            checkpoint: None,
            salvage: None,
            end: None,
            open_step: None,
            detached: Vec::new(),
            detached_count: 0,
            last_step: 0,
            energy: None,
            junctions: None,
            record_step: 0,
            ready: VecDeque::new(),
            announced: BTreeMap::new(),
            rewritten_by: None,
            counts: BTreeMap::new(),
            schemas: BTreeMap::new(),
            schema_bytes: 0,
            switches: 0,
            digests: Digests::default(),
            progress: Progress::Reading,
            skimmed: &[],
        };
        let read = reader.look(ahead);
        Ok((reader, read))
    }

    /// Takes header, scenario and gaps from where they are in the file, and reads up to its first channel.
    fn look(&mut self, ahead: Ahead) -> Result<(), LogProblem> {
        let Some(run) = ahead.run else {
            // What is wrong before the first message explains it.
            while !matches!(self.records.next()?, None | Some(Raw::Message { .. })) {}
            return Err(self.records.no_header());
        };
        metadata::check_version(&run)?;
        let header = metadata::header_from_map(&run)?;
        self.detached = vec![false; header.blocks as usize];
        if let Some(salvage) = &ahead.salvage {
            let gaps = metadata::gaps_from_map(salvage)?;
            let first_step = gaps.first().and_then(|gap| gap.before_step);
            self.salvage = Some(Gaps {
                first_ns: first_step.map_or(u64::MAX, |step| header.time_grid().time_ns(step)),
                says_lost: metadata::says_lost(salvage),
                is_passed: false,
            });
        }
        self.header = Some(header);
        if let Some(scenario) = ahead.scenario {
            let toml = String::from_utf8(scenario)
                .map_err(|_| LogProblem::misplaced("attachment `scenario.toml` is not UTF-8"))?;
            check_toml(&toml)?;
            self.scenario_toml = toml;
        }
        // What another program has made of the messages is known before any of them is used.
        if ahead.end.is_some() && ahead.rewritten_by.is_some() && self.topics != Topics::NONE {
            let messages =
                RunReader::open(&self.path, Topics::NONE).and_then(|mut messages| messages.verify());
            if let Err(LogError { problem: problem @ LogProblem::EndMismatch { .. }, .. }) = messages {
                return Err(problem);
            }
        }
        // Another program may leave out channels that have no messages.
        let end = ahead.end.and_then(|end| metadata::end_from_map(&end).ok());
        let counted = end.into_iter().flat_map(|end| end.message_counts.into_keys());
        self.announced = counted.map(|topic| (topic, 0)).collect();
        self.rewritten_by = ahead.rewritten_by;
        while !self.records.has_channels() && matches!(self.progress, Progress::Reading) {
            self.advance()?;
        }
        Ok(())
    }

    /// The library that the MCAP header names, if another program wrote the file or wrote it again.
    pub fn rewritten_by(&self) -> Option<&str> {
        self.rewritten_by.as_deref()
    }

    /// The header of the run.
    pub fn header(&self) -> &RunHeader {
        self.header.as_ref().expect("a reader is only handed out with its header read")
    }

    /// The resolved scenario, as TOML.
    pub fn scenario_toml(&self) -> &str {
        &self.scenario_toml
    }

    /// The files that a recording was read from: length and hash of each, by its path. Known after the first item.
    pub fn inputs(&self) -> &BTreeMap<String, String> {
        &self.inputs
    }

    /// The announced topics of events: one for each detector that the log was written with, whether
    /// or not it found events. Known after the first item.
    pub fn event_topics(&self) -> impl Iterator<Item = String> {
        self.announced.keys().filter(|topic| topic.starts_with(EVENTS)).cloned()
    }

    /// The announced topics of events with their JSON schemas, empty where there is none.
    pub fn event_schemas(&self) -> BTreeMap<&str, &str> {
        let schema = |id: &u16| self.schemas.get(id).map_or("", String::as_str);
        let events = self.announced.iter().filter(|(topic, _)| topic.starts_with(EVENTS));
        events.map(|(topic, id)| (topic.as_str(), schema(id))).collect()
    }

    /// The state of the last checkpoint read so far, as JSON; everything it depends on precedes it.
    pub fn checkpoint(&self) -> Option<&str> {
        self.checkpoint.as_deref()
    }

    /// Reads on to the next checkpoint and returns its state; `None` after the last one. Items are dropped: what
    /// only looks for a state need not parse them.
    ///
    /// # Errors
    /// If the file is damaged, incomplete, or contradicts its end. Further calls repeat the error.
    pub fn next_checkpoint(&mut self) -> Result<Option<&str>, LogError> {
        let before = self.checkpoint.take();
        while self.checkpoint.is_none() && matches!(self.progress, Progress::Reading) {
            if let Err(problem) = self.advance() {
                self.progress = Progress::Failed(problem);
            }
            self.ready.clear();
        }
        if let (None, Progress::Failed(problem)) = (&self.checkpoint, &self.progress) {
            return Err(LogError { path: self.path.clone(), problem: problem.again() });
        }
        Ok(match self.checkpoint {
            Some(_) => self.checkpoint.as_deref(),
            None => {
                self.checkpoint = before;
                None
            }
        })
    }

    /// Whether records or events before the last item may be missing, as in salvaged logs.
    /// Detectors cannot continue across such a gap.
    pub fn has_gap(&self) -> bool {
        self.salvage.as_ref().is_some_and(|gaps| gaps.is_passed)
    }

    /// Whether it was salvaged from a damaged log.
    pub fn is_salvaged(&self) -> bool {
        self.salvage.is_some()
    }

    /// Whether it was salvaged and states that messages were lost or may have been.
    pub fn says_lost(&self) -> bool {
        self.salvage.as_ref().is_some_and(|gaps| gaps.says_lost)
    }

    /// The end of the run; known once [`RunReader::next_item`] has returned `None`.
    pub fn end(&self) -> Option<&RunEnd> {
        self.end.as_ref()
    }

    /// Returns the next record or event; `None` after the last one of a whole log.
    ///
    /// # Errors
    /// If the file is damaged, incomplete, or contradicts its end. Further calls repeat the error.
    pub fn next_item(&mut self) -> Result<Option<LogItem>, LogError> {
        self.read_ahead();
        match &self.progress {
            Progress::Failed(problem) => Err(LogError { path: self.path.clone(), problem: problem.again() }),
            Progress::Whole | Progress::Reading => Ok(self.ready.pop_front()),
        }
    }

    /// Reads up to the next item without returning it: once the first has been read, the topics are
    /// known. An error is returned in place of the item.
    pub fn read_ahead(&mut self) {
        while self.ready.is_empty() && matches!(self.progress, Progress::Reading) {
            if let Err(problem) = self.advance() {
                self.progress = Progress::Failed(problem);
            }
        }
    }

    /// Reads the rest of the log.
    ///
    /// # Errors
    /// If it is damaged, incomplete, or contradicts its end: `Ok` means that it is whole.
    pub fn verify(&mut self) -> Result<RunEnd, LogError> {
        while self.next_item()?.is_some() {}
        Ok(self.end().expect("a log is only whole with its end").clone())
    }

    /// Reads one MCAP record.
    fn advance(&mut self) -> Result<(), LogProblem> {
        match self.records.next() {
            Ok(Some(record)) => self.take(record),
            Err(problem) => {
                // Of a file that is cut off behind `run_end`, this says more.
                if problem.is_early_end() && self.end.is_some() {
                    self.check_end()?;
                }
                Err(problem)
            }
            Ok(None) => {
                self.check_end()?;
                self.progress = Progress::Whole;
                Ok(())
            }
        }
    }

    fn take(&mut self, raw: Raw<'static>) -> Result<(), LogProblem> {
        match raw {
            Raw::Metadata(metadata) if metadata.name == RUN_END && self.end.is_none() => {
                self.end = Some(metadata::end_from_map(&metadata.metadata)?);
            }
            Raw::Metadata(metadata) if metadata.name == INPUTS => self.inputs = metadata.metadata,
            // Runs resume from checkpoints whose checksum, and all those before, are right.
            Raw::Attachment { header, data, .. }
                if header.name == CHECKPOINT && !self.records.is_doubtful() =>
            {
                // Other programs put it anywhere.
                if self.rewritten_by.is_none() {
                    self.close_step()?;
                }
                let text = String::from_utf8(data.into_owned());
                self.checkpoint =
                    Some(text.map_err(|_| LogProblem::misplaced("attachment `checkpoint` is not UTF-8"))?);
            }
            Raw::Schema { header, data } => {
                let is_new = !self.schemas.contains_key(&header.id);
                if is_new && self.schema_bytes + data.len() <= MOST_SCHEMA_BYTES {
                    self.schema_bytes += data.len();
                    self.schemas.insert(header.id, String::from_utf8_lossy(&data).into_owned());
                }
            }
            Raw::Channel(channel) => {
                let schema = self.announced.entry(channel.topic.clone()).or_insert(0);
                if *schema == 0 {
                    *schema = channel.schema_id;
                }
                self.counts.entry(channel.topic).or_insert(0);
            }
            Raw::Message { header, data } => {
                let topic = self.records.topic(header.channel_id).unwrap_or_default().to_owned();
                self.message(&topic, &header, &data)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, topic: &str, head: &MessageHeader, data: &[u8]) -> Result<(), LogProblem> {
        let header = self.header.as_ref().ok_or(LogProblem::NoHeader)?;
        may_be_as_long(header, topic, data.len())?;
        if self.skimmed.is_empty() {
            self.digests.add(topic, data);
        }
        let number = self.counts.get_mut(topic).expect("its channel was announced");
        if let Some(gaps) = &mut self.salvage {
            gaps.is_passed |= u64::from(head.sequence) != *number || head.log_time >= gaps.first_ns;
        }
        *number += 1;
        self.switches += u64::from(topic == SWITCH);
        if topic != SWITCH {
            self.close_step()?;
        }
        let Topics { steps, fields, windows, events } = self.topics;
        let is_wanted = match topic {
            STEP | SWITCH => steps,
            FIELDS => fields,
            WINDOW | SIGNAL | TRACES => windows,
            _ => events && topic.starts_with(EVENTS) || windows && RowKind::with(topic).is_some(),
        };
        if !is_wanted {
            return Ok(());
        }
        let header = self.header.as_ref().ok_or(LogProblem::NoHeader)?;
        // Switches may be missing in a gap, and the record that completed an event.
        let is_known = !self.has_gap();
        match Message::read(header, topic, head, data)? {
            Message::Step(message) => {
                let (promised, sliding) = (message.switches, message.sliding);
                let record = message.into_record();
                agree::totals(&record, self.junctions)?;
                if sliding != self.detached_count && is_known {
                    let left = self.detached_count;
                    let what =
                        format!("it says that {sliding} blocks slide; the switches before it leave {left}");
                    return Err(LogProblem::Contradiction { step: record.step, what });
                }
                (self.last_step, self.record_step) = (record.step, record.step);
                (self.energy, self.junctions) = (Some(record.energy), record.junctions);
                self.open_step = Some((record, promised));
                if promised == 0 {
                    self.close_step()?;
                }
            }
            Message::Switch(message) => self.switch(message, is_known)?,
            Message::Record(record) => {
                if let Record::Fields(record) = &record
                    && steps
                    && is_known
                {
                    agree::detached(record, &self.detached)?;
                }
                self.record_step = record.step();
                self.ready.push_back(LogItem::Record(record));
            }
            Message::Event(event) => {
                // An event has the time of the record before it.
                if self.topics == Topics::ALL && is_known {
                    let timed = agree::time(header, topic, self.record_step, head);
                    match &mut self.salvage {
                        Some(gaps) => gaps.is_passed = timed.is_err(),
                        None => timed?,
                    }
                }
                self.ready.push_back(LogItem::Event(event));
            }
        }
        Ok(())
    }

    fn switch(&mut self, message: SwitchMessage, is_known: bool) -> Result<(), LogProblem> {
        let Some((record, promised)) = &mut self.open_step else {
            return Err(switches(message.step, 0, 1));
        };
        agree::switch(record, &message)?;
        let (step, block, direction) = (message.step, message.block, message.direction);
        let is_detached = (block as usize).checked_sub(1).and_then(|n| self.detached.get_mut(n));
        match is_detached {
            Some(_) if !is_known => {}
            Some(is_detached) if *is_detached != (direction == Direction::Detach) => {
                *is_detached = !*is_detached;
                match direction {
                    Direction::Detach => self.detached_count += 1,
                    Direction::Attach => self.detached_count -= 1,
                }
            }
            _ => {
                let what = format!("block {block} cannot {direction:?}");
                return Err(LogProblem::Contradiction { step, what });
            }
        }
        record.switches.push(message.into_switch());
        if record.switches.len() as u32 == *promised { self.close_step() } else { Ok(()) }
    }

    /// Queues the open step record, if all its switches have been read.
    fn close_step(&mut self) -> Result<(), LogProblem> {
        let Some((record, promised)) = self.open_step.take() else { return Ok(()) };
        let found = record.switches.len() as u32;
        if found != promised {
            return Err(switches(record.step, promised, found));
        }
        self.ready.push_back(LogItem::Record(Record::Step(record)));
        Ok(())
    }

    fn check_end(&mut self) -> Result<(), LogProblem> {
        self.close_step()?;
        let Some(end) = &self.end else { return Err(LogProblem::NoEnd) };
        // A topic without messages may not be announced, or not be counted.
        let topics: BTreeSet<String> = end.message_counts.keys().chain(self.counts.keys()).cloned().collect();
        for topic in &topics {
            let of =
                |counts: &BTreeMap<String, u64>| counts.get(topic).copied().unwrap_or_default().to_string();
            mismatch(&format!("messages of {topic}:"), of(&end.message_counts), of(&self.counts))?;
        }
        let salvaged = end.status == RunStatus::Salvaged;
        if salvaged != self.salvage.is_some() {
            return Err(LogProblem::misplaced("metadata `salvage` and the status `salvaged` go together"));
        }
        let steps = self.header.as_ref().map_or(0, |header| header.steps);
        if end.last_step > steps && !salvaged {
            return mismatch("the last step:", end.last_step.to_string(), format!("a run of {steps}"));
        }
        if matches!(end.status, RunStatus::Complete | RunStatus::LoadNotReached) {
            mismatch("the last step:", end.last_step.to_string(), steps.to_string())?;
        }
        if self.topics.steps && !salvaged {
            mismatch("the last step:", end.last_step.to_string(), self.last_step.to_string())?;
            let texts = |energy: Option<Energy>| {
                let parts = energy.into_iter().flat_map(|energy| energy.parts());
                parts.map(|(name, energy_j)| format!("{name} = {energy_j}")).collect::<Vec<_>>()
            };
            let (promised, found) = (texts(end.energy), texts(self.energy));
            for n in 0..promised.len().max(found.len()) {
                let text = |parts: &[String]| parts.get(n).map_or("nothing".to_owned(), String::clone);
                mismatch("energies:", text(&promised), text(&found))?;
            }
        }
        mismatch("switches:", end.switches.to_string(), self.switches.to_string())?;
        let (digest, topic_digests) = self.digests.finish(topics.iter().chain(end.topic_digests.keys()));
        for (topic, found) in topic_digests {
            let nothing = self.counts.get(&topic).copied().unwrap_or_default() == 0;
            let promised = match end.topic_digests.get(&topic) {
                Some(promised) => promised.clone(),
                None if nothing => continue,
                None => "nothing".to_owned(),
            };
            mismatch(&format!("digest of {topic}:"), promised, found)?;
        }
        let order = "digest of the order among topics, each of which is right by itself:";
        mismatch(order, end.digest.clone(), digest)?;
        ending(end)
    }
}

fn mismatch(what: &str, promised: String, found: String) -> Result<(), LogProblem> {
    if promised == found {
        return Ok(());
    }
    Err(LogProblem::EndMismatch { what: what.to_owned(), promised, found })
}

/// Why a run with this end is not complete, if so.
fn ending(end: &RunEnd) -> Result<(), LogProblem> {
    match end.status {
        RunStatus::Interrupted => Err(LogProblem::Interrupted(end.last_step)),
        RunStatus::StoppedEnergy | RunStatus::StoppedNotFinite | RunStatus::StoppedStalled => {
            Err(LogProblem::Stopped(end.stopped.clone().unwrap_or_default()))
        }
        RunStatus::Salvaged => Err(LogProblem::Salvaged),
        RunStatus::Complete | RunStatus::LoadNotReached => Ok(()),
    }
}

/// The error for switches that do not belong to the step before them.
fn switches(step: u64, promised: u32, found: u32) -> LogProblem {
    LogProblem::Contradiction { step, what: format!("it promises {promised} switches and has {found}") }
}
