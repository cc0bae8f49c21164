//! The Foxglove layout fits the contents of logs. Foxglove itself is not available: the layout's message
//! paths are compared with the schemas of a real log and evaluated on it by the parser of `pymcap-cli`, and
//! its settings against those that the package foxglove-sdk declares.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::text;
use crate::support::clients::{Python, file, said};
use crate::support::small;
use asperity_record::{BulkField, BulkRecord, FieldRecord, SignalRecord, TraceRecord, WindowRecord};
use mcap::read::ChunkFlattener;
use mcap::records::Record;
use serde_json::{Value, json};

fn layout_path() -> PathBuf {
    file("fixtures/clients/foxglove.json")
}

fn layout() -> Value {
    let text = fs::read_to_string(layout_path()).expect("the layout is there");
    serde_json::from_str(&text).expect("a layout is JSON")
}

/// Message paths of a layout, with the panel that each is in and whether that draws numbers.
fn message_paths(layout: &Value) -> Vec<(String, String, bool)> {
    let mut paths = Vec::new();
    for (panel, config) in layout["configById"].as_object().expect("panels are an object") {
        let is_plot = panel.starts_with("Plot!");
        let mut push = |path: &Value| {
            let path = path.as_str().expect("a message path is a text");
            paths.push((panel.clone(), path.to_owned(), is_plot));
        };
        for series in config["paths"].as_array().into_iter().flatten() {
            push(&series["value"]);
        }
        config.get("xAxisPath").map(|axis| &axis["value"]).into_iter().for_each(&mut push);
        config.get("topicPath").into_iter().for_each(&mut push);
    }
    paths
}

/// The parts of `/topic{field==value}.field[slice]`; only the topic is required.
struct MessagePath<'a> {
    topic: &'a str,
    filter: Option<&'a str>,
    field: Option<&'a str>,
    slice: Option<&'a str>,
}

impl<'a> MessagePath<'a> {
    fn parse(path: &'a str) -> MessagePath<'a> {
        let (path, slice) = match path.split_once('[') {
            Some((path, slice)) => (path, Some(slice.strip_suffix(']').expect("a slice is closed"))),
            None => (path, None),
        };
        let (head, field) = match path.rsplit_once('.') {
            Some((head, field)) => (head, Some(field)),
            None => (path, None),
        };
        let (topic, filter) = match head.split_once('{') {
            Some((topic, filter)) => (topic, Some(filter.strip_suffix('}').expect("a filter is closed"))),
            None => (head, None),
        };
        MessagePath { topic, filter, field, slice }
    }
}

/// The schemas of a log's topics.
fn schemas(log: &Path) -> BTreeMap<String, Value> {
    let bytes = fs::read(log).expect("the log can be read");
    let mut by_id = BTreeMap::new();
    let mut by_topic = BTreeMap::new();
    for record in ChunkFlattener::new(&bytes).expect("the log is MCAP") {
        match record.expect("the log is whole") {
            Record::Schema { header, data } => {
                let schema = match header.name.as_str() {
                    "asperity.Fields" => of_bulk(FieldRecord::FIELDS),
                    "asperity.Window" => of_bulk(WindowRecord::FIELDS),
                    "asperity.Signal" => of_bulk(SignalRecord::FIELDS),
                    "asperity.Traces" => of_bulk(TraceRecord::FIELDS),
                    _ => serde_json::from_slice(&data).expect("a schema is JSON"),
                };
                by_id.insert(header.id, schema);
            }
            Record::Channel(channel) => {
                by_topic.insert(channel.topic, by_id[&channel.schema_id].clone());
            }
            _ => {}
        }
    }
    by_topic
}

/// A JSON schema with the fields of a binary message.
fn of_bulk(fields: &[BulkField]) -> Value {
    let property = |field: &BulkField| {
        let kind = json!({"type": if field.kind == "double" { "number" } else { "integer" }});
        (
            field.name.to_owned(),
            if field.is_repeated { json!({"type": "array", "items": kind}) } else { kind },
        )
    };
    json!({"properties": fields.iter().map(property).collect::<serde_json::Map<_, _>>()})
}

/// Errors of a message path for messages of these schemas.
fn problem(path: &str, is_plot: bool, schemas: &BTreeMap<String, Value>) -> Option<String> {
    let MessagePath { topic, filter, field, slice } = MessagePath::parse(path);
    let Some(schema) = schemas.get(topic) else { return Some(format!("there is no topic {topic}")) };
    let fields = &schema["properties"];
    if let Some(filter) = filter {
        let (field, value) = filter.split_once("==").expect("filters compare with ==");
        if fields[field]["type"] != "integer" || value.parse::<u64>().is_err() {
            return Some(format!("{field} is no whole number"));
        }
    }
    let Some(field) = field else { return is_plot.then(|| "a message is no number".to_owned()) };
    let kind = match (fields[field]["type"].as_str(), slice) {
        (None, _) => match fields.get(field) {
            None => return Some(format!("{topic} has no field {field}")),
            // Words of an enumeration are behind a reference.
            Some(_) => "word",
        },
        (Some("array"), Some(_)) => fields[field]["items"]["type"].as_str().expect("items have a type"),
        (Some("array"), None) => return Some(format!("{field} is an array")),
        (Some(_), Some(_)) => return Some(format!("{field} is no array")),
        (Some(kind), None) => kind,
    };
    (is_plot && !["number", "integer"].contains(&kind)).then(|| format!("{field} is no number"))
}

#[test]
fn every_message_path_names_a_topic_and_a_field() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    small::run(&log);
    let schemas = schemas(&log);
    let paths = message_paths(&layout());
    assert!(paths.len() > 10, "{paths:?}");
    for (panel, path, is_plot) in &paths {
        assert_eq!(problem(path, *is_plot, &schemas), None, "{panel}: {path}");
    }
    // Wrong paths are detected.
    for (path, word) in [
        ("/steps.ft_fn", "no topic"),
        ("/step.load", "no field load"),
        ("/fields.displacement_m", "is an array"),
        ("/step.ft_fn[:]", "is no array"),
        ("/switch{time_s==1}.threshold_n", "no whole number"),
        ("/switch.direction", "is no number"),
        ("/step", "is no number"),
    ] {
        let problem = problem(path, true, &schemas).unwrap_or_else(|| panic!("{path} passes"));
        assert!(problem.contains(word), "{path}: {problem}");
    }
}

