//! The announcement of a topic in a log: its schema and the units of its fields.

use std::collections::BTreeMap;

use asperity_record::{EventKind, RunHeader};

use crate::messages::{Topic, record_topics, units};

/// An announced topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Announced {
    /// The topic.
    pub topic: String,
    /// The encoding of its messages.
    pub message_encoding: String,
    /// The name of its schema.
    pub schema_name: String,
    /// The language of the schema.
    pub schema_encoding: String,
    /// The schema; empty if there is none.
    pub schema: String,
    /// Further metadata of the topic: `unit:FIELD`.
    pub metadata: BTreeMap<String, String>,
}

impl Announced {
    /// The announcement of a topic in a log of this program.
    pub(crate) fn of(topic: &Topic) -> Announced {
        let Topic { topic, schema_name, schema } = topic;
        Announced {
            topic: topic.clone(),
            message_encoding: "json".to_owned(),
            schema_name: schema_name.clone(),
            schema_encoding: "jsonschema".to_owned(),
            metadata: metadata(schema),
            schema: schema.clone(),
        }
    }

    /// Whether the units fit the fields of the schema, if there is one.
    pub fn agrees_with_itself(&self) -> bool {
        let schema: serde_json::Value = serde_json::from_str(&self.schema).unwrap_or_default();
        schema.is_object() && (schema.get("properties").is_none() || self.metadata == metadata(&self.schema))
    }
}

fn metadata(schema: &str) -> BTreeMap<String, String> {
    units(schema).into_iter().map(|(field, unit)| (format!("unit:{field}"), unit)).collect()
}

/// The announcements in a log of this program with that header, and detectors of these kinds.
pub fn announcements(header: &RunHeader, kinds: &[EventKind]) -> Vec<Announced> {
    record_topics(header)
        .iter()
        .chain(&kinds.iter().map(Topic::of).collect::<Vec<_>>())
        .map(Announced::of)
        .collect()
}

/// Whether a topic is one of records, or has the prefix of events.
pub fn is_topic_of_a_run(topic: &str) -> bool {
    use crate::format::{EVENTS, FIELDS, STEP, SWITCH, WINDOW};
    [STEP, SWITCH, FIELDS, WINDOW].contains(&topic) || topic.starts_with(EVENTS)
}
