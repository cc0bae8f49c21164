//! Eigenvalues and eigenvectors of a small upper Hessenberg matrix (zero below the first subdiagonal), the
//! projection of a large matrix by Arnoldi's iteration.
//!
//! Eigenvalues by Francis' double steps (EISPACK's `hqr`), eigenvectors by inverse iteration. Nothing
//! but the four operations and square roots, so that the same matrix gives the same bits everywhere.

use crate::kernels;
use crate::modes::complex::{Complex, Functions};
use crate::records::stop::Stop;

/// Most steps for one eigenvalue; two or three are usual.
const MOST_STEPS: usize = 60;

/// Steps after which an exceptional shift is tried.
const STUCK_AFTER: usize = 10;

/// A square matrix, row by row, that is zero below the first subdiagonal.
#[derive(Debug, Clone)]
pub(crate) struct Hessenberg {
    pub(crate) size: usize,
    pub(crate) rows: Vec<f64>,
}

impl Hessenberg {
    pub(crate) fn zero(size: usize) -> Hessenberg {
        Hessenberg { size, rows: vec![0.0; size * size] }
    }

    #[inline]
    fn at(&self, i: usize, j: usize) -> f64 {
        self.rows[i * self.size + j]
    }

    #[inline]
    pub(crate) fn entry(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.rows[i * self.size + j]
    }

    /// All eigenvalues, pairs of conjugates together; `None` if the iteration does not settle, or the stop comes.
    pub(crate) fn eigenvalues(&self, stop: &Stop<'_>) -> Option<Vec<Complex>> {
        let mut h = self.clone();
        let norm: f64 = h.rows.iter().map(|x| x.abs()).sum();
        let mut values = vec![Complex::ZERO; self.size];
        let (mut end, mut shifted, mut steps) = (self.size, 0.0, 0);
        while end > 0 {
            let n = end - 1;
            let start = h.split(n, norm);
            if start == n {
                values[n] = Complex::from(h.at(n, n) + shifted);
                (end, steps) = (n, 0);
                continue;
            }
            let (mut x, mut y) = (h.at(n, n), h.at(n - 1, n - 1));
            let mut w = h.at(n, n - 1) * h.at(n - 1, n);
            if start + 1 == n {
                let p = (y - x) / 2.0;
                let q = p * p + w;
                let root = q.abs().sqrt();
                x += shifted;
                if q >= 0.0 {
                    let z = if p >= 0.0 { p + root } else { p - root };
                    values[n - 1] = Complex::from(x + z);
                    values[n] = Complex::from(if z == 0.0 { x } else { x - w / z });
                } else {
                    values[n - 1] = Complex::new(x + p, root);
                    values[n] = Complex::new(x + p, -root);
                }
                (end, steps) = (n - 1, 0);
                continue;
            }
            if steps == MOST_STEPS || stop.look() {
                return None;
            }
            if steps > 0 && steps.is_multiple_of(STUCK_AFTER) {
                shifted += x;
                for i in 0..=n {
                    *h.entry(i, i) -= x;
                }
                let s = h.at(n, n - 1).abs() + h.at(n - 1, n - 2).abs();
                (x, y, w) = (0.75 * s, 0.75 * s, -0.4375 * s * s);
            }
            steps += 1;
            h.double_step(start, n, [x, y, w]);
        }
        Some(values)
    }

    /// First row of the block that ends in row `n`: the subdiagonal entry before it is negligible.
    fn split(&self, n: usize, norm: f64) -> usize {
        let mut start = n;
        while start > 0 {
            let beside = self.at(start - 1, start - 1).abs() + self.at(start, start).abs();
            let beside = if beside == 0.0 { norm } else { beside };
            if self.at(start, start - 1).abs() < f64::EPSILON * beside {
                break;
            }
            start -= 1;
        }
        start
    }

    /// One double step on rows `start` to `n`, at least three, with shifts given by sum and product.
    fn double_step(&mut self, start: usize, n: usize, [x, y, w]: [f64; 3]) {
        let mut m = n - 2;
        let (mut p, mut q, mut r);
        loop {
            let z = self.at(m, m);
            let (from_x, from_y) = (x - z, y - z);
            p = (from_x * from_y - w) / self.at(m + 1, m) + self.at(m, m + 1);
            q = self.at(m + 1, m + 1) - z - from_x - from_y;
            r = self.at(m + 2, m + 1);
            let s = p.abs() + q.abs() + r.abs();
            (p, q, r) = (p / s, q / s, r / s);
            if m == start {
                break;
            }
            let beside = self.at(m - 1, m - 1).abs() + z.abs() + self.at(m + 1, m + 1).abs();
            if self.at(m, m - 1).abs() * (q.abs() + r.abs()) < f64::EPSILON * (p.abs() * beside) {
                break;
            }
            m -= 1;
        }
        for i in m + 2..=n {
            *self.entry(i, i - 2) = 0.0;
            if i > m + 2 {
                *self.entry(i, i - 3) = 0.0;
            }
        }
        for k in m..n {
            let is_last = k + 1 == n;
            let mut scale = 0.0;
            if k != m {
                (p, q) = (self.at(k, k - 1), self.at(k + 1, k - 1));
                r = if is_last { 0.0 } else { self.at(k + 2, k - 1) };
                scale = p.abs() + q.abs() + r.abs();
                if scale == 0.0 {
                    continue;
                }
                (p, q, r) = (p / scale, q / scale, r / scale);
            }
            let s = (p * p + q * q + r * r).sqrt().copysign(p);
            if s == 0.0 {
                continue;
            }
            if k != m {
                *self.entry(k, k - 1) = -s * scale;
            } else if start != m {
                *self.entry(k, k - 1) = -self.at(k, k - 1);
            }
            p += s;
            let (x, y, z) = (p / s, q / s, r / s);
            (q, r) = (q / p, r / p);
            let size = self.size;
            let (upper, lower) = self.rows[k * size..].split_at_mut(size);
            let (second, third) = lower.split_at_mut(size);
            let third = if is_last { &mut [] } else { &mut third[k..=n] };
            kernels::reflect([&mut upper[k..=n], &mut second[k..=n], third], [q, r], [x, y, z]);
            for row in self.rows.chunks_exact_mut(size).take(n.min(k + 3) + 1).skip(start) {
                match &mut row[k..=n.min(k + 2)] {
                    [a, b, c] => {
                        let sum = x * *a + y * *b + z * *c;
                        (*a, *b, *c) = (*a - sum, *b - sum * q, *c - sum * r);
                    }
                    row => {
                        let sum = x * row[0] + y * row[1];
                        row[0] -= sum;
                        row[1] -= sum * q;
                    }
                }
            }
        }
    }

