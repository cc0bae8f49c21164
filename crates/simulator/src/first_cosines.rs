//! Sums over the standing waves of a long chain in its first blocks alone.
//!
//! What is done to some of the first blocks changes every wave, and where a jump ends it is those
//! blocks that are needed of all waves. Neither takes a transform of the whole chain: with `n` from 0
//!
//! ```text
//! cos q (N - n - 1/2) = cos qN cos q (n + 1/2) + sin qN sin q (n + 1/2),
//! ```
//!
//! and for `n` below a few hundred what follows `qN` varies little from one wave to the next. So it is
//! summed on a grid of wave numbers that is as fine as these blocks ask for, and passed between the
//! grid and the waves by the kernel of [`crate::cosines`].

use std::sync::Arc;

use crate::complex::Complex;
use crate::cosines::{BEYOND, Kernels, balance, over_psi};
use crate::sweep::{FirstGrids, NEAR, Parts, Sweeps};

/// What turns numbers of the first blocks into those of waves, and back.
#[derive(Debug, Clone)]
pub(crate) struct FirstCosines {
    sweeps: Sweeps,
    /// How many blocks.
    blocks: usize,
    /// Points of the grid from 0 to `pi`.
    size: usize,
    /// `cos` and `sin` of `-pi k / G`, and of `-pi k / (2 G)`.
    turns: [Arc<[f64]>; 2],
    half_turns: [Arc<[f64]>; 2],
    /// `1 / psi` of every block.
    part: Arc<[f64]>,
    /// `cos qN` and `sin qN` of every wave.
    far_end: Arc<[[Complex; 2]]>,
    kernels: Kernels,
    /// Cosines and sines of three kinds of numbers on the grid, with room for what kernels reach
    /// beyond it.
    grids: FirstGrids,
    values: [Vec<f64>; 2],
    scratch: [Vec<f64>; 2],
    sums: Vec<[f64; 12]>,
}

impl FirstCosines {
    /// For these wave numbers of a chain of `all` blocks, of which the first `blocks` are summed over;
    /// `None` if one of them lies too far from the real axis, or beyond 0 and `pi`.
    pub(crate) fn of(
        wave_numbers: &[Complex],
        all: usize,
        blocks: usize,
        sweeps: Sweeps,
    ) -> Option<FirstCosines> {
        let size = (2 * blocks).next_power_of_two().max(2 * NEAR);
        let spacing = std::f64::consts::PI / size as f64;
        let kernels = Kernels::of(wave_numbers.iter().copied(), size, sweeps)?;
        let far_end = wave_numbers.iter().map(|q| {
            let (sin, cos) = q.scaled(all as f64).sin_cos();
            [cos, sin]
        });
        let angles = |unit: f64| -> [Arc<[f64]>; 2] {
            let angles = move || (0..2 * size).map(move |k| unit * k as f64);
            [angles().map(libm::cos).collect(), angles().map(libm::sin).collect()]
        };
        let on_grid = || vec![0.0; size + 2 * BEYOND + 1];
        let values = || vec![0.0; 2 * size];
        Some(FirstCosines {
            sweeps,
            blocks,
            size,
            turns: angles(-spacing),
            half_turns: angles(-0.5 * spacing),
            part: (0..blocks).map(|n| over_psi(spacing * (n as f64 + 0.5))).collect(),
            far_end: far_end.collect(),
            kernels,
            grids: FirstGrids(std::array::from_fn(|_| [on_grid(), on_grid()])),
            values: [values(), values()],
            scratch: [values(), values()],
            sums: vec![[0.0; 12]; wave_numbers.len()],
        })
    }

    /// How many of the first blocks it sums over.
    pub(crate) fn blocks(&self) -> usize {
        self.blocks
    }

    /// Of each of so many waves, the sums of three kinds of numbers times `cos q (N - n - 1/2)` over the
    /// first blocks; of fewer blocks if there are fewer numbers.
    pub(crate) fn project(
        &mut self,
        of: [&[f64]; 3],
        waves: usize,
        mut take: impl FnMut(usize, [Complex; 3]),
    ) {
        let balance = balance(self.sweeps.largest(of[0]), self.sweeps.largest(of[1]));
        let nothing: &[f64] = &[];
        self.fill_grid([of[0], of[1]], balance, [0, 1]);
        self.fill_grid([of[2], nothing], 1.0, [2, 2]);
        let sums = &mut self.sums[..waves];
        self.sweeps.gather_first(sums, &self.kernels.near(), &self.grids);
        for (wave, (sums, [cos, sin])) in sums.iter().zip(&*self.far_end).enumerate() {
            let of_kind = |kind: usize, factor: f64| {
                let [c_re, c_im, s_re, s_im] = [0, 1, 2, 3].map(|part| sums[4 * kind + part] * factor);
                *cos * Complex { re: c_re, im: c_im } + *sin * Complex { re: s_re, im: s_im }
            };
            take(wave, [of_kind(0, 1.0), of_kind(1, 1.0 / balance), of_kind(2, 1.0)]);
        }
    }

