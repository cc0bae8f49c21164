//! Upper bounds on the length of a log before its run.
//!
//! A message counts with the length of its JSON, in which no number is longer than [`LONGEST_NUMBER`], and
//! MCAP's overhead. Compression is neglected, because its gain depends on the numbers.

use asperity_record::{
    ColumnKind, Direction, Energy, EventKind, FieldRecord, JunctionTotals, Parts, RunHeader, StepRecord,
    Switch, SwitchAcross, WindowRecord,
};
use serde::Serialize;
use serde_json::Value;

use crate::announced::Announced;
use crate::format::{CHUNK_BYTES, RECORD_HEAD_BYTES};
use crate::messages::{StepMessage, SwitchMessage, Topic, record_topics};
use crate::metadata::header_to_map;

/// The longest double in JSON, `-2.2250738585072014e-308`; whole numbers are shorter.
const LONGEST_NUMBER: u64 = 24;

/// The longest JSON of a byte.
const LONGEST_FLAG: u64 = 3;

/// Overhead of a message: head, channel, number and two times, and its time and place in the index
/// of its chunk.
const AROUND_A_MESSAGE: u64 = (RECORD_HEAD_BYTES + 2 + 4 + 8 + 8 + 8 + 8) as u64;

/// Overhead of a topic in each chunk: the head of its index, and the position of the index in the
/// summary.
const TOPIC_IN_A_CHUNK: u64 = (RECORD_HEAD_BYTES + 2 + 4 + 2 + 8) as u64;

/// Overhead of a chunk besides messages and topics: its head, the summary of it, and the compressor's
/// overhead on incompressible data, without a 256th of the data.
const AROUND_A_CHUNK: u64 = 512;

/// Keys, counts and digests of a topic at the end of a log, and in its statistics.
const TOPIC_AT_THE_END: u64 = 512;

/// Overhead of every log besides header, scenario and topics: status, energies, solver counters,
/// the index of metadata, the footer.
const FRAME: u64 = 16 << 10;

/// Upper bounds on the bytes of each kind of item in a log, with overhead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MostBytes {
    topics: u64,
    frame: u64,
    parts: Parts,
}

impl MostBytes {
    /// The bounds for the log of a run with that header and scenario, and events of these kinds.
    pub fn of(header: &RunHeader, scenario_toml: &str, kinds: &[EventKind]) -> MostBytes {
        let events = kinds.iter().map(Topic::of);
        let announced: Vec<Announced> =
            record_topics(header).into_iter().chain(events).map(|topic| Announced::of(&topic)).collect();
        let topics = announced.len() as u64;
        let said = |announced: &Announced| {
            let Announced { topic, message_encoding, schema_name, schema_encoding, schema, metadata } =
                announced;
            let texts = [topic, message_encoding, schema_name, schema_encoding, schema];
            let units = metadata.iter().map(|(key, unit)| key.len() + unit.len() + 8);
            let bytes = texts.map(|text| text.len() + 4).iter().sum::<usize>() + units.sum::<usize>();
            // Once in the first chunk, and again in the summary.
            2 * (bytes + 2 * RECORD_HEAD_BYTES + 16) as u64 + topic.len() as u64 * 2 + TOPIC_AT_THE_END
        };
        let run: usize = header_to_map(header).iter().map(|(key, value)| key.len() + value.len() + 8).sum();
        let frame = FRAME
            + run as u64
            + scenario_toml.len() as u64
            + announced.iter().map(said).sum::<u64>()
            + 2 * (AROUND_A_CHUNK + topics * TOPIC_IN_A_CHUNK);
        MostBytes { topics, frame, parts: header.parts() }
    }

    /// Bytes of the log of a run without records.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Bytes of a step, with the forces at both ends if `pulls_both_ways`.
    pub fn step(&self, pulls_both_ways: bool) -> u64 {
        self.message(&StepMessage::new(&StepRecord {
            end_forces_n: pulls_both_ways.then_some([0.0; 2]),
            energy: Energy { radiated_j: self.parts.radiation.then_some(0.0), ..Energy::default() },
            peak_velocity_m_per_s: self.parts.state.then_some(0.0),
            junctions: self.parts.junctions.then(JunctionTotals::default),
            ..step()
        }))
    }

