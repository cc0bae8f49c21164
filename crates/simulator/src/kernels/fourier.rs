//! Fourier sums, and the interpolation between their grid and arbitrary wave numbers.

use std::sync::Arc;

use crate::kernels::energy::total;
use crate::kernels::simd::kernel;

/// Grid points used to interpolate at a wave number.
pub(crate) const NEAR: usize = 16;

/// `1 / k^2`, from 1 on: more terms than any series needs.
const OVER_SQUARES: [f64; 127] = {
    let mut values = [0.0; 127];
    let mut k = 1;
    while k <= values.len() {
        values[k - 1] = 1.0 / (k * k) as f64;
        k += 1;
    }
    values
};

/// Square of the relative size below which a term is dropped.
const NO_PART: f64 = 1e-36;

/// Interpolation between a grid and the wave numbers beside it.
#[derive(Debug, Clone)]
pub(crate) struct Near {
    /// First grid point of each wave number.
    pub(crate) first: Arc<[u32]>,
    /// [`NEAR`] complex weights of each wave number.
    pub(crate) re: Arc<[[f64; NEAR]]>,
    pub(crate) im: Arc<[[f64; NEAR]]>,
}

kernel! {
    /// `y_k = sum_j x_j exp(-2 pi i j k / size)`, in place, of a power of two.
    /// Radix 4, with a final radix 2 if the power of two is odd; Stockham's order, which needs no bit
    /// reversal.
    fn fourier(values: [&mut [f64]; 2], scratch: [&mut [f64]; 2], turns: [&[f64]; 2]) {
        let ([mut re, mut im], [mut to_re, mut to_im]) = (values, scratch);
        let size = re.len();
        let (mut left, mut stride, mut swapped) = (size, 1, false);
        while left > 1 {
            if left.is_multiple_of(4) {
                match stride {
                    1 => first_by_four([re, im], [to_re, to_im], turns),
                    _ => by_four([re, im], [to_re, to_im], [left, stride], turns),
                }
                (left, stride) = (left / 4, stride * 4);
            } else {
                for q in 0..stride {
                    for (from, to) in [(&*re, &mut *to_re), (&*im, &mut *to_im)] {
                        let (a, b) = (from[q], from[stride + q]);
                        (to[q], to[stride + q]) = (a + b, a - b);
                    }
                }
                (left, stride) = (left / 2, stride * 2);
            }
            std::mem::swap(&mut re, &mut to_re);
            std::mem::swap(&mut im, &mut to_im);
            swapped = !swapped;
        }
        if swapped {
            to_re.copy_from_slice(re);
            to_im.copy_from_slice(im);
        }
    }
}

/// The sums over four numbers, by real and imaginary parts, each but the first turned.
#[inline(always)]
fn four([re, im]: [[f64; 4]; 2], [[c1, s1], [c2, s2], [c3, s3]]: [[f64; 2]; 3]) -> [[f64; 4]; 2] {
    let (sum_re, sum_im) = (re[0] + re[2], im[0] + im[2]);
    let (off_re, off_im) = (re[0] - re[2], im[0] - im[2]);
    let (other_re, other_im) = (re[1] + re[3], im[1] + im[3]);
    // Times -i.
    let (side_re, side_im) = (im[1] - im[3], re[3] - re[1]);
    let (x1, y1) = (off_re + side_re, off_im + side_im);
    let (x2, y2) = (sum_re - other_re, sum_im - other_im);
    let (x3, y3) = (off_re - side_re, off_im - side_im);
    [
        [sum_re + other_re, c1 * x1 - s1 * y1, c2 * x2 - s2 * y2, c3 * x3 - s3 * y3],
        [sum_im + other_im, c1 * y1 + s1 * x1, c2 * y2 + s2 * x2, c3 * y3 + s3 * x3],
    ]
}

/// [`by_four`] of stride 1: vectorised over the sums, for want of a loop within each.
#[inline(always)]
fn first_by_four([re, im]: [&[f64]; 2], [to_re, to_im]: [&mut [f64]; 2], [cos, sin]: [&[f64]; 2]) {
    let quarter = re.len() / 4;
    let [re, im] = [re, im].map(|of| [0, 1, 2, 3].map(|part| &of[part * quarter..][..quarter]));
    let (cos, sin) = (&cos[..4 * quarter], &sin[..4 * quarter]);
    let (to_re, to_im) = (&mut to_re.as_chunks_mut().0[..quarter], &mut to_im.as_chunks_mut().0[..quarter]);
    for p in 0..quarter {
        let turns = [1, 2, 3].map(|times| [cos[times * p], sin[times * p]]);
        [to_re[p], to_im[p]] = four([re.map(|re| re[p]), im.map(|im| im[p])], turns);
    }
}

