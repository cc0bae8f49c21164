//! How fast a front ran.

/// Fewest blocks, that of nucleation included, over which a front has a speed.
const FEWEST_BLOCKS: usize = 4;

/// Most blocks that are compared with each other; of a longer front, only every second, third, ... block
/// is used.
const MOST_BLOCKS: usize = 256;

/// The speed of a front over consecutive blocks, from its arrival times, by the method of Theil and Sen:
/// the slowness is the median, over all pairs of blocks, of the time between them divided by their
/// distance. A few early or late blocks do not affect it.
///
/// `None` over fewer than four blocks, or where the front has no direction.
pub(crate) fn speed_m_per_s(arrivals_s: &[f64], spacing_m: f64) -> Option<f64> {
    if arrivals_s.len() < FEWEST_BLOCKS {
        return None;
    }
    let each = arrivals_s.len().div_ceil(MOST_BLOCKS);
    let arrivals_s: Vec<f64> = arrivals_s.iter().step_by(each).copied().collect();
    let mut slowness: Vec<f64> = Vec::new();
    for (n, from_s) in arrivals_s.iter().enumerate() {
        for (way, to_s) in arrivals_s[n..].iter().enumerate().skip(1) {
            slowness.push((to_s - from_s) / (way * each) as f64);
        }
    }
    let middle = slowness.len() / 2;
    let (below, upper, _) = slowness.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    let lower = below.iter().copied().max_by(f64::total_cmp).unwrap_or(upper);
    let median = if slowness.len() % 2 == 1 { upper } else { (lower + upper) / 2.0 };
    (median > 0.0).then(|| spacing_m / median)
}

#[cfg(test)]
mod tests {
    use super::speed_m_per_s;

    #[test]
    fn a_steady_front_has_its_speed_whatever_a_few_blocks_do() {
        // 2 m/s over blocks 1 mm long.
        for blocks in [40, 2000] {
            let mut arrivals: Vec<f64> = (0..blocks).map(|block| 1.0 + 0.0005 * f64::from(block)).collect();
            let speed = |arrivals: &[f64]| speed_m_per_s(arrivals, 1e-3).expect("it has one");
            assert!((speed(&arrivals) - 2.0).abs() < 1e-9);
            arrivals[8] = 0.2;
            arrivals[16] = 70.0;
            assert!((speed(&arrivals) - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_front_without_a_direction_has_no_speed() {
        assert_eq!(speed_m_per_s(&[0.0, 1.0, 2.0], 1.0), None);
        assert_eq!(speed_m_per_s(&[1.0; 10], 1.0), None);
        assert_eq!(speed_m_per_s(&[9.0, 8.0, 7.0, 6.0, 5.0], 1.0), None);
        assert_eq!(speed_m_per_s(&[0.0, 1.0, 2.0, 3.0], 1.0), Some(1.0));
    }
}