mod in_ci {
    use super::*;

    #[test]
    #[ignore = "needs packages of others: cargo xtask ci"]
    fn every_message_path_finds_something() {
        let Some(python) = Python::find() else { return };
        let folder = asperity_testkit::folder();
        let log = folder.path().join("run.mcap");
        small::run(&log);
        let paths = message_paths(&layout());
        let script = file("tests/clients/message_paths.py");
        let mut arguments = vec![text(&script), text(&log)];
        arguments.extend(paths.iter().map(|(_, path, _)| path.as_str()));
        let output = python.program("python", &arguments);
        assert!(output.status.success(), "{}", said(&output));
        let found: Vec<Vec<Value>> = serde_json::from_slice(&output.stdout).expect("it prints lists");
        assert_eq!(found.len(), paths.len());
        for ((panel, path, is_plot), found) in paths.iter().zip(found) {
            // Messages excluded by a filter give null.
            let found: Vec<Value> = found.into_iter().filter(|value| !value.is_null()).collect();
            assert!(!found.is_empty(), "{panel}: {path} finds nothing");
            for value in found.iter().filter(|_| *is_plot) {
                let numbers = match value {
                    Value::Array(values) => values.len() == 10 && values.iter().all(Value::is_number),
                    value => value.is_number(),
                };
                assert!(numbers, "{panel}: {path}: {value}");
            }
        }
        let wrong = python.program("python", &[text(&script), text(&log), "/step.load"]);
        assert!(said(&wrong).contains("'load' not found"), "{}", said(&wrong));
    }

    #[test]
    #[ignore = "needs packages of others: cargo xtask ci"]
    fn every_setting_is_one_that_foxglove_declares() {
        let Some(python) = Python::find() else { return };
        let output =
            python.program("python", &[text(&file("tests/clients/layout.py")), text(&layout_path())]);
        assert!(output.status.success(), "{}", said(&output));
    }
}
