//! Factors of banded symmetric matrices, and systems solved by them.

use crate::kernels::{self, Entry, ROWS};
use crate::modes::complex::{Complex, Functions};
use crate::records::stop::Stop;

/// The factor `L` of a matrix `L L'`, without conjugates and without pivoting: rows of `width` numbers up to the
/// diagonal, which is inverted.
#[derive(Debug)]
pub(crate) struct Factor<T> {
    band: Vec<T>,
    width: usize,
    /// The index of each freedom in the band.
    place: Vec<usize>,
}

impl<T: Entry> Factor<T> {
    /// Solves a system.
    pub(crate) fn solve(&self, x: &mut [T]) {
        let mut placed = x.to_vec();
        for (place, x) in self.place.iter().zip(&*x) {
            placed[*place] = *x;
        }
        kernels::solve_band(&mut placed, &self.band, self.width);
        for (place, x) in self.place.iter().zip(x) {
            *x = placed[*place];
        }
    }
}

impl Factor<f64> {
    /// `None` if the matrix is not positive by its numbers, or the stop comes.
    pub(crate) fn of(
        mut band: Vec<f64>,
        width: usize,
        place: Vec<usize>,
        stop: &Stop<'_>,
    ) -> Option<Factor<f64>> {
        let mut groups = (0..place.len()).step_by(ROWS);
        let is_positive = groups.all(|from| !stop.look() && kernels::factor_rows(&mut band, width, from));
        is_positive.then_some(Factor { band, width, place })
    }
}

impl Factor<Complex> {
    /// `None` if the stop comes.
    pub(crate) fn of_complex(
        mut band: Vec<Complex>,
        width: usize,
        place: Vec<usize>,
        stop: &Stop<'_>,
    ) -> Option<Factor<Complex>> {
        let beside = width - 1;
        for i in (0..place.len()).take_while(|_| !stop.look()) {
            let (before, own) = band.split_at_mut(i * width);
            let first = i.saturating_sub(beside);
            for j in first..=i {
                let at = j + beside - i;
                let of_own = &own[first + beside - i..at];
                let row = if j == i { of_own } else { &before[j * width..][first + beside - j..beside] };
                let left = own[at] - Complex::dot(of_own, row);
                own[at] = if j == i { Complex::ONE / left.root() } else { left * before[j * width + beside] };
            }
        }
        (!stop.has_come()).then_some(Factor { band, width, place })
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::mixed;

    use super::Factor;
    use crate::modes::complex::{Complex, Functions};
    use crate::records::stop::Stop;

    #[test]
    fn what_is_solved_is_the_band() {
        let number = |n: usize| mixed(n as u64) as f64 / u64::MAX as f64 - 0.5;
        for (rows, width) in [(1, 1), (6, 2), (20, 7), (5, 9)] {
            let entry = |i: usize, j: usize| {
                let (i, j) = (i.max(j), i.min(j));
                let at = 1000 * i + 2 * j;
                match i - j {
                    0 => Complex::new(width as f64, 0.3 * width as f64),
                    off if off < width => Complex::new(number(at), 0.3 * number(at + 1)),
                    _ => Complex::ZERO,
                }
            };
            let mut band = vec![Complex::ZERO; rows * width];
            for i in 0..rows {
                for j in (i + 1).saturating_sub(width)..=i {
                    band[i * width + j + width - 1 - i] = entry(i, j);
                }
            }
            let right: Vec<Complex> = (0..rows).map(|n| Complex::new(number(n), number(n + 500))).collect();
            let mut x = right.clone();
            let factor = Factor::of_complex(band, width, (0..rows).collect(), &Stop::never());
            factor.expect("it is not stopped").solve(&mut x);
            for (i, right) in right.iter().enumerate() {
                let back = (0..rows).fold(Complex::ZERO, |sum, j| sum + entry(i, j) * x[j]);
                assert!((back - *right).size() < 1e-13, "{rows} {width}: {back:?} {right:?}");
            }
        }
    }
}
