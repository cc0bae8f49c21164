//! Rules of courses in time, of the load and of the velocity of the drive.

use asperity_record::TimeGrid;

use crate::choices::{DriveKind, ScheduleFrom};
use crate::lattice_keys::Refusal;
use crate::scenario::Scenario;

/// The keys of a course, and what it begins with.
struct Course<'a> {
    /// Its times.
    times: (&'static str, &'a [f64]),
    /// Its values.
    values: (&'static str, &'a [f64]),
    /// What a value is, and several of them.
    what: [&'static str; 2],
    /// The key of the value at the start, if there is one.
    start: Option<(&'static str, f64)>,
    /// Whether the value may jump.
    jumps: bool,
}

/// The courses of a scenario.
fn courses(scenario: &Scenario) -> [Course<'_>; 2] {
    let (load, drive) = (&scenario.normal_load, &scenario.drive);
    let times = ("drive.course_s", drive.course_s.as_slice());
    let of_drive = match drive.kind {
        DriveKind::Force => Course {
            times,
            values: ("drive.course_n", &drive.course_n),
            what: ["force", "forces"],
            start: None,
            jumps: true,
        },
        DriveKind::Side | DriveKind::Top | DriveKind::LeftRight => Course {
            times,
            values: ("drive.course_m_per_s", &drive.course_m_per_s),
            what: ["velocity", "velocities"],
            start: Some(("drive.velocity_m_per_s", drive.velocity_m_per_s)),
            jumps: true,
        },
    };
    [
        Course {
            times: ("normal_load.schedule_s", &load.schedule_s),
            values: ("normal_load.schedule_n", &load.schedule_n),
            what: ["load", "loads"],
            start: Some(("normal_load.total_n", load.total_n)),
            jumps: false,
        },
        of_drive,
    ]
}

/// The keys of a course of all contacts: its times, its values and its file.
struct ContactCourse<'a> {
    times: (&'static str, &'a [f64]),
    values: (&'static str, &'a [f64]),
    file: (&'static str, &'a str),
}

fn contact_courses(scenario: &Scenario) -> [ContactCourse<'_>; 2] {
    let (load, prestress) = (&scenario.normal_load, &scenario.prestress);
    [
        ContactCourse {
            times: ("normal_load.course_s", &load.course_s),
            values: ("normal_load.course_factor", &load.course_factor),
            file: ("normal_load.course_csv", &load.course_csv),
        },
        ContactCourse {
            times: ("prestress.course_s", &prestress.course_s),
            values: ("prestress.course_ratio", &prestress.course_ratio),
            file: ("prestress.course_csv", &prestress.course_csv),
        },
    ]
}

