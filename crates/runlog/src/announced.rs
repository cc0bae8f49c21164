//! The announcement of a topic in a log: its schema and the units of its fields.

use std::collections::BTreeMap;

use crate::messages::{Topic, units};

/// An announced topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Announced {
    /// The topic.
    pub(crate) topic: String,
    /// The encoding of its messages.
    pub(crate) message_encoding: String,
    /// The name of its schema.
    pub(crate) schema_name: String,
    /// The language of the schema.
    pub(crate) schema_encoding: String,
    /// The schema; empty if there is none.
    pub(crate) schema: String,
    /// Further metadata of the topic: `unit:FIELD`.
    pub(crate) metadata: BTreeMap<String, String>,
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
}

fn metadata(schema: &str) -> BTreeMap<String, String> {
    units(schema).into_iter().map(|(field, unit)| (format!("unit:{field}"), unit)).collect()
}
