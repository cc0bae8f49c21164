//! Writes a run log.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Seek};
use std::path::Path;
use std::time::{Duration, Instant};

use asperity_files::{Existing, UntilRefused};
use asperity_record::bounds::check_toml;
use asperity_record::{
    BulkRecord, Checkpoint, Energy, Event, EventKind, Record, RunEnd, RunHeader, RunStatus, SolverReport,
    StepRecord,
};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use serde::Serialize;

use crate::digest::Digests;
use crate::findings::Salvaged;
use crate::format::{
    BYTES, CHECKPOINT, CHUNK_BYTES, FIELDS, INPUTS, LIBRARY, LONGEST_CHECKPOINT_BYTES,
    LONGEST_METADATA_BYTES, PROFILE, RECORD_HEAD_BYTES, RECORDING, RUN, RUN_END, SALVAGE, SCENARIO, SIGNAL,
    STEP, SWITCH, TRACES, WINDOW,
};
use crate::messages::{self, StepMessage, SwitchMessage, Topic};
use crate::metadata;
use crate::problem::WriteError;
use crate::salvage::Kept;
use crate::unfinished::{Place, Unfinished};

/// Work that a crash of the machine may lose.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// What most of a log is, by which it is compressed: the levels of zstd.
#[derive(Debug, Clone, Copy)]
pub enum Content {
    /// Steps, switches and events. For digits and repeated keys, higher levels are slower and give longer logs, and lower
    /// ones give logs longer by a quarter or more.
    Text = 1,
    /// States. They have little that repeats: with less than a third of the search for it, logs are 4 to 6 % longer.
    States = -7,
}

/// Writes one run log. If dropped before [`RunWriter::finish`], it leaves a file without `run_end`
/// under the temporary name, recognisable as unfinished.
pub struct RunWriter {
    writer: Writer<BufWriter<UntilRefused<File>>>,
    /// After the writer, which writes when it is dropped, since this unlocks the file.
    place: Place,
    /// Uncompressed bytes in the current chunk.
    chunk_bytes: u64,
    channels: BTreeMap<String, Channel>,
    digests: Digests,
    switches: u64,
    last_step: u64,
    /// The step of the last record of any kind.
    record_step: u64,
    /// Energies of the last step.
    energy: Option<Energy>,
    header: RunHeader,
    synced: Instant,
    payload: Vec<u8>,
}

struct Channel {
    id: u16,
    messages: u64,
}

impl RunWriter {
    /// Starts the log of a run with its header and scenario. An existing log at `path` is replaced
    /// only if requested, and only once the new one is whole.
    ///
    /// # Errors
    /// If `path` exists and must not be replaced, or the temporary file cannot be written, because
    /// another process writes it or its name belongs to something other than a log.
    pub fn create(
        path: &Path,
        existing: Existing,
        header: &RunHeader,
        scenario_toml: &str,
        events: &[EventKind],
        content: Content,
    ) -> Result<RunWriter, WriteError> {
        let events = events.iter().map(Topic::of);
        RunWriter::start(Place::of_run(path, existing)?, header, scenario_toml, events, content)
    }

    /// Starts the log of a resumed run. The unfinished log stays until this one has its first
    /// checkpoint, and so contains as much.
    ///
    /// # Errors
    /// As [`RunWriter::create`].
    pub fn resume(
        unfinished: Unfinished,
        existing: Existing,
        header: &RunHeader,
        scenario_toml: &str,
        events: &[EventKind],
        content: Content,
    ) -> Result<RunWriter, WriteError> {
        let events = events.iter().map(Topic::of);
        RunWriter::start(Place::resuming(unfinished, existing)?, header, scenario_toml, events, content)
    }

