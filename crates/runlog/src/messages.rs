//! The messages of `/step` and `/switch`, and the schemas of all topics.
//!
//! A step record is taken apart into one flat message for the step and one for
//! each block that switched: plots and data frames read flat messages with a
//! fixed set of fields, and nothing else.

use std::collections::BTreeMap;

use asperity_record::{
    BulkField, BulkRecord, Direction, Energy, Event, EventKind, FieldRecord, JunctionTotals, Measured, Part,
    Record, RowKind, RunHeader, SignalRecord, StepRecord, Switch, SwitchAcross, TraceRecord, WindowRecord,
    unit_of,
};
use mcap::records::MessageHeader;
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::descriptor::PACKAGE;
use crate::format::{
    FIELDS, LONGEST_EVENT_BYTES, LONGEST_SIGNAL_BYTES, LONGEST_STATE_OF_BLOCK_BYTES, LONGEST_STEP_BYTES,
    SIGNAL, STEP, SWITCH, TRACES, WINDOW,
};
use crate::problem::{LogProblem, most};
use crate::{agree, descriptor};

/// A message that is of its topic and of its run, by itself.
pub(crate) enum Message {
    Step(StepMessage),
    Switch(SwitchMessage),
    /// A record of one message.
    Record(Record),
    Event(Event),
}

impl Message {
    /// Reads a message of the run with that header. A record must stand at the time of its step.
    ///
    /// # Errors
    /// If it is too long, is not of its topic, or cannot be of that run.
    pub(crate) fn read(
        header: &RunHeader,
        topic: &str,
        head: &MessageHeader,
        data: &[u8],
    ) -> Result<Message, LogProblem> {
        let message = match topic {
            STEP => Message::Step(decode(topic, head, data)?),
            SWITCH => Message::Switch(decode(topic, head, data)?),
            FIELDS => Message::Record(Record::Fields(Box::new(decode_bulk(topic, head, data)?))),
            WINDOW => Message::Record(Record::Window(decode_bulk(topic, head, data)?)),
            SIGNAL => Message::Record(Record::Signal(decode_bulk(topic, head, data)?)),
            TRACES => Message::Record(Record::Traces(decode_bulk(topic, head, data)?)),
            _ => {
                let text = std::str::from_utf8(data).map_err(serde_json::Error::custom);
                let message = text.and_then(|payload| match RowKind::with(topic) {
                    Some(row) => (row.read)(payload).map(|row| Message::Record(Record::Row(row))),
                    None => agree::event(topic, payload, header).map(Message::Event),
                });
                message.map_err(|error| unreadable(topic, head, error))?
            }
        };
        if let Some(step) = message.step() {
            agree::time(header, topic, step, head)?;
        }
        match &message {
            Message::Step(step) => agree::step(header, step)?,
            Message::Switch(switch) => agree::parts_of_switch(header, switch)?,
            Message::Record(record) => agree::record(header, record)?,
            Message::Event(_) => {}
        }
        Ok(message)
    }

    /// Its step; none of an event.
    pub(crate) fn step(&self) -> Option<u64> {
        match self {
            Message::Step(message) => Some(message.step),
            Message::Switch(message) => Some(message.step),
            Message::Record(record) => Some(record.step()),
            Message::Event(_) => None,
        }
    }
}

/// Checks that a message is no longer than its topic allows, before it is parsed.
///
/// # Errors
/// If it is.
pub(crate) fn may_be_as_long(header: &RunHeader, topic: &str, bytes: usize) -> Result<(), LogProblem> {
    let state = LONGEST_STEP_BYTES + header.blocks as usize * LONGEST_STATE_OF_BLOCK_BYTES;
    match topic {
        STEP | SWITCH => most("bytes in a step or switch", bytes, LONGEST_STEP_BYTES),
        FIELDS | WINDOW => most("bytes in a state", bytes, state),
        SIGNAL | TRACES => most("bytes of samples", bytes, LONGEST_SIGNAL_BYTES),
        _ => most("bytes in an event", bytes, LONGEST_EVENT_BYTES),
    }
}

