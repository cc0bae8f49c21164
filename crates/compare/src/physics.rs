//! What run logs say of ruptures and of the numbers of their summaries. Tables of events do not.

use std::convert::Infallible;

use asperity_diff::policy::Spread;
use asperity_diff::report::RuptureDiff;
use asperity_diff::rupture;
use asperity_diff::tally::{self, Comparison, Draft};
use asperity_record::{EventPayload, Rupture, SlipEvent};
use asperity_runlog::{LogItem, RunReader, Topics};

use crate::sides::Run;
use crate::table::TableError;

/// What a run log says beside its slip events.
pub(crate) struct Physics {
    /// How long the run is, s.
    pub(crate) duration_s: f64,
    /// How many slip events it has.
    pub(crate) slip_events: u64,
    /// Its ruptures as rows, in the order of their onsets, or why it has none.
    pub(crate) ruptures: Result<Vec<SlipEvent>, String>,
}

impl Physics {
    /// Reads the log of a run; none where it is a table.
    pub(crate) fn read(run: &Run) -> Result<Option<Physics>, TableError> {
        let Some(provenance) = &run.provenance else { return Ok(None) };
        let header = &provenance.header;
        let mut reader = RunReader::open(&run.path, Topics::EVENTS)?;
        let mut slip_events = 0;
        let mut rows = Vec::new();
        while let Some(item) = reader.next_item()? {
            let LogItem::Event(event) = item else { continue };
            slip_events += u64::from(event.topic == SlipEvent::TOPIC);
            if let Some(rupture) = event.decode::<Rupture>() {
                let unreadable =
                    |error| TableError::Event { path: run.path.clone(), topic: event.topic.clone(), error };
                rows.push(rupture::row(&rupture.map_err(unreadable)?));
            }
        }
        rupture::sort(&mut rows);
        let has_ruptures = reader.event_topics().any(|topic| topic == Rupture::TOPIC);
        let why = || {
            format!(
                "{} has none: it is of version {} of the records, from before there were any",
                run.path.display(),
                header.record_schema_version
            )
        };
        Ok(Some(Physics {
            duration_s: header.time_grid().time_s(header.steps),
            slip_events,
            ruptures: if has_ruptures { Ok(rows) } else { Err(why()) },
        }))
    }

    /// How many ruptures there are.
    pub(crate) fn ruptures(&self) -> u64 {
        self.ruptures.as_ref().map_or(0, |rows| rows.len() as u64)
    }

    /// Over which time so many events are spread.
    pub(crate) fn spread(&self, events: impl Fn(&Physics) -> u64) -> Spread {
        Spread { events: events(self), duration_s: self.duration_s }
    }
}

/// Compares the ruptures of two runs, or says why it cannot be done.
pub(crate) fn compare_ruptures(
    comparison: Comparison<'_>,
    old: Physics,
    new: Physics,
) -> Result<RuptureDiff, String> {
    let (old, new) = (old.ruptures?, new.ruptures?);
    let [old, new] = [old, new].map(|rows| rows.into_iter().map(Ok::<_, Infallible>));
    // What ruptures need of a policy is not what its tolerances for slip events are drafted from.
    // Few as they are, all findings are kept, so that the largest can be told first.
    let comparison = Comparison { keep_findings: usize::MAX, ..comparison };
    let compared = tally::compare(comparison, old, new, &mut Draft::default(), |_| Ok(()));
    compared.map(RuptureDiff::from).map_err(|error| format!("ruptures cannot be told apart: {error}"))
}
