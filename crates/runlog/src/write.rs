//! Writing a run log.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_record::{Event, EventKind, Record, RunEnd, RunHeader, RunStatus, SolverReport, StepRecord};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use serde::Serialize;

use crate::messages::{self, FIELDS, STEP, SWITCH, StepMessage, SwitchMessage, Topic, WINDOW};
use crate::metadata::{self, RUN, RUN_END};

/// Uncompressed size at which a chunk is closed: large enough to compress well,
/// small enough that a damaged one costs little.
const CHUNK_BYTES: u64 = 1 << 20;

/// How much work a crash of the machine may cost.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// A run log that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The final name is taken; nothing was written.
    #[error("{} exists already", .0.display())]
    Exists(PathBuf),
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

/// Where a log stands until it is whole.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().map(OsString::from).unwrap_or_default();
    name.push(".partial");
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

/// Writes one run log. Dropped before [`RunWriter::finish`], it leaves a file
/// under the temporary name without `run_end`, which says that it is not whole.
pub struct RunWriter {
    path: PathBuf,
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
        if existing == Existing::Refuse && path.exists() {
            return Err(WriteError::Exists(path.to_owned()));
        }
        let partial = partial_path(path);
        let file = File::create(&partial).map_err(|error| WriteError::Io { path: partial.clone(), error })?;
        let at = |error| WriteError::Mcap { path: partial.clone(), error };
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
                name: "scenario.toml".to_owned(),
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

    fn sync(&mut self) -> Result<(), WriteError> {
        let partial = partial_path(&self.path);
        self.writer.flush().map_err(|error| WriteError::Mcap { path: partial.clone(), error })?;
        let file = File::open(&partial).map_err(|error| WriteError::Io { path: partial.clone(), error })?;
        file.sync_data().map_err(|error| WriteError::Io { path: partial, error })?;
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
        let partial = partial_path(&self.path);
        let io_error = |error| WriteError::Io { path: partial.clone(), error };
        let path = self.path.clone();
        let file = self.writer.into_inner().into_inner().map_err(|error| io_error(error.into_error()))?;
        file.sync_all().map_err(io_error)?;
        if status == RunStatus::Interrupted {
            return Ok(end);
        }
        if self.existing == Existing::Refuse && path.exists() {
            return Err(WriteError::Exists(path));
        }
        fs::rename(&partial, &path).map_err(io_error)?;
        Ok(end)
    }

    fn at(&self, error: mcap::McapError) -> WriteError {
        WriteError::Mcap { path: partial_path(&self.path), error }
    }
}

/// Adds a message to a run's digest. Lengths go first, so that no two sequences
/// of messages can be spelled with the same bytes.
pub(crate) fn digest_message(digest: &mut blake3::Hasher, topic: &str, payload: &[u8]) {
    digest.update(&(topic.len() as u64).to_le_bytes());
    digest.update(topic.as_bytes());
    digest.update(&(payload.len() as u64).to_le_bytes());
    digest.update(payload);
}
