//! Courses in time: piecewise linear, of the normal load, the velocity of the drive and forces from outside; and swings.

/// A number that changes piecewise linearly in time, between knots on the grid of time steps; constant before the
/// first and after the last knot.
///
/// Of the normal load (6.1-6.3) it is the factor on the load at the start, of the drive its velocity in m/s. In (6.2)
/// the ramp starts where the drive stops, and in (6.3) its length is the difference of its ends.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Course {
    /// The value before the first knot, and of a course without knots.
    start: f64,
    /// Steps and values, ascending in steps. Two values at one step are a jump there: to the left of the step the
    /// first one counts, in it and to the right the second.
    knots: Vec<(u64, f64)>,
    /// Whether steps count from the one in which the drive stops.
    from_hold: bool,
}

impl Course {
    /// A course with the given values at the given steps, which do not descend. `start` is the value before the
    /// first of them, and equal to it.
    pub fn new(start: f64, steps: Vec<u64>, values: Vec<f64>, from_hold: bool) -> Course {
        Course { start, knots: steps.into_iter().zip(values).collect(), from_hold }
    }

    /// Whether the value ever changes.
    pub fn is_constant(&self) -> bool {
        self.knots.iter().all(|(_, value)| *value == self.start)
    }

    /// The largest value.
    pub fn largest(&self) -> f64 {
        self.knots.iter().fold(self.start, |most, (_, value)| most.max(*value))
    }

    /// The last step in which the value jumps.
    pub fn last_jump(&self) -> Option<u64> {
        let mut jumps = self.knots.windows(2).filter(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1);
        jumps.next_back().map(|pair| pair[0].0)
    }

    /// The step from which the knots count; `None` while it is unknown.
    fn origin(&self, hold_step: u64) -> Option<u64> {
        match (self.from_hold, hold_step) {
            (false, _) => Some(0),
            (true, u64::MAX) => None,
            (true, hold_step) => Some(hold_step),
        }
    }

    /// The value in a step. `hold_step` is the step in which the drive stopped, `u64::MAX` before
    /// that.
    #[inline]
    pub fn value(&self, step: u64, hold_step: u64) -> f64 {
        match self.knots.as_slice() {
            [] => self.start,
            [.., last] => self.value_up_to(*last, step, hold_step),
        }
    }

    fn value_up_to(&self, last: (u64, f64), step: u64, hold_step: u64) -> f64 {
        let Some(origin) = self.origin(hold_step) else { return self.start };
        let at = step.saturating_sub(origin);
        if at >= last.0 {
            return last.1;
        }
        let behind = self.knots.partition_point(|(knot, _)| *knot <= at);
        let Some(before) = behind.checked_sub(1) else { return self.start };
        let ((from, start), (to, end)) = (self.knots[before], self.knots[behind]);
        start + (end - start) * ((at - from) as f64 / (to - from) as f64)
    }

    /// The change of the value per step after `step`, up to the next knot. Computed from the
    /// knots, because a difference of two values would multiply its rounding error over many
    /// steps.
    pub fn rate(&self, step: u64, hold_step: u64) -> f64 {
        let Some(at) = self.origin(hold_step).and_then(|origin| step.checked_sub(origin)) else { return 0.0 };
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

    /// The integral of the value from step 0 to `step`, in steps times its unit: a sum of trapezoids, exact but for
    /// rounding.
    pub fn integral(&self, step: u64, hold_step: u64) -> f64 {
        let Some(origin) = self.origin(hold_step) else { return self.start * step as f64 };
        let (mut sum, mut from, mut value) = (0.0, 0, self.start);
        for (knot, next) in self.knots.iter().map(|(knot, next)| (origin + knot, *next)) {
            if knot > step {
                break;
            }
            sum += 0.5 * (value + next) * (knot - from) as f64;
            (from, value) = (knot, next);
        }
        sum + 0.5 * (value + self.value(step, hold_step)) * (step - from) as f64
    }
}

/// A sine in time, from a time on: of the force from outside on each block, over its normal load at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Amplitude.
    pub ratio: f64,
    /// Period, s.
    pub period_s: f64,
    /// When it begins, on the grid of time steps, s.
    pub from_s: f64,
}

impl Swing {
    /// Its value at a time from its beginning on, and its rate, 1/s.
    pub fn at(&self, time_s: f64) -> [f64; 2] {
        let per_s = std::f64::consts::TAU / self.period_s;
        // Without whole periods, whose remainder is exact, the phase keeps its digits.
        let phase = per_s * ((time_s - self.from_s) % self.period_s);
        [self.ratio * libm::sin(phase), self.ratio * per_s * libm::cos(phase)]
    }
}

/// A number of each contact that changes piecewise linearly in time, between knots on the grid of time steps; constant
/// before the first and after the last knot. Two knots at one step are a jump, as in [`Course`]. Of the normal load it
/// is a factor, of the prestress a force in N.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactCourse {
    /// Knots, ascending, at least one: a step and a value for each contact.
    knots: Vec<(u64, Vec<f64>)>,
}

impl ContactCourse {
    /// A course with the given values of all contacts at the given steps; `None` without any.
    pub fn new(steps: Vec<u64>, values: Vec<Vec<f64>>) -> Option<ContactCourse> {
        (!steps.is_empty()).then(|| ContactCourse { knots: steps.into_iter().zip(values).collect() })
    }