    /// Writes the sums of two kinds of numbers times cosines and sines to two pairs of grids, or to
    /// one if there is but one kind; the second is scaled before.
    fn fill_grid(&mut self, of: [&[f64]; 2], balance: f64, to: [usize; 2]) {
        let size = self.size;
        for ((values, numbers), factor) in self.values.iter_mut().zip(of).zip([1.0, balance]) {
            values.fill(0.0);
            for ((value, number), part) in values.iter_mut().zip(numbers).zip(&*self.part) {
                *value = factor * number * part;
            }
        }
        self.transform();
        // `sum_n f_n exp(-i pi g (n + 1/2) / G)` of both from one transform.
        let ([re, im], [cos, sin]) = (&self.values, &self.half_turns);
        for g in 0..=size {
            let mirror = (2 * size - g) % (2 * size);
            let (c, s) = (0.5 * cos[g], 0.5 * sin[g]);
            let first = (re[g] + re[mirror], im[g] - im[mirror]);
            let second = (im[g] + im[mirror], re[mirror] - re[g]);
            for (kind, (x, y)) in [(to[1], second), (to[0], first)] {
                let [of_cos, of_sin] = &mut self.grids.0[kind];
                of_cos[BEYOND + g] = c * x - s * y;
                of_sin[BEYOND + g] = -(c * y + s * x);
            }
        }
        for kind in to {
            let [of_cos, of_sin] = &mut self.grids.0[kind];
            of_cos[BEYOND + size] = 0.0;
            of_sin[BEYOND] = 0.0;
            for (grid, sign) in [(of_cos, 1.0), (of_sin, -1.0)] {
                for beyond in 1..=BEYOND {
                    let [below, from_below, above, from_above] = beyond_grid(beyond, size);
                    grid[below] = sign * grid[from_below];
                    grid[above] = -sign * grid[from_above];
                }
            }
        }
    }

    /// Writes the real parts of sums over waves, as many as have two complex coordinates, to the first
    /// blocks.
    pub(crate) fn compose(&mut self, coordinates: &[[f64; 4]], u: &mut [f64], v: &mut [f64]) {
        let size = self.size;
        let largest = coordinates.iter().fold([0.0, 0.0], |[u, v]: [f64; 2], of| {
            [u.max(of[0].abs()).max(of[1].abs()), v.max(of[2].abs()).max(of[3].abs())]
        });
        let balance = balance(largest[0], largest[1]);
        for ((sums, of), [cos, sin]) in self.sums.iter_mut().zip(coordinates).zip(&*self.far_end) {
            let of_u = Complex { re: of[0], im: of[1] };
            let of_v = Complex { re: of[2], im: of[3] }.scaled(balance);
            let all = [*cos * of_u, *sin * of_u, *cos * of_v, *sin * of_v];
            for (to, z) in sums.chunks_exact_mut(2).zip(all) {
                (to[0], to[1]) = (z.re, z.im);
            }
        }
        for grid in self.grids.0.iter_mut().take(2).flatten() {
            grid.fill(0.0);
        }
        self.sweeps.spread_first(&mut self.grids, &self.kernels.near(), &self.sums[..coordinates.len()]);
        for [of_cos, of_sin] in self.grids.0.iter_mut().take(2) {
            for (grid, sign) in [(&mut *of_cos, 1.0), (&mut *of_sin, -1.0)] {
                for beyond in 1..=BEYOND {
                    let [below, from_below, above, from_above] = beyond_grid(beyond, size);
                    grid[from_below] += sign * grid[below];
                    grid[from_above] -= sign * grid[above];
                }
            }
            (of_cos[BEYOND + size], of_sin[BEYOND]) = (0.0, 0.0);
        }
        // What `fill_grid` does, transposed.
        let [re, im] = &mut self.values;
        re.fill(0.0);
        im.fill(0.0);
        let [[cos_u, sin_u], [cos_v, sin_v], _] = &self.grids.0;
        for g in 0..=size {
            let (c, s) = (0.5 * self.half_turns[0][g], 0.5 * self.half_turns[1][g]);
            let at = BEYOND + g;
            // `(cos + i sin) exp(-i pi g / (2 G)) / 2`, and its conjugate at `-g`.
            let turned = |x: f64, y: f64| (c * x - s * y, c * y + s * x);
            let ((a, b), (p, q)) = (turned(cos_u[at], sin_u[at]), turned(cos_v[at], sin_v[at]));
            let mirror = (2 * size - g) % (2 * size);
            (re[g], im[g]) = (re[g] + (a - q), im[g] + (b + p));
            (re[mirror], im[mirror]) = (re[mirror] + (a + q), im[mirror] + (p - b));
        }
        self.transform();
        for ((values, numbers), factor) in self.values.iter().zip([u, v]).zip([1.0, balance]) {
            for ((number, value), part) in numbers.iter_mut().zip(values).zip(&*self.part) {
                *number = value * part / factor;
            }
        }
    }

