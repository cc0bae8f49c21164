//! The time grid: integer steps are the time, and seconds are derived from them here.

/// The grid of time steps of a run.
///
/// Most time steps are the reciprocal of a whole number (1e-8 s is a 100 MHz grid). Then the time of a
/// step is `step / rate`, the double nearest to the true value, which prints with few digits;
/// `step * dt` gives `0.056763560000000005` instead of `0.05676356`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeGrid {
    step_s: f64,
    rate_hz: Option<f64>,
}

/// Most steps of a run: doubles count them.
pub const MOST_STEPS: u64 = 1 << 53;

/// Largest distance of `1 / dt` from a whole number to be rounded to it: a few rounding errors of the
/// division.
const RATE_TOLERANCE: f64 = 1e-14;

/// Largest distance of a duration divided by `dt` from a whole number to be rounded to it. Decimal
/// durations over decimal steps differ by a few rounding errors (up to about 1e-7 steps in 1e9); a wrong
/// duration differs by much more.
const STEP_COUNT_TOLERANCE: f64 = 1e-6;

impl TimeGrid {
    /// A grid with steps of `step_s` seconds, which must be positive and finite.
    pub fn new(step_s: f64) -> TimeGrid {
        assert!(step_s.is_finite() && step_s > 0.0, "a time step of {step_s} s");
        let rate = 1.0 / step_s;
        let whole = rate.round();
        let is_whole =
            whole >= 1.0 && whole <= MOST_STEPS as f64 && (rate / whole - 1.0).abs() < RATE_TOLERANCE;
        TimeGrid { step_s, rate_hz: is_whole.then_some(whole) }
    }

    /// The time step `dt` in seconds.
    #[inline]
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The time at the end of `step` in seconds.
    #[inline]
    pub fn time_s(&self, step: u64) -> f64 {
        match self.rate_hz {
            Some(rate_hz) => step as f64 / rate_hz,
            None => step as f64 * self.step_s,
        }
    }

    /// The number of steps in `duration_s`; `None` if it is not whole.
    pub fn whole_steps(&self, duration_s: f64) -> Option<u64> {
        let steps = duration_s / self.step_s;
        let whole = steps.round();
        let is_whole = (steps - whole).abs() <= STEP_COUNT_TOLERANCE.max(steps.abs() * 4.0 * f64::EPSILON);
        (is_whole && (0.0..=MOST_STEPS as f64).contains(&whole)).then_some(whole as u64)
    }

    /// The nearest step to `time_s`.
    pub fn nearest_step(&self, time_s: f64) -> u64 {
        (time_s / self.step_s).round() as u64
    }

    /// The first step that does not end before `time_s`; `u64::MAX` if it is beyond all that a run can have.
    pub fn first_step_from(&self, time_s: f64) -> u64 {
        let steps = (time_s / self.step_s).ceil();
        if steps > MOST_STEPS as f64 {
            return u64::MAX;
        }
        let mut step = steps as u64;
        // The quotient is rounded.
        while self.time_s(step) < time_s {
            step += 1;
        }
        while step > 0 && self.time_s(step - 1) >= time_s {
            step -= 1;
        }
        step
    }

    /// The length of a step in nanoseconds, if that is a whole number.
    pub fn step_ns(&self) -> Option<u64> {
        let ns = self.step_s * 1e9;
        let whole = ns.round();
        (whole >= 1.0 && (ns / whole - 1.0).abs() < RATE_TOLERANCE).then_some(whole as u64)
    }

    /// The time at the end of `step` in nanoseconds: exact where
    /// [`TimeGrid::step_ns`] is a whole number, rounded elsewhere. Times from 584 years on are all the largest that files
    /// can give.
    pub fn time_ns(&self, step: u64) -> u64 {
        match self.step_ns() {
            Some(step_ns) => step.saturating_mul(step_ns),
            None => (step as f64 * self.step_s * 1e9).round() as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::TimeGrid;

    #[test]
    fn times_print_as_written() {
        let grid = TimeGrid::new(1e-8);
        assert_eq!(grid.time_s(5_676_356).to_string(), "0.05676356");
        assert_eq!(grid.time_ns(5_676_356), 56_763_560);
        assert_eq!(grid.step_ns(), Some(10));
        // Multiplication gives the neighbouring double.
        assert_ne!(5_676_356.0 * 1e-8, 0.056_763_56);
    }

    #[test]
    fn durations_are_whole_numbers_of_steps_or_refused() {
        for (step_s, duration_s, steps) in [
            (1e-8, 5.0, 500_000_000),
            (1e-7, 4.7, 47_000_000),
            (4e-7, 1.0, 2_500_000),
            (3e-8, 0.3, 10_000_000),
        ] {
            assert_eq!(TimeGrid::new(step_s).whole_steps(duration_s), Some(steps));
        }
        assert_eq!(TimeGrid::new(3e-8).whole_steps(0.1), None);
        assert_eq!(TimeGrid::new(1e-8).whole_steps(0.5e-8), None);
        assert_eq!(TimeGrid::new(1e-8).whole_steps(-1.0), None);
    }

    #[test]
    fn a_time_between_two_steps_is_that_of_the_nearer() {
        let grid = TimeGrid::new(0.25);
        assert_eq!([0.0, 0.3, 0.45, 0.75].map(|time_s| grid.nearest_step(time_s)), [0, 1, 2, 3]);
        // In doubles the quotient is a little less.
        assert_eq!(TimeGrid::new(1e-8).nearest_step(0.29), 29_000_000);
    }

    #[test]
    fn the_first_step_from_a_time_ends_then_or_later() {
        let grid = TimeGrid::new(0.25);
        assert_eq!([0.0, 0.25, 0.26, 1e300].map(|time_s| grid.first_step_from(time_s)), [0, 1, 2, u64::MAX]);
        for step_s in [1e-8, 3e-7, 1.0 / 3.0] {
            let grid = TimeGrid::new(step_s);
            for step in [1, 29_000_000, 123_456_789] {
                let time_s = grid.time_s(step);
                assert_eq!(grid.first_step_from(time_s), step);
                assert_eq!(grid.first_step_from(time_s.next_up()), step + 1);
                assert_eq!(grid.first_step_from(time_s.next_down()), step);
            }
        }
    }

    #[test]
    fn steps_that_are_no_whole_nanoseconds_say_so() {
        let grid = TimeGrid::new(2.5e-10);
        assert_eq!(grid.step_ns(), None);
        assert_eq!(grid.time_ns(7), 2);
        assert_eq!(TimeGrid::new(1.0 / 3.0).time_s(3), 1.0);
    }
}
