//! Moment rates of the largest ruptures against time: how fast the moment grows, as source time functions of
//! earthquakes are published.
//!
//! The rate is the factor of `moment_n_m` times the sum of the velocities of the blocks that slide in the rupture, each
//! from its arrival to its stop and in the direction of its slip. Blocks that stick move too, on their friction springs,
//! but their motion is no slip. The integral over time is the moment.

use std::collections::BTreeMap;

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::Rupture;

use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, no_ruptures};
use super::scale::{Scale, number};
use super::sheet::{Pen, Sheet};

keys! {
    MomentRates: run;

    /// How many ruptures, those of the largest moment among the recorded ones, up to five.
    #[serde(default = "three")]
    count: usize,
    /// Whether the axis of rates is logarithmic.
    #[serde(default)]
    logarithmic: bool,
}

fn three() -> usize {
    3
}

/// Smallest rate on a logarithmic axis, over the largest.
const LOWEST: f64 = 1e-3;

/// The rate at which the moment of a rupture grows, N m/s, at each recorded time from its onset to its end.
struct Course<'a> {
    rupture: &'a Rupture,
    points: Vec<(f64, f64)>,
}

impl Figure for MomentRates {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData::WINDOWS | RequiredData::arrivals()
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let mut courses = courses(run)?;
        courses.sort_by(|a, b| {
            let size = |course: &Course| course.rupture.moment_n_m.unwrap_or_default();
            size(b).total_cmp(&size(a))
        });
        courses.truncate(self.count.clamp(1, 5));
        let longest_s = courses.iter().filter_map(|course| course.points.last()).map(|point| point.0);
        let clock = Clock::of(0.0, longest_s.fold(0.0, f64::max), 0.0);
        let highest =
            courses.iter().flat_map(|course| &course.points).map(|point| point.1).fold(0.0, f64::max);
        let mut layers = Vec::new();
        for (index, Course { rupture, points }) in courses.iter().enumerate() {
            let is_shown = |rate: f64| !self.logarithmic || rate >= LOWEST * highest;
            let shown = points.iter().filter(|(_, rate)| is_shown(*rate));
            let moment = rupture.moment_n_m.unwrap_or(0.0);
            let label = format!("rupture {}: M_0 = {} N m", rupture.rupture, number(moment));
            let course = shown.map(|(t, rate)| (clock.place(*t), *rate)).collect();
            layers.push(Pen::nth(index, &label).line(course));
        }
        let label = "moment rate (N m/s)";
        let y = if self.logarithmic { Scale::free_powers(label) } else { Scale::free(label) };
        Ok(Sheet::single(Scale::free(&clock.label("t − onset")), y, layers))
    }
}

/// The courses of all ruptures that have ended and are recorded at three times or more.
fn courses(run: &RunData) -> Result<Vec<Course<'_>>, String> {
    let ruptures = run.ruptures.as_ref().ok_or_else(|| no_ruptures(run))?;
    if run.of_one_row().is_none() {
        return Err(format!(
            "run {} has contacts over an area, whose slip is a vector (accepted: a chain or a slab)",
            run.name
        ));
    }
    let plan = &run.plan;
    let of_velocity = plan.scales.modulus_n_per_m * plan.spacing_m;
    let mut slides: BTreeMap<u64, Vec<(usize, u64, u64, f64)>> = BTreeMap::new();
    for arrival in run.arrivals()? {
        if let Some(stop_step) = arrival.stop_step {
            let direction = arrival.slip_m.unwrap_or_default().signum();
            let of_block = (arrival.block as usize, arrival.arrival_step, stop_step, direction);
            slides.entry(arrival.rupture).or_default().push(of_block);
        }
    }
    let records = run.rupture_fields()?;
    let mut courses = Vec::new();
    for rupture in ruptures {
        let (Some(end_step), Some(blocks)) = (rupture.end_step, slides.get(&rupture.rupture)) else {
            continue;
        };
        let from = records.partition_point(|record| record.step < rupture.onset_step);
        let within = records[from..].iter().take_while(|record| record.step < end_step);
        let mut points = Vec::new();
        for record in within {
            let velocity = |(block, arrival, stop, direction): &(usize, u64, u64, f64)| {
                let is_sliding = (*arrival..*stop).contains(&record.step);
                let index = block.checked_sub(record.first_block as usize)?;
                record.velocity_m_per_s.get(index).filter(|_| is_sliding).map(|velocity| direction * velocity)
            };
            let sum: f64 = blocks.iter().filter_map(velocity).sum();
            points.push((record.time_s - rupture.onset_s, of_velocity * sum));
        }
        if points.len() > 2 {
            courses.push(Course { rupture, points });
        }
    }
    if courses.is_empty() {
        return Err(format!(
            "run {} has no rupture with states at three times or more (accepted: a run with \
             recording.rupture_fields_from_blocks and recording.rupture_fields_s)",
            run.name
        ));
    }
    Ok(courses)
}

#[cfg(test)]
mod tests {
    use asperity_record::WindowRecord;
    use asperity_testkit::made_up;

    use super::courses;

    #[test]
    fn blocks_count_from_arrival_to_stop_and_others_do_not() {
        let mut run = made_up::run("", &[(100, 105, &[1, 2])]);
        made_up::with_ruptures(&mut run, &[&[(1, 100, Some(104)), (2, 101, Some(105))]]);
        let record = |step: u64| WindowRecord {
            window: 0,
            step,
            time_s: run.plan.grid.time_s(step),
            sliding: 2,
            first_block: 1,
            displacement_m: vec![0.0; 3],
            velocity_m_per_s: vec![1e-3, 2e-3, 5e-3],
            tangential_force_n: vec![0.0; 3],
            displacement_across_m: Vec::new(),
            velocity_across_m_per_s: Vec::new(),
            tangential_force_across_n: Vec::new(),
        };
        let records: Vec<WindowRecord> = (99..107).map(record).collect();
        run.rupture_fields = records;
        let found = courses(&run).expect("it is recorded");
        // E L_y a.
        let factor = run.plan.scales.modulus_n_per_m * run.plan.spacing_m;
        let sums: Vec<f64> = found[0].points.iter().map(|(_, rate)| rate / factor * 1e3).collect();
        assert_eq!(found.len(), 1);
        assert!(sums.iter().zip([1.0, 3.0, 3.0, 3.0, 2.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{sums:?}");
        assert_eq!(sums.len(), 5);
        assert_eq!(found[0].points[0].0, 0.0);
        let forwards = found[0].points.clone();
        // Backwards, the same course is above 0 too, where the axis of the figure is.
        for record in &mut run.rupture_fields {
            record.velocity_m_per_s.iter_mut().for_each(|velocity| *velocity = -*velocity);
        }
        run.arrivals.iter_mut().for_each(|arrival| arrival.slip_m = Some(-1.0));
        assert_eq!(courses(&run).expect("it is recorded")[0].points, forwards);
        run.rupture_fields.clear();
        let why = courses(&run).err().expect("nothing is recorded");
        assert!(why.contains("recording.rupture_fields_s"), "{why}");
    }
}