    fn transform(&mut self) {
        let [re, im] = &mut self.values;
        let [a, b] = &mut self.scratch;
        self.sweeps.fourier(Parts(re, im), Parts(a, b), [&self.turns[0], &self.turns[1]]);
    }
}

/// Places beyond both ends of a grid, each with the one inside that it mirrors: below and above.
fn beyond_grid(beyond: usize, size: usize) -> [usize; 4] {
    [BEYOND - beyond, BEYOND + beyond, BEYOND + size + beyond, BEYOND + size - beyond]
}

#[cfg(test)]
mod tests {
    use super::FirstCosines;
    use crate::complex::Complex;
    use crate::sweep::Sweeps;

    /// Of velocities, where displacements are of size 1.
    const V_SIZE: f64 = 1e-9;

    #[test]
    fn sums_over_the_first_blocks_are_those_of_their_cosines() {
        for (all, blocks) in [(100usize, 17usize), (700, 128), (700, 100)] {
            let n = all as f64;
            let waves: Vec<Complex> = (0..all)
                .map(|j| Complex {
                    re: (j as f64 + 0.3 * ((j * 7919) % 101) as f64 / 101.0) * std::f64::consts::PI / n,
                    im: 0.2 * (((j * 31) % 17) as f64 / 17.0 - 0.5) / n,
                })
                .collect();
            let pattern = |seed: usize| -> Vec<f64> {
                (0..blocks).map(|j| ((j * j * 7919 + seed * (j + 1)) % 101) as f64 / 101.0 - 0.5).collect()
            };
            let (u, a) = (pattern(3), pattern(5));
            let v: Vec<f64> = pattern(17).iter().map(|x| V_SIZE * x).collect();
            let cosine = |j: usize, block: usize| waves[j].scaled(n - block as f64 - 0.5).sin_cos().1;
            let mut of_baseline = None;
            for sweeps in Sweeps::available() {
                let mut cosines = FirstCosines::of(&waves, all, blocks, sweeps).unwrap();
                let mut sums = vec![[Complex::ZERO; 3]; all];
                // Of the last kind there are fewer numbers.
                cosines.project([&u, &v, &a[..10]], all, |wave, of| sums[wave] = of);
                let allowed = 1e-14 * blocks as f64;
                for (j, sums) in sums.iter().enumerate() {
                    for (found, (f, size)) in sums.iter().zip([(&u[..], 1.0), (&v, V_SIZE), (&a[..10], 1.0)])
                    {
                        let exact = f
                            .iter()
                            .enumerate()
                            .fold(Complex::ZERO, |sum, (b, f)| sum + cosine(j, b).scaled(*f));
                        assert!((*found - exact).size() / size < allowed, "{all}, {j}: {found:?} {exact:?}");
                    }
                }
                let numbers: Vec<[f64; 4]> =
                    (0..all).map(|j| [u[j % blocks], a[j % blocks], v[j % 11], v[j % 7]]).collect();
                let (mut new_u, mut new_v) = (vec![0.0; blocks], vec![0.0; blocks]);
                cosines.compose(&numbers, &mut new_u, &mut new_v);
                for b in 0..blocks {
                    let sum = |at: usize| {
                        (0..all).fold(0.0, |sum, j| {
                            let x = cosine(j, b);
                            sum + (numbers[j][at] * x.re - numbers[j][at + 1] * x.im)
                        })
                    };
                    for (found, exact, size) in [(new_u[b], sum(0), 1.0), (new_v[b], sum(2), V_SIZE)] {
                        assert!((found - exact).abs() / size < 1e-14 * n, "{all}, {b}: {found} {exact}");
                    }
                }
                let found = (sums, new_u, new_v);
                assert!(of_baseline.get_or_insert_with(|| found.clone()) == &found, "{sweeps:?}");
            }
        }
    }
}
