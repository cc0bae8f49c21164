//! Standing waves of a long chain, eight at a time.

use crate::sweep::versions::{Sweeps, dispatch};

impl Sweeps {
    dispatch! {
        /// `sum_n x_n u_n`, `sum_n x_n v_n` and `sum_n x_n^2` of eight waves over all blocks but
        /// the first, and `x` of the first two.
        wave_sums(sums: &mut WaveSums, wave: &Lanes, u: &[f64], v: &[f64])
    }

    dispatch! {
        /// Adds eight waves to displacements, velocities and, in magnitude, forces;
        /// `x` of the first two blocks.
        add_waves(u: &mut [f64], v: &mut [f64], force: &mut [f64], waves: &Waves8) -> [Lanes; 2]
    }
}

/// A complex number of each of eight waves.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lanes {
    pub(crate) re: [f64; 8],
    pub(crate) im: [f64; 8],
}

/// Sums over eight waves; see [`Sweeps::wave_sums`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WaveSums {
    pub(crate) u: Lanes,
    pub(crate) v: Lanes,
    pub(crate) square: Lanes,
    pub(crate) first: Lanes,
    pub(crate) second: Lanes,
}

/// Eight waves, and what each brings.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Waves8 {
    /// `2 cos q`.
    pub(crate) turn: Lanes,
    /// What `x` is multiplied with for displacements and velocities.
    pub(crate) u: Lanes,
    pub(crate) v: Lanes,
    /// And `|x|` for forces.
    pub(crate) force: [f64; 8],
}

/// From one block to the one before it: `x_{n-1} = 2 cos q x_n - x_{n+1}`.
macro_rules! to_the_left {
    ($turn:expr, $x:ident, $behind:ident) => {
        for lane in 0..8 {
            let re = $turn.re[lane] * $x.re[lane] - $turn.im[lane] * $x.im[lane] - $behind.re[lane];
            let im = $turn.re[lane] * $x.im[lane] + $turn.im[lane] * $x.re[lane] - $behind.im[lane];
            ($behind.re[lane], $behind.im[lane]) = ($x.re[lane], $x.im[lane]);
            ($x.re[lane], $x.im[lane]) = (re, im);
        }
    };
}

const ONES: Lanes = Lanes { re: [1.0; 8], im: [0.0; 8] };

#[inline(always)]
fn wave_sums(sums: &mut WaveSums, wave: &Lanes, u: &[f64], v: &[f64]) {
    let blocks = u.len();
    let v = &v[..blocks];
    let turn = *wave;
    // The last block, and its image behind the free end.
    let (mut x, mut behind) = (ONES, ONES);
    let mut all = WaveSums::default();
    for n in (1..blocks).rev() {
        let (u, v) = (u[n], v[n]);
        for lane in 0..8 {
            let (re, im) = (x.re[lane], x.im[lane]);
            all.u.re[lane] += re * u;
            all.u.im[lane] += im * u;
            all.v.re[lane] += re * v;
            all.v.im[lane] += im * v;
            all.square.re[lane] += re * re - im * im;
            all.square.im[lane] += 2.0 * re * im;
        }
        to_the_left!(turn, x, behind);
    }
    (all.first, all.second) = (x, behind);
    *sums = all;
}

#[inline(always)]
fn add_waves(u: &mut [f64], v: &mut [f64], force: &mut [f64], waves: &Waves8) -> [Lanes; 2] {
    let blocks = u.len();
    let (v, force) = (&mut v[..blocks], &mut force[..blocks]);
    let Waves8 { turn, u: by_u, v: by_v, force: by_force } = *waves;
    let (mut x, mut behind) = (ONES, ONES);
    for n in (0..blocks).rev() {
        let (mut of_u, mut of_v, mut of_force) = ([0.0; 8], [0.0; 8], [0.0; 8]);
        for lane in 0..8 {
            let (re, im) = (x.re[lane], x.im[lane]);
            of_u[lane] = by_u.re[lane] * re - by_u.im[lane] * im;
            of_v[lane] = by_v.re[lane] * re - by_v.im[lane] * im;
            // No less than the magnitude.
            of_force[lane] = by_force[lane] * (re.abs() + im.abs());
        }
        u[n] += total(&of_u);
        v[n] += total(&of_v);
        force[n] += total(&of_force);
        if n > 0 {
            to_the_left!(turn, x, behind);
        }
    }
    [x, behind]
}

/// The sum of eight lanes, in one order.
#[inline(always)]
fn total(lanes: &[f64; 8]) -> f64 {
    let four: [f64; 4] = [lanes[0] + lanes[4], lanes[1] + lanes[5], lanes[2] + lanes[6], lanes[3] + lanes[7]];
    (four[0] + four[2]) + (four[1] + four[3])
}
