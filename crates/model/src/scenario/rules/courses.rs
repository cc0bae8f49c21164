//! Rules of courses in time, of the drive and of the loads.

use asperity_record::{TimeGrid, counted};

use crate::scenario::Scenario;
use crate::scenario::choices::{DriveKind, ScheduleFrom};
use crate::scenario::source::Refusals;

/// The times of all courses, each with its key.
pub(super) fn times_s(scenario: &Scenario) -> [(&'static str, &[f64]); 4] {
    let (load, drive, prestress) = (&scenario.normal_load, &scenario.drive, &scenario.prestress);
    [
        ("normal_load.schedule_s", &load.schedule_s),
        ("drive.course_s", &drive.course_s),
        ("normal_load.course_s", &load.course_s),
        ("prestress.course_s", &prestress.course_s),
    ]
}

pub(super) fn courses_ascend_from_the_start(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (load, drive, prestress) = (&scenario.normal_load, &scenario.drive, &scenario.prestress);
    let of_drive = match drive.kind {
        DriveKind::Force => ("drive.course_n", &drive.course_n),
        _ => ("drive.course_m_per_s", &drive.course_m_per_s),
    };
    let values = [
        ("normal_load.schedule_n", &load.schedule_n),
        of_drive,
        ("normal_load.course_factor", &load.course_factor),
        ("prestress.course_ratio", &prestress.course_ratio),
    ];
    for ((times_key, times), (key, values)) in times_s(scenario).into_iter().zip(values) {
        let (contacts, count) = (scenario.slider.contacts() as usize, times.len());
        let problem =
            || format!("{} at {}", counted(values.len() as u64, "value"), counted(count as u64, "time"));
        if key.starts_with("normal_load.course") || key.starts_with("prestress") {
            if values.len() != count && values.len() != count * contacts {
                let problem = format!("{} of {contacts} blocks", problem());
                refusals.refuse(key, problem, format!("{count} or {} values", count * contacts));
            }
        } else if count != values.len() || count == 1 {
            refusals.refuse(key, problem(), format!("as many as {times_key}, none or at least 2"));
        }
        let step = |at: usize| TimeGrid::new(scenario.time.step_s).nearest_step(times[at]);
        let jumps = ["drive.course_s", "prestress.course_s"].contains(&times_key);
        // Of three equal times the second would have no effect.
        let descends = |at: &usize| match jumps {
            false => step(*at) <= step(at - 1),
            true => step(*at) < step(at - 1) || (*at > 1 && step(*at) == step(at - 2)),
        };
        if let Some(at) = (1..count).find(descends) {
            let accepted = match jumps {
                false => "times that ascend, by at least time.step_s",
                true => "times that ascend; two may be equal, for a jump",
            };
            refusals.refuse(times_key, format!("goes from {} to {}", times[at - 1], times[at]), accepted);
        }
        let start = match key {
            "normal_load.schedule_n" => Some(("normal_load.total_n", load.total_n)),
            "drive.course_m_per_s" => Some(("drive.velocity_m_per_s", drive.velocity_m_per_s)),
            _ => None,
        };
        if let (Some((start_key, start)), Some(first)) = (start, values.first())
            && *first != start
        {
            let problem = format!("begins with {first}, but before it {start_key} is {start}");
            refusals.refuse(key, problem, format!("a first value of {start_key}"));
        }
    }
    if drive.kind == DriveKind::Force && drive.course_n.is_empty() {
        let accepted = "two forces or more, at drive.course_s";
        refusals.refuse("drive.course_n", "a drive by force has no forces", accepted);
    }
    let stops = drive.hold_from_s > 0.0 || drive.until_load_ratio > 0.0;
    if load.schedule_from == ScheduleFrom::Hold && !stops {
        let accepted = "\"start\", or drive.hold_from_s or drive.until_load_ratio above 0";
        refusals.refuse("normal_load.schedule_from", "the drive never stops", accepted);
    }
}
