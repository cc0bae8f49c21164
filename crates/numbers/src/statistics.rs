//! Means, medians and quantiles; None for empty input.

/// The mean.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.into_iter().fold((0_u64, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / count as f64)
}

/// The median; the mean of the middle two of an even number of values.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    (!values.is_empty()).then(|| asperity_record::median(&mut values))
}

/// The number below which a share of them lies, between two numbers by a straight line.
pub fn quantile(ascending: &[f64], share: f64) -> Option<f64> {
    let at = share * (ascending.len().checked_sub(1)? as f64);
    let (low, high) = (ascending[at.floor() as usize], ascending[at.ceil() as usize]);
    Some(low + (high - low) * at.fract())
}

#[cfg(test)]
mod tests {
    use super::{mean, median};

    #[test]
    fn middles_are_those_of_the_textbook() {
        assert_eq!(mean([1.0, 2.0, 6.0]), Some(3.0));
        assert_eq!(mean([]), None);
        assert_eq!(median([5.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([5.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median([]), None);
    }
}
