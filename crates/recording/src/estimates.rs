//! Numbers of a model that a recording tells: how the drive moves, how stiff it is, both friction coefficients, and how
//! the normal load tilts.
//!
//! Friction and tilt follow from *first reach* as well: a rupture from the driven end that for the first time reaches a
//! place `x`, over the length of the slider, needs `F_T / F_N = mu_d (x + theta (x - x^2))`.

use asperity_detect::{RuptureTracker, Slipped};
use asperity_model::theory::analytic::tilted_law;
use asperity_record::{Estimate, FirstReach, Line, LoadDrop, Row, median_and_scatter};

use crate::description::Channel;
use crate::error::Result;
use crate::pass::Ranges;
use crate::recording::{Detected, Recording};

/// Samples of a shear gauge up to an arrival, the largest of which counts.
const SHEAR_SAMPLES: u64 = 16;

/// Parts of the sliding stage, from the deviation of whose means the error of `mu_d` follows.
const BLOCKS: usize = 10;

/// Most means of the forces in memory; of longer recordings each is of several samples.
pub(crate) const MOST_MEANS: u64 = 1 << 17;

/// A value and its standard error.
type Value = [f64; 2];

/// Means of time, `F_T`, `F_T / F_N`, load point, and load point less slip of the pushed end; NaN of what is not measured.
pub(crate) type Means = [f64; 5];
const TIME: usize = 0;
const FORCE: usize = 1;
const RATIO: usize = 2;
const POINT: usize = 3;
const STRETCH: usize = 4;

/// The median with the error `1.4826 MAD / sqrt(n)`; none of fewer than two values.
pub(crate) fn median_of(mut values: Vec<f64>) -> Option<Value> {
    let (count, [value, scatter]) = (values.len() as f64, median_and_scatter(&mut values));
    (count > 1.0).then(|| [value, scatter / count.sqrt()])
}

/// The slope of the least-squares line of a column on another; none where either is not measured.
fn slope(means: &[Means], x: usize, y: usize) -> Option<Value> {
    let line = Line::of(means.iter().map(|of| (of[x], of[y])))?;
    line.slope.is_finite().then(|| [line.slope, line.slope_error()])
}

/// The mean of `F_T / F_N` from a time on; of no or a resting drive there is none.
fn sliding(means: &[Means], from_s: f64, speed: Option<f64>) -> Option<Value> {
    let means = &means[means.partition_point(|of| of[TIME] < from_s)..];
    let of = |means: &[Means]| means.iter().map(|of| of[RATIO]).sum::<f64>() / means.len() as f64;
    let blocks = || means.chunks_exact((means.len() / BLOCKS).max(1)).take(BLOCKS);
    let middle = blocks().map(of).sum::<f64>() / BLOCKS as f64;
    let squares: f64 = blocks().map(|block| (of(block) - middle).powi(2)).sum();
    let moves_half = |block: &[Means]| {
        let moved = |n: usize| block[block.len() - 1][n] - block[0][n];
        speed.is_none_or(|speed| moved(POINT) / (speed * moved(TIME)) > 0.5)
    };
    let is_told = means.len() > BLOCKS && middle.is_finite() && blocks().all(moves_half);
    is_told.then(|| [of(means), (squares / (BLOCKS as f64 - 1.0) / BLOCKS as f64).sqrt()])
}

impl Recording {
    /// The ruptures that the step records show, numbered as in the log, in order of their onsets.
    pub(crate) fn ruptures(&self, found: &Detected) -> Vec<Slipped> {
        let sensors = self.description.positions_m().len().max(1) as u32;
        let mut tracker = RuptureTracker::new(sensors, self.time_grid().step_s(), self.scales().link_s());
        let mut ruptures = Vec::new();
        found.steps().for_each(|record| tracker.observe(&record, &mut ruptures));
        tracker.finish(&mut ruptures);
        ruptures.sort_by_key(|rupture| rupture.onset_step);
        ruptures
    }

