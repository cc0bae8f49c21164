//! What a diff takes of a run log: header and scenario, slip events, ruptures, and the numbers of
//! its summary, all collected in one pass over the file.

use std::path::Path;

use asperity_record::{Event, EventPayload, Rupture, SlipEvent};
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
    /// Ruptures that were found in its step records because the log has no topic for them.
    pub found_anew: Option<Vec<Rupture>>,
    /// Whether the log has a topic for ruptures.
    pub has_ruptures: bool,
    ruptures: Vec<Rupture>,
    slip_events: Vec<SlipEvent>,
    slip_event_count: u64,
    most_slip_events: usize,
}

impl RunLog {
    /// Begins with a log that is open and of which nothing has been read. At most so many slip
    /// events are kept; of a log with more they are read again, one at a time.
    pub fn begin(reader: &RunReader, most_slip_events: usize) -> RunLog {
        RunLog {
            provenance: Provenance {
                header: reader.header().clone(),
                scenario_toml: reader.scenario_toml().to_owned(),
            },
            summary: Vec::new(),
            problem: None,
            found_anew: None,
            has_ruptures: false,
            ruptures: Vec::new(),
            slip_events: Vec::new(),
            slip_event_count: 0,
            most_slip_events,
        }
    }

    /// Adds an event of the log.
    ///
    /// # Errors
    /// If it does not match its topic.
    pub fn event(&mut self, event: &Event) -> Result<(), serde_json::Error> {
        if let Some(slip) = event.decode::<SlipEvent>() {
            self.slip_event_count += 1;
            if self.slip_events.len() < self.most_slip_events {
                self.slip_events.push(slip?);
            }
        } else if let Some(rupture) = event.decode::<Rupture>() {
            self.has_ruptures = true;
            self.ruptures.push(rupture?);
        }
        Ok(())
    }

    /// Reads a log, without its summary.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(path: &Path, most_slip_events: usize) -> Result<RunLog, TableError> {
        let mut reader = RunReader::open(path, Topics::EVENTS)?;
        let mut log = RunLog::begin(&reader, most_slip_events);
        while let Some(item) = reader.next_item()? {
            let LogItem::Event(event) = item else { continue };
            log.event(&event).map_err(|error| TableError::event(path, &event, error))?;
        }
        log.has_ruptures = reader.event_topics().any(|topic| topic == Rupture::TOPIC);
        Ok(log)
    }

    /// Its slip events, if all of them were kept.
    pub(crate) fn slip_events(&self) -> Option<&[SlipEvent]> {
        (self.slip_events.len() as u64 == self.slip_event_count).then_some(&self.slip_events)
    }

    /// Its ruptures, or why there are none.
    pub(crate) fn ruptures(&self, path: &Path) -> Result<&[Rupture], String> {
        match &self.found_anew {
            _ if self.has_ruptures => Ok(&self.ruptures),
            Some(found) => Ok(found),
            None => Err(format!(
                "{} has none (accepted: a log with the topic {}; this one is of version {} of the records)",
                path.display(),
                Rupture::TOPIC,
                self.provenance.header.record_schema_version
            )),
        }
    }

    /// Over which time its slip events are spread.
    pub(crate) fn spread_of_slip_events(&self) -> Spread {
        self.spread(self.slip_event_count)
    }

    /// Over which time its ruptures are spread.
    pub(crate) fn spread_of_ruptures(&self) -> Spread {
        let found = self.found_anew.as_ref().filter(|_| !self.has_ruptures).unwrap_or(&self.ruptures);
        self.spread(found.len() as u64)
    }

    fn spread(&self, events: u64) -> Spread {
        Spread { events, duration_s: self.provenance.duration_s() }
    }
}
