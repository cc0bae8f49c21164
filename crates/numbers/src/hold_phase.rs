//! Numbers of a run before and after its drive stops.

use asperity_model::theory::analytic::LengthLaw;

use crate::curves::{PrecursorPoint, precursor_points};
use crate::precursors::{self, Precursor};
use crate::run_data::{Load, RunEvents};
use crate::theory_residuals::largest;

/// One side of the step in which the drive stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    BeforeHold,
    AfterHold,
}

impl Side {
    /// Whether steps from the first to the second lie wholly on this side; `None` if the drive never stops.
    fn holds(self, run: &RunEvents, (from, to): (u64, u64)) -> Option<bool> {
        let hold = run.plan.drive.hold_from_step?;
        Some(match self {
            Side::BeforeHold => to < hold,
            Side::AfterHold => from >= hold,
        })
    }
}

/// The step records of the longest rest between two slip events on one side of the hold;
/// after it, of those in which the normal load falls, or rises, evenly.
pub(crate) fn longest_flank<'a>(run: &RunEvents, loads: &'a [Load], side: Side) -> Option<&'a [Load]> {
    let hold_step = run.plan.drive.hold_from_step?;
    let mut longest: Option<(u64, u64)> = None;
    for pair in run.slips.windows(2) {
        let Some(from) = pair[0].end_step else { continue };
        let to = pair[1].onset_step - 1;
        let is_even = run.plan.load_course.next_knot(from, hold_step) >= to
            && run.plan.outside(from, hold_step).load() != run.plan.outside(to, hold_step).load();
        if side == Side::AfterHold && !is_even {
            continue;
        }
        let is_longer = longest.is_none_or(|(start, end)| to - from > end - start);
        if side.holds(run, (from, to))? && is_longer {
            longest = Some((from, to));
        }
    }
    let (from, to) = longest?;
    let first = loads.partition_point(|record| record.step < from);
    let end = loads.partition_point(|record| record.step <= to);
    Some(&loads[first..end])
}

/// Mean of a quantity in step records, linear between them.
pub(crate) fn mean_in_time(records: &[Load], of: impl Fn(&Load) -> f64) -> Option<f64> {
    let (first, last) = (records.first()?, records.last()?);
    let area: f64 = records
        .windows(2)
        .map(|pair| (pair[1].time_s - pair[0].time_s) * (of(&pair[0]) + of(&pair[1])) / 2.0)
        .sum();
    (last.time_s > first.time_s).then(|| area / (last.time_s - first.time_s))
}

pub(crate) fn sag(flank: &[Load]) -> Option<f64> {
    let (first, last) = (flank.first()?.load_ratio(), flank.last()?.load_ratio());
    let mean = mean_in_time(flank, Load::load_ratio)?;
    (last != first).then(|| ((first + last) / 2.0 - mean) / (last - first))
}

pub(crate) fn parabola_error(flank: &[Load]) -> Option<f64> {
    let point = |record: &Load| (record.time_s, record.load_ratio());
    let ((t0, y0), (t1, y1), (t2, y2)) =
        (point(flank.first()?), point(flank.get(flank.len() / 2)?), point(flank.last()?));
    // Lagrange's form; it needs three points in time.
    let parabola = |t: f64| {
        y0 * (t - t1) * (t - t2) / ((t0 - t1) * (t0 - t2))
            + y1 * (t - t0) * (t - t2) / ((t1 - t0) * (t1 - t2))
            + y2 * (t - t0) * (t - t1) / ((t2 - t0) * (t2 - t1))
    };
    let has_three = t0 < t1 && t1 < t2 && y2 != y0;
    largest(flank.iter().map(point).map(|(t, y)| (y - parabola(t)) / (y2 - y0))).filter(|_| has_three)
}

pub(crate) fn hyperbola_error(flank: &[Load]) -> Option<f64> {
    let force_n = flank.first()?.driving_force_n;
    let rise = flank.last()?.load_ratio() - flank.first()?.load_ratio();
    let deviation = |record: &Load| (record.load_ratio() - force_n / record.normal_load_n) / rise;
    largest(flank.iter().map(deviation)).filter(|_| rise != 0.0)
}

/// The precursors on one side of the hold, beside the law that the scenario calls for; after it with the
/// first global slip, often the only point shown.
pub(crate) fn points_beside_hold(run: &RunEvents, side: Side) -> Option<Vec<PrecursorPoint>> {
    run.plan.drive.hold_from_step.and(run.mu_d())?;
    let mut precursors = match side {
        Side::BeforeHold => precursors::alone(run),
        Side::AfterHold => precursors::one_by_one(run),
    };
    let onset = |precursor: &Precursor<'_>| precursor.start.onset_step;
    precursors.retain(|precursor| side.holds(run, (onset(precursor), onset(precursor))) == Some(true));
    run.has_free_ends().map(|run| precursor_points(run, LengthLaw::natural(&run.scenario), &precursors))
}
