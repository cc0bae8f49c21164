//! Thins a sound log to a small one with all kinds of records: fuzzers read it hundreds of times a second,
//! and the repository has a hundred such logs.

use std::collections::BTreeMap;

use asperity_record::{BulkRecord, FieldRecord};
use mcap::records::op;

use super::parts::{Part, correct_end};

/// Gives the messages the numbers that they must have.
pub fn renumber(parts: &mut [Part]) {
    let mut next: BTreeMap<u16, u32> = BTreeMap::new();
    for part in parts.iter_mut().filter(|part| part.opcode == op::MESSAGE) {
        let number = next.entry(part.channel_id().expect("it is a message")).or_insert(0);
        part.body[2..6].copy_from_slice(&number.to_le_bytes());
        *number += 1;
    }
}

/// A small log from a sound one: with only the first few samples between slips and those in which ruptures become
/// certain, and only the used parts of scenario and schemas.
pub fn thinned(sound: &[Part]) -> Vec<Part> {
    let steps = messages(sound, "/step");
    let states = messages(sound, "/fields");
    let ruptures = ["/events/rupture", "/events/arrival"].map(|topic| messages(sound, topic)).concat();
    let number = |part: &Part, key: &str| {
        let message: serde_json::Value =
            serde_json::from_slice(part.payload().unwrap_or_default()).expect("messages are JSON");
        message[key].as_u64().unwrap_or(0)
    };
    let mut thin = Vec::new();
    let (mut samples, mut slid, mut step) = (0, false, 0);
    for (at, part) in sound.iter().enumerate() {
        if steps.contains(&at) {
            let slides = number(part, "sliding") + number(part, "switches") > 0;
            samples += 1;
            let next = steps.iter().find(|step| **step > at).copied().unwrap_or(sound.len());
            let is_needed = ruptures.iter().any(|rupture| (at..next).contains(rupture));
            if !slides && !slid && !is_needed && samples > 8 && Some(&at) != steps.last() {
                continue;
            }
            (slid, step) = (slides, number(part, "step"));
        }
        if states.contains(&at) {
            let state = FieldRecord::of_message(part.payload().unwrap_or_default()).expect("it is a state");
            if state.step != step {
                continue;
            }
        }
        thin.push(match (part.opcode, part.name()) {
            (op::SCHEMA, _) => Part::new(op::SCHEMA, small_schema(&part.body)),
            (op::ATTACHMENT, Some("scenario.toml")) => {
                let mut text = String::new();
                let scenario =
                    String::from_utf8_lossy(part.attached().expect("it is an attachment")).into_owned();
                for line in scenario.lines().filter(|line| !line.starts_with('#') && !line.is_empty()) {
                    text += line;
                    text += "\n";
                }
                Part::attachment("scenario.toml", text.as_bytes())
            }
            _ => part.clone(),
        });
    }
    renumber(&mut thin);
    correct_end(&mut thin);
    thin
}

/// A schema with number and name only.
fn small_schema(body: &[u8]) -> Vec<u8> {
    let mut small = body[..2].to_vec();
    for text in ["", "jsonschema", "{}"] {
        small.extend((text.len() as u32).to_le_bytes());
        small.extend(text.as_bytes());
    }
    small
}

/// Where the messages of a topic are.
pub fn messages(parts: &[Part], topic: &str) -> Vec<usize> {
    let id = parts
        .iter()
        .find(|part| part.opcode == op::CHANNEL && part.name() == Some(topic))
        .and_then(Part::channel_id)
        .unwrap_or_else(|| panic!("no channel of {topic}"));
    (0..parts.len())
        .filter(|&at| parts[at].opcode == op::MESSAGE && parts[at].channel_id() == Some(id))
        .collect()
}
