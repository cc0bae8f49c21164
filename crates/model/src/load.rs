//! Normal load per block.

/// `p_n = F_N / N (1 - theta (2n - N - 1) / (N - 1))` (5.18), n from 1.
///
/// The sign is that of (5.18) and of the thesis' program: a positive `theta`
/// loads the driven end more. (5.10) and (2.8) have the other sign.
pub fn tilted(total_n: f64, theta: f64, blocks: usize) -> Vec<f64> {
    let count = blocks as f64;
    (1..=blocks)
        .map(|n| total_n / count * (1.0 - (2.0 * n as f64 - count - 1.0) / (count - 1.0) * theta))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::tilted;

    #[test]
    fn tilt_shifts_load_to_the_driven_end_and_keeps_the_total() {
        assert_eq!(tilted(400.0, 0.0, 4), [100.0; 4]);
        let p = tilted(400.0, 0.5, 5);
        assert_eq!((p[0], p[2], p[4]), (120.0, 80.0, 40.0));
        assert!((p.iter().sum::<f64>() - 400.0).abs() < 1e-12);
    }
}
