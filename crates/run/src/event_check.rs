//! Compares the events in a log with the events that detectors find now.
//!
//! A log may have been written with other detectors, more of them or fewer. The topics of both are
//! compared, each in its order, and topics of only one are listed. Columns that the schema in a log lacks are ignored.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;

use asperity_detect::Detectors;
use asperity_record::{Event, EventPayload, LoadDrop};
use serde_json::{Map, Value};

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
    /// By topic, the fields that are ignored, if any.
    ignored: BTreeMap<&'static str, BTreeSet<String>>,
    /// Size of all queues.
    bytes: usize,
    /// The first difference, once found.
    parted: Option<Difference>,
    /// Logged and found events by topic. Which follows which of another topic may depend on the code version.
    queues: BTreeMap<String, [VecDeque<Event>; 2]>,
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
    /// Starts the comparison for a log that announces these topics of events with these schemas.
    pub(crate) fn with(detectors: &Detectors, announced: &BTreeMap<&str, &str>) -> EventCheck {
        let mut ignored = BTreeMap::new();
        for kind in detectors.kinds() {
            let schema =
                announced.get(kind.topic).and_then(|schema| serde_json::from_str::<Value>(schema).ok());
            let Some(logged) = schema.as_ref().and_then(|schema| schema["properties"].as_object()) else {
                continue;
            };
            let names = kind.columns().into_iter().map(|column| column.name.to_string());
            let lacks: BTreeSet<String> = names.filter(|name| !logged.contains_key(name)).collect();
            ignored.extend((!lacks.is_empty()).then_some((kind.topic, lacks)));
        }
        EventCheck {
            emitted: detectors.kinds().map(|kind| kind.topic.to_owned()).collect(),
            // Found by the source itself, in samples that no log has.
            announced: announced
                .keys()
                .filter(|topic| **topic != LoadDrop::TOPIC)
                .map(|topic| (*topic).to_owned())
                .collect(),
            ignored,
            ..EventCheck::default()
        }
    }

    /// Removes the fields that the log lacks.
    fn comparable(&self, event: Event) -> Event {
        let Some((topic, fields)) = self.ignored.get_key_value(event.topic()) else { return event };
        let Ok(mut payload) = serde_json::from_str::<Map<String, Value>>(&event.json()) else { return event };
        payload.retain(|field, _| !fields.contains(field));
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
        self.keep(event, 0);
    }

    /// Adds an event that a detector found.
    pub(crate) fn found(&mut self, event: Event) {
        if !self.announced.contains(event.topic()) {
            return;
        }
        self.keep(event, 1);
    }

    /// Queues an event of a side until its counterpart arrives, and drops the pair if they are equal. Nothing is queued
    /// after the first difference; too large a distance between the sides is a difference as well.
    fn keep(&mut self, event: Event, side: usize) {
        if self.parted.is_some() {
            return;
        }
        let event = self.comparable(event);
        if !self.queues.contains_key(event.topic()) {
            self.queues.insert(event.topic().to_owned(), Default::default());
        }
        let queues = self.queues.get_mut(event.topic()).expect("it is there");
        match queues[1 - side].front() {
            Some(other) if *other == event => {
                self.bytes -= other.bytes();
                self.agreed += 1;
                queues[1 - side].pop_front();
                return;
            }
            counterpart => {
                self.bytes += event.bytes();
                let differs = counterpart.is_some() || self.bytes > MOST_AHEAD_BYTES;
                queues[side].push_back(event);
                self.parted = differs.then(|| difference(self.agreed, queues));
            }
        }
        if self.parted.is_some() {
            self.queues.clear();
            self.bytes = 0;
        }
    }

    /// Reports the first difference among the events that both sides have so far.
    pub(crate) fn compare(&self) -> Result<(), Difference> {
        self.parted.clone().map_or(Ok(()), Err)
    }

    /// Reports the first difference after the last event of both sides.
    pub(crate) fn finish(self) -> Result<(), Difference> {
        self.compare()?;
        let left = self.queues.values().find(|queues| queues.iter().any(|queue| !queue.is_empty()));
        left.map_or(Ok(()), |queues| Err(difference(self.agreed, queues)))
    }
}

/// The difference at the front of two queues.
fn difference(number: usize, [logged, found]: &[VecDeque<Event>; 2]) -> Difference {
    let told = |event: Option<&Event>| event.map_or("nothing".to_owned(), |event| format!("{event:?}"));
    Difference { number, logged: told(logged.front()), found: told(found.front()) }
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
        EventCheck { emitted: topics(emitted), announced: topics(announced), ..EventCheck::default() }
    }

    #[test]
    fn a_column_that_the_log_lacks_is_not_compared() {
        let compare = |lacks: &[&str], found: &str| {
            let ignored = lacks.iter().map(|&name| name.to_owned()).collect();
            let mut both = EventCheck { ignored: [("/a", ignored)].into(), ..between(&["/a"], &["/a"]) };
            both.logged(event("/a", r#"{"number":0}"#));
            both.found(event("/a", found));
            both.finish().is_ok()
        };
        assert!(compare(&["moment"], r#"{"number":0,"moment":5.0}"#));
        assert!(!compare(&[], r#"{"number":0,"moment":5.0}"#));
        assert!(!compare(&["moment"], r#"{"number":1,"moment":5.0}"#));
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
