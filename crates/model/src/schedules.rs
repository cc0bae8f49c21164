//! Rules of courses in time, of the load and of the velocity of the drive.

use asperity_record::TimeGrid;

use crate::choices::ScheduleFrom;
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
    /// The key of the value at the start.
    start: (&'static str, f64),
    /// Whether the value may jump.
    jumps: bool,
}

/// The courses of a scenario.
fn courses(scenario: &Scenario) -> [Course<'_>; 2] {
    let (load, drive) = (&scenario.normal_load, &scenario.drive);
    [
        Course {
            times: ("normal_load.schedule_s", &load.schedule_s),
            values: ("normal_load.schedule_n", &load.schedule_n),
            what: ["load", "loads"],
            start: ("normal_load.total_n", load.total_n),
            jumps: false,
        },
        Course {
            times: ("drive.course_s", &drive.course_s),
            values: ("drive.course_m_per_s", &drive.course_m_per_s),
            what: ["velocity", "velocities"],
            start: ("drive.velocity_m_per_s", drive.velocity_m_per_s),
            jumps: true,
        },
    ]
}

/// All times of courses, each with its key.
pub(crate) fn times_s(scenario: &Scenario) -> impl Iterator<Item = (&'static str, f64)> {
    let of =
        |Course { times: (key, times), .. }: Course<'_>| times.iter().map(|time_s| (key, *time_s)).collect();
    courses(scenario).map(of).into_iter().flat_map(|times: Vec<(&'static str, f64)>| times)
}

/// Checks the rules of courses.
pub(crate) fn refused(scenario: &Scenario) -> Vec<Refusal> {
    let grid = TimeGrid::new(scenario.time.step_s);
    let mut refused: Vec<Refusal> =
        courses(scenario).iter().flat_map(|course| of_course(course, grid)).collect();
    let drive = &scenario.drive;
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
    let (start_key, start) = course.start;
    if let Some(first) = values.first().filter(|first| **first != start) {
        refused.push((
            values_key,
            format!("begins with {first}, but the {one} before it is {start}"),
            format!("a first {one} of {start_key}"),
        ));
    }
    refused
}
