//! Consistency checks between messages of a log, or between fields of one message. A writer cannot violate
//! them; readers of one of two redundant values can rely on it.

use mcap::records::MessageHeader;

use asperity_record::{
    Arrival, Cell, Column, Direction, Energy, Event, EventPayload, FieldRecord, GlobalSlip, JunctionTotals,
    LoadDrop, Onset, Part, Record, Role, RowKind, RunHeader, Rupture, SignalRecord, SlipEvent, StepRecord,
    TraceRecord, WindowRecord, magnitude,
};
use serde_json::{Map, Value};

use crate::messages::{StepMessage, SwitchMessage};
use crate::problem::LogProblem;

/// Compares the times of a message in the file with its step.
///
/// # Errors
/// If they disagree.
pub(crate) fn time(
    header: &RunHeader,
    topic: &str,
    step: u64,
    head: &MessageHeader,
) -> Result<(), LogProblem> {
    let expected_ns = header.time_grid().time_ns(step);
    let Some(found_ns) =
        [head.log_time, head.publish_time].into_iter().find(|found_ns| *found_ns != expected_ns)
    else {
        return Ok(());
    };
    let what = format!("the message of {topic} stands at {found_ns} ns, not at {expected_ns} ns");
    Err(LogProblem::Contradiction { step, what })
}

/// Checks a step: the ratio against the loads; the forces at both ends, both present or absent; the
/// radiated energy and the largest speed, where the header says so; the totals of junctions against the header.
///
/// # Errors
/// If they disagree.
pub(crate) fn step(header: &RunHeader, message: &StepMessage) -> Result<(), LogProblem> {
    let ratio = message.driving_force_n / message.normal_load_n;
    // Equal to the bit, except that NaN equals NaN.
    if message.ft_fn != ratio && !(message.ft_fn.is_nan() && ratio.is_nan()) {
        let what = format!("ft_fn = {}, but its loads give {ratio}", message.ft_fn);
        return Err(LogProblem::Contradiction { step: message.step, what });
    }
    if message.first_end_force_n.is_some() != message.last_end_force_n.is_some() {
        let what = "a force on one end and none on the other".to_owned();
        return Err(LogProblem::Contradiction { step: message.step, what });
    }
    if message.ft_fn_error.is_some() && header.sensors.is_none() {
        let what = "ft_fn_error, in a run that is no recording".to_owned();
        return Err(LogProblem::Contradiction { step: message.step, what });
    }
    for (Column { name, only, .. }, energy_j) in Energy::COLUMNS.iter().zip(message.energy().values()) {
        if let Some(part) = only.filter(|part| energy_j.is_some() != header.parts().has(*part)) {
            let what = misplaced(name, part, energy_j.is_none());
            return Err(LogProblem::Contradiction { step: message.step, what });
        }
    }
    peak(message.peak_velocity_m_per_s, header)
        .and_then(|()| junctions(header, message))
        .map_err(|what| LogProblem::Contradiction { step: message.step, what })
}

/// Checks the totals of junctions: both are there in runs with junctions only, and what broke without being pinned
/// again are not more junctions than there are.
fn junctions(header: &RunHeader, message: &StepMessage) -> Result<(), String> {
    let (breaks, repins) = match (message.breaks, message.repins) {
        (None, None) if !header.parts().junctions => return Ok(()),
        (Some(breaks), Some(repins)) if header.parts().junctions => (breaks, repins),
        (Some(_), None) => return Err("it has breaks without repins".to_owned()),
        (None, Some(_)) => return Err("it has repins without breaks".to_owned()),
        (Some(_), _) => return Err("it has breaks and repins, in a run without junctions".to_owned()),
        (None, _) => return Err("it has no breaks and repins, in a run with junctions".to_owned()),
    };
    let junctions = u64::from(header.blocks) * u64::from(header.junction_count);
    match breaks.checked_sub(repins) {
        Some(slipping) if slipping <= junctions => Ok(()),
        _ => Err(format!("{breaks} breaks and {repins} repins of {junctions} junctions")),
    }
}

/// Checks that no total of junctions falls from one step to the next.
///
/// # Errors
/// If one does.
pub(crate) fn totals(step: &StepRecord, before: Option<JunctionTotals>) -> Result<(), LogProblem> {
    let (now, before) = (step.junctions.unwrap_or_default(), before.unwrap_or_default());
    for (key, total, before) in [("breaks", now.breaks, before.breaks), ("repins", now.repins, before.repins)]
    {
        if total < before {
            let what = format!("{key} = {total}, after {before}");
            return Err(LogProblem::Contradiction { step: step.step, what });
        }
    }
    Ok(())
}

