//! Normal load per block.

use crate::body::elastic::gaps;

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

#[cfg(test)]
mod tests {
    use super::tilted;

    #[test]
    fn tilt_shifts_load_to_the_driven_end_and_keeps_the_total() {
        assert_eq!(tilted(400.0, 0.0, 4, 1), [100.0; 4]);
        let p = tilted(400.0, 0.5, 5, 1);
        assert_eq!((p[0], p[2], p[4]), (120.0, 80.0, 40.0));
        assert!((p.iter().sum::<f64>() - 400.0).abs() < 1e-12);
        assert_eq!(tilted(400.0, 0.0, 1, 1), [400.0]);
    }
}
