//! How fast a front ran.

use asperity_record::{median, median_and_scatter};

/// Fewest contacts of a row, the column of nucleation included, over which a front has a speed.
const FEWEST_CONTACTS: usize = 4;

/// Most contacts of a row that are compared with each other; of a longer front, only every second, third,
/// ... column is used.
const MOST_OF_A_ROW: usize = 256;

/// Rows up to which that many are compared; of more rows fewer, so that the number of pairs is bounded.
const MOST_ROWS: usize = 16;

/// A contact that a front has passed: its column's distance from that of nucleation, and the time of the
/// arrival, s.
pub(crate) type Passed = (u32, f64);

/// The speed of a front along rows of contacts, in columns away from that of nucleation, by the method of
/// Theil and Sen: the slowness is the median, over all pairs of contacts of the same row, of the time
/// between them divided by their distance. A few early or late contacts do not affect it.
///
/// `None` where no row has four contacts, or the front has no direction.
pub(crate) fn speed_m_per_s(rows: &[Vec<Passed>], spacing_m: f64) -> Option<f64> {
    let longest = rows.iter().map(Vec::len).max().filter(|longest| *longest >= FEWEST_CONTACTS)?;
    let most = most_of_a_row(rows.len());
    // Of a row with gaps, at most as many columns as it has contacts.
    let each = longest.div_ceil(most) as u32;
    let mut slowness: Vec<f64> = Vec::new();
    for row in rows {
        let row: Vec<&Passed> = row.iter().filter(|(distance, _)| distance.is_multiple_of(each)).collect();
        for (n, (from, from_s)) in row.iter().enumerate() {
            for (to, to_s) in &row[n + 1..] {
                slowness.push((to_s - from_s) / f64::from(to - from));
            }
        }
    }
    let median = median(&mut slowness);
    (median > 0.0).then(|| spacing_m / median)
}

/// An arrival at a sensor: the distance from that of nucleation, m, the time, s, and its standard error, s.
pub(crate) type Seen = [f64; 3];

/// The speed of a front that sensors saw, by the same method, and its standard error, m/s: by the larger of the mean
/// error of an arrival and the scatter about the front, 1.4826 times the median of absolute deviations.
pub(crate) fn measured_speed_m_per_s(seen: &[Seen]) -> Option<[f64; 2]> {
    if seen.len() < FEWEST_CONTACTS {
        return None;
    }
    let used: Vec<Seen> = seen.iter().copied().step_by(seen.len().div_ceil(MOST_OF_A_ROW)).collect();
    let pairs = used.iter().enumerate().flat_map(|(n, [x_m, time_s, _])| {
        used[n + 1..].iter().map(move |[next_m, next_s, _]| (next_s - time_s) / (next_m - x_m))
    });
    let slowness = median(&mut pairs.collect::<Vec<f64>>());
    let speed_m_per_s = (slowness > 0.0).then(|| 1.0 / slowness)?;
    let count = seen.len() as f64;
    let mut late_s: Vec<f64> = seen.iter().map(|[x_m, time_s, _]| time_s - x_m / speed_m_per_s).collect();
    let [_, scatter_s] = median_and_scatter(&mut late_s);
    let mean_error_s = seen.iter().map(|[.., error_s]| error_s).sum::<f64>() / count;
    let scatter_s = mean_error_s.max(scatter_s);
    let mean_m = seen.iter().map(|[x_m, ..]| x_m).sum::<f64>() / count;
    let squares_m2: f64 = seen.iter().map(|[x_m, ..]| (x_m - mean_m).powi(2)).sum();
    Some([speed_m_per_s, speed_m_per_s * speed_m_per_s * scatter_s / squares_m2.sqrt()])
}

/// Most contacts of each row that are compared, for the pairs of all rows to be no more than those of
/// [`MOST_ROWS`] rows of [`MOST_OF_A_ROW`].
fn most_of_a_row(rows: usize) -> usize {
    (MOST_ROWS * MOST_OF_A_ROW * MOST_OF_A_ROW / rows).isqrt().clamp(FEWEST_CONTACTS, MOST_OF_A_ROW)
}

/// Fewest arrivals among the 3 x 3 contacts around one for a local speed: six cannot lie on one line.
const FEWEST_AROUND: usize = 6;

/// The gradient of arrivals, in steps per spacing along columns and along rows, of the least-squares plane
/// through those of a contact and its neighbours, each by its column, its row and its step.
///
/// Sums are whole numbers, so the result does not depend on their order. `None` of too few arrivals.
pub(crate) fn gradient(around: &[(u32, u32, u64)]) -> Option<[f64; 2]> {
    if around.len() < FEWEST_AROUND {
        return None;
    }
    let &(column, row, step) = around.first()?;
    let count = around.len() as i128;
    let from = |place: u32, of: u32| i128::from(place) - i128::from(of);
    // Sums over the arrivals: x, y, t, x x, x y, y y, x t, y t, from the first of them.
    let mut sums = [0; 8];
    for &(at_column, at_row, at_step) in around {
        let (x, y) = (from(at_column, column), from(at_row, row));
        let t = i128::from(at_step) - i128::from(step);
        for (sum, term) in sums.iter_mut().zip([x, y, t, x * x, x * y, y * y, x * t, y * t]) {
            *sum += term;
        }
    }
    let [x, y, t, xx, xy, yy, xt, yt] = sums;
    // Covariances times the square of the count.
    let (xx, xy, yy) = (count * xx - x * x, count * xy - x * y, count * yy - y * y);
    let (xt, yt) = (count * xt - x * t, count * yt - y * t);
    let determinant = xx * yy - xy * xy;
    let part = |numerator: i128| numerator as f64 / determinant as f64;
    (determinant > 0).then(|| [part(xt * yy - yt * xy), part(yt * xx - xt * xy)])
}

