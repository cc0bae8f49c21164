//! Writing a run log.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_record::{
    Checkpoint, Event, EventKind, Record, RunEnd, RunHeader, RunStatus, SolverReport, StepRecord,
};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use serde::Serialize;

use crate::messages::{self, FIELDS, STEP, SWITCH, StepMessage, SwitchMessage, Topic, WINDOW};
use crate::metadata::{self, RUN, RUN_END, SALVAGE};
use crate::salvage::Salvaged;

/// Uncompressed size at which a chunk is closed: large enough to compress well,
/// small enough that a damaged one costs little.
const CHUNK_BYTES: u64 = 1 << 20;

/// Name of the attachment that holds the resolved scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";

/// Name of the attachments that hold checkpoints.
pub(crate) const CHECKPOINT: &str = "checkpoint";

/// How much work a crash of the machine may cost.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// A run log that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The final name is taken; nothing was written.
    #[error("{} exists already", .0.display())]
    Exists(PathBuf),
    /// Another process writes this log.
    #[error("{} is being written by another process", .0.display())]
    Busy(PathBuf),
    /// The system refused.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The MCAP library refused.
    #[error("{}: {error}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// Why.
        error: mcap::McapError,
    },
    /// An event of a topic that no detector announced.
    #[error("an event of the topic {0}, which no detector announced")]
    UnknownTopic(String),
    /// A value that JSON cannot hold.
    #[error("a message of {topic} at step {step} holds a value that is not finite")]
    NotFinite {
        /// The topic.
        topic: &'static str,
        /// The step.
        step: u64,
    },
}

impl WriteError {
    fn of_mcap(path: &Path, error: mcap::McapError) -> WriteError {
        let path = path.to_owned();
        match error {
            // In the system's words, which say that the disk is full.
            mcap::McapError::Io(error) => WriteError::Io { path, error },
            error => WriteError::Mcap { path, error },
        }
    }
}

/// Where a log stands until it is whole.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().map(OsString::from).unwrap_or_default();
    name.push(".partial");
    path.with_file_name(name)
}

/// Where a run that is taken up again is written until it holds what the log of the
/// unfinished one holds.
fn resumed_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().map(OsString::from).unwrap_or_default();
    name.push(".resumed");
    path.with_file_name(name)
}

/// What to do with a log that stands where one is to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Keep it, and write nothing.
    Refuse,
    /// Replace it by the new one, once that is whole.
    Replace,
}

/// An unfinished log that no other process writes, for as long as this lives.
#[derive(Debug)]
pub struct Unfinished {
    path: PathBuf,
    file: File,
}

impl Unfinished {
    /// Takes hold of what stands for `path` until that is whole, if there is any of it.
    ///
    /// # Errors
    /// If another process writes it, or the system refuses.
    pub fn of(path: &Path) -> Result<Option<Unfinished>, WriteError> {
        let partial = partial_path(path);
        match File::options().read(true).write(true).open(&partial) {
            Ok(file) => Ok(Some(Unfinished { file: locked(file, &partial)?, path: path.to_owned() })),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(WriteError::Io { path: partial, error }),
        }
    }

    /// Where it is.
    pub fn partial_path(&self) -> PathBuf {
        partial_path(&self.path)
    }

    /// Gives it its final name, which only a whole one may have.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn publish(self) -> Result<(), WriteError> {
        let partial = self.partial_path();
        let outcome = self.file.sync_all().and_then(|()| fs::rename(&partial, &self.path));
        outcome.map_err(|error| WriteError::Io { path: partial, error })
    }
}

/// Locks a file that stands at `path`, until it is closed.
fn locked(file: File, path: &Path) -> Result<File, WriteError> {
    let io_error = |error| WriteError::Io { path: path.to_owned(), error };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => return Err(WriteError::Busy(path.to_owned())),
        // Some network file systems have no locks; there nobody keeps two processes apart.
        Err(TryLockError::Error(error)) if error.kind() != io::ErrorKind::Unsupported => {
            return Err(io_error(error));
        }
        _ => {}
    }
    // Whoever held the lock until now may have given the file another name.
    let ours = same_file::Handle::from_file(file.try_clone().map_err(io_error)?).map_err(io_error)?;
    match same_file::Handle::from_path(path) {
        Ok(here) if here == ours => Ok(file),
        _ => Err(WriteError::Busy(path.to_owned())),
    }
}

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
    digest: blake3::Hasher,
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
        RunWriter::start(path, partial_path(path), existing, header, scenario_toml, events)
    }

    /// Starts the log of a run that is taken up again where an unfinished one left off. That
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
        let path = unfinished.path.clone();
        let resumed = resumed_path(&path);
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
        events: &[EventKind],
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
            .profile("asperity")
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
        topics.extend(events.iter().map(|kind| Topic {
            topic: kind.topic.to_owned(),
            schema_name: kind.schema_name.clone(),
            schema: kind.schema.clone(),
        }));
        let mut channels = BTreeMap::new();
        for Topic { topic, schema_name, schema } in topics {
            let schema_id =
                writer.add_schema(&schema_name, "jsonschema", schema.to_string().as_bytes()).map_err(at)?;
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
            digest: blake3::Hasher::new(),
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

    /// Writes where the run can be taken up again, and sees to it that it is on the disk.
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
        digest_message(&mut self.digest, topic, &self.payload);
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
        digest_message(&mut self.digest, topic, payload);
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
        let end = RunEnd {
            status,
            last_step: self.last_step,
            message_counts: self
                .channels
                .iter()
                .map(|(topic, channel)| (topic.clone(), channel.messages))
                .collect(),
            switches: self.switches,
            digest: self.digest.finalize().to_hex().to_string(),
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

    fn at(&self, error: mcap::McapError) -> WriteError {
        WriteError::of_mcap(&self.stands_at, error)
    }
}

/// Sees to it that a new name outlives a crash of the machine.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

/// Elsewhere a folder cannot be opened as a file.
#[cfg(not(unix))]
fn sync_folder(_path: &Path) -> io::Result<()> {
    Ok(())
}

/// Adds a message to a run's digest. Lengths go first, so that no two sequences
/// of messages can be spelled with the same bytes.
pub(crate) fn digest_message(digest: &mut blake3::Hasher, topic: &str, payload: &[u8]) {
    digest.update(&(topic.len() as u64).to_le_bytes());
    digest.update(topic.as_bytes());
    digest.update(&(payload.len() as u64).to_le_bytes());
    digest.update(payload);
}
