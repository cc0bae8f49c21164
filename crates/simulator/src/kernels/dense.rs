//! Dense and banded linear algebra for the modes of a slab: products with the columns of a matrix, and
//! Cholesky's factor of a band.

use crate::kernels::simd::{Simd, dispatch};

impl Simd {
    dispatch! {
        /// The product of each column of a matrix with a vector.
        dots(products: &mut [f64], columns: &[f64], vector: &[f64])
    }

    dispatch! {
        /// Adds multiples of the columns of a matrix, in ascending order.
        add_columns(sum: &mut [f64], columns: &[f64], times: &[f64])
    }

    dispatch! {
        /// Replaces the lower band of a symmetric matrix, stored by rows of `width` numbers up to the
        /// diagonal, by its Cholesky factor with the diagonal inverted; `false` if the matrix is not
        /// positive.
        factor_band(band: &mut [f64], width: usize) -> bool
    }

    dispatch! {
        /// Solves a system by that factor.
        solve_band(x: &mut [f64], band: &[f64], width: usize)
    }
}

/// Lanes of a sum: its order is the same on every machine.
const LANES: usize = 8;

/// Columns that are processed at once.
const COLUMNS: usize = 4;

#[inline(always)]
fn sum_of(lanes: [f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let b = &b[..a.len()];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut lanes = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    for (lane, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        lanes[lane] += a * b;
    }
    sum_of(lanes)
}

#[inline(always)]
fn dots(products: &mut [f64], columns: &[f64], vector: &[f64]) {
    let size = vector.len();
    let (groups, rest) = products.as_chunks_mut::<COLUMNS>();
    let (of_groups, of_rest) = columns.split_at(groups.len() * COLUMNS * size);
    let (vector_lanes, vector_rest) = vector.as_chunks::<LANES>();
    for (products, columns) in groups.iter_mut().zip(of_groups.chunks_exact(COLUMNS * size)) {
        let column = |c: usize| columns[c * size..][..size].as_chunks::<LANES>();
        let [(a, a_rest), (b, b_rest), (c, c_rest), (d, d_rest)] =
            [column(0), column(1), column(2), column(3)];
        let mut lanes = [[0.0; LANES]; COLUMNS];
        for ((((x, a), b), c), d) in vector_lanes.iter().zip(a).zip(b).zip(c).zip(d) {
            for lane in 0..LANES {
                lanes[0][lane] += a[lane] * x[lane];
                lanes[1][lane] += b[lane] * x[lane];
                lanes[2][lane] += c[lane] * x[lane];
                lanes[3][lane] += d[lane] * x[lane];
            }
        }
        for (lane, x) in vector_rest.iter().enumerate() {
            lanes[0][lane] += a_rest[lane] * x;
            lanes[1][lane] += b_rest[lane] * x;
            lanes[2][lane] += c_rest[lane] * x;
            lanes[3][lane] += d_rest[lane] * x;
        }
        *products = lanes.map(sum_of);
    }
    for (product, column) in rest.iter_mut().zip(of_rest.chunks_exact(size)) {
        *product = dot(column, vector);
    }
}

#[inline(always)]
fn add_columns(sum: &mut [f64], columns: &[f64], times: &[f64]) {
    let size = sum.len();
    let (groups, rest) = times.as_chunks::<COLUMNS>();
    let (of_groups, of_rest) = columns.split_at(groups.len() * COLUMNS * size);
    for (times, columns) in groups.iter().zip(of_groups.chunks_exact(COLUMNS * size)) {
        let (a, columns) = columns.split_at(size);
        let (b, columns) = columns.split_at(size);
        let (c, d) = columns.split_at(size);
        let d = &d[..size];
        for n in 0..size {
            sum[n] = (((sum[n] + times[0] * a[n]) + times[1] * b[n]) + times[2] * c[n]) + times[3] * d[n];
        }
    }
    for (times, column) in rest.iter().zip(of_rest.chunks_exact(size)) {
        for (sum, x) in sum.iter_mut().zip(column) {
            *sum += times * x;
        }
    }
}

#[inline(always)]
fn factor_band(band: &mut [f64], width: usize) -> bool {
    let (rows, beside) = (band.len() / width, width - 1);
    for i in 0..rows {
        let (before, own) = band.split_at_mut(i * width);
        let own = &mut own[..width];
        let first = i.saturating_sub(beside);
        for j in first..i {
            let row = &before[j * width..][..width];
            let from = first.max(j.saturating_sub(beside));
            // Column k of row i is stored at k + beside - i.
            let (of_own, of_row) = (from + beside - i, from + beside - j);
            let done = dot(&own[of_own..][..j - from], &row[of_row..][..j - from]);
            let at = j + beside - i;
            own[at] = (own[at] - done) * row[beside];
        }
        let of_own = &own[first + beside - i..beside];
        let square = own[beside] - dot(of_own, of_own);
        // Written so that NaN is refused.
        let is_positive = square > 0.0;
        if !is_positive {
            return false;
        }
        own[beside] = 1.0 / square.sqrt();
    }
    true
}

#[inline(always)]
fn solve_band(x: &mut [f64], band: &[f64], width: usize) {
    let (rows, beside) = (band.len() / width, width - 1);
    for i in 0..rows {
        let (row, first) = (&band[i * width..][..width], i.saturating_sub(beside));
        let (before, own) = x.split_at_mut(i);
        own[0] = (own[0] - dot(&row[first + beside - i..beside], &before[first..])) * row[beside];
    }
    for i in (0..rows).rev() {
        let (row, first) = (&band[i * width..][..width], i.saturating_sub(beside));
        let (before, own) = x.split_at_mut(i);
        own[0] *= row[beside];
        let times = own[0];
        for (x, factor) in before[first..].iter_mut().zip(&row[first + beside - i..beside]) {
            *x -= times * factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::mixed;

    use super::Simd;

    fn numbers(seed: u64, count: usize) -> Vec<f64> {
        (0..count).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits_and_the_right_numbers() {
        for (size, count) in [(1, 1), (7, 3), (8, 4), (29, 9), (64, 12)] {
            let (columns, vector, times) = (numbers(1, size * count), numbers(2, size), numbers(3, count));
            let run = |simd: Simd| {
                let (mut products, mut sum) = (vec![0.0; count], vector.clone());
                simd.dots(&mut products, &columns, &vector);
                simd.add_columns(&mut sum, &columns, &times);
                (products, sum)
            };
            let (products, sum) = run(Simd::Baseline);
            for (c, product) in products.iter().enumerate() {
                let simple: f64 = (0..size).map(|n| columns[c * size + n] * vector[n]).sum();
                assert!((product - simple).abs() < 1e-13);
            }
            for (n, sum) in sum.iter().enumerate() {
                let simple: f64 = (0..count).map(|c| columns[c * size + n] * times[c]).sum();
                assert!((sum - simple - vector[n]).abs() < 1e-13);
            }
            for simd in Simd::available() {
                assert_eq!(run(simd), (products.clone(), sum.clone()), "{simd:?}");
            }
        }
    }

    #[test]
    fn a_band_is_factored_and_solved_with() {
        for (rows, width) in [(1, 1), (5, 2), (30, 7), (41, 20), (9, 9)] {
            let entry = |i: usize, j: usize| {
                let (i, j) = (i.max(j), i.min(j));
                match i - j {
                    0 => width as f64,
                    off if off < width => numbers((i * 100 + j) as u64, 1)[0],
                    _ => 0.0,
                }
            };
            let mut band = vec![0.0; rows * width];
            for i in 0..rows {
                for j in (i + 1).saturating_sub(width)..=i {
                    band[i * width + j + width - 1 - i] = entry(i, j);
                }
            }
            let right = numbers(7, rows);
            let run = |simd: Simd| {
                let (mut factor, mut x) = (band.clone(), right.clone());
                assert!(simd.factor_band(&mut factor, width));
                simd.solve_band(&mut x, &factor, width);
                x
            };
            let x = run(Simd::Baseline);
            for (i, right) in right.iter().enumerate() {
                let back: f64 = (0..rows).map(|j| entry(i, j) * x[j]).sum();
                assert!((back - right).abs() < 1e-12, "{rows} {width}: {back} {right}");
            }
            for simd in Simd::available() {
                assert_eq!(run(simd), x, "{simd:?}");
            }
        }
        assert!(!Simd::Baseline.factor_band(&mut [1.0, -1.0], 1), "it is not positive");
    }
}
