//! What is compared of run logs beside their slip events: their ruptures, and the numbers of their
//! summaries. Of a table of events there is neither.

use std::convert::Infallible;
use std::path::Path;

use asperity_diff::policy::Spread;
use asperity_diff::report::{NumberChange, RuptureDiff};
use asperity_diff::rupture;
use asperity_diff::tally::{self, Comparison, Draft};
use asperity_record::{EventPayload, RunHeader, Rupture, SlipEvent};
use asperity_runlog::{LogItem, RunReader, Topics};
use serde_json::Value;

use crate::error::CompareError;
use crate::table::TableError;

/// What the caller can tell of a run log that it takes more than its events to know.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Told {
    /// The numbers of its summary, in order: key and value.
    pub summary: Vec<(String, Value)>,
    /// Its ruptures, if they were found in its step records because it contains none.
    pub ruptures: Option<Vec<Rupture>>,
}

/// What a run log says beside its slip events.
pub(crate) struct Physics {
    summary: Vec<(String, Value)>,
    /// How long the run is, s.
    pub(crate) duration_s: f64,
    /// How many slip events it has.
    pub(crate) slip_events: u64,
    /// Whether its ruptures are not those of the log.
    found_anew: bool,
    /// Its ruptures as rows, in the order of their onsets, or why it has none.
    pub(crate) ruptures: Result<Vec<SlipEvent>, String>,
}

impl Physics {
    /// Reads the log of a run.
    pub(crate) fn read(path: &Path, header: &RunHeader, tell: Option<Tell>) -> Result<Physics, CompareError> {
        let untold = |problem| CompareError::Told { path: path.to_owned(), problem };
        let told = tell.map_or(Ok(Told::default()), |tell| tell(path)).map_err(untold)?;
        let mut reader = RunReader::open(path, Topics::EVENTS).map_err(TableError::Log)?;
        let mut slip_events = 0;
        let mut rows = Vec::new();
        while let Some(item) = reader.next_item().map_err(TableError::Log)? {
            let LogItem::Event(event) = item else { continue };
            slip_events += u64::from(event.topic() == SlipEvent::TOPIC);
            rows.extend(event.get::<Rupture>().map(rupture::row));
        }
        let has_ruptures = reader.event_topics().any(|topic| topic == Rupture::TOPIC);
        let why = || {
            format!(
                "{} has none (accepted: a log with the topic {}; this one is of version {} of the records)",
                path.display(),
                Rupture::TOPIC,
                header.record_schema_version
            )
        };
        let mut ruptures = match (has_ruptures, told.ruptures) {
            (true, _) => Ok(rows),
            (false, Some(found)) => Ok(found.iter().map(rupture::row).collect()),
            (false, None) => Err(why()),
        };
        ruptures.iter_mut().for_each(|rows| rupture::sort(rows));
        Ok(Physics {
            duration_s: header.time_grid().time_s(header.steps),
            slip_events,
            found_anew: !has_ruptures,
            ruptures,
            summary: told.summary,
        })
    }

    /// How many ruptures there are.
    pub(crate) fn ruptures(&self) -> u64 {
        self.ruptures.as_ref().map_or(0, |rows| rows.len() as u64)
    }

    /// The number of events, and the time that they are spread over.
    pub(crate) fn spread(&self, events: impl Fn(&Physics) -> u64) -> Spread {
        Spread { events: events(self), duration_s: self.duration_s }
    }
}

/// How the caller tells it, by the path of the log; or why it cannot.
pub type Tell = fn(&Path) -> Result<Told, String>;

/// Compares the numbers of two summaries, key by key, in the order of the old one.
pub(crate) fn compare_summaries(old: &Physics, new: &Physics) -> Vec<NumberChange> {
    let numbers = old.summary.iter().filter_map(|(key, old)| {
        let (_, new) = new.summary.iter().find(|(other, _)| other == key)?;
        Some(NumberChange::between(key, old, new))
    });
    numbers.collect()
}

/// Compares the ruptures of two runs, or says why it cannot be done.
pub(crate) fn compare_ruptures(
    comparison: Comparison<'_>,
    old: Physics,
    new: Physics,
) -> Result<RuptureDiff, String> {
    let found_anew = old.found_anew || new.found_anew;
    let (old, new) = (old.ruptures?, new.ruptures?);
    let [old, new] = [old, new].map(|rows| rows.into_iter().map(Ok::<_, Infallible>));
    // Tolerances for slip events do not apply to ruptures. There are few ruptures, so all findings
    // are kept, to list the largest first.
    let comparison = Comparison { keep_findings: usize::MAX, ..comparison };
    let compared = tally::compare(comparison, old, new, &mut Draft::default(), |_| Ok(()));
    compared
        .map(|run| RuptureDiff::of(run, found_anew))
        .map_err(|error| format!("they cannot be told apart: {error}"))
}
