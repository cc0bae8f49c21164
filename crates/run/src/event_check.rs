//! Compares the events in a log with the events that detectors find now.
//!
//! A log may have been written with other detectors, more of them or fewer. The topics of both are
//! compared, and topics of only one are listed. Fields that a later log version added or redefined
//! are ignored in older logs.

use std::collections::{BTreeSet, VecDeque};
use std::fmt;

use asperity_detect::Detectors;
use asperity_record::{Event, EventPayload, RunHeader, Rupture};
use serde_json::{Map, Value};

/// Fields of events by the log version that added or redefined them.
const SINCE: [(u32, &str, &[&str]); 1] =
    [(6, Rupture::TOPIC, &["moment_n_m", "anchor_change_j", "elastic_change_j"])];

/// Most bytes that one side may be ahead of the other; far more than records and events are ever
/// apart in the log of a run.
const MOST_AHEAD_BYTES: usize = 64 << 20;

/// Topics of events of only one side: the log, or the present detectors.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct OtherDetectors {
    /// Topics in the log that no present detector emits.
    pub only_logged: Vec<String>,
    /// Topics of the present detectors that the log lacks.
    pub only_found: Vec<String>,
}

impl OtherDetectors {
    /// Whether the log has no topic for an event of the present detectors.
    pub(crate) fn is_lacking(&self, event: &Event) -> bool {
        self.only_found.iter().any(|topic| topic == event.topic())
    }

    /// Whether there are none: the log was written with the present detectors.
    pub fn is_none(&self) -> bool {
        self.only_logged.is_empty() && self.only_found.is_empty()
    }
}

impl fmt::Display for OtherDetectors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("by other detectors")?;
        let parts = [("also has", &self.only_logged), ("lacks", &self.only_found)];
        let parts = parts.iter().filter(|(_, topics)| !topics.is_empty());
        for (number, (what, topics)) in parts.enumerate() {
            let before = if number == 0 { ": it " } else { " and " };
            write!(f, "{before}{what} {}", topics.join(", "))?;
        }
        Ok(())
    }
}

/// Logged and found events that have not been compared yet.
#[derive(Debug, Default)]
pub(crate) struct EventCheck {
    /// Topics of the present detectors.
    emitted: BTreeSet<String>,
    /// Topics that the log announces.
    announced: BTreeSet<String>,
    /// The log's version of the record schema.
    version: u32,
    /// Size of both queues.
    bytes: usize,
    /// The first difference, once found.
    parted: Option<Difference>,
    logged: VecDeque<Event>,
    found: VecDeque<Event>,
    agreed: usize,
}

/// The first difference between logged and found events.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("other events from number {number} on\n  logged:   {logged}\n  found:    {found}")]
pub struct Difference {
    /// Number of equal events before.
    pub number: usize,
    /// The logged event.
    pub logged: String,
    /// The found event.
    pub found: String,
}

impl EventCheck {
    /// Starts the comparison for a log with that header, which announces these topics of events.
    pub(crate) fn with(
        detectors: &Detectors,
        header: &RunHeader,
        announced: impl Iterator<Item = String>,
    ) -> EventCheck {
        EventCheck {
            emitted: detectors.kinds().map(|kind| kind.topic.to_owned()).collect(),
            announced: announced.collect(),
            version: header.record_schema_version,
            ..EventCheck::default()
        }
    }

    /// Removes the fields that the log's version lacks or defines otherwise.
    fn comparable(&self, event: Event) -> Event {
        let later = SINCE.iter().find(|(since, topic, _)| self.version < *since && event.topic() == *topic);
        let Some((_, topic, fields)) = later else { return event };
        let Ok(mut payload) = serde_json::from_str::<Map<String, Value>>(&event.json()) else { return event };
        payload.retain(|field, _| !fields.contains(&field.as_str()));
        Event::of_json(topic, &Value::Object(payload).to_string())
    }

    /// The topics of only one side.
    pub(crate) fn other_detectors(&self) -> OtherDetectors {
        let only = |of: &BTreeSet<String>, other: &BTreeSet<String>| of.difference(other).cloned().collect();
        OtherDetectors {
            only_logged: only(&self.announced, &self.emitted),
            only_found: only(&self.emitted, &self.announced),
        }
    }

    /// Adds an event of the log.
    pub(crate) fn logged(&mut self, event: Event) {
        if !self.emitted.contains(event.topic()) {
            return;
        }
        let event = self.comparable(event);
        self.keep(event.bytes(), |both| both.logged.push_back(event));
    }

    /// Adds an event that a detector found.
    pub(crate) fn found(&mut self, event: Event) {
        if !self.announced.contains(event.topic()) {
            return;
        }
        let event = self.comparable(event);
        self.keep(event.bytes(), |both| both.found.push_back(event));
    }

