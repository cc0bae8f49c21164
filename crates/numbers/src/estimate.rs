//! Numbers with their standard errors: statistics of repeated events in one run, or of single ones in
//! several.
//!
//! Successive precursors are correlated, so their scatter is not that of independent draws. Errors are
//! those of Newey and West, Econometrica 55, 703 (1987), who add the covariances of neighbours, with
//! weights that fall to zero over `4 (n / 100)^(2/9)` of them (Rev. Econ. Stud. 61, 631 (1994)). They need
//! neither independent nor even scatter. A dozen values hardly determine the covariances, so these may only
//! increase an error, never reduce it.

use std::fmt;

use asperity_record::Line;

use crate::median;

/// A number and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error; 0 for numbers that are no statistics of a sample.
    pub error: f64,
}

impl Estimate {
    /// A number read off a run as it is.
    pub fn exact(value: f64) -> Estimate {
        Estimate { value, error: 0.0 }
    }

    /// Its distance from another number.
    pub fn distance_from(self, other: f64) -> Estimate {
        Estimate { value: (self.value - other).abs(), ..self }
    }

    /// In units of a number.
    pub fn over(self, unit: f64) -> Estimate {
        Estimate { value: self.value / unit, error: self.error / unit.abs() }
    }

    /// Its natural logarithm.
    pub fn ln(self) -> Estimate {
        Estimate { value: libm::log(self.value), error: self.error / self.value.abs() }
    }

    /// The difference of two that are independent.
    pub fn minus(self, other: Estimate) -> Estimate {
        Estimate { value: self.value - other.value, error: self.error.hypot(other.error) }
    }
}

/// Both to two digits of the error.
impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Estimate { value, error } = self;
        let decimals = (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize;
        let text = format!("{value:.decimals$} ± {error:.decimals$}");
        f.write_str(&text.replace('-', "\u{2212}"))
    }
}

impl From<f64> for Estimate {
    fn from(value: f64) -> Estimate {
        Estimate::exact(value)
    }
}

/// The error of a statistic, from the influence of each value of a sample on it, in chronological order,
/// and the number of parameters estimated from the sample.
fn error_of(moves: &[f64], parameters: usize) -> f64 {
    let count = moves.len();
    let lags = (4.0 * (count as f64 / 100.0).powf(2.0 / 9.0)) as usize;
    let covariance = |lag: usize| moves.iter().zip(&moves[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let weighted = |lag: usize| 2.0 * (1.0 - lag as f64 / (lags + 1) as f64) * covariance(lag);
    let neighbours = (1..=lags.min(count - 1)).map(weighted).sum::<f64>();
    let variance = covariance(0) + neighbours.max(0.0);
    (variance * count as f64 / (count - parameters) as f64).sqrt()
}

/// The mean; none of fewer than two values.
pub fn mean(values: &[f64]) -> Option<Estimate> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let moves: Vec<f64> = values.iter().map(|value| (value - mean) / count).collect();
    (values.len() > 1).then(|| Estimate { value: mean, error: error_of(&moves, 1) })
}

/// The root of the mean square; of one value its magnitude, without an error.
pub fn root_mean_square(values: &[f64]) -> Option<Estimate> {
    if let [value] = values {
        return Some(Estimate::exact(value.abs()));
    }
    let squares: Vec<f64> = values.iter().map(|value| value * value).collect();
    let Estimate { value, error } = mean(&squares)?;
    let root = value.sqrt();
    Some(Estimate { value: root, error: if root > 0.0 { error / (2.0 * root) } else { 0.0 } })
}

/// Slope and intercept of the straight line through points by least squares; none where there are
/// fewer than three, or all at one `x`.
pub fn line(points: &[(f64, f64)]) -> Option<[Estimate; 2]> {
    let (count, line) = (points.len() as f64, Line::of(points.iter().copied())?);
    let (slope, intercept, Line { mean_x: x_mean, squares_x: spread, .. }) =
        (line.slope, line.at(0.0).0, line);
    let moves = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        points.iter().map(|(x, y)| of((x - x_mean) / spread) * (y - intercept - slope * x)).collect()
    };
    Some([
        Estimate { value: slope, error: error_of(&moves(&|lever| lever), 2) },
        Estimate { value: intercept, error: error_of(&moves(&|lever| 1.0 / count - x_mean * lever), 2) },
    ])
}

/// The median of independent values, with the error of McKean and Schrader, Commun. Stat. Simul.
/// Comput. 13, 751 (1984): the distance of the order statistics between which it lies with 99 %,
/// over twice the normal distribution's quantile.
pub fn median_of(values: &[f64]) -> Option<Estimate> {
    const QUANTILE: f64 = 2.575_829;
    let mut ascending = values.to_vec();
    ascending.sort_by(f64::total_cmp);
    let count = ascending.len();
    let value = median(values.iter().copied())?;
    let rank =
        (0.5 * (count as f64 + 1.0) - QUANTILE * (count as f64 / 4.0).sqrt()).round().max(1.0) as usize;
    Some(Estimate { value, error: (ascending[count - rank] - ascending[rank - 1]) / (2.0 * QUANTILE) })
}