    /// Bytes of a switch.
    pub fn switch(&self) -> u64 {
        self.message(&SwitchMessage::new(
            &step(),
            &Switch {
                block: 0,
                direction: Direction::Detach,
                displacement_m: 0.0,
                velocity_m_per_s: 0.0,
                tangential_force_n: 0.0,
                stick_position_m: 0.0,
                threshold_n: 0.0,
                junctions_slipping: self.parts.junctions.then_some(0),
                across: self.parts.area.then(SwitchAcross::default),
            },
        ))
    }

    /// Bytes of the state of all blocks of a slider, with the contact loads of a slab if `loads`.
    pub fn fields(&self, blocks: usize, loads: bool) -> u64 {
        let with_junctions = |blocks: usize| if self.parts.junctions { blocks } else { 0 };
        let across = |blocks: usize| vec![0.0; self.across(blocks)];
        self.of_blocks(blocks, |blocks| FieldRecord {
            step: 0,
            time_s: 0.0,
            displacement_m: vec![0.0; blocks],
            velocity_m_per_s: vec![0.0; blocks],
            tangential_force_n: vec![0.0; blocks],
            normal_load_n: if loads { vec![0.0; blocks] } else { Vec::new() },
            stick_position_m: vec![0.0; blocks],
            detached: vec![0; blocks],
            junctions_slipping: vec![u32::MAX; with_junctions(blocks)],
            pinned_mean_ratio: vec![0.0; with_junctions(blocks)],
            pinned_width_ratio: vec![0.0; with_junctions(blocks)],
            state: vec![0.0; if self.parts.state { blocks } else { 0 }],
            displacement_across_m: across(blocks),
            velocity_across_m_per_s: across(blocks),
            tangential_force_across_n: across(blocks),
            stick_position_across_m: across(blocks),
        })
    }

    /// How many of these blocks have components across the sliding direction.
    fn across(&self, blocks: usize) -> usize {
        if self.parts.area { blocks } else { 0 }
    }

    /// Bytes of the state of that many blocks in a dense window.
    pub fn window(&self, blocks: usize) -> u64 {
        let across = |blocks: usize| vec![0.0; self.across(blocks)];
        self.of_blocks(blocks, |blocks| WindowRecord {
            window: 0,
            step: 0,
            time_s: 0.0,
            sliding: 0,
            first_block: 0,
            displacement_m: vec![0.0; blocks],
            velocity_m_per_s: vec![0.0; blocks],
            tangential_force_n: vec![0.0; blocks],
            displacement_across_m: across(blocks),
            velocity_across_m_per_s: across(blocks),
            tangential_force_across_n: across(blocks),
        })
    }

    /// Bytes of an event of that kind, whose words are not longer than a number.
    pub fn event(&self, kind: &EventKind) -> u64 {
        let longest = |kind: ColumnKind| if kind == ColumnKind::Flag { 5 } else { LONGEST_NUMBER };
        // Quotes, a colon and a comma.
        let cells = kind.columns.iter().map(|column| column.name.len() as u64 + 4 + longest(column.kind));
        self.payload(2 + cells.sum::<u64>())
    }

    /// Bytes added by a chunk that is closed early because it was open for a second.
    pub fn early_chunk(&self) -> u64 {
        AROUND_A_CHUNK + self.topics * TOPIC_IN_A_CHUNK
    }

    fn message(&self, message: &impl Serialize) -> u64 {
        self.payload(longest_message(message))
    }

    /// Bytes of a message with an equal number of values for each block.
    fn of_blocks<M: Serialize>(&self, blocks: usize, message: impl Fn(usize) -> M) -> u64 {
        // Empty arrays might be omitted, so it extrapolates from one and two blocks.
        let [one, two] = [1, 2].map(|blocks| longest_message(&message(blocks)));
        self.payload(one + (two - one) * (blocks as u64).saturating_sub(1))
    }

    /// Bytes of a payload with its share of a chunk.
    fn payload(&self, bytes: u64) -> u64 {
        let message = bytes + AROUND_A_MESSAGE;
        let compressor = message.div_ceil(256);
        message + compressor + (message * self.early_chunk()).div_ceil(CHUNK_BYTES)
    }
}

fn step() -> StepRecord {
    StepRecord {
        step: 0,
        time_s: 0.0,
        driving_force_n: 0.0,
        normal_load_n: 0.0,
        end_forces_n: None,
        energy: Energy::default(),
        junctions: None,
        peak_velocity_m_per_s: None,
        sliding: 0,
        switches: Vec::new(),
    }
}

