//! Numbers of a model that samples tell: how the drive moves, how stiff it is, and both friction coefficients.

use asperity_detect::{Passage, RuptureTracker, Slipped};
use asperity_record::{Estimates, LoadDrop, StepRecord};

use crate::description::{Channel, Role};
use crate::error::RecordingError;
use crate::force::Request;
use crate::recording::Recording;
use crate::window::{MAD_TO_SIGMA, median};

/// Samples of a shear gauge up to an arrival, the largest of which counts.
const SHEAR_SAMPLES: u64 = 16;

/// Parts of the sliding stage, from the deviation of whose means the error of `mu_d` follows.
const BLOCKS: usize = 10;

/// Most sums of `F_T / F_N` that are kept; of longer recordings each is of several samples.
const MOST_SUMS: usize = 1 << 17;

/// A value and its standard error.
pub(crate) type Estimate = [f64; 2];

/// The median with the error `1.4826 MAD / sqrt(n)`; none of fewer than two values.
pub(crate) fn median_of(mut values: Vec<f64>) -> Option<Estimate> {
    let value = median(&mut values);
    let count = values.len() as f64;
    values.iter_mut().for_each(|of| *of = (*of - value).abs());
    (count > 1.0).then(|| [value, MAD_TO_SIGMA * median(&mut values) / count.sqrt()])
}

/// A straight line by least squares through points that come one by one (Welford, Technometrics 4, 419 (1962)).
#[derive(Debug, Default)]
struct Line {
    count: f64,
    mean: [f64; 2],
    /// Sums of products of deviations: x x, x y, y y.
    products: [f64; 3],
}

impl Line {
    fn add(&mut self, x: f64, y: f64) {
        self.count += 1.0;
        let before = [x - self.mean[0], y - self.mean[1]];
        self.mean = [0, 1].map(|n| self.mean[n] + before[n] / self.count);
        let after = [x - self.mean[0], y - self.mean[1]];
        let added = [before[0] * after[0], before[0] * after[1], before[1] * after[1]];
        self.products = [0, 1, 2].map(|n| self.products[n] + added[n]);
    }

    /// None of fewer than three points, or of points at one x.
    fn slope(&self) -> Option<Estimate> {
        let [xx, xy, yy] = self.products;
        let variance = (yy - xy * xy / xx).max(0.0) / (self.count - 2.0);
        (self.count > 2.0 && xx > 0.0).then(|| [xy / xx, (variance / xx).sqrt()])
    }
}

/// `F_T / F_N` over time, in sums of equally many samples.
#[derive(Debug)]
struct Ratios {
    /// Samples of a sum.
    each: u64,
    /// Samples of the last one.
    last: u64,
    sums: Vec<Sum>,
}

#[derive(Debug, Clone, Copy)]
struct Sum {
    ratio: f64,
    /// The time of the first sample, and the load point there.
    time_s: f64,
    point_m: f64,
}

impl Ratios {
    fn add(&mut self, sample: Sum) {
        if self.last < self.each {
            let sum = self.sums.last_mut().expect("one is begun");
            sum.ratio += sample.ratio;
            self.last += 1;
            return;
        }
        if self.sums.len() == MOST_SUMS {
            let pair = |pair: &[Sum]| Sum { ratio: pair[0].ratio + pair[1].ratio, ..pair[0] };
            self.sums = self.sums.chunks_exact(2).map(pair).collect();
            self.each *= 2;
        }
        self.sums.push(sample);
        self.last = 1;
    }

    /// The whole sums from a time on.
    fn from(&self, time_s: f64) -> &[Sum] {
        let whole = self.sums.len() - usize::from(self.last < self.each);
        &self.sums[self.sums.partition_point(|sum| sum.time_s < time_s).min(whole)..whole]
    }

    /// The mean from a time on.
    fn mean(&self, time_s: f64) -> f64 {
        let sums = self.from(time_s);
        sums.iter().map(|sum| sum.ratio).sum::<f64>() / (sums.len() as u64 * self.each) as f64
    }

    /// Its standard error by the means of blocks; none of too few samples, or of a drive that stops.
    fn error(&self, time_s: f64, velocity_m_per_s: Option<f64>) -> Option<f64> {
        let sums = self.from(time_s);
        let length = sums.len() / BLOCKS;
        if length == 0 {
            return None;
        }
        // It moves less than half as far as on the whole.
        let rests = |block: &[Sum]| {
            let [first, .., last] = block else { return false };
            let due_m = velocity_m_per_s.unwrap_or_default() * (last.time_s - first.time_s);
            (last.point_m - first.point_m) / due_m < 0.5
        };
        let blocks = || sums.chunks_exact(length).take(BLOCKS);
        let mean = |block: &[Sum]| {
            block.iter().map(|sum| sum.ratio).sum::<f64>() / (length as u64 * self.each) as f64
        };
        let means: Vec<f64> = blocks().map(mean).collect();
        let count = BLOCKS as f64;
        let middle = means.iter().sum::<f64>() / count;
        let variance = means.iter().map(|mean| (mean - middle).powi(2)).sum::<f64>() / (count - 1.0);
        (!blocks().any(rests)).then(|| (variance / count).sqrt())
    }
}