/// All times of courses, each with its key.
pub(crate) fn times_s(scenario: &Scenario) -> impl Iterator<Item = (&'static str, f64)> {
    let of =
        |Course { times: (key, times), .. }: Course<'_>| times.iter().map(|time_s| (key, *time_s)).collect();
    let of_contacts = contact_courses(scenario).map(|ContactCourse { times: (key, times), .. }| {
        times.iter().map(|time_s| (key, *time_s)).collect::<Vec<_>>()
    });
    let of_all = courses(scenario).map(of).into_iter().flat_map(|times: Vec<(&'static str, f64)>| times);
    of_all.chain(of_contacts.into_iter().flatten())
}

/// Checks the rules of courses.
pub(crate) fn refused(scenario: &Scenario) -> Vec<Refusal> {
    let grid = TimeGrid::new(scenario.time.step_s);
    let mut refused: Vec<Refusal> =
        courses(scenario).iter().flat_map(|course| of_course(course, grid)).collect();
    let drive = &scenario.drive;
    refused.extend(contact_courses(scenario).iter().flat_map(|course| of_contacts(course, scenario, grid)));
    refused.extend(by_force(scenario));
    let stops = drive.hold_from_s > 0.0 || drive.until_load_ratio > 0.0;
    if scenario.normal_load.schedule_from == ScheduleFrom::Hold && !stops {
        let accepted = "\"start\", or drive.hold_from_s or drive.until_load_ratio above 0";
        refused.push(("normal_load.schedule_from", "the drive never stops".to_owned(), accepted.to_owned()));
    }
    refused
}

fn of_course(course: &Course<'_>, grid: TimeGrid) -> Vec<Refusal> {
    let Course { times: (times_key, times), values: (values_key, values), what: [one, several], .. } =
        *course;
    let mut refused = Vec::new();
    if times.len() != values.len() || times.len() == 1 {
        refused.push((
            values_key,
            format!("{} {several} at {} times", values.len(), times.len()),
            format!("as many as {times_key}, none or at least 2"),
        ));
    }
    let step = |at: usize| grid.nearest_step(times[at]);
    // Of three equal times the second would have no effect.
    let descends = |at: &usize| match course.jumps {
        false => step(*at) <= step(at - 1),
        true => step(*at) < step(at - 1) || (*at > 1 && step(*at) == step(at - 2)),
    };
    if let Some(at) = (1..times.len()).find(descends) {
        let accepted = match course.jumps {
            false => "times that ascend, by at least time.step_s",
            true => "times that ascend; two may be equal, for a jump",
        };
        refused.push((
            times_key,
            format!("goes from {} to {}", times[at - 1], times[at]),
            accepted.to_owned(),
        ));
    }
    if let Some((start_key, start)) = course.start
        && let Some(first) = values.first().filter(|first| **first != start)
    {
        refused.push((
            values_key,
            format!("begins with {first}, but the {one} before it is {start}"),
            format!("a first {one} of {start_key}"),
        ));
    }
    refused
}

/// The rules of a drive by force.
fn by_force(scenario: &Scenario) -> Vec<Refusal> {
    let drive = &scenario.drive;
    let mut refused = Vec::new();
    if drive.kind != DriveKind::Force {
        if !drive.course_n.is_empty() {
            let problem = "a drive by springs has no course of its force".to_owned();
            refused.push(("drive.course_n", problem, "none, or drive.kind = \"force\"".to_owned()));
        }
        return refused;
    }
    let mut refuse =
        |key, problem: &str, accepted: &str| refused.push((key, problem.to_owned(), accepted.to_owned()));
    if drive.course_n.is_empty() {
        refuse("drive.course_n", "a drive by force has no forces", "two forces or more, at drive.course_s");
    }
    if !drive.course_m_per_s.is_empty() {
        refuse("drive.course_m_per_s", "a drive by force has no velocity", "none, or another drive.kind");
    }
    if scenario.slider.is_lattice() || !scenario.friction.law.sticks() {
        refuse(
            "drive.kind",
            "\"force\" pulls block 1 of a chain by whose friction blocks stick",
            "\"side\" or \"top\"",
        );
    }
    refused
}

/// The rules of a course of all contacts.
fn of_contacts(course: &ContactCourse<'_>, scenario: &Scenario, grid: TimeGrid) -> Vec<Refusal> {
    let ContactCourse { times: (times_key, times), values: (values_key, values), file: (file_key, file) } =
        *course;
    let (contacts, counted) = (scenario.slider.contacts() as usize, times.len());
    let mut refused = Vec::new();
    let is_there = !times.is_empty() || !values.is_empty() || !file.is_empty();
    let law = scenario.friction.law;
    let is_load = values_key == "normal_load.course_factor";
    // By rate-and-state, energies do not include the work of a force that changes.
    let is_of_law = scenario.contact_law().junctions().is_none() && (law.sticks() || is_load);
    let is_known = !scenario.slider.is_lattice() && is_of_law;
    if is_there && !is_known {
        let key = if times.is_empty() { file_key } else { times_key };
        let problem = "courses of single contacts are those of a chain, by a law with one state per contact";
        let or = if is_load { ", \"rate-and-state\"" } else { "" };
        let accepted = format!(
            "none, or a chain with friction.law = \"interfacial-springs\", \"rigid\"{or} or \"velocity-weakening\""
        );
        refused.push((key, problem.to_owned(), accepted));
        return refused;
    }
    if values.len() != counted && values.len() != counted * contacts {
        refused.push((
            values_key,
            format!("{} values at {counted} times of {contacts} blocks", values.len()),
            format!("{counted} or {} values", counted * contacts),
        ));
        return refused;
    }
    let step = |at: usize| grid.nearest_step(times[at]);
    if let Some(at) = (1..counted).find(|at| step(*at) <= step(at - 1)) {
        let problem = format!("goes from {} to {}", times[at - 1], times[at]);
        refused.push((times_key, problem, "times that ascend, by at least time.step_s".to_owned()));
    }
    refused
}