fn longest_message(message: &impl Serialize) -> u64 {
    longest_json(&serde_json::to_value(message).expect("messages are plain structs of numbers"))
}

/// The longest JSON of a value of that shape.
fn longest_json(value: &Value) -> u64 {
    // Whole numbers in arrays are flags, whether a block slides, or counts, given by the longest.
    let in_array = |value: &Value| match value.is_u64() {
        true => LONGEST_FLAG.max(value.to_string().len() as u64),
        false => longest_json(value),
    };
    match value {
        Value::Null | Value::Number(_) => LONGEST_NUMBER,
        Value::Bool(_) => 5,
        Value::String(text) => text.len() as u64 + 2,
        Value::Array(values) => 2 + values.iter().map(|value| in_array(value) + 1).sum::<u64>(),
        Value::Object(fields) => {
            2 + fields.iter().map(|(key, value)| key.len() as u64 + 4 + longest_json(value)).sum::<u64>()
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{EventKind, FieldRecord, Parts, SlipEvent};

    use super::{LONGEST_NUMBER, MostBytes, longest_json};

    #[test]
    fn no_number_is_longer_than_the_longest() {
        for number in [f64::MIN_POSITIVE, -f64::MIN_POSITIVE, f64::MAX, f64::MIN, -5e-324, -1.0 / 3.0e200] {
            assert!(serde_json::to_string(&number).unwrap().len() as u64 <= LONGEST_NUMBER, "{number:e}");
        }
        assert_eq!(serde_json::to_string(&-f64::MIN_POSITIVE).unwrap().len() as u64, LONGEST_NUMBER);
        assert!(serde_json::to_string(&u64::MAX).unwrap().len() as u64 <= LONGEST_NUMBER);
    }

    #[test]
    fn a_message_is_not_longer_than_it_can_be() {
        let worst = |blocks: usize, loads: usize, junctions: usize, across: usize| FieldRecord {
            step: u64::MAX,
            time_s: -f64::MIN_POSITIVE,
            displacement_m: vec![-f64::MIN_POSITIVE; blocks],
            velocity_m_per_s: vec![-f64::MIN_POSITIVE; blocks],
            tangential_force_n: vec![-f64::MIN_POSITIVE; blocks],
            normal_load_n: vec![-f64::MIN_POSITIVE; loads],
            stick_position_m: vec![-f64::MIN_POSITIVE; blocks],
            detached: vec![1; blocks],
            junctions_slipping: vec![u32::MAX; junctions],
            pinned_mean_ratio: vec![-f64::MIN_POSITIVE; junctions],
            pinned_width_ratio: vec![-f64::MIN_POSITIVE; junctions],
            state: Vec::new(),
            displacement_across_m: vec![-f64::MIN_POSITIVE; across],
            velocity_across_m_per_s: vec![-f64::MIN_POSITIVE; across],
            tangential_force_across_n: vec![-f64::MIN_POSITIVE; across],
            stick_position_across_m: vec![-f64::MIN_POSITIVE; across],
        };
        let of = |junctions, area| MostBytes {
            topics: 9,
            frame: 0,
            parts: Parts { junctions, area, ..Parts::default() },
        };
        for (blocks, has_loads, has_junctions, has_area) in [
            (2, false, false, false),
            (100, false, false, false),
            (2, true, false, false),
            (100, true, false, false),
            (2, true, true, false),
            (100, true, true, false),
            (2, true, false, true),
            (100, true, true, true),
        ] {
            let length = |is_there| if is_there { blocks } else { 0 };
            let most = of(has_junctions, has_area);
            let worst = worst(blocks, length(has_loads), length(has_junctions), length(has_area));
            let payload = serde_json::to_string(&worst).unwrap().len() as u64;
            assert!(payload <= longest_json(&serde_json::to_value(&worst).unwrap()));
            let found = most.fields(blocks, has_loads);
            assert!(
                found > payload && found < payload * 11 / 10 + 400,
                "{blocks} {has_loads} {has_junctions} {has_area}"
            );
        }
        let event = of(false, false).event(&EventKind::of::<SlipEvent>());
        assert!(event > 200 && event < 1000, "{event}");
    }
}
