//! When a step arrives: where the signal crosses a fifth of it, or, of a slip, whose start is a bend, by Akaike's
//! information criterion on the samples themselves (N. Maeda, Zisin 38 (1985) 365).

use crate::description::Role;
use crate::ramp::Ramp;
use crate::samples::Rows;

/// Part of a step that has happened at its arrival.
const SHARE: f64 = 0.2;

/// Samples behind the middle of a ramp from which its arrival is looked for, backwards.
const BEHIND_MIDDLE: f64 = 3.0;

/// Fewest samples on either side of an arrival by the information criterion.
const FEWEST: usize = 4;

/// Scatter of an arrival over that of a sample, in slopes of the ramp, measured for both methods.
const SCATTER: f64 = 0.6;
const SCATTER_OF_SLIP: f64 = 1.2;

/// The place of the arrival of a step, in samples.
pub(crate) fn arrival(rows: &Rows<'_>, channel: usize, ramp: &Ramp, width: u64, role: Role) -> f64 {
    match role {
        Role::Slip | Role::Acoustic => by_information(rows, channel, ramp, width),
        _ => by_crossing(rows, channel, ramp, width),
    }
}

/// Standard error of the arrival, in samples, given the noise of a sample.
pub(crate) fn error(ramp: &Ramp, noise: f64, role: Role) -> f64 {
    let scatter = if role == Role::Slip { SCATTER_OF_SLIP } else { SCATTER };
    let lasts = (ramp.end - ramp.begin).max(1.0);
    (1.0 / 12.0 + (scatter * noise * lasts / ramp.size).powi(2)).sqrt()
}

fn by_crossing(rows: &Rows<'_>, channel: usize, ramp: &Ramp, width: u64) -> f64 {
    let level = ramp.before + SHARE * ramp.size;
    let from = (((ramp.begin + ramp.end + 1.0) / 2.0).floor() + BEHIND_MIDDLE) as u64;
    let first = (from + 1).saturating_sub(3 * width);
    let samples = rows.of(channel, first..from + 1).collect::<Vec<f64>>();
    let first = rows.end().min(from + 1) - samples.len() as u64;
    let beyond = |y: f64| ramp.size.signum() * (y - level);
    let crosses = |pair: &[f64]| beyond(pair[0]) < 0.0 && beyond(pair[1]) >= 0.0;
    samples.windows(2).rposition(crosses).map_or(ramp.begin, |n| {
        let (y, next) = (samples[n], samples[n + 1]);
        (first + n as u64) as f64 + (level - y) / (next - y)
    })
}

fn by_information(rows: &Rows<'_>, channel: usize, ramp: &Ramp, width: u64) -> f64 {
    let middle = ramp.begin.floor() as u64;
    let samples = rows.of(channel, middle.saturating_sub(2 * width)..middle + width).collect::<Vec<f64>>();
    let count = samples.len();
    if count <= 12 {
        return ramp.begin;
    }
    let first = (middle + width).min(rows.end()) - count as u64;
    let mean = samples.iter().sum::<f64>() / count as f64;
    let add = |sums: &mut [f64; 2], sample: &f64| {
        let off = sample - mean;
        *sums = [sums[0] + off, sums[1] + off * off];
        Some(*sums)
    };
    let sums: Vec<[f64; 2]> = samples.iter().scan([0.0; 2], add).collect();
    // Of samples that are all equal not minus infinity, which would end the search.
    let logarithm = |[sum, squares]: [f64; 2], count: f64| {
        (squares / count - (sum / count).powi(2)).max(f64::MIN_POSITIVE).ln()
    };
    let all = sums[count - 1];
    let criterion = |k: usize| {
        let (before, rest) = (k as f64, (count - k) as f64);
        let behind = [all[0] - sums[k - 1][0], all[1] - sums[k - 1][1]];
        before * logarithm(sums[k - 1], before) + (rest - 1.0) * logarithm(behind, rest)
    };
    let places = (FEWEST..=count - FEWEST - 1).map(|k| (k, criterion(k)));
    let (k, _) =
        places.reduce(|best, next| if next.1 < best.1 { next } else { best }).expect("twelve samples");
    (first + k as u64) as f64 - 0.5
}