/// Checks what only some runs have of a switch: the number of junctions that slip, and the components across
/// the sliding direction, over an area, where a contact detaches by the magnitude of its tangential force.
///
/// # Errors
/// If a value is missing or has no place in the run, more junctions slip than a contact has, or a contact
/// detaches below its threshold.
pub(crate) fn parts_of_switch(header: &RunHeader, message: &SwitchMessage) -> Result<(), LogProblem> {
    let (step, parts) = (message.step, header.parts());
    let contradiction = |what: String| Err(LogProblem::Contradiction { step, what });
    let of_recording = [
        ("error_s", message.error_s),
        ("step_size", message.step_size),
        ("step_size_error", message.step_size_error),
    ];
    let of_parts = [("junctions_slipping", message.junctions_slipping.is_some(), parts.junctions)]
        .into_iter()
        .chain(of_recording.map(|(key, value)| (key, value.is_some(), parts.recording)))
        .chain(message.components_across().map(|(key, value)| (key, value.is_some(), parts.area)));
    for (key, is_there, belongs) in of_parts {
        if is_there != belongs {
            let has = if belongs { "without" } else { "with" };
            return contradiction(format!("a switch of block {} {has} {key}", message.block));
        }
    }
    slipping(header, step, message.junctions_slipping.as_slice())?;
    // Contacts of junctions slip once all of their junctions do.
    if let Some(across_n) = message.tangential_force_across_n
        && !parts.junctions
        && message.direction == Direction::Detach
    {
        let force_n = magnitude([message.tangential_force_n, across_n]);
        // Neither is NaN: JSON has no such numbers.
        if force_n < message.threshold_n {
            let SwitchMessage { block, threshold_n, .. } = message;
            return contradiction(format!("block {block} detaches under {force_n} N, below {threshold_n} N"));
        }
    }
    Ok(())
}

/// Checks the numbers of junctions that slip at contacts.
fn slipping(header: &RunHeader, step: u64, counts: &[u32]) -> Result<(), LogProblem> {
    let Some(most) = counts.iter().find(|count| **count > header.junction_count) else { return Ok(()) };
    let what = format!("{most} junctions slip, of {} at each contact", header.junction_count);
    Err(LogProblem::Contradiction { step, what })
}

/// Checks a switch against its step.
///
/// # Errors
/// If it is of another step, or its block does not follow that of the previous switch.
pub(crate) fn switch(open: &StepRecord, message: &SwitchMessage) -> Result<(), LogProblem> {
    let contradiction = |what: String| Err(LogProblem::Contradiction { step: open.step, what });
    if message.step != open.step || message.time_s != open.time_s {
        return contradiction(format!(
            "a switch that says it is of step {}, {} s",
            message.step, message.time_s
        ));
    }
    match open.switches.last() {
        Some(before) if before.block >= message.block => {
            contradiction(format!("a switch of block {} after one of block {}", message.block, before.block))
        }
        _ => Ok(()),
    }
}

/// Checks the state of all blocks against the run.
///
/// # Errors
/// If an array does not have one value per block, or is not of such a run.
fn fields(header: &RunHeader, record: &FieldRecord) -> Result<(), LogProblem> {
    let blocks = header.blocks as usize;
    let with_junctions = if header.parts().junctions { blocks } else { 0 };
    let across = if header.parts().area { blocks } else { 0 };
    let with_state = if header.flags.state { blocks } else { 0 };
    let lengths = [
        ("displacement_m", record.displacement_m.len(), blocks),
        ("velocity_m_per_s", record.velocity_m_per_s.len(), blocks),
        ("tangential_force_n", record.tangential_force_n.len(), blocks),
        // Only slabs and bodies have it.
        (
            "normal_load_n",
            record.normal_load_n.len(),
            if record.normal_load_n.is_empty() { 0 } else { blocks },
        ),
        ("stick_position_m", record.stick_position_m.len(), blocks),
        ("detached", record.detached.len(), blocks),
        ("junctions_slipping", record.junctions_slipping.len(), with_junctions),
        ("pinned_mean_ratio", record.pinned_mean_ratio.len(), with_junctions),
        ("pinned_width_ratio", record.pinned_width_ratio.len(), with_junctions),
        ("state", record.state.len(), with_state),
        ("displacement_across_m", record.displacement_across_m.len(), across),
        ("velocity_across_m_per_s", record.velocity_across_m_per_s.len(), across),
        ("tangential_force_across_n", record.tangential_force_across_n.len(), across),
        ("stick_position_across_m", record.stick_position_across_m.len(), across),
    ];
    let step = record.step;
    if let Some((key, found, expected)) = lengths.into_iter().find(|(_, found, expected)| found != expected) {
        return Err(length(step, key, found, expected));
    }
    slipping(header, step, &record.junctions_slipping)
}

