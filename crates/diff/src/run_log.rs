//! Data that a diff reads from a run log: header and scenario, slip events, ruptures, and the numbers of
//! its summary, all collected in one pass over the file.

use std::path::Path;

use asperity_numbers::{Summarizer, Summary};
use asperity_record::{Event, EventPayload, Observer, Record, RunEnd, RunHeader, Rupture, SlipEvent};
use asperity_runlog::{LogItem, RunReader, Topics};
use serde_json::Value;

use crate::policy::Spread;
use crate::provenance::Provenance;
use crate::table::TableError;

/// The contents of a run log that are compared.
#[derive(Debug, Clone)]
pub struct RunLog {
    /// Header and scenario.
    pub provenance: Provenance,
    /// The numbers of its summary, in order: key and value; none if nobody determined them.
    pub summary: Vec<(String, Value)>,
    /// Why summary or ruptures could not be determined; then it is not compared.
    pub problem: Option<String>,
    /// Whether it has a topic for ruptures.
    pub has_ruptures: bool,
    ruptures: Vec<Rupture>,
    slip_events: Vec<SlipEvent>,
    slip_event_count: u64,
    most_slip_events: usize,
}

impl RunLog {
    /// Begins with a log after its header and scenario have been read. If it has more slip events than
    /// `most_slip_events`, they are read again later, one at a time.
    pub fn begin(header: &RunHeader, scenario_toml: &str, most_slip_events: usize) -> RunLog {
        RunLog {
            provenance: Provenance { header: header.clone(), scenario_toml: scenario_toml.to_owned() },
            summary: Vec::new(),
            problem: None,
            has_ruptures: false,
            ruptures: Vec::new(),
            slip_events: Vec::new(),
            slip_event_count: 0,
            most_slip_events,
        }
    }

    /// Reads a log, without its summary.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(path: &Path, most_slip_events: usize) -> Result<RunLog, TableError> {
        let mut reader = RunReader::open(path, Topics::EVENTS)?;
        let mut log = RunLog::begin(reader.header(), reader.scenario_toml(), most_slip_events);
        while let Some(item) = reader.next_item()? {
            if let LogItem::Event(event) = item {
                log.event(&event);
            }
        }
        log.has_ruptures = reader.event_topics().any(|topic| topic == Rupture::TOPIC);
        Ok(log)
    }

    /// Its slip events, if all of them were kept.
    pub(crate) fn slip_events(&self) -> Option<&[SlipEvent]> {
        (self.slip_events.len() as u64 == self.slip_event_count).then_some(&self.slip_events)
    }

    /// Its ruptures, or the reason why there are none.
    pub(crate) fn ruptures(&self, path: &Path) -> Result<&[Rupture], String> {
        if self.has_ruptures {
            return Ok(&self.ruptures);
        }
        Err(format!("{} has none (accepted: a log with the topic {})", path.display(), Rupture::TOPIC))
    }

    /// The time span of its slip events.
    pub(crate) fn spread_of_slip_events(&self) -> Spread {
        self.spread(self.slip_event_count)
    }

    /// The time span of its ruptures.
    pub(crate) fn spread_of_ruptures(&self) -> Spread {
        self.spread(self.ruptures.len() as u64)
    }

    fn spread(&self, events: u64) -> Spread {
        Spread { events, duration_s: self.provenance.duration_s() }
    }
}

/// A log that is being read, and its summary.
pub struct Summarized {
    log: RunLog,
    /// Or why there is none: the comparison reports it.
    summarizer: Result<Summarizer, String>,
}

impl Summarized {
    /// Begins as [`RunLog::begin`]. `summarizer` may be the reason why there is none.
    pub fn begin(
        header: &RunHeader,
        scenario_toml: &str,
        summarizer: Result<Summarizer, String>,
        most_slip_events: usize,
    ) -> Summarized {
        Summarized { log: RunLog::begin(header, scenario_toml, most_slip_events), summarizer }
    }

    /// The log at this path, after its last event.
    pub fn finish(self, path: &Path, has_ruptures: bool, end: Option<&RunEnd>) -> RunLog {
        let Summarized { mut log, summarizer } = self;
        log.has_ruptures = has_ruptures;
        match summarizer {
            Ok(summarizer) => {
                let summary = summarizer.finish(has_ruptures, end);
                let keys = Summary::KEYS.iter().map(|key| key.column.name.to_string());
                // The name of the file is no number of the run.
                log.summary = keys.zip(summary.values()).filter(|(key, _)| key != "run").collect();
            }
            Err(problem) => log.problem = Some(format!("{}: {problem}", path.display())),
        }
        log
    }
}

impl Observer for Summarized {
    fn record(&mut self, record: &Record) {
        if let Ok(summarizer) = &mut self.summarizer {
            summarizer.record(record);
        }
    }

    fn event(&mut self, event: &Event) {
        self.log.event(event);
        if let Ok(summarizer) = &mut self.summarizer {
            summarizer.event(event);
        }
    }
}

impl Observer for RunLog {
    fn event(&mut self, event: &Event) {
        if let Some(slip) = event.get::<SlipEvent>() {
            self.slip_event_count += 1;
            if self.slip_events.len() < self.most_slip_events {
                self.slip_events.push(slip.clone());
            }
        } else if let Some(rupture) = event.get::<Rupture>() {
            self.ruptures.push(rupture.clone());
        }
    }
}