#[cfg(test)]
mod tests {
    use super::{MOST_OF_A_ROW, MOST_ROWS, Passed, gradient, most_of_a_row, speed_m_per_s};

    /// A single row of consecutive contacts.
    fn one_row(arrivals_s: &[f64]) -> [Vec<Passed>; 1] {
        [(0..).zip(arrivals_s.iter().copied()).collect()]
    }

    #[test]
    fn a_steady_front_has_its_speed_whatever_a_few_blocks_do() {
        // 2 m/s over blocks 1 mm long.
        for blocks in [40, 2000] {
            let mut arrivals: Vec<f64> = (0..blocks).map(|block| 1.0 + 0.0005 * f64::from(block)).collect();
            let speed = |arrivals: &[f64]| speed_m_per_s(&one_row(arrivals), 1e-3).expect("it has one");
            assert!((speed(&arrivals) - 2.0).abs() < 1e-9);
            arrivals[8] = 0.2;
            arrivals[16] = 70.0;
            assert!((speed(&arrivals) - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_front_without_a_direction_has_no_speed() {
        let speed = |arrivals: &[f64]| speed_m_per_s(&one_row(arrivals), 1.0);
        assert_eq!(speed(&[0.0, 1.0, 2.0]), None);
        assert_eq!(speed(&[1.0; 10]), None);
        assert_eq!(speed(&[9.0, 8.0, 7.0, 6.0, 5.0]), None);
        assert_eq!(speed(&[0.0, 1.0, 2.0, 3.0]), Some(1.0));
        assert_eq!(speed_m_per_s(&[], 1.0), None);
    }

    /// Rows begin at times of their own, and lack some contacts: only pairs within a row count.
    #[test]
    fn rows_are_compared_within_themselves() {
        let row = |late_s: f64, columns: &[u32]| -> Vec<Passed> {
            columns.iter().map(|column| (*column, late_s + 0.25 * f64::from(*column))).collect()
        };
        let rows = [row(0.0, &[0, 1, 2, 5]), row(100.0, &[3, 7]), row(-9.0, &[1, 2, 3, 4, 6])];
        assert_eq!(speed_m_per_s(&rows, 0.5), Some(2.0));
        // Pairs of the second row alone are too few, those of two rows of three likewise.
        assert_eq!(speed_m_per_s(&rows[1..2], 0.5), None);
        assert_eq!(speed_m_per_s(&[row(0.0, &[0, 1, 2]), row(1.0, &[0, 1, 2])], 0.5), None);
        // A row without any contact in the columns used.
        let long: Vec<u32> = (0..600).collect();
        assert_eq!(speed_m_per_s(&[row(0.0, &long), row(0.0, &[1, 2])], 0.5), Some(2.0));
    }

    #[test]
    fn the_pairs_of_many_rows_are_bounded() {
        assert_eq!((most_of_a_row(1), most_of_a_row(16)), (256, 256));
        for rows in [17, 100, 316, 5_000] {
            let most = most_of_a_row(rows);
            let bound = MOST_ROWS * MOST_OF_A_ROW * MOST_OF_A_ROW;
            assert!(rows * most * most <= bound && rows * (most + 1) * (most + 1) > bound, "{rows}: {most}");
        }
        assert_eq!(most_of_a_row(100_000), 4);
    }

    /// Arrivals on a plane, and the plane of known residuals: symmetric ones do not tilt it.
    #[test]
    fn the_gradient_is_that_of_the_least_squares_plane() {
        let square = || (1..=3).flat_map(|row| (1..=3).map(move |column| (column, row)));
        let plane = |column: u32, row: u32| 1_000_000_007 + 12 * u64::from(column) - 5 * u64::from(row);
        let all: Vec<_> = square().map(|(column, row)| (column, row, plane(column, row))).collect();
        for left_out in 0..=3 {
            assert_eq!(gradient(&all[left_out..]), Some([12.0, -5.0]));
        }
        assert_eq!(gradient(&all[4..]), None);
        // t = x y about the middle: no tilt.
        let saddle: Vec<_> = square().map(|(x, y)| (x, y, u64::from(50 + x * y - 2 * x - 2 * y))).collect();
        assert_eq!(gradient(&saddle), Some([0.0, 0.0]));
        // One late arrival in the corner (3, 3): by hand, t = 9 there gives 9 / 6 along each axis.
        let late: Vec<_> = square().map(|(x, y)| (x, y, if (x, y) == (3, 3) { 9 } else { 0 })).collect();
        assert_eq!(gradient(&late), Some([1.5, 1.5]));
        // The largest steps of a log.
        let far: Vec<_> = square().map(|(x, y)| (x, y, if x == 3 { u64::MAX } else { 0 })).collect();
        assert_eq!(gradient(&far), Some([u64::MAX as f64 / 2.0, 0.0]));
    }
}
