//! Writing a run log.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_record::{
    Checkpoint, Event, EventKind, Record, RunEnd, RunHeader, RunStatus, SolverReport, StepRecord,
};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use serde::Serialize;

use crate::digest::Digests;
use crate::findings::Salvaged;
use crate::format::{
    CHECKPOINT, CHUNK_BYTES, FIELDS, PROFILE, RUN, RUN_END, SALVAGE, SCENARIO, STEP, SWITCH, WINDOW,
};
use crate::messages::{self, StepMessage, SwitchMessage, Topic};
use crate::metadata;
use crate::problem::WriteError;
use crate::unfinished::{Existing, Unfinished, locked, resumed_path};
use crate::whole::{partial_path, sync_folder};

/// How much work a crash of the machine may cost.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// Writes one run log. Dropped before [`RunWriter::finish`], it leaves a file
/// under the temporary name without `run_end`, which says that it is not whole.
pub struct RunWriter {
    path: PathBuf,
    /// Where the file is at present.
    stands_at: PathBuf,
    /// The unfinished log that this one is to take the place of, once it holds as much.
    takes_place_of: Option<Unfinished>,
    existing: Existing,
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<String, Channel>,
    digests: Digests,
    switches: u64,
    last_step: u64,
    header: RunHeader,
    synced: Instant,
    payload: Vec<u8>,
}

struct Channel {
    id: u16,
    messages: u64,
}

impl RunWriter {
    /// Starts the log of a run: header and scenario first. A log that stands at
    /// `path` is only replaced once the new one is whole, and only if asked for.
    ///
    /// # Errors
    /// If `path` exists and is not to be replaced, or the temporary file cannot be
    /// written.
    pub fn create(
        path: &Path,
        existing: Existing,
        header: &RunHeader,
        scenario_toml: &str,
        events: &[EventKind],
    ) -> Result<RunWriter, WriteError> {
        let events = events.iter().map(Topic::of);
        RunWriter::start(path, partial_path(path), existing, header, scenario_toml, events)
    }

    /// Starts a log of what is left of another, with the topics of events that it has.
    pub(crate) fn create_salvaged(
        path: &Path,
        header: &RunHeader,
        scenario_toml: &str,
        events: impl Iterator<Item = Topic>,
    ) -> Result<RunWriter, WriteError> {
        RunWriter::start(path, partial_path(path), Existing::Refuse, header, scenario_toml, events)
    }

    /// Starts the log of a run that goes on where an unfinished one left off. That
    /// stays as it is until this one has its first checkpoint, and so holds as much.
    ///
    /// # Errors
    /// As [`RunWriter::create`].
    pub fn resume(
        unfinished: Unfinished,
        existing: Existing,
        header: &RunHeader,
        scenario_toml: &str,
        events: &[EventKind],
    ) -> Result<RunWriter, WriteError> {
        let path = unfinished.path().to_owned();
        let resumed = resumed_path(&path);
        let events = events.iter().map(Topic::of);
        let mut writer = RunWriter::start(&path, resumed, existing, header, scenario_toml, events)?;
        writer.takes_place_of = Some(unfinished);
        Ok(writer)
    }