/// Checks the state of all blocks against the switches before it.
///
/// # Errors
/// If other blocks slide.
pub(crate) fn detached(record: &FieldRecord, detached: &[bool]) -> Result<(), LogProblem> {
    let differing = record.detached.iter().zip(detached).position(|(said, known)| *said != u8::from(*known));
    match differing {
        None => Ok(()),
        Some(n) => Err(LogProblem::Contradiction {
            step: record.step,
            what: format!(
                "detached = {} for block {}, but its switches leave it {}",
                record.detached[n],
                n + 1,
                if detached[n] { "detached" } else { "stuck" }
            ),
        }),
    }
}

/// The error for an array that does not have one value per block.
fn length(step: u64, key: &str, found: usize, expected: usize) -> LogProblem {
    LogProblem::Contradiction { step, what: format!("{key} has {found} values, not {expected}") }
}

/// Checks the state of a range of blocks.
///
/// # Errors
/// If the slider does not have these blocks, or the arrays differ in length, or are not of such a run.
fn window(header: &RunHeader, record: &WindowRecord) -> Result<(), LogProblem> {
    let (step, blocks) = (record.step, header.blocks);
    let count = record.displacement_m.len();
    let across = if header.parts().area { count } else { 0 };
    for (key, found, expected) in [
        ("velocity_m_per_s", record.velocity_m_per_s.len(), count),
        ("tangential_force_n", record.tangential_force_n.len(), count),
        ("displacement_across_m", record.displacement_across_m.len(), across),
        ("velocity_across_m_per_s", record.velocity_across_m_per_s.len(), across),
        ("tangential_force_across_n", record.tangential_force_across_n.len(), across),
    ] {
        if found != expected {
            return Err(length(step, key, found, expected));
        }
    }
    let next = u64::from(record.first_block) + count as u64;
    if record.first_block == 0 || count == 0 || next > u64::from(blocks) + 1 {
        let what =
            format!("a window of {count} blocks from block {} of {}", record.first_block, all_of(header));
        return Err(LogProblem::Contradiction { step, what });
    }
    Ok(())
}

/// Checks so many samples of a recording, and the lengths of their arrays: key, found and expected.
fn samples(
    header: &RunHeader,
    step: u64,
    samples: u32,
    lengths: [(&str, usize, usize); 2],
) -> Result<(), LogProblem> {
    if header.sensors.is_none() || !(1..=SignalRecord::MOST_SAMPLES).contains(&samples) {
        let what = format!("{samples} samples (accepted: 1 to 1000, in a recording)");
        return Err(LogProblem::Contradiction { step, what });
    }
    match lengths.into_iter().find(|(_, found, expected)| found != expected) {
        Some((key, found, expected)) => Err(length(step, key, found, expected)),
        None => Ok(()),
    }
}

/// Checks a record of one message, by itself.
///
/// # Errors
/// If it cannot be of that run.
pub(crate) fn record(header: &RunHeader, record: &Record) -> Result<(), LogProblem> {
    match record {
        Record::Fields(record) => fields(header, record),
        Record::Window(record) => window(header, record),
        Record::Signal(SignalRecord { step, samples, least, mean, largest, .. }) => {
            let lengths = [("least", least.len(), mean.len()), ("largest", largest.len(), mean.len())];
            self::samples(header, *step, *samples, lengths)
        }
        Record::Traces(TraceRecord { step, samples, sensors, values, .. }) => {
            let [sensors, blocks] = [*sensors, header.blocks].map(|count| count as usize);
            let expected = blocks * *samples as usize;
            let lengths = [("sensors", sensors, blocks), ("values", values.len(), expected)];
            self::samples(header, *step, *samples, lengths)
        }
        Record::Row(row) => {
            let kind = (RowKind::with(row.values.topic()).expect("it was read as a row").kind)();
            let cells = kind.cells(&row.values).unwrap_or_default();
            let contradicts = |what| LogProblem::Contradiction { step: row.step, what };
            ranges(&kind.columns(), &cells, header).map_err(contradicts)
        }
        Record::Step(_) => Ok(()),
    }
}

