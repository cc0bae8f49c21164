//! Straight lines through samples, by least squares.

/// A line through points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    count: f64,
    mean_x: f64,
    mean: f64,
    pub(crate) slope: f64,
    squares_x: f64,
    variance: f64,
}

/// Fewest samples of a line with an error.
const FEWEST: usize = 4;

impl Line {
    /// The line through samples, the first at this place; none through fewer than [`FEWEST`].
    pub(crate) fn through(first: u64, samples: &[f64]) -> Option<Line> {
        Line::of(samples.iter().enumerate().map(|(n, y)| ((first + n as u64) as f64, *y)))
    }

    /// The line through points, likewise.
    pub(crate) fn of(points: impl ExactSizeIterator<Item = (f64, f64)> + Clone) -> Option<Line> {
        if points.len() < FEWEST {
            return None;
        }
        let count = points.len() as f64;
        let [mean_x, mean] =
            points.clone().fold([0.0; 2], |sums, (x, y)| [sums[0] + x, sums[1] + y]).map(|sum| sum / count);
        let off = points.map(|(x, y)| (x - mean_x, y - mean));
        let squares_x = off.clone().map(|(x, _)| x * x).sum::<f64>();
        let slope = off.clone().map(|(x, y)| x * y).sum::<f64>() / squares_x;
        let residual = off.map(|(x, y)| (y - slope * x).powi(2)).sum::<f64>();
        Some(Line { count, mean_x, mean, slope, squares_x, variance: residual / (count - 2.0) })
    }

    /// The standard error of its slope.
    pub(crate) fn slope_error(&self) -> f64 {
        (self.variance / self.squares_x).sqrt()
    }

    /// Its value at a place and the standard error of that.
    pub(crate) fn at(&self, x: f64) -> (f64, f64) {
        let off = x - self.mean_x;
        let error = (self.variance * (1.0 / self.count + off * off / self.squares_x)).sqrt();
        (self.mean + self.slope * off, error)
    }
}

#[cfg(test)]
mod tests {
    use super::Line;

    /// By hand: through 1, 3, 3 and 6 at 10 to 13 the line has the slope 1.5 and the values 1, 2.5, 4 and 5.5.
    #[test]
    fn a_line_has_the_error_of_a_regression() {
        let line = Line::through(10, &[1.0, 3.0, 3.0, 6.0]).unwrap();
        assert!((line.slope - 1.5).abs() < 1e-12);
        let (value, error) = line.at(14.0);
        assert!((value - 7.0).abs() < 1e-12);
        // Residuals 0, 0.5, -1 and 0.5: the variance is 0.75; of it 1/4 + 2.5^2/5.
        assert!((error - (0.75f64 * 1.5).sqrt()).abs() < 1e-12, "{error}");
        assert!(Line::through(0, &[1.0; 3]).is_none());
    }
}
