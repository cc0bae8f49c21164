//! Cholesky's factor of a banded matrix, and systems solved by it.
//!
//! The lower band is stored by rows of `width` numbers, up to the diagonal. Each entry of the factor is one
//! sum of products, whose order depends on nothing but its row and column ([`LANES`]). The loops around
//! these sums only decide which numbers are at hand: a row of a wide band has hundreds of kilobytes of
//! earlier rows to be multiplied with, so several rows share them ([`ROWS`]), and several sums are computed
//! at once ([`SUMS`]), since a single one would wait for its own additions.

use std::ops::{Mul, Sub};

use crate::kernels::dense::{LANES, dot, sum_of};
use crate::kernels::simd::kernel;
use num_complex::Complex64 as Complex;

/// Rows that are multiplied with the same earlier rows, while these are at hand.
pub(crate) const ROWS: usize = 8;

/// Entries of a row that are computed at once: their sums fit in the registers of 256-bit vectors.
const SUMS: usize = 4;

/// A band whose first rows are factored.
struct Rows<'a> {
    factored: &'a [f64],
    width: usize,
}

impl Rows<'_> {
    /// The numbers of a row from a column on.
    #[inline(always)]
    fn from(&self, row: usize, column: usize) -> &[f64] {
        &self.factored[row * self.width..][column + self.width - 1 - row..self.width]
    }

    /// Computes the entries of row `i` in some columns, each from those before it. `columns` begins a whole
    /// number of [`LANES`] behind the first column of the row, and is no longer than that.
    #[inline(always)]
    fn fill(&self, own: &mut [f64], i: usize, columns: std::ops::Range<usize>) {
        let beside = self.width - 1;
        let first = i.saturating_sub(beside);
        let at = |column: usize| column + beside - i;
        let mut sums = [[0.0; LANES]; LANES];
        let (of_own, _) = own[at(first)..at(columns.start)].as_chunks::<LANES>();
        let mut groups = sums[..columns.len()].chunks_mut(SUMS).zip(columns.clone().step_by(SUMS));
        for (sums, j) in &mut groups {
            if let [a, b, c, d] = sums {
                let row = |n: usize| &self.from(j + n, first).as_chunks::<LANES>().0[..of_own.len()];
                let [of_a, of_b, of_c, of_d] = [row(0), row(1), row(2), row(3)];
                for ((((x, of_a), of_b), of_c), of_d) in of_own.iter().zip(of_a).zip(of_b).zip(of_c).zip(of_d)
                {
                    for lane in 0..LANES {
                        a[lane] += x[lane] * of_a[lane];
                        b[lane] += x[lane] * of_b[lane];
                        c[lane] += x[lane] * of_c[lane];
                        d[lane] += x[lane] * of_d[lane];
                    }
                }
                continue;
            }
            for (n, sum) in sums.iter_mut().enumerate() {
                let row = &self.from(j + n, first).as_chunks::<LANES>().0[..of_own.len()];
                for (x, of_row) in of_own.iter().zip(row) {
                    for lane in 0..LANES {
                        sum[lane] += x[lane] * of_row[lane];
                    }
                }
            }
        }
        // What the entries of these columns contribute to those behind them.
        for (n, j) in columns.clone().enumerate() {
            let (row, sums) = (self.from(j, columns.start), &mut sums[n]);
            for (lane, (x, of_row)) in own[at(columns.start)..at(j)].iter().zip(row).enumerate() {
                sums[lane] += x * of_row;
            }
            own[at(j)] = (own[at(j)] - sum_of(*sums)) * row[n];
        }
    }
}

