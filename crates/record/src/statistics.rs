//! Medians, the scatter about them, and straight lines.

/// The median: the mean of the middle two of an even number of values; NaN of none.
pub fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return f64::NAN;
    }
    let is_odd = values.len() % 2 == 1;
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).unwrap_or(*upper);
    if is_odd { *upper } else { (lower + *upper) / 2.0 }
}

/// The median, and 1.4826 times the median of the distances from it, which estimates the standard deviation of values that
/// are normally distributed but for some outliers.
pub fn median_and_scatter(values: &mut [f64]) -> [f64; 2] {
    let middle = median(values);
    values.iter_mut().for_each(|value| *value = (*value - middle).abs());
    [middle, 1.4826 * median(values)]
}

/// A straight line through points by least squares.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    count: f64,
    /// The mean `x` of the points.
    pub mean_x: f64,
    mean: f64,
    /// Its slope.
    pub slope: f64,
    /// The sum of the squares of `x` less the mean.
    pub squares_x: f64,
    variance: f64,
}

impl Line {
    /// The line through points; none through fewer than three, or where all are at one `x`.
    pub fn of(points: impl ExactSizeIterator<Item = (f64, f64)> + Clone) -> Option<Line> {
        let count = points.len() as f64;
        let [mean_x, mean] =
            points.clone().fold([0.0; 2], |sums, (x, y)| [sums[0] + x, sums[1] + y]).map(|sum| sum / count);
        let off = points.map(|(x, y)| (x - mean_x, y - mean));
        let squares_x = off.clone().map(|(x, _)| x * x).sum::<f64>();
        let slope = off.clone().map(|(x, y)| x * y).sum::<f64>() / squares_x;
        let residual = off.map(|(x, y)| (y - slope * x).powi(2)).sum::<f64>();
        let line = Line { count, mean_x, mean, slope, squares_x, variance: residual / (count - 2.0) };
        (count > 2.0 && squares_x != 0.0).then_some(line)
    }

    /// The standard error of its slope, if the points scatter normally, each by itself.
    pub fn slope_error(&self) -> f64 {
        (self.variance / self.squares_x).sqrt()
    }

    /// Its value at a place, and the standard error of that, likewise.
    pub fn at(&self, x: f64) -> (f64, f64) {
        let off = x - self.mean_x;
        let error = (self.variance * (1.0 / self.count + off * off / self.squares_x)).sqrt();
        (self.mean + self.slope * off, error)
    }
}

#[cfg(test)]
mod tests {
    use super::{Line, median, median_and_scatter};

    #[test]
    fn the_median_of_an_even_number_lies_between_two() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
        assert!(median(&mut []).is_nan());
        // Distances 1, 0, 1 and, of an outlier, 97.
        assert_eq!(median_and_scatter(&mut [2.0, 3.0, 4.0, 100.0, 3.0]), [3.0, 1.4826]);
    }

    /// By hand: through 1, 3, 3 and 6 at 10 to 13 the line has the slope 1.5 and the values 1, 2.5, 4 and 5.5.
    #[test]
    fn a_line_has_the_error_of_a_regression() {
        let points = [(10.0, 1.0), (11.0, 3.0), (12.0, 3.0), (13.0, 6.0)];
        let line = Line::of(points.into_iter()).unwrap();
        assert!((line.slope - 1.5).abs() < 1e-12);
        let (value, error) = line.at(14.0);
        assert!((value - 7.0).abs() < 1e-12);
        // Residuals 0, 0.5, -1 and 0.5: the variance is 0.75; of it 1/4 + 2.5^2/5.
        assert!((error - (0.75f64 * 1.5).sqrt()).abs() < 1e-12, "{error}");
        assert!(
            Line::of(points[..2].iter().copied()).is_none()
                && Line::of([(1.0, 2.0); 3].into_iter()).is_none()
        );
    }
}