    /// The eigenvector of an eigenvalue, of length 1.
    pub(crate) fn eigenvector(&self, value: Complex) -> Vec<Complex> {
        let size = self.size;
        let norm = self.rows.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let least = f64::EPSILON * norm;
        // Elimination that pivots to the row below where that is larger, of real and imaginary parts.
        let mut upper = [self.rows.clone(), vec![0.0; size * size]];
        for i in 0..size {
            upper[0][i * size + i] -= value.re;
            upper[1][i * size + i] -= value.im;
        }
        let at = |upper: &[Vec<f64>; 2], i: usize, j: usize| {
            Complex::new(upper[0][i * size + j], upper[1][i * size + j])
        };
        let mut swaps = vec![(false, Complex::ZERO); size];
        for i in 0..size {
            let swap = i + 1 < size && at(&upper, i + 1, i).size() > at(&upper, i, i).size();
            if swap {
                for part in &mut upper {
                    let (above, below) = part.split_at_mut((i + 1) * size);
                    above[i * size + i..].swap_with_slice(&mut below[i..size]);
                }
            }
            if at(&upper, i, i).size() < least {
                (upper[0][i * size + i], upper[1][i * size + i]) = (least, 0.0);
            }
            if i + 1 < size {
                let factor = at(&upper, i + 1, i) / at(&upper, i, i);
                let [[re, below_re], [im, below_im]] = upper.each_mut().map(|part| {
                    let (above, below) = part.split_at_mut((i + 1) * size);
                    [&mut above[i * size + i..], &mut below[i..size]]
                });
                kernels::subtract_multiple([below_re, below_im], [re, im], [factor.re, factor.im]);
                swaps[i] = (swap, factor);
            }
        }
        let mut x = vec![Complex::ONE; size];
        for round in 0..2 {
            if round > 0 {
                for i in 0..size - 1 {
                    let (swap, factor) = swaps[i];
                    if swap {
                        x.swap(i, i + 1);
                    }
                    x[i + 1] = x[i + 1] - factor * x[i];
                }
            }
            for i in (0..size).rev() {
                let [re, im] = upper.each_ref().map(|part| &part[i * size..][..size]);
                let beside = re.iter().zip(im).zip(&x).skip(i + 1);
                let sum = beside.fold(x[i], |sum, ((re, im), x)| sum - Complex::new(*re, *im) * *x);
                x[i] = sum / Complex::new(re[i], im[i]);
                // Only its direction counts, and it may grow beyond all bounds.
                let large = x[i].size();
                if large > 1e100 {
                    for x in &mut x[..] {
                        *x = x.scale(1.0 / large);
                    }
                }
            }
            let square: f64 = x.iter().map(|x| x.re * x.re + x.im * x.im).sum();
            for x in &mut x {
                *x = x.scale(1.0 / square.sqrt());
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::mixed;

    use super::Hessenberg;
    use crate::modes::complex::{Complex, Functions};
    use crate::records::stop::Stop;

    #[test]
    fn eigenvalues_and_vectors_are_those_of_the_matrix() {
        for size in [1, 2, 3, 5, 20, 61] {
            let mut matrix = Hessenberg::zero(size);
            for i in 0..size {
                for j in i.saturating_sub(1)..size {
                    let number = mixed((size * 1000 + i * size + j) as u64) as f64 / u64::MAX as f64;
                    *matrix.entry(i, j) = number - 0.5;
                }
            }
            let values = matrix.eigenvalues(&Stop::never()).expect("the iteration settles");
            let trace: f64 = (0..size).map(|i| matrix.at(i, i)).sum();
            let sum = values.iter().fold(Complex::ZERO, |sum, value| sum + *value);
            assert!((sum.re - trace).abs() < 1e-12 && sum.im.abs() < 1e-12);
            for value in values {
                let x = matrix.eigenvector(value);
                for i in 0..size {
                    let image = (0..size).fold(Complex::ZERO, |sum, j| sum + x[j].scale(matrix.at(i, j)));
                    assert!((image - value * x[i]).size() < 1e-11, "{size}: {value:?}");
                }
            }
        }
    }
}