impl Recording {
    /// Reads the forces and the shear gauges once more. Of what was found, the first global slip, the load drops and
    /// the arrivals count.
    pub(crate) fn estimates(
        &self,
        records: &[StepRecord],
        drops: &[LoadDrop],
    ) -> Result<Estimates, RecordingError> {
        let (step, time_grid, ruptures) = (self.last_step(), self.time_grid(), self.ruptures(records));
        let [mut velocity, mut stiffness, mut dynamic] = [None; 3];
        if let Some(stream) = self.description.forces {
            let (mut channels, rows) = self.force_channels(stream);
            let of_end = |channel: &&Channel| channel.role == Role::Slip && channel.x_m == Some(0.0);
            channels.extend(self.description.streams[stream].channel.iter().find(of_end));
            let end = channels.get(rows.iter().flatten().count()).map(|_| channels.len() - 1);
            let known_n = self.description.slider.normal_force_n.map(|load| load.0);
            let [mut point, mut spring] = [Line::default(), Line::default()];
            let mut ratios = Ratios { each: 1, last: 1, sums: Vec::new() };
            let mut before = (0, 0);
            self.pass(stream, &channels, &mut |part, block, _| {
                before = if before.0 == part { before } else { (part, 0) };
                for n in 0..block[0].len() {
                    let at = |row: usize| channels[row].si(block[row][n]);
                    let time_s = self.streams[stream].parts[part].time_s((before.1 + n) as f64);
                    let [force_n, normal_n, point_m] = rows.map(|row| row.map(at));
                    let force_n = force_n.expect("the stream has a tangential force");
                    if let Some(point_m) = point_m {
                        point.add(time_s, point_m);
                        if let Some(end) = end {
                            spring.add(point_m - at(end), force_n);
                        }
                    }
                    if let Some(normal_n) = normal_n.or(known_n) {
                        let point_m = point_m.unwrap_or_default();
                        ratios.add(Sum { ratio: force_n / normal_n, time_s, point_m });
                    }
                }
                before.1 += block[0].len();
                Ok(())
            })?;
            [velocity, stiffness] = [point.slope(), spring.slope()];
            let exceeds_mean =
                |drop: &&LoadDrop| drop.ft_fn_before.is_some_and(|ratio| ratio > ratios.mean(drop.onset_s));
            let from_s = match self.description.contacts {
                Some(stream) => {
                    let reached_all = |rupture: &&Slipped| {
                        rupture.blocks.len() == self.description.streams[stream].sensors.len()
                    };
                    let onsets = ruptures.iter().filter(reached_all).map(|rupture| rupture.onset_step);
                    onsets.min().map(|step| time_grid.time_s(step))
                }
                None => drops.iter().find(exceeds_mean).map(|drop| drop.onset_s),
            };
            let speed = velocity.map(|[speed, _]| speed);
            dynamic = from_s.and_then(|s| Some([ratios.mean(s), ratios.error(s, speed)?]));
        }
        let local = median_of(self.shear_ratios(&ruptures)?);
        let parts = |of: Option<Estimate>| (of.map(|of| of[0]), of.map(|of| of[1]));
        let (drive_velocity_m_per_s, drive_velocity_error_m_per_s) = parts(velocity);
        let (drive_stiffness_n_per_m, drive_stiffness_error_n_per_m) = parts(stiffness);
        let (dynamic_coefficient, dynamic_coefficient_error) = parts(dynamic);
        let (static_coefficient, static_coefficient_error) = parts(local);
        Ok(Estimates {
            step,
            time_s: time_grid.time_s(step),
            drive_velocity_m_per_s,
            drive_velocity_error_m_per_s,
            drive_stiffness_n_per_m,
            drive_stiffness_error_n_per_m,
            dynamic_coefficient,
            dynamic_coefficient_error,
            static_coefficient,
            static_coefficient_error,
        })
    }

    fn ruptures(&self, records: &[StepRecord]) -> Vec<Slipped> {
        let header = self.header(&[]);
        let mut tracker = RuptureTracker::new(header.blocks, header.time_step_s, header.scales.link_s());
        let mut found = Vec::new();
        records.iter().for_each(|record| tracker.observe(record, &mut found));
        tracker.finish(&mut found);
        found
    }

    /// At each arrival the largest shear just before, by a gauge at the sensor, over the normal load that it reads.
    fn shear_ratios(&self, ruptures: &[Slipped]) -> Result<Vec<f64>, RecordingError> {
        let reads_load = |channel: &Channel| channel.normal_n.is_some();
        let streams = &self.description.streams;
        let Some(stream) = streams.iter().position(|stream| stream.sensors.iter().any(reads_load)) else {
            return Ok(Vec::new());
        };
        let (gauges, parts) = (&streams[stream].sensors, &self.streams[stream].parts);
        let x_m = self.description.positions_m();
        let request = |(block, passage): (&u32, &Passage)| {
            let gauge = gauges.iter().position(|gauge| gauge.x_m == x_m.get(*block as usize - 1).copied())?;
            let time_s = self.time_grid().time_s(passage.arrival_step);
            let part = parts.iter().position(|part| (part.first_s()..=part.last_s()).contains(&time_s))?;
            let end = parts[part].sample_at(time_s) as u64 + 1;
            Some((gauge, Request { part, samples: end.saturating_sub(SHEAR_SAMPLES)..end }))
        };
        let arrivals = ruptures.iter().flat_map(|rupture| &rupture.blocks);
        let (wanted, requests): (Vec<usize>, Vec<Request>) = arrivals.filter_map(request).unzip();
        let mut ratios = vec![0.0; wanted.len()];
        self.gather(stream, &gauges.iter().collect::<Vec<_>>(), requests, &mut |n, request, rows| {
            let (gauge, samples) =
                (wanted[n], request.samples.start - rows.first..request.samples.end - rows.first);
            let stored = &rows.rows[gauge][samples.start as usize..samples.end as usize];
            let shear_n = stored.iter().map(|stored| gauges[gauge].si(*stored));
            let normal_n = gauges[gauge].normal_n.map_or(f64::NAN, |load| load.0);
            ratios[n] = shear_n.fold(f64::NEG_INFINITY, f64::max) / normal_n;
        })?;
        Ok(ratios)
    }
}
