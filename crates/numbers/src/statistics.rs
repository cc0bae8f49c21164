//! Means, medians and regression lines; None for empty input.

/// The mean.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.into_iter().fold((0_u64, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / count as f64)
}

/// The median; the mean of the middle two of an even number of values.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some((lower + upper) / 2.0)
}

/// The number below which a share of them lies, between two numbers by a straight line.
pub fn quantile(ascending: &[f64], share: f64) -> Option<f64> {
    let at = share * (ascending.len().checked_sub(1)? as f64);
    let (low, high) = (ascending[at.floor() as usize], ascending[at.ceil() as usize]);
    Some(low + (high - low) * at.fract())
}

/// A straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) slope: f64,
    pub(crate) intercept: f64,
}

impl Line {
    /// The least-squares line in `y`; None through fewer than three points, or points at one `x`.
    pub(crate) fn through(points: &[(f64, f64)]) -> Option<Line> {
        if points.len() < 3 {
            return None;
        }
        let x_mean = mean(points.iter().map(|(x, _)| *x))?;
        let y_mean = mean(points.iter().map(|(_, y)| *y))?;
        let spread: f64 = points.iter().map(|(x, _)| (x - x_mean) * (x - x_mean)).sum();
        let common: f64 = points.iter().map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
        let slope = common / spread;
        slope.is_finite().then_some(Line { slope, intercept: y_mean - slope * x_mean })
    }
}

#[cfg(test)]
mod tests {
    use super::{Line, mean, median};

    #[test]
    fn middles_are_those_of_the_textbook() {
        assert_eq!(mean([1.0, 2.0, 6.0]), Some(3.0));
        assert_eq!(mean([]), None);
        assert_eq!(median([5.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([5.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median([]), None);
    }

    #[test]
    fn a_line_goes_through_its_points_or_between_them() {
        let line = |points: &[(f64, f64)]| Line::through(points);
        assert_eq!(line(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]), Some(Line { slope: 2.0, intercept: 1.0 }));
        // By hand: means 1 and 2, slope (1 * 2 + 1 * 1) / 2, intercept 2 - 3 / 2.
        assert_eq!(line(&[(0.0, 0.0), (1.0, 3.0), (2.0, 3.0)]), Some(Line { slope: 1.5, intercept: 0.5 }));
        assert_eq!(line(&[(0.0, 0.0), (1.0, 1.0)]), None);
        assert_eq!(line(&[(1.0, 0.0), (1.0, 1.0), (1.0, 2.0)]), None);
    }
}
