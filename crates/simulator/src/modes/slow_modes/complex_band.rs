//! Complex symmetric bands, and systems solved by them.

use crate::modes::complex::Complex;
use crate::records::stop::Stop;

/// A complex symmetric band, factored as `L L'` without conjugates and without pivoting; rows of `width` numbers
/// up to the diagonal, which is inverted.
#[derive(Debug)]
pub(crate) struct ComplexBand {
    rows: Vec<Complex>,
    width: usize,
}

impl ComplexBand {
    /// Factors a band, unless the stop comes.
    pub(crate) fn factored(mut rows: Vec<Complex>, width: usize, stop: &Stop<'_>) -> ComplexBand {
        let beside = width - 1;
        for i in (0..rows.len() / width).take_while(|_| !stop.look()) {
            let (before, own) = rows.split_at_mut(i * width);
            let first = i.saturating_sub(beside);
            for j in first..=i {
                let at = j + beside - i;
                let of_own = &own[first + beside - i..at];
                let row = if j == i { of_own } else { &before[j * width..][first + beside - j..beside] };
                let done = of_own.iter().zip(row).fold(Complex::ZERO, |sum, (a, b)| sum + *a * *b);
                let left = own[at] - done;
                own[at] = if j == i { Complex::ONE / left.sqrt() } else { left * before[j * width + beside] };
            }
        }
        ComplexBand { rows, width }
    }

    /// Solves a system.
    pub(crate) fn solve(&self, x: &mut [Complex]) {
        let beside = self.width - 1;
        let row = |i: usize| {
            let first = i.saturating_sub(beside);
            let row = &self.rows[i * self.width..][..self.width];
            (first, &row[first + beside - i..beside], row[beside])
        };
        for i in 0..x.len() {
            let (first, factors, inverse) = row(i);
            let (before, own) = x.split_at_mut(i);
            let done = factors.iter().zip(&before[first..]).fold(Complex::ZERO, |sum, (a, b)| sum + *a * *b);
            own[0] = (own[0] - done) * inverse;
        }
        for i in (0..x.len()).rev() {
            let (first, factors, inverse) = row(i);
            let (before, own) = x.split_at_mut(i);
            own[0] = own[0] * inverse;
            for (x, factor) in before[first..].iter_mut().zip(factors) {
                *x = *x - own[0] * *factor;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::mixed;

    use super::ComplexBand;
    use crate::modes::complex::Complex;
    use crate::records::stop::Stop;

    #[test]
    fn what_is_solved_is_the_band() {
        let number = |n: usize| mixed(n as u64) as f64 / u64::MAX as f64 - 0.5;
        for (rows, width) in [(1, 1), (6, 2), (20, 7), (5, 9)] {
            let entry = |i: usize, j: usize| {
                let (i, j) = (i.max(j), i.min(j));
                let at = 1000 * i + 2 * j;
                match i - j {
                    0 => Complex { re: width as f64, im: 0.3 * width as f64 },
                    off if off < width => Complex { re: number(at), im: 0.3 * number(at + 1) },
                    _ => Complex::ZERO,
                }
            };
            let mut band = vec![Complex::ZERO; rows * width];
            for i in 0..rows {
                for j in (i + 1).saturating_sub(width)..=i {
                    band[i * width + j + width - 1 - i] = entry(i, j);
                }
            }
            let right: Vec<Complex> =
                (0..rows).map(|n| Complex { re: number(n), im: number(n + 500) }).collect();
            let mut x = right.clone();
            ComplexBand::factored(band, width, &Stop::never()).solve(&mut x);
            for (i, right) in right.iter().enumerate() {
                let back = (0..rows).fold(Complex::ZERO, |sum, j| sum + entry(i, j) * x[j]);
                assert!((back - *right).size() < 1e-13, "{rows} {width}: {back:?} {right:?}");
            }
        }
    }
}
