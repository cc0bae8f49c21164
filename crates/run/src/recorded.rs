//! The log of a recording: its step records pass through the detectors as those of a run do.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::Path;

use asperity_record::{Event, EventKind, LoadDrop, Record, Row, RunEnd, RunHeader, RunStatus};
use asperity_record::{SolverReport, StepRecord};
use asperity_runlog::{Content, Existing, RunWriter, WriteError};

use crate::detectors::Settings;
use crate::header::{CODE_VERSION, run_id};
use crate::stream::{Given, Item, StreamError, run_in_turn};

/// A recording that has been read.
#[derive(Debug)]
pub struct Recorded {
    /// The header of its log, without code version and run id.
    pub header: RunHeader,
    /// Its description, as TOML.
    pub toml: String,
    /// Length and hash of its files, by their paths.
    pub inputs: BTreeMap<String, String>,
    /// Its step records, in order.
    pub records: Vec<StepRecord>,
    /// The noise of its channels, in order of the steps.
    pub noise: Vec<Row>,
    /// Its load drops, in order.
    pub drops: Vec<LoadDrop>,
}

impl Recorded {
    /// Writes the log.
    ///
    /// # Errors
    /// If it cannot be written, or exists and must not be replaced.
    pub fn write(self, path: &Path, existing: Existing) -> Result<RunEnd, WriteError> {
        let mut header = self.header;
        header.code_version = CODE_VERSION.to_owned();
        header.run_id = run_id(&header);
        let detectors = Settings::default().start(&header, None);
        let kinds: Vec<EventKind> = detectors.kinds().chain([EventKind::of::<LoadDrop>()]).collect();
        let mut writer = RunWriter::create(path, existing, &header, &self.toml, &kinds, Content::Text)?;
        writer.inputs(self.inputs)?;
        let time_grid = header.time_grid();
        let mut noise = self.noise.into_iter().peekable();
        let mut drops = self.drops.into_iter().peekable();
        let mut records = self.records.into_iter().peekable();
        // Noise stands at the beginning of its part, a load drop behind its end.
        let mut last = None;
        let source = || {
            let next = records.peek().map_or(u64::MAX, |record| record.step);
            if let Some(drop) =
                drops.next_if(|drop| last >= Some(time_grid.nearest_step(drop.end_s)) || next == u64::MAX)
            {
                return Ok::<_, Infallible>(Some(Given::Event(Event::new(drop))));
            }
            if let Some(noise) = noise.next_if(|noise| noise.step < next) {
                return Ok(Some(Given::Record(Record::Row(noise))));
            }
            last = Some(next);
            Ok(records.next().map(|record| Given::Record(Record::Step(record))))
        };
        let written = run_in_turn(source, detectors, |item| match item {
            Item::Record(record) => writer.record(&record),
            Item::Event(event) => writer.event(&event),
            Item::Checkpoint(_) => Ok(()),
        });
        match written {
            Ok(()) => {}
            Err(StreamError::Sink(error)) => {
                writer.discard()?;
                return Err(error);
            }
            Err(StreamError::Source(never)) => match never {},
            Err(StreamError::Thread(_)) => unreachable!("it runs on this thread"),
        }
        writer.finish(RunStatus::Complete, SolverReport::default())
    }
}
