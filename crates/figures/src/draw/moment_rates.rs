//! Moment rates of the largest ruptures against time: how fast the moment grows, as source time functions of
//! earthquakes are published.
//!
//! The rate is the factor of `moment_n_m` times the sum of the velocities of the blocks that slide in the rupture, each
//! from its arrival to its stop and in the direction of its slip. Blocks that stick move too, on their friction springs,
//! but their motion is no slip. The integral over time is the moment.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Arrival, Rupture, WindowRecord};

use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::no_ruptures;
use super::scale::{Scale, number};
use super::sheet::{Pen, Sheet};

keys! {
    MomentRates: run;

    /// How many ruptures, those of the largest moment among the recorded ones, up to five.
    #[serde(default = "super::kind::number::<3>")]
    count: u32,
    /// Whether the axis of rates is logarithmic.
    #[serde(default)]
    logarithmic: bool,
}

/// Smallest rate on a logarithmic axis, over the largest.
const LOWEST: f64 = 1e-3;

/// A rupture, and the rate at which its moment grows, N m/s, at each recorded time from its onset to its end.
type Course<'a> = (&'a Rupture, Vec<(f64, f64)>);

impl Figure for MomentRates {
    of_one_run!(RequiredData::WINDOWS | RequiredData::arrivals());

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let mut courses = courses(run)?;
        let moment = |course: &Course| course.0.moment_n_m.unwrap_or_default();
        courses.sort_by(|a, b| moment(b).total_cmp(&moment(a)));
        courses.truncate(self.count.clamp(1, 5) as usize);
        let rates = courses.iter().flat_map(|(_, points)| points).map(|point| point.1);
        let highest = rates.fold(0.0, f64::max);
        let mut layers = Vec::new();
        for (index, course) in courses.iter().enumerate() {
            let is_shown = |rate: f64| !self.logarithmic || rate >= LOWEST * highest;
            let shown = course.1.iter().filter(|(_, rate)| is_shown(*rate));
            let label = format!("rupture {}: M_0 = {} N m", course.0.rupture, number(moment(course)));
            layers.push(Pen::nth(index, &label).line(shown.copied().collect()));
        }
        let y = Scale::free("moment rate (N m/s)").in_powers(self.logarithmic);
        Ok(Sheet::single(Scale::free("t − onset (s)"), y, layers))
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
    let records = run.rupture_fields()?;
    let mut courses = Vec::new();
    for arrivals in run.arrivals()?.chunk_by(|a, b| a.rupture == b.rupture) {
        let rupture = ruptures.iter().find(|rupture| rupture.rupture == arrivals[0].rupture);
        let Some((rupture, end_step)) = rupture.and_then(|rupture| Some((rupture, rupture.end_step?))) else {
            continue;
        };
        let rate = |record: &WindowRecord| {
            let velocity = |arrival: &Arrival| {
                let is_sliding = (arrival.arrival_step..arrival.stop_step?).contains(&record.step);
                let index = arrival.block.checked_sub(record.first_block)? as usize;
                let velocity = record.velocity_m_per_s.get(index).filter(|_| is_sliding)?;
                Some(arrival.slip_m.unwrap_or_default().signum() * velocity)
            };
            let sum: f64 = arrivals.iter().filter_map(velocity).sum();
            (record.time_s - rupture.onset_s, of_velocity * sum)
        };
        let from = records.partition_point(|record| record.step < rupture.onset_step);
        let within = records[from..].iter().take_while(|record| record.step < end_step);
        let points: Vec<(f64, f64)> = within.map(rate).collect();
        if points.len() > 2 {
            courses.push((rupture, points));
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
        let sums: Vec<f64> = found[0].1.iter().map(|(_, rate)| rate / factor * 1e3).collect();
        assert_eq!(found.len(), 1);
        assert!(sums.iter().zip([1.0, 3.0, 3.0, 3.0, 2.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{sums:?}");
        assert_eq!(sums.len(), 5);
        assert_eq!(found[0].1[0].0, 0.0);
        let forwards = found[0].1.clone();
        // Backwards, the same course is above 0 too, where the axis of the figure is.
        for record in &mut run.rupture_fields {
            record.velocity_m_per_s.iter_mut().for_each(|velocity| *velocity = -*velocity);
        }
        run.arrivals.iter_mut().for_each(|arrival| arrival.slip_m = Some(-1.0));
        assert_eq!(courses(&run).expect("it is recorded")[0].1, forwards);
        run.rupture_fields.clear();
        let why = courses(&run).expect_err("nothing is recorded");
        assert!(why.contains("recording.rupture_fields_s"), "{why}");
    }
}