    /// Queues an event until its counterpart arrives. Nothing is queued after the first difference;
    /// too large a distance between the sides is a difference as well.
    fn keep(&mut self, bytes: usize, push: impl FnOnce(&mut EventCheck)) {
        if self.parted.is_some() {
            return;
        }
        self.bytes += bytes;
        push(self);
        if self.bytes > MOST_AHEAD_BYTES {
            self.let_go();
            if self.bytes > MOST_AHEAD_BYTES {
                self.part();
            }
        }
    }

    /// Drops pairs of equal events from the queues, and records the first difference.
    pub(crate) fn let_go(&mut self) {
        while let (Some(logged), Some(found)) = (self.logged.front(), self.found.front()) {
            if logged != found {
                self.part();
                break;
            }
            self.bytes -= logged.bytes() + found.bytes();
            self.logged.pop_front();
            self.found.pop_front();
            self.agreed += 1;
        }
    }

    /// Reports the first difference among the events that both sides have so far.
    pub(crate) fn compare(&mut self) -> Result<(), Difference> {
        self.let_go();
        self.parted.clone().map_or(Ok(()), Err)
    }

    /// Reports the first difference after the last event of both sides.
    pub(crate) fn finish(mut self) -> Result<(), Difference> {
        self.compare()?;
        if self.logged.is_empty() && self.found.is_empty() { Ok(()) } else { Err(self.difference()) }
    }

    fn part(&mut self) {
        self.parted = Some(self.difference());
        self.logged.clear();
        self.found.clear();
        self.bytes = 0;
    }

    fn difference(&self) -> Difference {
        let told = |event: Option<&Event>| event.map_or("nothing".to_owned(), |event| format!("{event:?}"));
        Difference { number: self.agreed, logged: told(self.logged.front()), found: told(self.found.front()) }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use asperity_record::Event;

    use super::{EventCheck, OtherDetectors};

    fn event(topic: &str, payload: &str) -> Event {
        Event::of_json(topic, payload)
    }

    fn topics(topics: &[&str]) -> BTreeSet<String> {
        topics.iter().map(|&topic| topic.to_owned()).collect()
    }

    fn between(emitted: &[&str], announced: &[&str]) -> EventCheck {
        let version = asperity_record::RECORD_SCHEMA_VERSION;
        EventCheck {
            emitted: topics(emitted),
            announced: topics(announced),
            version,
            ..EventCheck::default()
        }
    }

    /// An older log has no moment and another anchor change; the other fields must agree.
    #[test]
    fn what_a_later_version_says_is_not_compared_with_an_older_log() {
        let logged = r#"{"rupture":0,"anchor_change_j":1.0,"elastic_change_j":2.0,"drive_work_j":3.0}"#;
        let found = r#"{"rupture":0,"moment_n_m":5.0,"anchor_change_j":-1.0,"elastic_change_j":0.0,"drive_work_j":3.0}"#;
        let compare = |version: u32, found: &str| {
            let topic = "/events/rupture";
            let mut both = EventCheck { version, ..between(&[topic], &[topic]) };
            both.logged(event(topic, logged));
            both.found(event(topic, found));
            both.finish().is_ok()
        };
        assert!(compare(5, found) && !compare(6, found));
        assert!(!compare(5, &found.replace("3.0", "3.5")));
    }

    #[test]
    fn the_first_difference_is_told() {
        let compare = |logged: &[&str], found: &[&str]| {
            let mut both = between(&["/a"], &["/a"]);
            logged.iter().for_each(|payload| both.logged(event("/a", payload)));
            found.iter().for_each(|payload| both.found(event("/a", payload)));
            both.finish()
        };
        assert_eq!(compare(&["a", "b"], &["a", "b"]), Ok(()));
        for (logged, found) in
            [(&["a", "b"][..], &["a", "c"][..]), (&["a"], &["a", "b"]), (&["a", "b"], &["a"])]
        {
            assert_eq!(compare(logged, found).unwrap_err().number, 1);
        }
    }

    #[test]
    fn of_other_detectors_only_what_both_have_is_compared() {
        let mut both = between(&["/a", "/new"], &["/a", "/old"]);
        both.logged(event("/old", "1"));
        both.logged(event("/a", "2"));
        both.found(event("/new", "3"));
        both.found(event("/a", "2"));
        let other = both.other_detectors();
        let expected = OtherDetectors { only_logged: vec!["/old".into()], only_found: vec!["/new".into()] };
        assert_eq!(other, expected);
        assert_eq!(other.to_string(), "by other detectors: it also has /old and lacks /new");
        assert_eq!(both.finish(), Ok(()));
        assert!(between(&["/a"], &["/a"]).other_detectors().is_none());
    }

    /// A log of events only, which a chunk of a few bytes can decompress to, once filled the
    /// memory.
    #[test]
    fn events_without_steps_are_not_kept_for_ever() {
        let event = event("/a", &"x".repeat(1 << 20));
        let mut both = between(&["/a"], &["/a"]);
        let told = (0..100).find(|_| {
            both.logged(event.clone());
            both.compare().is_err()
        });
        assert_eq!(told, Some(63));
    }
}