    /// Rows of what steps and load drops tell. The shear gauges are read once more.
    pub(crate) fn estimates(&self, found: &Detected, means: &[Means]) -> Result<Vec<Row>> {
        let (step, grid, drops, x_m) =
            (self.last_step(), self.time_grid(), &found.drops, self.description.positions_m());
        let ruptures = self.ruptures(found);
        let global = ruptures.iter().position(|rupture| rupture.blocks.len() == x_m.len());
        let (velocity, mut rows) = (slope(means, TIME, POINT), Vec::new());
        let speed = velocity.map(|[speed, _]| speed);
        let exceeds_mean = |drop: &&LoadDrop| {
            let before = drop.ft_fn_before.zip(sliding(means, drop.onset_s, None));
            before.is_some_and(|(before, [mean, _])| before > mean)
        };
        let from_s = match self.description.contacts {
            Some(_) => global.map(|n| grid.time_s(ruptures[n].onset_step)),
            None => drops.iter().find(exceeds_mean).map(|drop| drop.onset_s),
        };
        let mut points = Vec::new();
        if self.description.forces.is_some() {
            let last = |rupture: &Slipped| rupture.blocks.keys().next_back().copied().unwrap_or_default();
            let mut farthest: Option<&Slipped> = None;
            let up_to_global = ruptures.iter().take(global.map_or(usize::MAX, |global| global + 1));
            for rupture in up_to_global.filter(|rupture| rupture.blocks.contains_key(&1)) {
                let before = farthest.unwrap_or(rupture);
                let (low, high) = (before.ft_fn_onset, rupture.ft_fn_onset);
                for sensor in last(before) + 1..=last(rupture) {
                    let x_over_l = x_m[sensor as usize - 1] / self.description.slider.length_m.0;
                    let (ft_fn, ft_fn_error) = ((low + high) / 2.0, (high - low).abs() / 12f64.sqrt());
                    let time_s = grid.time_s(step);
                    rows.push(Row::new(FirstReach { step, time_s, sensor, x_over_l, ft_fn, ft_fn_error }));
                    points.push([x_over_l, ft_fn]);
                }
                farthest = Some(if last(before) > last(rupture) { before } else { rupture });
            }
        }
        let [by_reach, tilt] = tilted_law(&points).map_or([None; 2], |told| told.map(Some));
        let rate = median_of(drops.iter().map(|drop| drop.loading_rate_n_per_s).collect());
        let numbers = [
            ("drive_velocity_m_per_s", velocity),
            ("drive_stiffness_n_per_m", slope(means, STRETCH, FORCE)),
            ("system_stiffness_n_per_m", rate.zip(speed).map(|(rate, speed)| rate.map(|of| of / speed))),
            ("dynamic_coefficient", from_s.and_then(|from_s| sliding(means, from_s, speed))),
            ("dynamic_coefficient_first_reach", by_reach),
            ("tilt", tilt),
            ("static_coefficient", median_of(self.shear_ratios(&ruptures)?)),
        ];
        rows.extend(numbers.into_iter().filter_map(|(number, told)| {
            let ([value, error], number, time_s) = (told?, number.to_owned(), grid.time_s(step));
            Some(Row::new(Estimate { step, time_s, number, value, error }))
        }));
        Ok(rows)
    }

    /// At each arrival the largest shear just before, by a gauge at the sensor, over the normal load that it reads.
    fn shear_ratios(&self, ruptures: &[Slipped]) -> Result<Vec<f64>> {
        let reads_load = |channel: &Channel| channel.normal_n.is_some();
        let streams = &self.description.streams;
        let Some(stream) = streams.iter().position(|stream| stream.sensors.iter().any(reads_load)) else {
            return Ok(Vec::new());
        };
        let (gauges, parts) = (&streams[stream].sensors, &self.streams[stream].parts);
        let x_m = self.description.positions_m();
        let passages = ruptures.iter().flat_map(|rupture| &rupture.blocks);
        let mut arrivals: Vec<(u64, usize)> =
            passages.map(|(block, passage)| (passage.arrival_step, *block as usize - 1)).collect();
        arrivals.sort_unstable();
        let mut ranges = Ranges::new(self, stream, gauges.iter().collect());
        let mut ratios = Vec::new();
        for (step, sensor) in arrivals {
            let time_s = self.time_grid().time_s(step);
            let part = parts.iter().position(|part| (part.first_s()..=part.last_s()).contains(&time_s));
            let gauge = gauges.iter().position(|gauge| gauge.x_m == x_m.get(sensor).copied());
            let (Some(part), Some(gauge)) = (part, gauge) else { continue };
            let end = parts[part].sample_at(time_s) as u64 + 1;
            let samples = end.saturating_sub(SHEAR_SAMPLES)..end;
            let rows = ranges.rows(part, &samples)?;
            let largest_n = rows.si(gauge, &gauges[gauge], samples).fold(f64::NEG_INFINITY, f64::max);
            ratios.extend(gauges[gauge].normal_n.map(|load| largest_n / load.0));
        }
        Ok(ratios)
    }
}
