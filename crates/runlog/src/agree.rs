//! Consistency checks between messages of a log, or between fields of one message. A writer cannot violate
//! them; readers of one of two redundant values can rely on it.

use mcap::records::MessageHeader;

use asperity_record::{
    Arrival, BoundingBox, Direction, Event, EventPayload, FieldRecord, GlobalSlip, JunctionTotals, Onset,
    Reach, RunHeader, Rupture, SlipEvent, StepRecord, WindowRecord, magnitude,
};
use serde_json::{Map, Value};

use crate::messages::{StepMessage, SwitchMessage};
use crate::problem::LogProblem;

/// The time of a message in the file, in nanoseconds, for a step; None if it exceeds what a file
/// can store.
pub(crate) fn time_ns(header: &RunHeader, step: u64) -> Option<u64> {
    let grid = header.time_grid();
    match grid.step_ns() {
        Some(step_ns) => step.checked_mul(step_ns),
        None => Some(grid.time_ns(step)),
    }
}

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
    let expected_ns = time_ns(header, step);
    let Some(found_ns) =
        [head.log_time, head.publish_time].into_iter().find(|found_ns| Some(*found_ns) != expected_ns)
    else {
        return Ok(());
    };
    let expected = expected_ns.map_or("any time that a file can give".to_owned(), |ns| format!("{ns} ns"));
    let what = format!("the message of {topic} stands at {found_ns} ns, not at {expected}");
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
    if message.radiated_j.is_some() != header.radiates {
        let what =
            format!("radiated_j = {:?}, in a run with radiates = {}", message.radiated_j, header.radiates);
        return Err(LogProblem::Contradiction { step: message.step, what });
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
    let of_parts = [("junctions_slipping", message.junctions_slipping.is_some(), parts.junctions)]
        .into_iter()
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
pub(crate) fn fields(header: &RunHeader, record: &FieldRecord) -> Result<(), LogProblem> {
    let blocks = header.blocks as usize;
    let with_junctions = if header.parts().junctions { blocks } else { 0 };
    let across = if header.parts().area { blocks } else { 0 };
    let with_state = if header.has_state { blocks } else { 0 };
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
pub(crate) fn window(header: &RunHeader, record: &WindowRecord) -> Result<(), LogProblem> {
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

/// Reads an event of the run with that header, and checks that its payload matches its topic, and
/// that its blocks and steps exist.
///
/// # Errors
/// A message about what is wrong.
pub(crate) fn event(topic: &str, payload: &str, header: &RunHeader) -> Result<Event, serde_json::Error> {
    let blocks = header.blocks;
    let wrong = |what: String| Err(serde::de::Error::custom(what));
    let in_chain = |block: u32| (1..=blocks).contains(&block);
    if topic == SlipEvent::TOPIC {
        let slip: SlipEvent = serde_json::from_str(payload)?;
        let &SlipEvent { nucleation_block, blocks_slipped, max_sliding, .. } = &slip;
        let most = event_box(slip.bounding_box(), [slip.first_across, slip.last_across], header)
            .and_then(|most| nucleation(slip.bounding_box(), nucleation_block, header).map(|()| most));
        let most = most.map_err(serde::de::Error::custom)?;
        for (key, count) in [("blocks_slipped", blocks_slipped), ("max_sliding", max_sliding)] {
            if !(1..=most).contains(&u64::from(count)) {
                return wrong(format!("{key} = {count} between {}", ends(slip.bounding_box(), header)));
            }
        }
        if slip.end_step.is_some_and(|end| end <= slip.onset_step) {
            return wrong(format!(
                "it ends in step {:?} and begins in step {}",
                slip.end_step, slip.onset_step
            ));
        }
        if slip.open != slip.end_step.is_none() || slip.open != slip.end_s.is_none() {
            return wrong(format!("open = {}, and it ends in step {:?}", slip.open, slip.end_step));
        }
        if let Err(what) = peak(slip.peak_velocity_m_per_s, header) {
            return wrong(what);
        }
        let junctions = header.parts().junctions;
        for (what, onset, end) in
            [("breaks", slip.breaks_onset, slip.breaks_end), ("repins", slip.repins_onset, slip.repins_end)]
        {
            if onset.is_some() != junctions
                || end.is_some() != (junctions && !slip.open)
                || end < onset && end.is_some()
            {
                return wrong(format!("{what}_onset = {onset:?} and {what}_end = {end:?}"));
            }
        }
        Ok(Event::new(slip))
    } else if topic == Onset::TOPIC {
        let onset: Onset = serde_json::from_str(payload)?;
        let &Onset { nucleation_block, nucleation_blocks, .. } = &onset;
        if !in_chain(nucleation_block) || !in_chain(nucleation_blocks) {
            return wrong(format!(
                "{nucleation_blocks} blocks from block {nucleation_block} of {}",
                all_of(header)
            ));
        }
        if onset.tangential_force_across_n.is_some() != header.parts().area {
            let across_n = onset.tangential_force_across_n;
            return wrong(format!("tangential_force_across_n = {across_n:?}, in {}", kind_of(header)));
        }
        Ok(Event::new(onset))
    } else if topic == Rupture::TOPIC {
        let read: Rupture = serde_json::from_str(payload)?;
        rupture(&read, header).map_or_else(wrong, |()| Ok(Event::new(read)))
    } else if topic == Arrival::TOPIC {
        let read: Arrival = serde_json::from_str(payload)?;
        arrival(&read, header).map_or_else(wrong, |()| Ok(Event::new(read)))
    } else if topic == GlobalSlip::TOPIC {
        Ok(Event::new(serde_json::from_str::<GlobalSlip>(payload)?))
    } else {
        // An event of an unknown detector, which must still be a JSON object.
        serde_json::from_str::<Map<String, Value>>(payload)?;
        Ok(Event::of_json(topic, payload))
    }
}

/// Checks the largest speed of a step or an event: a number from 0 on in runs with a state, and none in others.
fn peak(speed: Option<f64>, header: &RunHeader) -> Result<(), String> {
    let has_state = header.has_state;
    if speed.is_some() != has_state || speed.is_some_and(|speed| speed < 0.0) {
        return Err(format!("peak_velocity_m_per_s = {speed:?}, in a run with has_state = {has_state}"));
    }
    Ok(())
}

/// What kind of run a header is of, as far as its contacts go, in words.
fn kind_of(header: &RunHeader) -> String {
    match header.parts().area {
        false => "a run without an area of contact".to_owned(),
        true => format!("a run with {} rows of contacts", header.rows),
    }
}

/// All contacts of a run, in words.
pub(crate) fn all_of(header: &RunHeader) -> String {
    let contacts = header.contacts();
    match header.parts().area {
        false => format!("a chain of {}", header.blocks),
        true => format!("{} columns and {} rows", contacts.columns(), contacts.rows()),
    }
}

/// The ends of the box of an event, in words: first and last block, or column and row.
fn ends(of: BoundingBox, header: &RunHeader) -> String {
    let BoundingBox { columns: Reach { first, last }, rows } = of;
    match header.parts().area {
        false => format!("blocks {first} and {last}"),
        true => format!("columns {first} and {last}, rows {} and {}", rows.first, rows.last),
    }
}

/// Checks the box of an event, whose first and last row are given over an area only; returns how many
/// contacts lie in it.
fn event_box(of: BoundingBox, across: [Option<u32>; 2], header: &RunHeader) -> Result<u64, String> {
    let BoundingBox { columns: Reach { first, last }, rows } = of;
    let contacts = header.contacts();
    if across.iter().any(|row| row.is_some() != header.parts().area) {
        let [first, last] = across;
        return Err(format!("first_across = {first:?} and last_across = {last:?}, in {}", kind_of(header)));
    }
    if of.is_within(contacts) {
        return Ok(of.count());
    }
    let Reach { first: first_row, last: last_row } = rows;
    let of = match header.parts().area {
        false => format!("blocks {first} to {last}"),
        true => format!("columns {first} to {last} and rows {first_row} to {last_row}"),
    };
    Err(format!("{of} of {}", all_of(header)))
}

/// Checks that an event began within its box.
fn nucleation(of: BoundingBox, nucleation_block: u32, header: &RunHeader) -> Result<(), String> {
    if (1..=header.blocks).contains(&nucleation_block) && of.contains(nucleation_block, header.contacts()) {
        return Ok(());
    }
    let BoundingBox { columns: Reach { first, last }, rows } = of;
    let rows = match header.parts().area {
        false => String::new(),
        true => format!(" and rows {} to {}", rows.first, rows.last),
    };
    Err(format!("nucleation at block {nucleation_block}, outside {first} to {last}{rows}"))
}

/// How many contacts of a rupture have slid: in a single row all from the first to the last.
///
/// Over an area neighbours differ by one column and one row at most, so each column and each row of the box
/// has one.
fn slipped(rupture: &Rupture, most: u64, header: &RunHeader) -> Result<u32, String> {
    let BoundingBox { columns, rows } = rupture.bounding_box();
    match rupture.contacts {
        None if !header.parts().area => Ok(columns.count()),
        Some(contacts) if header.parts().area => {
            let fewest = columns.count().max(rows.count());
            let is_possible = contacts >= fewest && u64::from(contacts) <= most;
            let between = || ends(rupture.bounding_box(), header);
            is_possible
                .then_some(contacts)
                .ok_or_else(|| format!("contacts = {contacts} between {}", between()))
        }
        contacts => Err(format!("contacts = {contacts:?}, in {}", kind_of(header))),
    }
}

fn rupture(rupture: &Rupture, header: &RunHeader) -> Result<(), String> {
    let &Rupture { nucleation_block, onset_step, end_step, open, first_across, last_across, .. } = rupture;
    let of = rupture.bounding_box();
    let most = event_box(of, [first_across, last_across], header)?;
    nucleation(of, nucleation_block, header)?;
    let (blocks, count) = (header.blocks, slipped(rupture, most, header)?);
    if rupture.reached_every_block != (count == blocks) {
        let said = rupture.reached_every_block;
        return Err(format!("reached_every_block = {said} of {count} blocks of {}", all_of(header)));
    }
    if rupture.detachments < u64::from(count) {
        return Err(format!("{} detachments of {count} blocks", rupture.detachments));
    }
    if end_step.is_some_and(|end| end <= onset_step) {
        return Err(format!("it ends in step {end_step:?} and begins in step {onset_step}"));
    }
    let ends = [end_step.is_some(), rupture.end_s.is_some(), rupture.ft_fn_end.is_some()];
    if ends.iter().any(|is_there| *is_there != ends[0]) || (!ends[0] && !open) {
        return Err(format!("open = {open}, and it ends in step {end_step:?}"));
    }
    if rupture.radiated_j.is_some() && !header.radiates {
        return Err("it has radiated_j, in a run without radiation".to_owned());
    }
    let potencies = [("potency_m2", rupture.potency_m2, false), ("potency_m3", rupture.potency_m3, true)];
    match potencies
        .into_iter()
        .find(|(_, potency, of_area)| potency.is_some() && *of_area != header.parts().area)
    {
        None => Ok(()),
        Some((key, ..)) => Err(format!("it has {key}, in {}", kind_of(header))),
    }
}

fn arrival(arrival: &Arrival, header: &RunHeader) -> Result<(), String> {
    let &Arrival { block, arrival_step, stop_step, detachments, column, across, .. } = arrival;
    let blocks = header.blocks;
    if !(1..=blocks).contains(&block) {
        return Err(format!("block {block} of {}", all_of(header)));
    }
    if detachments == 0 {
        return Err(format!("block {block} is passed without a detachment"));
    }
    if stop_step.is_some_and(|stop| stop <= arrival_step) {
        return Err(format!("it stops in step {stop_step:?} and arrives in step {arrival_step}"));
    }
    let stops = [arrival.stop_s.is_some(), arrival.slip_m.is_some(), arrival.force_attach_n.is_some()];
    if stops.iter().any(|is_there| *is_there != stop_step.is_some()) {
        return Err(format!("it stops in step {stop_step:?}, but not in all that is said of that"));
    }
    let (is_area, contacts) = (header.parts().area, header.contacts());
    let place = is_area.then(|| (contacts.column(block), contacts.row(block)));
    if column.zip(across) != place || column.is_some() != is_area || across.is_some() != is_area {
        return Err(format!(
            "column = {column:?} and across = {across:?} of block {block}, in {}",
            kind_of(header)
        ));
    }
    if arrival.slip_across_m.is_some() != (is_area && stop_step.is_some()) {
        return Err(format!("slip_across_m = {:?}, in {}", arrival.slip_across_m, kind_of(header)));
    }
    if arrival.local_speed_m_per_s.is_some() && !is_area {
        return Err(format!("it has local_speed_m_per_s, in {}", kind_of(header)));
    }
    Ok(())
}