    /// The values of all contacts in a step.
    pub fn values(&self, step: u64) -> Vec<f64> {
        let behind = self.knots.partition_point(|(knot, _)| *knot <= step);
        let (from, start) = &self.knots[behind.saturating_sub(1)];
        match self.knots.get(behind).filter(|_| behind > 0) {
            None => start.clone(),
            Some((to, end)) => {
                let share = (step - from) as f64 / (to - from) as f64;
                start.iter().zip(end).map(|(start, end)| start + (end - start) * share).collect()
            }
        }
    }

    /// The largest value of a contact.
    pub fn largest(&self, contact: usize) -> f64 {
        self.knots.iter().fold(0.0, |most, (_, values)| most.max(values[contact]))
    }

    /// The values before the run: those of the first knot, also if they jump at once.
    pub(crate) fn at_start(&self) -> &[f64] {
        &self.knots[0].1
    }

    /// The first knot after a step; `u64::MAX` if there is none.
    pub fn next_knot(&self, step: u64) -> u64 {
        let behind = self.knots.partition_point(|(knot, _)| *knot <= step);
        self.knots.get(behind).map_or(u64::MAX, |(knot, _)| *knot)
    }

    /// The change of all values per step after a step, up to the next knot.
    pub fn rates(&self, step: u64) -> Vec<f64> {
        let behind = self.knots.partition_point(|(knot, _)| *knot <= step);
        let pair =
            behind.checked_sub(1).and_then(|before| self.knots.get(before)).zip(self.knots.get(behind));
        match pair {
            None => vec![0.0; self.knots[0].1.len()],
            Some(((from, start), (to, end))) => {
                let steps = (to - from) as f64;
                start.iter().zip(end).map(|(start, end)| (end - start) / steps).collect()
            }
        }
    }
}

/// The values of a course of all contacts, time by time: of each contact, or one for all.
pub(crate) fn by_contact<'a>(
    values: &'a [f64],
    times: &[f64],
    contacts: usize,
) -> impl Iterator<Item = Vec<f64>> + use<'a> {
    let per_time = if times.is_empty() { 1 } else { (values.len() / times.len()).max(1) };
    values.chunks(per_time).map(move |values| match values {
        [value] => vec![*value; contacts],
        values => values.to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use super::{ContactCourse, Course};

    #[test]
    fn courses_of_contacts_are_linear_between_knots_and_constant_outside() {
        let course =
            ContactCourse::new(vec![10, 20, 40], vec![vec![1.0, 0.0], vec![3.0, 0.0], vec![1.0, 4.0]]);
        let course = course.unwrap();
        for (step, expected) in [
            (0, [1.0, 0.0]),
            (10, [1.0, 0.0]),
            (15, [2.0, 0.0]),
            (20, [3.0, 0.0]),
            (25, [2.5, 1.0]),
            (99, [1.0, 4.0]),
        ] {
            assert_eq!(course.values(step), expected, "step {step}");
        }
        assert_eq!([0, 10, 20, 40].map(|step| course.next_knot(step)), [10, 20, 40, u64::MAX]);
        assert_eq!([9, 10, 25, 40].map(|step| course.rates(step)[0]), [0.0, 0.2, -0.1, 0.0]);
        assert_eq!(ContactCourse::new(Vec::new(), Vec::new()), None);
    }

    #[test]
    fn a_course_is_linear_between_its_knots_and_constant_outside() {
        let course = Course::new(1.0, vec![10, 20, 40, 50], vec![1.0, 0.5, 0.5, 0.25], false);
        let at = |step| course.value(step, u64::MAX);
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
        let course = Course::new(1.0, vec![0, 10], vec![1.0, 0.5], true);
        assert_eq!([course.value(99, u64::MAX), course.value(105, 100)], [1.0, 0.75]);
        assert_eq!([course.next_knot(100, u64::MAX), course.next_knot(100, 100)], [u64::MAX, 110]);
        // Also where the stop is known in advance.
        assert_eq!([99, 100, 110].map(|step| course.rate(step, 100)), [0.0, -0.05, 0.0]);
    }

    #[test]
    fn integrals_are_those_of_the_trapezoids() {
        let course = Course::new(2.0, vec![10, 20, 20, 40], vec![2.0, 4.0, 1.0, 0.0], false);
        let integral = |step| course.integral(step, u64::MAX);
        // 2 for 10 steps, 2 to 4 over 10, 1 to 0 over 20, 0.
        let found =
            [integral(0), integral(5), integral(10), integral(15), integral(20), integral(30), integral(99)];
        assert_eq!(found, [0.0, 10.0, 20.0, 32.5, 50.0, 57.5, 60.0]);
        // The second value at a jump counts in its step.
        let at = |step| course.value(step, u64::MAX);
        assert_eq!([at(19), at(20), at(30), at(40)], [3.8, 1.0, 0.5, 0.0]);
        assert_eq!([course.rate(19, u64::MAX), course.rate(20, u64::MAX)], [0.2, -0.05]);
        assert_eq!([course.next_knot(10, u64::MAX), course.next_knot(20, u64::MAX)], [20, 40]);
        let constant = Course::new(3.0, Vec::new(), Vec::new(), false);
        assert_eq!((constant.integral(7, u64::MAX), constant.is_constant()), (21.0, true));
        let from_hold = Course::new(1.0, vec![0, 10], vec![1.0, 0.0], true);
        assert_eq!([from_hold.integral(100, u64::MAX), from_hold.integral(105, 100)], [100.0, 103.75]);
    }
}