fn decode<T: DeserializeOwned>(topic: &str, head: &MessageHeader, data: &[u8]) -> Result<T, LogProblem> {
    serde_json::from_slice(data).map_err(|error| unreadable(topic, head, error))
}

fn decode_bulk<R: BulkRecord>(topic: &str, head: &MessageHeader, data: &[u8]) -> Result<R, LogProblem> {
    R::of_message(data).map_err(|problem| unreadable(topic, head, serde_json::Error::custom(problem)))
}

fn unreadable(topic: &str, head: &MessageHeader, error: serde_json::Error) -> LogProblem {
    LogProblem::Message { topic: topic.to_owned(), sequence: head.sequence, error }
}

/// Declares the message of a step with the energies of the table.
macro_rules! step_message {
    ($($(#[doc = $_shown:tt])+ $name:ident: $type:ty = $about:literal $_more:tt;)+) => {
        /// The chain's load at the end of one time step.
        #[derive(Debug, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[schemars(rename = "Step")]
        pub(crate) struct StepMessage {
            /// The step, counted from 1.
            pub(crate) step: u64,
            /// Simulated time at the end of the step, s.
            pub(crate) time_s: f64,
            /// Sum of the driving forces that this step's update used, N.
            pub(crate) driving_force_n: f64,
            /// Total normal load that this step's update used, N.
            pub(crate) normal_load_n: f64,
            /// Driving force on the first block, N, where the drive pulls both ways.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub(crate) first_end_force_n: Option<f64>,
            /// The same on the last block.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub(crate) last_end_force_n: Option<f64>,
            /// The driving force over the normal load.
            pub(crate) ft_fn: f64,
            /// Standard error of that ratio.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub(crate) ft_fn_error: Option<f64>,
            /// How many blocks slid in this step.
            pub(crate) sliding: u32,
            /// How many blocks switched at its end: so many `/switch` messages follow.
            pub(crate) switches: u32,
            $(
                #[doc = concat!($about, ", J.")]
                #[serde(skip_serializing_if = "Energy::lacks")]
                pub(crate) $name: $type,
            )+
            /// Largest speed of any block since the message before, m/s.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub(crate) peak_velocity_m_per_s: Option<f64>,
            /// How many junctions broke in all steps before this one.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub(crate) breaks: Option<u64>,
            /// How many junctions were pinned again in all steps before this one.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub(crate) repins: Option<u64>,
        }

        impl StepMessage {
            pub(crate) fn new(record: &StepRecord) -> StepMessage {
                let energy = record.energy;
                StepMessage {
                    step: record.step,
                    time_s: record.time_s,
                    driving_force_n: record.driving_force_n,
                    normal_load_n: record.normal_load_n,
                    first_end_force_n: record.end_forces_n.map(|ends| ends[0]),
                    last_end_force_n: record.end_forces_n.map(|ends| ends[1]),
                    ft_fn: record.load_ratio(),
                    ft_fn_error: record.ft_fn_error,
                    sliding: record.sliding,
                    switches: record.switches.len() as u32,
                    $($name: energy.$name,)+
                    peak_velocity_m_per_s: record.peak_velocity_m_per_s,
                    breaks: record.junctions.map(|totals| totals.breaks),
                    repins: record.junctions.map(|totals| totals.repins),
                }
            }

            /// The energies.
            pub(crate) fn energy(&self) -> Energy {
                Energy { $($name: self.$name,)+ }
            }
        }
    };
}

asperity_record::energies!(logged step_message);

/// One block that detached or re-attached at the end of a step.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Switch")]
pub(crate) struct SwitchMessage {
    /// The step, counted from 1.
    pub(crate) step: u64,
    /// Simulated time at the end of the step, s.
    pub(crate) time_s: f64,
    /// The block, counted from 1.
    pub(crate) block: u32,
    /// From stick to slip, or back.
    pub(crate) direction: Direction,
    /// Displacement after the step, m.
    pub(crate) displacement_m: f64,
    /// Velocity after the step, m/s.
    pub(crate) velocity_m_per_s: f64,
    /// Tangential force without friction of this step, N.
    pub(crate) tangential_force_n: f64,
    /// Anchor of the friction spring: left behind or newly taken, m.
    pub(crate) stick_position_m: f64,
    /// Static friction threshold, N.
    pub(crate) threshold_n: f64,
    /// How many junctions of the contact slip at the end of the step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) junctions_slipping: Option<u32>,
    /// Displacement across the sliding direction after the step, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) displacement_across_m: Option<f64>,
    /// Velocity across it after the step, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) velocity_across_m_per_s: Option<f64>,
    /// Tangential force without friction across it, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) tangential_force_across_n: Option<f64>,
    /// Anchor of the friction spring across it, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) stick_position_across_m: Option<f64>,
    /// Standard error of the time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) error_s: Option<f64>,
    /// Size of the step that the sensor saw, in its unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) step_size: Option<f64>,
    /// Standard error of that size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) step_size_error: Option<f64>,
}

impl StepMessage {
    pub(crate) fn into_record(self) -> StepRecord {
        StepRecord {
            step: self.step,
            time_s: self.time_s,
            driving_force_n: self.driving_force_n,
            normal_load_n: self.normal_load_n,
            ft_fn_error: self.ft_fn_error,
            end_forces_n: self.first_end_force_n.zip(self.last_end_force_n).map(|(a, b)| [a, b]),
            energy: self.energy(),
            junctions: self.breaks.zip(self.repins).map(|(breaks, repins)| JunctionTotals { breaks, repins }),
            peak_velocity_m_per_s: self.peak_velocity_m_per_s,
            sliding: self.sliding,
            switches: Vec::new(),
        }
    }
}

impl SwitchMessage {
    pub(crate) fn new(record: &StepRecord, switch: &Switch) -> SwitchMessage {
        SwitchMessage {
            step: record.step,
            time_s: record.time_s,
            block: switch.block,
            direction: switch.direction,
            displacement_m: switch.displacement_m,
            velocity_m_per_s: switch.velocity_m_per_s,
            tangential_force_n: switch.tangential_force_n,
            stick_position_m: switch.stick_position_m,
            threshold_n: switch.threshold_n,
            junctions_slipping: switch.junctions_slipping,
            displacement_across_m: switch.across.map(|across| across.displacement_m),
            velocity_across_m_per_s: switch.across.map(|across| across.velocity_m_per_s),
            tangential_force_across_n: switch.across.map(|across| across.tangential_force_n),
            stick_position_across_m: switch.across.map(|across| across.stick_position_m),
            error_s: switch.measured.map(|measured| measured.error_s),
            step_size: switch.measured.map(|measured| measured.step),
            step_size_error: switch.measured.map(|measured| measured.step_error),
        }
    }

    /// The components across the sliding direction, with their names.
    pub(crate) fn components_across(&self) -> [(&'static str, Option<f64>); 4] {
        [
            ("displacement_across_m", self.displacement_across_m),
            ("velocity_across_m_per_s", self.velocity_across_m_per_s),
            ("tangential_force_across_n", self.tangential_force_across_n),
            ("stick_position_across_m", self.stick_position_across_m),
        ]
    }

    /// These components; `None` if one is missing.
    fn across(&self) -> Option<SwitchAcross> {
        Some(SwitchAcross {
            displacement_m: self.displacement_across_m?,
            velocity_m_per_s: self.velocity_across_m_per_s?,
            tangential_force_n: self.tangential_force_across_n?,
            stick_position_m: self.stick_position_across_m?,
        })
    }

    /// What the sensor saw; `None` if a part of it is missing.
    fn measured(&self) -> Option<Measured> {
        let (step, step_error) = (self.step_size?, self.step_size_error?);
        Some(Measured { error_s: self.error_s?, step, step_error })
    }

    pub(crate) fn into_switch(self) -> Switch {
        Switch {
            block: self.block,
            direction: self.direction,
            displacement_m: self.displacement_m,
            velocity_m_per_s: self.velocity_m_per_s,
            tangential_force_n: self.tangential_force_n,
            stick_position_m: self.stick_position_m,
            threshold_n: self.threshold_n,
            junctions_slipping: self.junctions_slipping,
            across: self.across(),
            measured: self.measured(),
        }
    }
}

/// A topic as announced in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Topic {
    pub(crate) topic: String,
    pub(crate) schema_name: String,
    /// The encoding of messages and that of their schema, as MCAP names them.
    pub(crate) encodings: [&'static str; 2],
    pub(crate) schema: Vec<u8>,
    /// The units of the fields, for the channel's metadata.
    pub(crate) units: BTreeMap<String, String>,
}

impl Topic {
    /// The topic of a detector's events.
    pub(crate) fn of(kind: &EventKind) -> Topic {
        Topic::of_json(kind.topic, &kind.schema_name, kind.schema().to_string())
    }

    /// A topic of JSON objects with that JSON schema.
    pub(crate) fn of_json(topic: &str, schema_name: &str, schema: String) -> Topic {
        let parsed: Value = serde_json::from_str(&schema).unwrap_or_default();
        let fields = parsed["properties"].as_object().into_iter().flat_map(|properties| properties.keys());
        Topic {
            topic: topic.to_owned(),
            schema_name: schema_name.to_owned(),
            encodings: ["json", "jsonschema"],
            units: units(fields.map(String::as_str)),
            schema: schema.into_bytes(),
        }
    }

    /// A topic of binary records, of those fields that the run has.
    fn of_bulk<R: BulkRecord>(topic: &str, has: impl Fn(&str) -> bool) -> Topic {
        let fields: Vec<&BulkField> = R::FIELDS.iter().filter(|field| has(field.name)).collect();
        Topic {
            topic: topic.to_owned(),
            schema_name: format!("{PACKAGE}.{}", R::NAME),
            encodings: ["protobuf"; 2],
            schema: descriptor::schema(R::NAME, &fields),
            units: units(fields.iter().map(|field| field.name)),
        }
    }
}

/// Fields of records that only runs with a part have.
const OF_PARTS: [(Part, &[&str]); 4] = [
    (Part::Junctions, &["breaks", "repins", "junctions_slipping", "pinned_mean_ratio", "pinned_width_ratio"]),
    (
        Part::Area,
        &[
            "displacement_across_m",
            "velocity_across_m_per_s",
            "tangential_force_across_n",
            "stick_position_across_m",
        ],
    ),
    (Part::State, &["state", "peak_velocity_m_per_s"]),
    (Part::Recording, &["ft_fn_error", "error_s", "step_size", "step_size_error"]),
];

/// The topics of records of the run with that header.
pub(crate) fn record_topics(header: &RunHeader) -> Vec<Topic> {
    let parts = header.parts();
    let has = |name: &str| {
        let energies = Energy::COLUMNS.iter().filter(|energy| energy.name == name);
        OF_PARTS.iter().all(|(part, names)| parts.has(*part) || !names.contains(&name))
            && energies.filter_map(|energy| energy.only).all(|part| parts.has(part))
    };
    let topic = |topic: &str, name: &str, mut schema: Value| {
        if let Some(properties) = schema["properties"].as_object_mut() {
            properties.retain(|name, _| has(name));
        }
        Topic::of_json(topic, name, schema.to_string())
    };
    let mut topics = vec![
        topic(STEP, "Step", schemars::schema_for!(StepMessage).to_value()),
        topic(SWITCH, "Switch", schemars::schema_for!(SwitchMessage).to_value()),
        Topic::of_bulk::<FieldRecord>(FIELDS, has),
        Topic::of_bulk::<WindowRecord>(WINDOW, has),
    ];
    if parts.has(Part::Recording) {
        topics.extend([
            Topic::of_bulk::<SignalRecord>(SIGNAL, has),
            Topic::of_bulk::<TraceRecord>(TRACES, has),
        ]);
    }
    topics.extend(RowKind::all_in(parts).map(|row| Topic::of(&(row.kind)().with(parts))));
    topics
}

/// The units of a message's fields: the last parts of the fields' names. Ratios have none.
fn units<'a>(fields: impl Iterator<Item = &'a str>) -> BTreeMap<String, String> {
    let unit = |field: &str| {
        let unit = unit_of(field).filter(|unit| *unit != "1")?;
        Some((format!("unit:{field}"), unit.to_owned()))
    };
    fields.filter_map(unit).collect()
}