kernel! {
    /// Replaces [`ROWS`] rows of the lower band of a symmetric matrix, behind those that are replaced, by its
    /// Cholesky factor with the diagonal inverted; `false` if the matrix is not positive.
    fn factor_rows(band: &mut [f64], width: usize, from: usize) -> bool {
        let (rows, beside) = (band.len() / width, width - 1);
        let to = (from + ROWS).min(rows);
        let (before, own) = band.split_at_mut(from * width);
        // With the rows before these, a few columns of all of them at a time.
        let factored = Rows { factored: before, width };
        let first = |i: usize| i.saturating_sub(beside);
        let groups = (from - first(from)) / LANES;
        for group in 0..groups {
            for (i, own) in (from..to).zip(own.chunks_exact_mut(width)) {
                let start = first(i) + group * LANES;
                if start + LANES <= from {
                    factored.fill(own, i, start..start + LANES);
                }
            }
        }
        // With each other.
        for i in from..to {
            let (before, own) = band.split_at_mut(i * width);
            let (factored, own) = (Rows { factored: before, width }, &mut own[..width]);
            let filled = (from - first(i).min(from)) / LANES * LANES;
            for start in (first(i) + filled..i).step_by(LANES) {
                factored.fill(own, i, start..(start + LANES).min(i));
            }
            let of_own = &own[first(i) + beside - i..beside];
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
}

/// A number of a band.
pub(crate) trait Entry: Copy + Mul<Output = Self> + Sub<Output = Self> {
    /// The sum of the products of two rows, without conjugates.
    fn dot(a: &[Self], b: &[Self]) -> Self;
}

impl Entry for f64 {
    #[inline(always)]
    fn dot(a: &[f64], b: &[f64]) -> f64 {
        dot(a, b)
    }
}

impl Entry for Complex {
    #[inline(always)]
    fn dot(a: &[Complex], b: &[Complex]) -> Complex {
        a.iter().zip(b).fold(Complex::ZERO, |sum, (a, b)| sum + a * b)
    }
}

kernel! {
    /// Solves a system by the factor of a symmetric matrix whose diagonal is inverted.
    fn solve_band[T: Entry](x: &mut [T], band: &[T], width: usize) {
        let (rows, beside) = (band.len() / width, width - 1);
        for i in 0..rows {
            let (row, first) = (&band[i * width..][..width], i.saturating_sub(beside));
            let (before, own) = x.split_at_mut(i);
            own[0] = (own[0] - T::dot(&row[first + beside - i..beside], &before[first..])) * row[beside];
        }
        for i in (0..rows).rev() {
            let (row, first) = (&band[i * width..][..width], i.saturating_sub(beside));
            let (before, own) = x.split_at_mut(i);
            own[0] = own[0] * row[beside];
            let times = own[0];
            for (x, factor) in before[first..].iter_mut().zip(&row[first + beside - i..beside]) {
                *x = *x - times * *factor;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::mixed;

    use super::{ROWS, factor_rows, solve_band};
    use crate::kernels::by_all;
    use crate::kernels::dense::dot;

    fn numbers(seed: u64, count: usize) -> Vec<f64> {
        (0..count).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
    }

    /// Entry by entry, in the order of rows and columns.
    fn factor_simply(band: &mut [f64], width: usize) {
        let beside = width - 1;
        for i in 0..band.len() / width {
            let first = i.saturating_sub(beside);
            for j in first..=i {
                let row =
                    |of: usize, to: usize| band[of * width..][first + beside - of..to + beside - of].to_vec();
                let done = dot(&row(i, j), &row(j, j));
                let left = band[i * width + j + beside - i] - done;
                let diagonal = if i == j { 1.0 / left.sqrt() } else { left * band[j * width + beside] };
                band[i * width + j + beside - i] = diagonal;
            }
        }
    }

    #[test]
    fn a_band_is_factored_and_solved_with() {
        for (rows, width) in [(1, 1), (5, 2), (30, 7), (41, 20), (9, 9), (50, 30), (120, 73), (16, 40)] {
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
            let (right, mut simple) = (numbers(7, rows), band.clone());
            factor_simply(&mut simple, width);
            let x = by_all(|| {
                let (mut factor, mut x) = (band.clone(), right.clone());
                assert!((0..rows).step_by(ROWS).all(|from| factor_rows(&mut factor, width, from)));
                assert_eq!(factor, simple, "{rows} {width}");
                solve_band(&mut x, &factor, width);
                x
            });
            for (i, right) in right.iter().enumerate() {
                let back: f64 = (0..rows).map(|j| entry(i, j) * x[j]).sum();
                assert!((back - right).abs() < 1e-12, "{rows} {width}: {back} {right}");
            }
        }
        assert!(!factor_rows(&mut [1.0, -1.0], 1, 0), "it is not positive");
    }
}
