//! Normal load per block, and its course in time.

use crate::elastic::gaps;

/// `p_n = F_N / N (1 - theta (2n - N - 1) / (N - 1))` (5.18), n from 1.
///
/// The sign is that of (5.18) and of the thesis' program: a positive `theta`
/// loads the driven end more. (5.10) and (2.8) have the other sign.
///
/// Over an area all rows across are alike, one after the other: `n` is the column, and `F_N` is divided by the
/// number of contacts.
pub fn tilted(total_n: f64, theta: f64, columns: usize, rows: usize) -> Vec<f64> {
    let (count, mean_n) = (columns as f64, total_n / (columns * rows) as f64);
    let at = |n: usize| mean_n * (1.0 - (2.0 * n as f64 - count - 1.0) / gaps(columns) as f64 * theta);
    (0..rows).flat_map(|_| (1..=columns).map(at)).collect()
}

/// A piecewise-linear course of the normal load (6.1-6.3), as a factor on its value at the start;
/// constant before the first and after the last knot.
///
/// In (6.2) the ramp starts where the drive stops, and in (6.3) its length is the difference of its
/// ends.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadCourse {
    /// Steps and factors, ascending in steps; empty for a constant load.
    knots: Vec<(u64, f64)>,
    /// Whether steps count from the one in which the drive stops.
    from_hold: bool,
}

impl LoadCourse {
    /// A course with the given factors at the given steps.
    pub fn new(steps: Vec<u64>, factors: Vec<f64>, from_hold: bool) -> LoadCourse {
        LoadCourse { knots: steps.into_iter().zip(factors).collect(), from_hold }
    }

    /// Whether the load ever changes.
    pub fn is_constant(&self) -> bool {
        self.knots.iter().all(|(_, factor)| *factor == 1.0)
    }

    /// The step from which the knots count; `None` while it is unknown.
    fn origin(&self, hold_step: u64) -> Option<u64> {
        match (self.from_hold, hold_step) {
            (false, _) => Some(0),
            (true, u64::MAX) => None,
            (true, hold_step) => Some(hold_step),
        }
    }

    /// The factor in a step. `hold_step` is the step in which the drive stopped, `u64::MAX` before
    /// that.
    #[inline]
    pub fn factor(&self, step: u64, hold_step: u64) -> f64 {
        match self.knots.as_slice() {
            [] => 1.0,
            [first, .., last] => self.factor_between(*first, *last, step, hold_step),
            [only] => self.factor_between(*only, *only, step, hold_step),
        }
    }

    fn factor_between(&self, first: (u64, f64), last: (u64, f64), step: u64, hold_step: u64) -> f64 {
        let Some(origin) = self.origin(hold_step) else { return first.1 };
        let at = step.saturating_sub(origin);
        if at >= last.0 {
            return last.1;
        }
        let behind = self.knots.partition_point(|(knot, _)| *knot <= at);
        let Some(before) = behind.checked_sub(1) else { return first.1 };
        let ((from, start), (to, end)) = (self.knots[before], self.knots[behind]);
        start + (end - start) * ((at - from) as f64 / (to - from) as f64)
    }

    /// The change of the factor per step after `step`, up to the next knot. Computed from the
    /// knots, because a difference of two factors would multiply its rounding error over many
    /// steps.
    pub fn rate(&self, step: u64, hold_step: u64) -> f64 {
        let Some(origin) = self.origin(hold_step) else { return 0.0 };
        let at = step.saturating_sub(origin);
        let behind = self.knots.partition_point(|(knot, _)| *knot <= at);
        match (behind.checked_sub(1).map(|before| self.knots[before]), self.knots.get(behind)) {
            (Some((from, start)), Some((to, end))) => (end - start) / (to - from) as f64,
            _ => 0.0,
        }
    }

    /// The first knot after a step; `u64::MAX` if there is none.
    pub fn next_knot(&self, step: u64, hold_step: u64) -> u64 {
        let Some(origin) = self.origin(hold_step) else { return u64::MAX };
        let knots = self.knots.iter().map(|(knot, _)| origin + knot);
        knots.into_iter().find(|knot| *knot > step).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::{LoadCourse, tilted};

    #[test]
    fn a_course_is_linear_between_its_knots_and_constant_outside() {
        let course = LoadCourse::new(vec![10, 20, 40, 50], vec![1.0, 0.5, 0.5, 0.25], false);
        let at = |step| course.factor(step, u64::MAX);
        assert_eq!(
            [at(0), at(10), at(15), at(20), at(30), at(45), at(50), at(99)],
            [1.0, 1.0, 0.75, 0.5, 0.5, 0.375, 0.25, 0.25]
        );
        let rate = |step| course.rate(step, u64::MAX);
        assert_eq!(
            [rate(9), rate(10), rate(19), rate(20), rate(49), rate(50)],
            [0.0, -0.05, -0.05, 0.0, -0.025, 0.0]
        );
        let next = |step| course.next_knot(step, u64::MAX);
        assert_eq!([next(0), next(10), next(49), next(50)], [10, 20, 50, u64::MAX]);
        // A course that counts from the stop of the drive is constant until then.
        let course = LoadCourse::new(vec![0, 10], vec![1.0, 0.5], true);
        assert_eq!([course.factor(99, u64::MAX), course.factor(105, 100)], [1.0, 0.75]);
        assert_eq!([course.next_knot(100, u64::MAX), course.next_knot(100, 100)], [u64::MAX, 110]);
    }

    #[test]
    fn tilt_shifts_load_to_the_driven_end_and_keeps_the_total() {
        assert_eq!(tilted(400.0, 0.0, 4, 1), [100.0; 4]);
        let p = tilted(400.0, 0.5, 5, 1);
        assert_eq!((p[0], p[2], p[4]), (120.0, 80.0, 40.0));
        assert!((p.iter().sum::<f64>() - 400.0).abs() < 1e-12);
        assert_eq!(tilted(400.0, 0.0, 1, 1), [400.0]);
    }
}
