//! Curves of a fault line in a medium: its slip by depth, and its series as solved.

use asperity_model::body::medium::Medium;
use asperity_record::{SeriesBlock, SlipEvent, YEAR_S, short, unit_of_time};

use crate::curve::{Curve, CurveKeys, Role};
use crate::run_data::RunData;

/// The fault line of a run, or that it has none.
fn medium(run: &RunData) -> Result<&Medium, String> {
    let none = || format!("run {} has no fault line in a medium (accepted: slider.medium)", run.name);
    run.plan.medium.as_deref().ok_or_else(none)
}

/// No line has more points than can be seen.
pub(crate) fn slip_profiles(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    const POINTS: usize = 200;
    let (medium, states) = (medium(run)?, run.states()?);
    let interval_s = |key: &str, given: Option<f64>, usual_s: f64| match given.unwrap_or(usual_s) {
        every_s if every_s > 0.0 => Ok(every_s),
        other => Err(format!("{key}: {other} is not accepted (accepted: a number of seconds above 0)")),
    };
    let every_s = interval_s("every_s", keys.every_s, 5.0 * YEAR_S)?;
    let event_every_s = interval_s("event_every_s", keys.event_every_s, 1.0)?;
    let nodes: Vec<usize> = (0..medium.nodes()).step_by(medium.nodes().div_ceil(POINTS)).collect();
    let event = |time_s: f64| {
        let within =
            |slip: &&SlipEvent| slip.onset_s <= time_s && slip.end_s.is_none_or(|end_s| time_s < end_s);
        run.slips.iter().find(within)
    };
    // In which interval a time is; one that is at its beginning but for rounding is in it.
    let number = |time_s: f64, every_s: f64| (time_s / every_s * (1.0 + 1e-12)).floor() as u64;
    let mut lines = [Vec::new(), Vec::new()];
    let mut last = [None, None];
    let mut add = |is_slow: bool, interval: (u64, u64), slip_m: &dyn Fn(usize) -> f64| {
        let kind = usize::from(!is_slow);
        if last[kind].replace(interval) != Some(interval) {
            lines[kind].extend(nodes.iter().map(|n| (slip_m(*n), medium.depth_m(*n) / 1e3)));
            lines[kind].push((f64::NAN, f64::NAN));
        }
    };
    let courses: Vec<&[(f64, f64)]> = (1..=run.header.blocks).map(|n| states.displacement_of(n)).collect();
    for (n, (time_s, _)) in courses.first().copied().unwrap_or_default().iter().enumerate() {
        if event(*time_s).is_none() {
            add(true, (0, number(*time_s, every_s)), &|node| courses[node][n].1);
        }
    }
    for state in run.rupture_fields()? {
        if let Some(slip) = event(state.time_s) {
            let interval = number(state.time_s - slip.onset_s, event_every_s);
            add(false, (slip.event, interval), &|node| state.displacement_m[node]);
        }
    }
    let [slow, events] = lines;
    if slow.is_empty() && events.is_empty() {
        return Err(format!("run {} has no recorded states (accepted: recording.fields_s)", run.name));
    }
    let (unit_s, unit) = unit_of_time(every_s);
    let event_every_s = event_every_s.max(run.scenario.recording.rupture_fields_s);
    Ok(vec![
        Curve::new(Role::Measured, format!("slow: every {} {unit}", short(every_s / unit_s)), slow),
        Curve::new(Role::Measured, format!("in events: every {} s", short(event_every_s)), events),
    ])
}

pub(crate) fn largest_velocity(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    let rows = run.series()?.0.iter().filter(|row| keys.is_from_to(row.time_s));
    let points = rows.map(|row| (row.time_s, row.v_max_m_per_s));
    let curve = Curve::new(Role::Measured, "", points.collect());
    if curve.points.is_empty() { Err(without_series(run, "series_every")) } else { Ok(vec![curve]) }
}

fn without_series(run: &RunData, key: &str) -> String {
    format!("run {} has no such series (accepted: a run with recording.{key})", run.name)
}

pub(crate) fn stations(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    const MOST: usize = 5;
    let (medium, (_, rows), name) = (medium(run)?, run.series()?, &run.name);
    let recorded: Vec<u32> = run.plan.recording.series_blocks.iter().map(|n| *n as u32 + 1).collect();
    let every = recorded.len().div_ceil(MOST).max(1);
    let shown: Vec<u32> = match keys.at_blocks.is_empty() {
        true => recorded.iter().copied().step_by(every).collect(),
        false => keys.at_blocks.clone(),
    };
    if let Some(other) = shown.iter().find(|block| !recorded.contains(block)) {
        return Err(format!("at_blocks: block {other} of run {name} is no station (accepted: {recorded:?})"));
    }
    if shown.is_empty() || rows.is_empty() {
        return Err(without_series(run, "stations_m"));
    }
    let mut curves = Vec::new();
    for block in shown {
        let n = block as usize - 1;
        let course = |axis: usize, value: &dyn Fn(&SeriesBlock) -> f64| {
            let points = rows.iter().filter(|row| row.block == block).map(|row| (row.time_s, value(row)));
            let label =
                if axis == 0 { format!("z = {} km", short(medium.depth_m(n) / 1e3)) } else { String::new() };
            Curve { axis, ..Curve::new(Role::Measured, label, points.collect()) }
        };
        curves.push(course(0, &|row| row.velocity_m_per_s.abs()));
        curves.push(course(1, &|row| row.friction_n / medium.cell_m(n) / 1e6));
        curves.push(course(2, &|row| row.theta_s));
    }
    Ok(curves)
}
