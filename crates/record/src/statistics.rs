//! The median, and the scatter about it.

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

#[cfg(test)]
mod tests {
    use super::{median, median_and_scatter};

    #[test]
    fn the_median_of_an_even_number_lies_between_two() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
        assert!(median(&mut []).is_nan());
        // Distances 1, 0, 1 and, of an outlier, 97.
        assert_eq!(median_and_scatter(&mut [2.0, 3.0, 4.0, 100.0, 3.0]), [3.0, 1.4826]);
    }
}