#[inline(always)]
fn by_four(
    [re, im]: [&[f64]; 2],
    [to_re, to_im]: [&mut [f64]; 2],
    [left, stride]: [usize; 2],
    [cos, sin]: [&[f64]; 2],
) {
    let quarter = left / 4;
    for p in 0..quarter {
        let turns = [1, 2, 3].map(|times| [cos[times * p * stride], sin[times * p * stride]]);
        let from = |part: usize| (p + part * quarter) * stride;
        let [a_re, b_re, c_re, d_re] = [0, 1, 2, 3].map(|part| &re[from(part)..][..stride]);
        let [a_im, b_im, c_im, d_im] = [0, 1, 2, 3].map(|part| &im[from(part)..][..stride]);
        let (first, rest) = to_re[4 * p * stride..].split_at_mut(stride);
        let (second, rest) = rest.split_at_mut(stride);
        let (third, rest) = rest.split_at_mut(stride);
        let to_re = [first, second, third, &mut rest[..stride]];
        let (first, rest) = to_im[4 * p * stride..].split_at_mut(stride);
        let (second, rest) = rest.split_at_mut(stride);
        let (third, rest) = rest.split_at_mut(stride);
        let to_im = [first, second, third, &mut rest[..stride]];
        for q in 0..stride {
            let of = [[a_re[q], b_re[q], c_re[q], d_re[q]], [a_im[q], b_im[q], c_im[q], d_im[q]]];
            let sums = four(of, turns);
            for part in 0..4 {
                (to_re[part][q], to_im[part][q]) = (sums[0][part], sums[1][part]);
            }
        }
    }
}
kernel! {
    /// Turns the transform `Z` of a real sequence of length `M = 2 C`, its even numbers as real and its odd ones as
    /// imaginary parts, into the conjugate of that of its convolution with an even sequence, over `C`. `S` is the
    /// transform of the latter, up to `C`, and turns are `t = e^(-2 pi i k / M)`.
    fn multiply(values: [&mut [f64]; 2], spectrum: &[f64], turns: [&[f64]; 2]) {
        let ([re, im], size) = (values, spectrum.len() - 1);
        let per = 0.25 / size as f64;
        // `E + t O` and `E - t O` are the transforms of the sequence at `k` and `C - k`, conjugated.
        let pair = |[x, y]: [f64; 2], [u, v]: [f64; 2], [s, s_other]: [f64; 2], [c, d]: [f64; 2]| {
            let (e_re, e_im, o_re, o_im) = (x + u, y - v, y + v, u - x);
            let (t_re, t_im) = (c * o_re - d * o_im, c * o_im + d * o_re);
            let (a_re, a_im) = ((e_re + t_re) * s, (e_im + t_im) * s);
            let (b_re, b_im) = ((e_re - t_re) * s_other, (e_im - t_im) * s_other);
            let (e_re, e_im, d_re, d_im) = (a_re + b_re, a_im + b_im, a_re - b_re, a_im - b_im);
            let (o_re, o_im) = (c * d_re + d * d_im, c * d_im - d * d_re);
            [[per * (e_re - o_im), -per * (e_im + o_re)], [per * (e_re + o_im), per * (e_im - o_re)]]
        };
        for k in 0..=size / 2 {
            let j = (size - k) & (size - 1);
            let lags = [spectrum[k], spectrum[size - k]];
            let [here, there] = pair([re[k], im[k]], [re[j], im[j]], lags, [turns[0][k], turns[1][k]]);
            ([re[k], im[k]], [re[j], im[j]]) = (here, there);
        }
    }
}

kernel! {
    /// The cosine sums of two real quantities, from the Fourier sums `V` of both as one complex one:
    /// `C_g = (w_g V_g + conj(w_g) V_{G-g}) / 2`, `w_g = exp(-i pi g / (2 G))`.
    fn to_cosines(sums: [&mut [f64]; 2], of: [&[f64]; 2], turns: [&[f64]; 2]) {
        let ([u, v], size) = (sums, of[0].len());
        let ([re, im], [cos, sin]) = (of.map(|of| &of[..size]), turns.map(|turns| &turns[..size]));
        let (u, v) = (&mut u[..size], &mut v[..size]);
        (u[0], v[0]) = (re[0], im[0]);
        for g in 1..size {
            let (c, s, mirror) = (cos[g], sin[g], size - g);
            u[g] = 0.5 * ((c * re[g] - s * im[g]) + (c * re[mirror] + s * im[mirror]));
            v[g] = 0.5 * ((c * im[g] + s * re[g]) + (c * im[mirror] - s * re[mirror]));
        }
    }
}

kernel! {
    /// The transpose of [`to_cosines`], `W_k = w_k (D_k + i D_{G-k}) / 2`, of numbers up to the `G`th.
    fn from_cosines(values: [&mut [f64]; 2], of: [&[f64]; 2], turns: [&[f64]; 2]) {
        let ([re, im], size) = (values, turns[0].len());
        let ([u, v], [cos, sin]) = (of.map(|of| &of[..=size]), turns.map(|turns| &turns[..size]));
        let (re, im) = (&mut re[..size], &mut im[..size]);
        (re[0], im[0]) = (u[0], v[0]);
        for k in 1..size {
            let (x, y) = (u[k] - v[size - k], v[k] + u[size - k]);
            let (c, s) = (cos[k], sin[k]);
            re[k] = 0.5 * (c * x - s * y);
            im[k] = 0.5 * (c * y + s * x);
        }
    }
}

