//! Dense linear algebra for the modes of a lattice: products with the columns of a matrix, and changes of its rows.

use crate::kernels::simd::kernel;

/// Lanes of a sum: its order is the same on every machine.
pub(super) const LANES: usize = 8;

/// Columns that are processed at once.
const COLUMNS: usize = 4;

#[inline(always)]
pub(super) fn sum_of(lanes: [f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
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

kernel! {
    /// The product of two vectors.
    fn product(a: &[f64], b: &[f64]) -> f64 {
        dot(a, b)
    }
}

kernel! {
    /// The product of each column of a matrix with a vector.
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
}

kernel! {
    /// Adds multiples of the columns of a matrix, in ascending order.
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
}

kernel! {
    /// Reflects three rows of a matrix, or two where the third is empty: each loses its share of `a + q b + r c`.
    fn reflect(rows: [&mut [f64]; 3], sum: [f64; 2], shares: [f64; 3]) {
        let ([a, b, c], [q, r], [x, y, z]) = (rows, sum, shares);
        let b = &mut b[..a.len()];
        if c.is_empty() {
            for n in 0..a.len() {
                let sum = a[n] + q * b[n];
                a[n] -= sum * x;
                b[n] -= sum * y;
            }
            return;
        }
        let c = &mut c[..a.len()];
        for n in 0..a.len() {
            let sum = (a[n] + q * b[n]) + r * c[n];
            c[n] -= sum * z;
            a[n] -= sum * x;
            b[n] -= sum * y;
        }
    }
}

kernel! {
    /// Subtracts a complex multiple of a row from another; real parts come first.
    fn subtract_multiple(from: [&mut [f64]; 2], row: [&[f64]; 2], factor: [f64; 2]) {
        let ([from_re, from_im], [re, im], [by_re, by_im]) = (from, row, factor);
        let size = from_re.len();
        let (from_im, re, im) = (&mut from_im[..size], &re[..size], &im[..size]);
        for n in 0..size {
            from_re[n] -= by_re * re[n] - by_im * im[n];
            from_im[n] -= by_re * im[n] + by_im * re[n];
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::mixed;

    use super::{add_columns, dots, reflect, subtract_multiple};
    use crate::kernels::by_all;

    fn numbers(seed: u64, count: usize) -> Vec<f64> {
        (0..count).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
    }

    #[test]
    fn all_instruction_sets_change_rows_the_same_to_the_bit() {
        for size in [1, 3, 8, 29] {
            let [first, second] = by_all(|| {
                let [mut a, mut b, mut c] = [4, 5, 6].map(|seed| numbers(seed, size));
                reflect([&mut a, &mut b, &mut c], [0.3, -0.7], [1.2, 0.4, -0.9]);
                reflect([&mut a, &mut b, &mut []], [0.3, 0.0], [1.2, 0.4, 0.0]);
                subtract_multiple([&mut a, &mut b], [&c, &second_of(&c)], [0.6, -0.8]);
                [a, b]
            });
            // The first entry by hand.
            let [mut a, mut b, mut c] = [4, 5, 6].map(|seed| numbers(seed, size)[0]);
            let sum = a + 0.3 * b - 0.7 * c;
            (a, b, c) = (a - 1.2 * sum, b - 0.4 * sum, c + 0.9 * sum);
            let sum = a + 0.3 * b;
            (a, b) = (a - 1.2 * sum, b - 0.4 * sum);
            let (re, im) = (0.6 * c + 0.8 * 2.0 * c, 0.6 * 2.0 * c - 0.8 * c);
            assert!((first[0] - (a - re)).abs() < 1e-14 && (second[0] - (b - im)).abs() < 1e-14);
        }
    }

    fn second_of(row: &[f64]) -> Vec<f64> {
        row.iter().map(|x| 2.0 * x).collect()
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits_and_the_right_numbers() {
        for (size, count) in [(1, 1), (7, 3), (8, 4), (29, 9), (64, 12)] {
            let (columns, vector, times) = (numbers(1, size * count), numbers(2, size), numbers(3, count));
            let (products, sum) = by_all(|| {
                let (mut products, mut sum) = (vec![0.0; count], vector.clone());
                dots(&mut products, &columns, &vector);
                add_columns(&mut sum, &columns, &times);
                (products, sum)
            });
            for (c, product) in products.iter().enumerate() {
                let simple: f64 = (0..size).map(|n| columns[c * size + n] * vector[n]).sum();
                assert!((product - simple).abs() < 1e-13);
            }
            for (n, sum) in sum.iter().enumerate() {
                let simple: f64 = (0..count).map(|c| columns[c * size + n] * times[c]).sum();
                assert!((sum - simple - vector[n]).abs() < 1e-13);
            }
        }
    }
}