    fn start(
        path: &Path,
        partial: PathBuf,
        existing: Existing,
        header: &RunHeader,
        scenario_toml: &str,
        events: impl Iterator<Item = Topic>,
    ) -> Result<RunWriter, WriteError> {
        if existing == Existing::Refuse && path.exists() {
            return Err(WriteError::Exists(path.to_owned()));
        }
        let io_error = |error| WriteError::Io { path: partial.clone(), error };
        // Emptied only once no one else writes it.
        let file = File::options().write(true).create(true).truncate(false).open(&partial);
        let file = locked(file.map_err(io_error)?, &partial)?;
        file.set_len(0).map_err(io_error)?;
        let at = |error| WriteError::of_mcap(&partial, error);
        let mut writer = WriteOptions::new()
            .profile(PROFILE)
            .library(concat!("asperity-runlog ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .chunk_size(Some(CHUNK_BYTES))
            // Threads of the compressor would make the bytes depend on the machine.
            .compression_threads(0)
            // With seeking, a crash leaves a chunk that claims to be 2^64 - 1 bytes long.
            .disable_seeking(true)
            .create(BufWriter::new(file))
            .map_err(at)?;
        writer
            .write_metadata(&Metadata { name: RUN.to_owned(), metadata: metadata::header_to_map(header) })
            .map_err(at)?;
        writer
            .attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: SCENARIO.to_owned(),
                media_type: "application/toml".to_owned(),
                data: Cow::Borrowed(scenario_toml.as_bytes()),
            })
            .map_err(at)?;
        let mut topics = messages::record_topics(header.blocks);
        topics.extend(events);
        let mut channels = BTreeMap::new();
        for Topic { topic, schema_name, schema } in topics {
            let schema_id = writer.add_schema(&schema_name, "jsonschema", schema.as_bytes()).map_err(at)?;
            let units =
                messages::units(&schema).into_iter().map(|(field, unit)| (format!("unit:{field}"), unit));
            let id = writer.add_channel(schema_id, &topic, "json", &units.collect()).map_err(at)?;
            channels.insert(topic, Channel { id, messages: 0 });
        }
        Ok(RunWriter {
            path: path.to_owned(),
            stands_at: partial,
            takes_place_of: None,
            existing,
            writer,
            channels,
            digests: Digests::default(),
            switches: 0,
            last_step: 0,
            header: header.clone(),
            synced: Instant::now(),
            payload: Vec::new(),
        })
    }

    /// Writes the next record.
    ///
    /// # Errors
    /// If the file cannot be written or a value is not finite.
    pub fn record(&mut self, record: &Record) -> Result<(), WriteError> {
        self.last_step = record.step();
        match record {
            Record::Step(record) => self.step(record),
            Record::Fields(record) => self.message(FIELDS, record.step, record),
            Record::Window(record) => self.message(WINDOW, record.step, record),
        }
    }