kernel! {
    /// For each wave number, the sums over its grid points of weights times values.
    fn gather(sums: &mut [[f64; 4]], near: &Near, of: [&[f64]; 2]) {
        let [u, v] = of;
        for (((sums, first), re), im) in sums.iter_mut().zip(&*near.first).zip(&*near.re).zip(&*near.im) {
            let from = *first as usize;
            let (u, v) = (&u[from..][..NEAR], &v[from..][..NEAR]);
            let (mut u_re, mut u_im, mut v_re, mut v_im) = ([0.0; 8], [0.0; 8], [0.0; 8], [0.0; 8]);
            for at in (0..NEAR).step_by(8) {
                let (re, im, u, v) = (&re[at..at + 8], &im[at..at + 8], &u[at..at + 8], &v[at..at + 8]);
                for lane in 0..8 {
                    u_re[lane] += re[lane] * u[lane];
                    u_im[lane] += im[lane] * u[lane];
                    v_re[lane] += re[lane] * v[lane];
                    v_im[lane] += im[lane] * v[lane];
                }
            }
            *sums = [total(&u_re), total(&u_im), total(&v_re), total(&v_im)];
        }
    }
}

kernel! {
    /// Adds to the values at the grid points of each wave number the real parts of weights times
    /// two complex coordinates.
    fn spread(values: [&mut [f64]; 2], near: &Near, coordinates: &[[f64; 4]]) {
        let [u, v] = values;
        for (((of, first), re), im) in coordinates.iter().zip(&*near.first).zip(&*near.re).zip(&*near.im) {
            // As most waves of a sample are.
            if *of == [0.0; 4] {
                continue;
            }
            let from = *first as usize;
            let (u, v) = (&mut u[from..][..NEAR], &mut v[from..][..NEAR]);
            for t in 0..NEAR {
                u[t] += of[0] * re[t] - of[1] * im[t];
                v[t] += of[2] * re[t] - of[3] * im[t];
            }
        }
    }
}

kernel! {
    /// The Bessel function `I_0(2 sqrt(z))` of complex numbers, by its power series `sum z^k / k!^2`.
    fn bessel(re: &mut [f64; NEAR], im: &mut [f64; NEAR]) {
        let (z_re, z_im) = (*re, *im);
        let (mut term_re, mut term_im) = ([1.0; NEAR], [0.0; NEAR]);
        (*re, *im) = (term_re, term_im);
        for over_square in OVER_SQUARES {
            let mut going_on = 0;
            for t in 0..NEAR {
                let (x, y) = (term_re[t], term_im[t]);
                let (x, y) =
                    ((x * z_re[t] - y * z_im[t]) * over_square, (x * z_im[t] + y * z_re[t]) * over_square);
                re[t] += x;
                im[t] += y;
                // A sum that has converged is no longer changed.
                let goes_on = x * x + y * y > NO_PART * (re[t] * re[t] + im[t] * im[t]);
                (term_re[t], term_im[t]) = if goes_on { (x, y) } else { (0.0, 0.0) };
                going_on += u64::from(goes_on);
            }
            if going_on == 0 {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::fourier;
    use crate::kernels::by_all;

    #[test]
    fn fourier_sums_are_what_they_say_on_every_instruction_set() {
        for size in [1usize, 2, 4, 8, 32, 64, 512] {
            let angle = |k: usize| -2.0 * std::f64::consts::PI * (k % size) as f64 / size as f64;
            let cos: Vec<f64> = (0..size).map(|k| libm::cos(angle(k))).collect();
            let sin: Vec<f64> = (0..size).map(|k| libm::sin(angle(k))).collect();
            let pattern = |seed: usize| -> Vec<f64> {
                (0..size).map(|j| ((j * j * 7919 + seed * (j + 1)) % 101) as f64 / 101.0 - 0.5).collect()
            };
            let (re, im) = (pattern(3), pattern(17));
            by_all(|| {
                let (mut to_re, mut to_im) = (re.clone(), im.clone());
                let (mut a, mut b) = (vec![0.0; size], vec![0.0; size]);
                fourier([&mut to_re, &mut to_im], [&mut a, &mut b], [&cos, &sin]);
                for k in 0..size {
                    let (mut x, mut y) = (0.0, 0.0);
                    for j in 0..size {
                        let (c, s) = (cos[j * k % size], sin[j * k % size]);
                        x += re[j] * c - im[j] * s;
                        y += re[j] * s + im[j] * c;
                    }
                    assert!((x - to_re[k]).abs() < 1e-12 && (y - to_im[k]).abs() < 1e-12, "{size}, {k}");
                }
                (to_re, to_im)
            });
        }
    }
}
