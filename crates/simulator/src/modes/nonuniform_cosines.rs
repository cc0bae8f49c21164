//! Nonuniform cosine transforms: sums over standing waves of arbitrary wave numbers, in a time that
//! grows as `N log N`.
//!
//! Projecting a state onto waves, and composing it from them, are
//!
//! ```text
//! F(q_m) = sum_p f_p cos q_m (p + 1/2),    g_p = Re sum_m a_m cos q_m (p + 1/2),    p = 0 ... N - 1,
//! ```
//!
//! for wave numbers `q_m` at arbitrary places between 0 and `pi`, close to the real axis. On a grid
//! `h = pi / G` of wave numbers both are cosine transforms. Between its points a cosine is interpolated
//! from the [`NEAR`] nearest, with a kernel `K` of that width (Kaiser and Bessel's; for the error of
//! such sums see Fessler and Sutton 2003, Barnett 2019):
//!
//! ```text
//! cos q y = sum_g K(q / h - g) cos(g h y) / psi(y) + the same at y + 2 G, y - 2 G, ...,
//! K(t) = I_0(beta sqrt(1 - (t / w)^2)),    psi(y) = 2 w sinh(r) / r,    r^2 = beta^2 - (w h y)^2,
//! ```
//!
//! with `w` half the width; this is Poisson's sum over the grid. With `G >= 2 N`, `h y` is at most
//! `pi / 2` and its images at least `3 pi / 2`: there `r` is 0, by the choice of `beta`, and the rest
//! is below `1 / sinh(35)`, 1e-15. `K` has no singularity, so it serves complex `q` as well; an
//! imaginary part `b` multiplies the rest by `exp(b y)` and by the growth of `K` over `b / h`, so it
//! must stay a fraction of `h`.

use std::sync::Arc;

use crate::kernels::{self, NEAR, Near};
use crate::modes::complex::Complex;

/// Half the width of the kernel, in points of the grid.
const HALF_WIDTH: f64 = NEAR as f64 / 2.0;

/// Points of the grid that kernels reach beyond 0 and `pi`.
const BEYOND: usize = NEAR / 2;

/// Numbers left free in memory behind an array of a power of two of them.
const APART: usize = 136;

/// The largest imaginary part of a wave number, in points of the grid.
const LARGEST_IMAGINARY: f64 = 1.0;

/// Transforms between values at blocks and coefficients of waves.
#[derive(Debug, Clone)]
pub(crate) struct Cosines {
    blocks: usize,
    /// `G`.
    size: usize,
    /// `cos` and `sin` of `-2 pi k / G`, and of `-pi k / (2 G)`.
    turns: [Arc<[f64]>; 2],
    quarter_turns: [Arc<[f64]>; 2],
    /// `1 / psi` of every block.
    part: Arc<[f64]>,
    near: Near,
    /// Two quantities on the grid, padded by what kernels reach beyond its ends.
    grid: [Vec<f64>; 2],
    values: [Vec<f64>; 2],
    scratch: [Vec<f64>; 2],
}

impl Cosines {
    /// The transform for these wave numbers of a chain; `None` if one of them is too far from the real
    /// axis, or not between 0 and `pi`.
    pub(crate) fn of(wave_numbers: impl Iterator<Item = Complex>, blocks: usize) -> Option<Cosines> {
        let pi = std::f64::consts::PI;
        let size = (2 * blocks).next_power_of_two().max(2 * NEAR);
        let spacing = pi / size as f64;
        let near = Near::of(wave_numbers, size)?;
        let angles = |unit: f64| -> [Arc<[f64]>; 2] {
            let angle = move |k: usize| unit * k as f64;
            [
                (0..size).map(|k| libm::cos(angle(k))).collect(),
                (0..size).map(|k| libm::sin(angle(k))).collect(),
            ]
        };
        let on_grid = || vec![0.0; size + 2 * BEYOND + 1];
        // Arrays a power of two apart would meet in the same few sets of the cache's lines.
        let values = || {
            let mut values = Vec::with_capacity(size + APART);
            values.resize(size, 0.0);
            values
        };
        Some(Cosines {
            blocks,
            size,
            turns: angles(-2.0 * spacing),
            quarter_turns: angles(-0.5 * spacing),
            part: (0..blocks).map(|p| over_psi(spacing * (p as f64 + 0.5))).collect(),
            near,
            grid: [on_grid(), on_grid()],
            values: [values(), values()],
            scratch: [values(), values()],
        })
    }