#[cfg(test)]
mod tests {
    use asperity_testkit::Random;

    use super::{Estimate, error_of, line, mean, median_of, root_mean_square};

    fn near(found: Estimate, value: f64, error: f64) {
        assert!((found.value - value).abs() < 1e-12 && (found.error - error).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn errors_are_worked_out_by_hand() {
        // Moves are -1/2 and 1/2: 1/2, times 2 for one degree of freedom.
        near(mean(&[1.0, 3.0]).unwrap(), 2.0, 1.0);
        assert_eq!(mean(&[1.0]), None);
        // Of the lags 4 (4/100)^(2/9) = 1.96 one, with the weight 2 (1 - 1/2). Moves are -1/4, -1/4,
        // 1/4, 1/4: 4/16 + 1/16, times 4/3.
        near(mean(&[1.0, 1.0, 3.0, 3.0]).unwrap(), 2.0, (5.0f64 / 12.0).sqrt());
        // 9 and 1: 5 +- 4, over twice the root.
        near(root_mean_square(&[3.0, -1.0]).unwrap(), 5f64.sqrt(), 2.0 / 5f64.sqrt());
        assert_eq!(root_mean_square(&[0.0, 0.0]), Some(Estimate::exact(0.0)));
        let [slope, intercept] = line(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]).unwrap();
        near(slope, 2.0, 0.0);
        near(intercept, 1.0, 0.0);
        // Residuals 1/6, -1/3, 1/6; levers -1/2, 0, 1/2: moves -1/12, 0, 1/12.
        let [slope, _] = line(&[(0.0, 0.0), (1.0, 0.0), (2.0, 1.0)]).unwrap();
        near(slope, 0.5, (2.0f64 / 144.0 * 3.0).sqrt());
        // Means 1 and 2, slope (1 * 2 + 1 * 1) / 2, intercept 2 - 3 / 2.
        let [slope, intercept] = line(&[(0.0, 0.0), (1.0, 3.0), (2.0, 3.0)]).unwrap();
        assert_eq!((slope.value, intercept.value), (1.5, 0.5));
        assert_eq!(line(&[(0.0, 1.0), (1.0, 3.0)]), None);
        assert_eq!(line(&[(1.0, 1.0), (1.0, 3.0), (1.0, 2.0)]), None);
        // Of 16 the third and the fourteenth: 8.5 - 2.58 * 2 = 3.3.
        let values: Vec<f64> = (1..=16).map(f64::from).collect();
        near(median_of(&values).unwrap(), 8.5, 11.0 / (2.0 * 2.575_829));
        near(median_of(&[2.0]).unwrap(), 2.0, 0.0);
        near(Estimate { value: -2.0, error: 3.0 }.minus(Estimate { value: 1.0, error: 4.0 }), -3.0, 5.0);
        near(Estimate { value: 0.9, error: 0.2 }.distance_from(1.0).over(2.0), 0.05, 0.1);
    }

    /// The scatter of a thousand means, slopes and medians is that of their errors, of values that
    /// depend on the one before as well.
    #[test]
    fn errors_are_the_scatter_of_many_samples() {
        let mut random = Random::new(3);
        let mut check = |of: &str, memory: f64, statistic: &dyn Fn(&[f64]) -> Estimate| {
            let samples: Vec<Estimate> = (0..1000)
                .map(|_| {
                    let mut last = 0.0;
                    let next = |_| {
                        last = memory * last + random.uniform(-1.0, 1.0);
                        last
                    };
                    statistic(&(0..100).map(next).collect::<Vec<f64>>())
                })
                .collect();
            let mean_of = |of: &dyn Fn(&Estimate) -> f64| samples.iter().map(of).sum::<f64>() / 1000.0;
            let middle = mean_of(&|sample| sample.value);
            let scatter = mean_of(&|sample| (sample.value - middle).powi(2)).sqrt();
            let ratio = mean_of(&|sample| sample.error) / scatter;
            assert!((0.8..1.15).contains(&ratio), "{of} with memory {memory}: {ratio}");
        };
        let through = |values: &[f64]| -> Vec<(f64, f64)> {
            values.iter().enumerate().map(|(n, value)| (n as f64, *value)).collect()
        };
        for memory in [0.0, 0.3] {
            check("mean", memory, &|values| mean(values).unwrap());
            check("root mean square", memory, &|values| root_mean_square(values).unwrap());
            check("slope", memory, &|values| line(&through(values)).unwrap()[0]);
            check("intercept", memory, &|values| line(&through(values)).unwrap()[1]);
        }
        check("median", 0.0, &|values| median_of(values).unwrap());
    }

    #[test]
    fn values_that_swing_about_their_mean_have_no_smaller_error() {
        let swing: Vec<f64> = (0..50).map(|n| if n % 2 == 0 { 1.0 } else { -1.0 }).collect();
        near(mean(&swing).unwrap(), 0.0, (1.0f64 / 49.0).sqrt());
        assert_eq!(error_of(&[0.0; 5], 1), 0.0);
    }
}