    /// Writes from where the run can go on, and sees to it that it is on the disk.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<(), WriteError> {
        let attachment = Attachment {
            log_time: self.header.time_grid().time_ns(checkpoint.step),
            create_time: 0,
            name: CHECKPOINT.to_owned(),
            media_type: "application/json".to_owned(),
            data: Cow::Borrowed(checkpoint.state.as_bytes()),
        };
        self.writer.attach(&attachment).map_err(|error| self.at(error))?;
        self.sync()?;
        if let Some(unfinished) = self.takes_place_of.take() {
            let partial = unfinished.partial_path();
            fs::rename(&self.stands_at, &partial)
                .map_err(|error| WriteError::Io { path: self.stands_at.clone(), error })?;
            self.stands_at = partial;
        }
        Ok(())
    }

    /// Writes the next event, at the time of the last record.
    ///
    /// # Errors
    /// If the file cannot be written or the event's topic was not announced.
    pub fn event(&mut self, event: &Event) -> Result<(), WriteError> {
        self.payload.clear();
        self.payload.extend_from_slice(event.payload.as_bytes());
        self.put(&event.topic, self.last_step)
    }

    fn step(&mut self, record: &StepRecord) -> Result<(), WriteError> {
        self.message(STEP, record.step, &StepMessage::new(record))?;
        for switch in &record.switches {
            self.switches += 1;
            self.message(SWITCH, record.step, &SwitchMessage::new(record, switch))?;
        }
        Ok(())
    }

    fn message(
        &mut self,
        topic: &'static str,
        step: u64,
        message: &impl Serialize,
    ) -> Result<(), WriteError> {
        self.payload.clear();
        serde_json::to_writer(&mut self.payload, message)
            .expect("records are plain structs of numbers, which JSON can always hold");
        // JSON has no word for what is not finite, and the library writes null.
        if self.payload.windows(4).any(|word| word == b"null") {
            return Err(WriteError::NotFinite { topic, step });
        }
        self.put(topic, step)
    }

    fn put(&mut self, topic: &str, step: u64) -> Result<(), WriteError> {
        let channel =
            self.channels.get_mut(topic).ok_or_else(|| WriteError::UnknownTopic(topic.to_owned()))?;
        let time_ns = self.header.time_grid().time_ns(step);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages as u32,
            log_time: time_ns,
            publish_time: time_ns,
        };
        channel.messages += 1;
        self.digests.add(topic, &self.payload);
        self.writer.write_to_known_channel(&header, &self.payload).map_err(|error| self.at(error))?;
        if self.synced.elapsed() >= SYNC_INTERVAL {
            self.sync()?;
        }
        Ok(())
    }

    /// Says what is missing, before anything else that was salvaged.
    pub(crate) fn salvaged(&mut self, salvaged: &Salvaged) -> Result<(), WriteError> {
        let metadata = Metadata { name: SALVAGE.to_owned(), metadata: metadata::salvaged_to_map(salvaged) };
        self.writer.write_metadata(&metadata).map_err(|error| self.at(error))
    }

    /// Writes a message as it was, with its number and time.
    pub(crate) fn salvaged_message(
        &mut self,
        topic: &str,
        sequence: u32,
        time_ns: u64,
        step: Option<u64>,
        payload: &[u8],
    ) -> Result<(), WriteError> {
        let channel =
            self.channels.get_mut(topic).ok_or_else(|| WriteError::UnknownTopic(topic.to_owned()))?;
        let header =
            MessageHeader { channel_id: channel.id, sequence, log_time: time_ns, publish_time: time_ns };
        channel.messages += 1;
        self.switches += u64::from(topic == SWITCH);
        self.last_step = step.unwrap_or(self.last_step);
        self.digests.add(topic, payload);
        self.writer.write_to_known_channel(&header, payload).map_err(|error| self.at(error))
    }

    /// Writes a checkpoint as it was.
    pub(crate) fn salvaged_checkpoint(&mut self, state: &str) -> Result<(), WriteError> {
        self.checkpoint(&Checkpoint { step: self.last_step, state: state.to_owned() })
    }

    fn sync(&mut self) -> Result<(), WriteError> {
        self.writer.flush().map_err(|error| self.at(error))?;
        let file = File::open(&self.stands_at).and_then(|file| file.sync_data());
        file.map_err(|error| WriteError::Io { path: self.stands_at.clone(), error })?;
        self.synced = Instant::now();
        Ok(())
    }

    /// Closes the log, with how the run ended and what its solver's work was made of. That
    /// of a run that took all its steps gets its final name; that of one that was interrupted
    /// stays under its [`partial_path`].
    ///
    /// # Errors
    /// If the file cannot be written or renamed, or the name was taken meanwhile.
    pub fn finish(mut self, status: RunStatus, solver: SolverReport) -> Result<RunEnd, WriteError> {
        let (digest, topic_digests) = self.digests.finish(self.channels.keys());
        let end = RunEnd {
            status,
            last_step: self.last_step,
            message_counts: self
                .channels
                .iter()
                .map(|(topic, channel)| (topic.clone(), channel.messages))
                .collect(),
            switches: self.switches,
            digest,
            topic_digests,
            solver,
        };
        let metadata = Metadata { name: RUN_END.to_owned(), metadata: metadata::end_to_map(&end) };
        self.writer.write_metadata(&metadata).map_err(|error| self.at(error))?;
        self.writer.finish().map_err(|error| self.at(error))?;
        let partial = self.stands_at.clone();
        let io_error = |error| WriteError::Io { path: partial.clone(), error };
        let path = self.path.clone();
        let file = self.writer.into_inner().into_inner().map_err(|error| io_error(error.into_error()))?;
        file.sync_all().map_err(io_error)?;
        if status == RunStatus::Interrupted {
            if self.takes_place_of.is_some() {
                // It holds less than the one that it was to replace.
                fs::remove_file(&partial).map_err(io_error)?;
            }
            return Ok(end);
        }
        if self.existing == Existing::Refuse && path.exists() {
            return Err(WriteError::Exists(path));
        }
        fs::rename(&partial, &path).map_err(io_error)?;
        sync_folder(&path).map_err(io_error)?;
        if let Some(unfinished) = self.takes_place_of {
            fs::remove_file(unfinished.partial_path()).map_err(io_error)?;
        }
        Ok(end)
    }

    /// Removes what there is of a log that will not go on and holds no step: nobody can go on
    /// with it, and it would stand in the way of the next run.
    pub fn discard_if_empty(&mut self) {
        if self.channels.get(STEP).is_some_and(|channel| channel.messages == 0) {
            // If it cannot be removed, the problem that led here is the one to tell.
            fs::remove_file(&self.stands_at).ok();
        }
    }

    fn at(&self, error: mcap::McapError) -> WriteError {
        WriteError::of_mcap(&self.stands_at, error)
    }
}
