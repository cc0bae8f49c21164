//! How a log announces a topic: its schema, and the units of its fields.

use std::collections::BTreeMap;

use asperity_record::EventKind;

use crate::messages::{Topic, record_topics, units};

/// A topic as it stands in a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Announced {
    /// The topic.
    pub topic: String,
    /// How its messages are encoded.
    pub message_encoding: String,
    /// The name of its schema.
    pub schema_name: String,
    /// In what the schema is written.
    pub schema_encoding: String,
    /// The schema; empty where there is none.
    pub schema: String,
    /// What else is said of the topic: `unit:FIELD`.
    pub metadata: BTreeMap<String, String>,
}

impl Announced {
    /// As a log of this program announces a topic.
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

    /// Whether the units are those of the fields that the schema names, if it names any.
    pub fn agrees_with_itself(&self) -> bool {
        let schema: serde_json::Value = serde_json::from_str(&self.schema).unwrap_or_default();
        schema.is_object() && (schema.get("properties").is_none() || self.metadata == metadata(&self.schema))
    }
}

fn metadata(schema: &str) -> BTreeMap<String, String> {
    units(schema).into_iter().map(|(field, unit)| (format!("unit:{field}"), unit)).collect()
}

/// What a log of this program announces, of a slider of so many blocks and with detectors of these
/// kinds.
pub fn announcements(blocks: u32, kinds: &[EventKind]) -> Vec<Announced> {
    record_topics(blocks)
        .iter()
        .chain(&kinds.iter().map(Topic::of).collect::<Vec<_>>())
        .map(Announced::of)
        .collect()
}

/// Whether a topic is one of records, or is named as events are.
pub fn is_topic_of_a_run(topic: &str) -> bool {
    use crate::format::{EVENTS, FIELDS, STEP, SWITCH, WINDOW};
    [STEP, SWITCH, FIELDS, WINDOW].contains(&topic) || topic.starts_with(EVENTS)
}