    pub(crate) fn start(
        place: Place,
        header: &RunHeader,
        scenario_toml: &str,
        events: impl Iterator<Item = Topic>,
        content: Content,
    ) -> Result<RunWriter, WriteError> {
        check_toml(scenario_toml).map_err(|error| WriteError::TooLong(SCENARIO, error.to_string()))?;
        let file = BufWriter::new(UntilRefused::new(place.writer()?));
        let at = |error| WriteError::of_mcap(place.path(), error);
        let mut writer = WriteOptions::new()
            .profile(PROFILE)
            .library([LIBRARY, env!("CARGO_PKG_VERSION")].concat())
            .compression(Some(Compression::Zstd))
            // The library passes it on as the signed number that it is.
            .compression_level(content as i32 as u32)
            // Chunks end between steps, which the library cannot know.
            .chunk_size(None)
            // With threads, the compressed bytes would depend on the machine.
            .compression_threads(0)
            // With seeking, a crash would leave a chunk with a length of 2^64 - 1 bytes.
            .disable_seeking(true)
            .create(file)
            .map_err(at)?;
        writer.write_metadata(&metadata(RUN, metadata::header_to_map(header))?).map_err(at)?;
        writer
            .attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: if header.sensors.is_some() { RECORDING } else { SCENARIO }.to_owned(),
                media_type: "application/toml".to_owned(),
                data: Cow::Borrowed(scenario_toml.as_bytes()),
            })
            .map_err(at)?;
        writer.flush().map_err(at)?;
        let mut chunk_bytes = 0;
        let mut topics = messages::record_topics(header);
        topics.extend(events);
        let mut channels = BTreeMap::new();
        for topic in &topics {
            let Topic { topic, schema_name, encodings: [encoding, of_schema], schema, units } = topic;
            let schema_id = writer.add_schema(schema_name, of_schema, schema).map_err(at)?;
            let id = writer.add_channel(schema_id, topic, encoding, units).map_err(at)?;
            chunk_bytes += schema.len() as u64;
            channels.insert(topic.clone(), Channel { id, messages: 0 });
        }
        Ok(RunWriter {
            place,
            writer,
            chunk_bytes,
            channels,
            digests: Digests::default(),
            switches: 0,
            last_step: 0,
            record_step: 0,
            energy: None,
            header: header.clone(),
            synced: Instant::now(),
            payload: Vec::new(),
        })
    }

    /// Writes which files a recording was read from: length and hash of each, by its path.
    ///
    /// # Errors
    /// If the file cannot be written, or there are too many.
    pub fn inputs(&mut self, inputs: BTreeMap<String, String>) -> Result<(), WriteError> {
        let metadata = metadata(INPUTS, inputs)?;
        self.close_chunk()?;
        self.writer.write_metadata(&metadata).map_err(|error| self.at(error))
    }

    /// Writes the next record.
    ///
    /// # Errors
    /// If the file cannot be written or a value is not finite.
    pub fn record(&mut self, record: &Record) -> Result<(), WriteError> {
        self.record_step = record.step();
        match record {
            Record::Step(record) => {
                self.last_step = record.step;
                self.energy = Some(record.energy);
                self.step(record)
            }
            Record::Fields(record) => self.bulk(FIELDS, record.step, &**record),
            Record::Window(record) => self.bulk(WINDOW, record.step, record),
            Record::Row(row) => self.event(&row.values),
            Record::Signal(record) => self.bulk(SIGNAL, record.step, record),
            Record::Traces(record) => self.bulk(TRACES, record.step, record),
        }
    }

    /// Writes a checkpoint, and syncs the log to disk. Leaves out one that is longer than readers accept, as of a body
    /// of half a million nodes: such a run starts again from its beginning.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<(), WriteError> {
        if checkpoint.state.len() > LONGEST_CHECKPOINT_BYTES {
            return Ok(());
        }
        let attachment = Attachment {
            log_time: self.header.time_grid().time_ns(checkpoint.step),
            create_time: 0,
            name: CHECKPOINT.to_owned(),
            media_type: "application/json".to_owned(),
            data: Cow::Borrowed(checkpoint.state.as_bytes()),
        };
        self.close_chunk()?;
        self.writer.attach(&attachment).map_err(|error| self.at(error))?;
        self.flush()?;
        self.sync()?;
        self.place.has_caught_up()
    }

    /// Writes the next event or row, at the time of the last record.
    ///
    /// # Errors
    /// If the file cannot be written or the event's topic was not announced.
    pub fn event(&mut self, event: &Event) -> Result<(), WriteError> {
        self.payload.clear();
        event.write_json(&mut self.payload);
        self.put(event.topic(), None, self.header.time_grid().time_ns(self.record_step))
    }

    fn step(&mut self, record: &StepRecord) -> Result<(), WriteError> {
        self.message(STEP, record.step, &StepMessage::new(record))?;
        for switch in &record.switches {
            self.switches += 1;
            self.message(SWITCH, record.step, &SwitchMessage::new(record, switch))?;
        }
        Ok(())
    }

    fn bulk(&mut self, topic: &'static str, step: u64, record: &impl BulkRecord) -> Result<(), WriteError> {
        if record.not_finite().is_some() {
            return Err(WriteError::NotFinite { topic, step });
        }
        self.payload = record.to_message();
        self.put(topic, None, self.header.time_grid().time_ns(step))
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
        // The library writes null for numbers that are not finite, which JSON cannot represent.
        if str::from_utf8(&self.payload).expect("JSON is UTF-8").contains("null") {
            return Err(WriteError::NotFinite { topic, step });
        }
        self.put(topic, None, self.header.time_grid().time_ns(step))
    }

    /// Writes the payload as the next message of a topic, with its number among them unless another one is given.
    fn put(&mut self, topic: &str, number: Option<u32>, time_ns: u64) -> Result<(), WriteError> {
        self.make_room(topic)?;
        let channel =
            self.channels.get_mut(topic).ok_or_else(|| WriteError::UnknownTopic(topic.to_owned()))?;
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: number.unwrap_or(channel.messages as u32),
            log_time: time_ns,
            publish_time: time_ns,
        };
        channel.messages += 1;
        self.digests.add(topic, &self.payload);
        self.chunk_bytes += message_bytes(&self.payload);
        self.writer.write_to_known_channel(&header, &self.payload).map_err(|error| self.at(error))
    }

    /// Closes the chunk before a message if it is full or has been open for long. A step and its
    /// switches stay in one chunk, so that a lost chunk does not affect steps in others.
    fn make_room(&mut self, topic: &str) -> Result<(), WriteError> {
        if topic == SWITCH {
            return Ok(());
        }
        if self.synced.elapsed() >= SYNC_INTERVAL {
            self.close_chunk()?;
            return self.sync();
        }
        if self.chunk_bytes >= CHUNK_BYTES { self.close_chunk() } else { Ok(()) }
    }

    /// Closes the chunk, unless it is empty.
    fn close_chunk(&mut self) -> Result<(), WriteError> {
        if std::mem::take(&mut self.chunk_bytes) == 0 { Ok(()) } else { self.flush() }
    }

    /// Ends the chunk, and passes all bytes to the file.
    fn flush(&mut self) -> Result<(), WriteError> {
        self.writer.flush().map_err(|error| self.at(error))
    }

    /// Writes what is missing, before all salvaged messages.
    pub(crate) fn salvaged(&mut self, salvaged: &Salvaged) -> Result<(), WriteError> {
        let metadata = metadata(SALVAGE, metadata::salvaged_to_map(salvaged))?;
        self.close_chunk()?;
        self.writer.write_metadata(&metadata).map_err(|error| self.at(error))
    }

    /// Writes what is kept of a damaged log. Messages keep their numbers and times.
    pub(crate) fn keep(&mut self, kept: Kept<'_>) -> Result<(), WriteError> {
        match kept {
            Kept::Checkpoint(state) => self.checkpoint(&Checkpoint { step: self.last_step, state }),
            Kept::Message { topic, head, step, payload } => {
                self.payload = payload;
                self.switches += u64::from(topic == SWITCH);
                self.last_step = step.unwrap_or(self.last_step);
                self.put(topic, Some(head.sequence), head.log_time)
            }
        }
    }

    fn sync(&mut self) -> Result<(), WriteError> {
        self.place.sync()?;
        self.synced = Instant::now();
        Ok(())
    }

    /// Finishes the log with the run's status and the solver's counters. Renames the log of a
    /// complete run to its final name; leaves that of an interrupted run at its
    /// [`partial_path`](crate::partial_path).
    ///
    /// # Errors
    /// If the file cannot be written, the name was taken in the meantime, or the temporary name no
    /// longer belongs to this log.
    pub fn finish(self, status: RunStatus, solver: SolverReport) -> Result<RunEnd, WriteError> {
        self.finish_stopped(status, None, solver)
    }

    /// Finishes the log of a run that the solver may have stopped, with the reason. Such a run cannot be
    /// resumed, so the log gets its final name.
    ///
    /// # Errors
    /// As [`RunWriter::finish`].
    pub fn finish_stopped(
        mut self,
        status: RunStatus,
        stopped: Option<String>,
        solver: SolverReport,
    ) -> Result<RunEnd, WriteError> {
        let (digest, topic_digests) = self.digests.finish(self.channels.keys());
        let end = RunEnd {
            status,
            stopped,
            last_step: self.last_step,
            message_counts: self
                .channels
                .iter()
                .map(|(topic, channel)| (topic.clone(), channel.messages))
                .collect(),
            switches: self.switches,
            energy: self.energy,
            digest,
            topic_digests,
            solver,
        };
        self.flush()?;
        let bytes = self.place.writer()?.stream_position();
        let bytes = bytes.map_err(|error| WriteError::io(self.place.path(), error))?;
        let mut map = metadata::end_to_map(&end);
        map.insert(BYTES.to_owned(), bytes.to_string());
        let metadata = metadata(RUN_END, map)?;
        self.writer.write_metadata(&metadata).map_err(|error| self.at(error))?;
        self.writer.finish().map_err(|error| self.at(error))?;
        let place = self.place;
        let written = self.writer.into_inner().into_inner();
        written.map_err(|error| WriteError::io(place.path(), error.into_error()))?;
        if status == RunStatus::Interrupted { place.leave() } else { place.publish() }?;
        Ok(end)
    }

    /// Removes a log without any step after a failure: no run can resume from it, and it would block the
    /// next run.
    pub fn discard_if_empty(&mut self) {
        if self.channels.get(STEP).is_some_and(|channel| channel.messages == 0) {
            // If this fails, the original error is the one to report.
            self.place.discard().ok();
        }
    }

    /// Removes a log that will not be resumed.
    ///
    /// # Errors
    /// If its name was lost, or the system refuses.
    pub fn discard(&mut self) -> Result<(), WriteError> {
        self.place.discard()
    }

    fn at(&self, error: mcap::McapError) -> WriteError {
        WriteError::of_mcap(self.place.path(), error)
    }
}

/// A metadata record, if readers accept one of its length.
fn metadata(name: &'static str, metadata: BTreeMap<String, String>) -> Result<Metadata, WriteError> {
    // The lengths of the name and of all, and for each entry two.
    let entries: usize = metadata.iter().map(|(key, value)| 8 + key.len() + value.len()).sum();
    let problem = || format!("{entries} bytes of metadata (accepted: up to {LONGEST_METADATA_BYTES})");
    match 8 + name.len() + entries > LONGEST_METADATA_BYTES {
        true => Err(WriteError::TooLong(name, problem())),
        false => Ok(Metadata { name: name.to_owned(), metadata }),
    }
}

/// Bytes of a message in its chunk.
fn message_bytes(payload: &[u8]) -> u64 {
    // Head, channel, number and two times precede it.
    (RECORD_HEAD_BYTES + 2 + 4 + 8 + 8 + payload.len()) as u64
}