    /// For each wave, `sum_n u_n x_n` and `sum_n v_n x_n` with `x_n = cos q (N - n - 1/2)`, each by its
    /// real and imaginary part.
    pub(crate) fn project(&mut self, u: &[f64], v: &[f64]) -> Vec<[f64; 4]> {
        let (blocks, size) = (self.blocks, self.size);
        let balance = balance(kernels::largest(u), kernels::largest(v));
        for ((values, numbers), factor) in self.values.iter_mut().zip([u, v]).zip([1.0, balance]) {
            values.fill(0.0);
            for p in 0..blocks {
                values[place(p, size)] = factor * numbers[blocks - 1 - p] * self.part[p];
            }
        }
        self.transform();
        let ([re, im], [cos, sin], [u, v]) = (&self.values, &self.quarter_turns, &mut self.grid);
        kernels::to_cosines([&mut u[BEYOND..], &mut v[BEYOND..]], [re, im], [cos, sin]);
        for grid in [u, v] {
            grid[BEYOND + size] = 0.0;
            for beyond in 1..=BEYOND {
                grid[BEYOND - beyond] = grid[BEYOND + beyond];
                grid[BEYOND + size + beyond] = -grid[BEYOND + size - beyond];
            }
        }
        let mut sums = vec![[0.0; 4]; self.near.first.len()];
        kernels::gather(&mut sums, &self.near, [&self.grid[0], &self.grid[1]]);
        for [_, _, re, im] in &mut sums {
            (*re, *im) = (*re / balance, *im / balance);
        }
        sums
    }

    /// Writes the real parts of sums over all waves into `u` and `v`, from two complex coordinates per
    /// wave. Scales the second coordinates in place.
    pub(crate) fn compose(&mut self, coordinates: &mut [[f64; 4]], u: &mut [f64], v: &mut [f64]) {
        let (blocks, size) = (self.blocks, self.size);
        let largest = coordinates.iter().fold([0.0, 0.0], |[u, v]: [f64; 2], of| {
            [u.max(of[0].abs()).max(of[1].abs()), v.max(of[2].abs()).max(of[3].abs())]
        });
        let balance = balance(largest[0], largest[1]);
        for of in &mut *coordinates {
            (of[2], of[3]) = (of[2] * balance, of[3] * balance);
        }
        let [of_u, of_v] = &mut self.grid;
        of_u.fill(0.0);
        of_v.fill(0.0);
        kernels::spread([of_u, of_v], &self.near, coordinates);
        for grid in [of_u, of_v] {
            for beyond in 1..=BEYOND {
                grid[BEYOND + beyond] += grid[BEYOND - beyond];
                grid[BEYOND + size - beyond] -= grid[BEYOND + size + beyond];
            }
            // All cosines are 0 there.
            grid[BEYOND + size] = 0.0;
        }
        let ([re, im], [cos, sin], [u_grid, v_grid]) = (&mut self.values, &self.quarter_turns, &self.grid);
        kernels::from_cosines([re, im], [&u_grid[BEYOND..], &v_grid[BEYOND..]], [cos, sin]);
        self.transform();
        for ((values, numbers), factor) in self.values.iter().zip([u, v]).zip([1.0, balance]) {
            for p in 0..blocks {
                numbers[blocks - 1 - p] = values[place(p, size)] * self.part[p] / factor;
            }
        }
    }

    fn transform(&mut self) {
        let [re, im] = &mut self.values;
        let [a, b] = &mut self.scratch;
        kernels::fourier([re, im], [a, b], [&self.turns[0], &self.turns[1]]);
    }
}

/// Index of a number in the Fourier transform that computes a cosine transform (Makhoul 1980): even ones
/// first, then odd ones in reverse.
#[inline]
fn place(p: usize, size: usize) -> usize {
    if p.is_multiple_of(2) { p / 2 } else { size - 1 - p / 2 }
}

/// Factor that brings the second of two quantities to the size of the first. Both pass through one
/// transform, which rounds each relative to the larger. A power of two, so that scaling is exact.
fn balance(first: f64, second: f64) -> f64 {
    const BIAS: i64 = 1023;
    const MOST: i64 = 500;
    let exponent = |x: f64| (x.to_bits() >> 52) as i64;
    let between = if first > 0.0 && second > 0.0 { exponent(first) - exponent(second) } else { 0 };
    f64::from_bits(((BIAS + between.clamp(-MOST, MOST)) as u64) << 52)
}

/// The largest `w h y` of the nearest images.
fn beta() -> f64 {
    HALF_WIDTH * 1.5 * std::f64::consts::PI
}