/// Reads an event of the run with that header, and checks that its payload matches its topic, and that it has
/// the places and parts of such a run. What else it says is compared with the steps, where these are read.
///
/// # Errors
/// A message about what is wrong.
pub(crate) fn event(topic: &str, payload: &str, header: &RunHeader) -> Result<Event, serde_json::Error> {
    match topic {
        SlipEvent::TOPIC => read::<SlipEvent>(payload, header),
        Onset::TOPIC => read::<Onset>(payload, header),
        Rupture::TOPIC => read::<Rupture>(payload, header),
        Arrival::TOPIC => read::<Arrival>(payload, header),
        GlobalSlip::TOPIC => read::<GlobalSlip>(payload, header),
        LoadDrop::TOPIC => read::<LoadDrop>(payload, header),
        _ => {
            // An event of an unknown detector, which must still be a JSON object.
            serde_json::from_str::<Map<String, Value>>(payload)?;
            Ok(Event::of_json(topic, payload))
        }
    }
}

fn read<P: EventPayload>(payload: &str, header: &RunHeader) -> Result<Event, serde_json::Error> {
    let read: P = serde_json::from_str(payload)?;
    ranges(P::COLUMNS, read.cells().as_ref(), header).map_err(serde::de::Error::custom)?;
    Ok(Event::new(read))
}

/// Checks the cells of an event by the roles of their columns: places exist, ranges do not end before they
/// begin, and columns that only some runs have are there in those alone.
fn ranges(columns: &[Column], cells: &[Cell], header: &RunHeader) -> Result<(), String> {
    let (parts, contacts) = (header.parts(), header.contacts());
    let mut before: Option<(&Column, u64)> = None;
    for (column, cell) in columns.iter().zip(cells) {
        let (name, is_empty) = (&*column.name, *cell == Cell::Empty);
        if let Some(part) = column.only
            && (if parts.has(part) { is_empty && column.role == Some(Role::Place) } else { !is_empty })
        {
            return Err(misplaced(name, part, is_empty));
        }
        let value = match (column.role, cell) {
            (Some(Role::Place), Cell::Count(place)) => u64::from(*place),
            (Some(Role::Step | Role::Total), Cell::Step(step)) => *step,
            _ => continue,
        };
        if column.role == Some(Role::Place) {
            let most = match name {
                "first_block" | "last_block" | "column" => contacts.columns(),
                "first_across" | "last_across" | "across" => contacts.rows(),
                _ => header.blocks,
            };
            if !(1..=u64::from(most)).contains(&value) {
                return Err(format!("{name} = {value} of {}", all_of(header)));
            }
        }
        if let Some((first, from)) = before.filter(|(first, _)| is_range(first, column)) {
            let is_in_order = if column.role == Some(Role::Step) { from < value } else { from <= value };
            if !is_in_order {
                return Err(format!("{name} = {value}, and {} = {from}", first.name));
            }
        }
        before = Some((column, value));
    }
    Ok(())
}

/// That a value is missing in a run with the part that has it, or is there in another run.
fn misplaced(name: &str, part: Part, is_empty: bool) -> String {
    let [has, with] = if is_empty { ["lacks", "with"] } else { ["has", "without"] };
    format!("it {has} {name}, in a run {with} {part:?}")
}

/// Whether two columns, one after the other, are the ends of a range: `first_block` and `last_block`,
/// `onset_step` and `end_step`, `breaks_onset` and `breaks_end`.
fn is_range(first: &Column, last: &Column) -> bool {
    let thing = first.name.strip_prefix("first").or(first.name.strip_suffix("onset"));
    let end = last.name.strip_prefix("last").or(last.name.strip_suffix("end"));
    first.role == last.role && (first.role == Some(Role::Step) || thing.is_some() && thing == end)
}

/// Checks the largest speed of a step or an event: a number from 0 on in runs with a state, and none in others.
fn peak(speed: Option<f64>, header: &RunHeader) -> Result<(), String> {
    let has_state = header.flags.state;
    if speed.is_some() != has_state || speed.is_some_and(|speed| speed < 0.0) {
        return Err(format!("peak_velocity_m_per_s = {speed:?}, in a run with has_state = {has_state}"));
    }
    Ok(())
}

/// All contacts of a run, in words.
pub(crate) fn all_of(header: &RunHeader) -> String {
    let contacts = header.contacts();
    match header.parts().area {
        false => format!("a chain of {}", header.blocks),
        true => format!("{} columns and {} rows", contacts.columns(), contacts.rows()),
    }
}