impl Near {
    /// On a grid of `size` points from 0 to `pi`; `None` if a wave number is too far from the real axis,
    /// or not between 0 and `pi`.
    fn of(wave_numbers: impl Iterator<Item = Complex>, size: usize) -> Option<Near> {
        let spacing = std::f64::consts::PI / size as f64;
        let (mut first, mut re, mut im) = (Vec::new(), Vec::new(), Vec::new());
        for q in wave_numbers {
            let at = q.scale(1.0 / spacing);
            let is_near = (0.0..=size as f64).contains(&at.re) && at.im.abs() <= LARGEST_IMAGINARY;
            if !is_near {
                return None;
            }
            let from = at.re.floor() - HALF_WIDTH + 1.0;
            let [mut of_re, mut of_im] = [[0.0; NEAR]; 2];
            for (t, (re, im)) in of_re.iter_mut().zip(&mut of_im).enumerate() {
                // `I_0(beta sqrt(1 - (t / w)^2))`
                let share = (at - Complex::from(from + t as f64)).scale(1.0 / HALF_WIDTH);
                let quarter = (Complex::ONE - share * share).scale(beta() * beta() / 4.0);
                (*re, *im) = (quarter.re, quarter.im);
            }
            kernels::bessel(&mut of_re, &mut of_im);
            first.push((from + BEYOND as f64) as u32);
            re.push(of_re);
            im.push(of_im);
        }
        Some(Near { first: first.into(), re: re.into(), im: im.into() })
    }
}

/// `1 / psi` of a place, from `h y`.
fn over_psi(reach: f64) -> f64 {
    let reach = HALF_WIDTH * reach;
    let r = (beta() * beta() - reach * reach).sqrt();
    r / (2.0 * HALF_WIDTH * libm::sinh(r))
}

#[cfg(test)]
mod tests {
    use super::Cosines;
    use crate::kernels::by_all;
    use crate::modes::complex::{Complex, Functions};

    /// Size of velocities, for displacements of size 1.
    const V_SIZE: f64 = 1e-9;

    #[test]
    fn sums_over_waves_beside_the_grid_are_those_of_their_cosines() {
        for blocks in [3usize, 17, 100, 513] {
            let n = blocks as f64;
            let wave = |j: usize| Complex {
                re: (j as f64 + 0.3 * ((j * 7919) % 101) as f64 / 101.0) * std::f64::consts::PI / n,
                im: 0.2 * (((j * 31) % 17) as f64 / 17.0 - 0.5) / n,
            };
            let pattern = |seed: usize| -> Vec<f64> {
                (0..blocks).map(|j| ((j * j * 7919 + seed * (j + 1)) % 101) as f64 / 101.0 - 0.5).collect()
            };
            let (u, v) = (pattern(3), pattern(17).iter().map(|x| V_SIZE * x).collect::<Vec<_>>());
            let cosine = |j: usize, block: usize| wave(j).scale(n - block as f64 - 0.5).sin_cos().1;
            by_all(|| {
                let mut cosines = Cosines::of((0..blocks).map(wave), blocks).unwrap();
                let sums = cosines.project(&u, &v);
                let allowed = 1e-14 * n;
                for (j, sums) in sums.iter().enumerate() {
                    let sum =
                        |f: &[f64]| (0..blocks).fold(Complex::ZERO, |sum, b| sum + cosine(j, b).scale(f[b]));
                    for (part, exact) in [sum(&u).re, sum(&u).im, sum(&v).re, sum(&v).im].iter().enumerate() {
                        let off = (sums[part] - exact).abs() / if part < 2 { 1.0 } else { V_SIZE };
                        assert!(off < allowed, "{blocks}, {j}: {} {exact}", sums[part]);
                    }
                }
                let (mut new_u, mut new_v) = (vec![0.0; blocks], vec![0.0; blocks]);
                cosines.compose(&mut sums.clone(), &mut new_u, &mut new_v);
                let largest = sums.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
                for b in 0..blocks {
                    let sum = |at: usize| {
                        (0..blocks).fold(0.0, |sum, j| {
                            let x = cosine(j, b);
                            sum + (sums[j][at] * x.re - sums[j][at + 1] * x.im)
                        })
                    };
                    for (found, exact, size) in [(new_u[b], sum(0), 1.0), (new_v[b], sum(2), V_SIZE)] {
                        let off = (found - exact).abs() / (largest * size);
                        assert!(off < allowed, "{blocks}, {b}: {found} {exact}");
                    }
                }
                (sums, new_u, new_v)
            });
        }
    }

    #[test]
    fn wave_numbers_far_from_the_axis_are_refused() {
        let of = |re: f64, im: f64| Cosines::of(std::iter::once(Complex { re, im }), 100);
        assert!(of(1.0, 0.0).is_some() && of(3.1, 1e-3).is_some());
        assert!(of(1.0, 0.1).is_none() && of(-0.1, 0.0).is_none() && of(3.2, 0.0).is_none());
        assert!(of(f64::NAN, 0.0).is_none() && of(1.0, f64::NAN).is_none());
    }
}
