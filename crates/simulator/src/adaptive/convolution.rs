//! The stress that slip on a line causes in an elastic medium, by the fast Fourier transform.
//!
//! Slip `w_j` of cells `dz` wide, none beyond them, changes the shear stress by `sum_j k_|i-j| w_j`, with
//! `k_0 = -pi mu / (4 dz)`, and `mu / (pi m^2 dz)` for odd `m` and 0 for even `m`: the symbol is `-mu |q| / 2` up to
//! Nyquist's wave number. A free surface is a mirror of `w`. The sequence is padded so that the sum is not periodic, except
//! in a periodic medium, whose symbol is `-(mu / 2) sqrt(q^2 + (2 pi / W)^2)`.

use std::f64::consts::PI;

use asperity_model::body::medium::{FirstNode, Medium, MediumKind};

use crate::kernels;

/// The convolution of a medium.
#[derive(Debug, Clone)]
pub(super) struct Convolution {
    /// Where the image of node `j` is, from the end of the sequence: `j` before it, or `j + 1`.
    image: Option<usize>,
    /// `k_m` up to half of the sequence's length `M`.
    lags: Vec<f64>,
    /// Their transform `S`.
    pub(super) spectrum: Vec<f64>,
    /// `e^(-2 pi i k / C)`, `C = M / 2`, and `e^(-2 pi i k / M)` up to `C / 2`.
    turns: [Vec<f64>; 2],
    half_turns: [Vec<f64>; 2],
    /// The sequence, its even numbers as real and its odd ones as imaginary parts.
    values: [Vec<f64>; 2],
    scratch: [Vec<f64>; 2],
}

impl Convolution {
    pub(super) fn of(medium: &Medium) -> Convolution {
        let (nodes, mu, dz) = (medium.nodes(), medium.shear_modulus_pa, medium.spacing_m);
        let size = match medium.kind {
            MediumKind::HalfSpace => (4 * nodes).next_power_of_two(),
            MediumKind::WholeSpace => (2 * nodes).next_power_of_two(),
            MediumKind::Periodic { .. } => nodes.next_power_of_two(),
        };
        let (half, angle) = (size / 2, |k: usize| -2.0 * PI * k as f64 / size as f64);
        let turns = |of: fn(f64) -> f64, step: usize| {
            (0..size / step).map(|k| of(angle(step * k))).collect::<Vec<_>>()
        };
        // The transform of an even sequence, given its first half, which is real and even.
        let transformed = |values: Vec<f64>| -> Vec<f64> {
            let mut re: Vec<f64> = (0..size).map(|k| values[k.min(size - k)]).collect();
            let [mut im, mut a, mut b] = [(); 3].map(|()| vec![0.0; size]);
            kernels::fourier(
                [&mut re, &mut im],
                [&mut a, &mut b],
                [&turns(libm::cos, 1), &turns(libm::sin, 1)],
            );
            re.truncate(half + 1);
            re
        };
        let (lags, spectrum) = match medium.kind {
            MediumKind::Periodic { width_m } => {
                let q = |n: usize| 2.0 * PI * n as f64 / (nodes as f64 * dz);
                let symbol = |n| -0.5 * mu * libm::hypot(q(n), 2.0 * PI / width_m);
                let spectrum: Vec<f64> = (0..=half).map(symbol).collect();
                (transformed(spectrum.iter().map(|s| s / size as f64).collect()), spectrum)
            }
            MediumKind::HalfSpace | MediumKind::WholeSpace => {
                let lag = |m: usize| match m {
                    0 => -PI * mu / (4.0 * dz),
                    _ if m.is_multiple_of(2) => 0.0,
                    _ => mu / (PI * (m * m) as f64 * dz),
                };
                let lags: Vec<f64> = (0..=half).map(lag).collect();
                (lags.clone(), transformed(lags))
            }
        };
        let zeros = || [(); 2].map(|()| vec![0.0; half]);
        Convolution {
            image: (medium.kind == MediumKind::HalfSpace)
                .then_some(usize::from(medium.first_node == FirstNode::HalfCell)),
            lags,
            spectrum,
            turns: [turns(libm::cos, 2), turns(libm::sin, 2)],
            half_turns: [turns(libm::cos, 1), turns(libm::sin, 1)],
            values: zeros(),
            scratch: zeros(),
        }
    }

    /// Adds the stress of slip `w` to a prestress.
    pub(super) fn stress(&mut self, stress: &mut [f64], prestress: &[f64], w: &[f64]) {
        let (nodes, half) = (w.len(), self.spectrum.len() - 1);
        let [re, im] = &mut self.values;
        re.fill(0.0);
        im.fill(0.0);
        for (j, w) in w.iter().enumerate() {
            [&mut *re, &mut *im][j % 2][j / 2] = *w;
        }
        if let Some(beside) = self.image {
            for (j, w) in w.iter().enumerate().skip(1 - beside) {
                let place = 2 * half - beside - j;
                [&mut *re, &mut *im][place % 2][place / 2] = *w;
            }
        }
        let ([a, b], [cos, sin]) = (&mut self.scratch, &self.turns);
        kernels::fourier([re, im], [a, b], [cos, sin]);
        kernels::multiply([re, im], &self.spectrum, self.half_turns.each_ref().map(|turns| &**turns));
        kernels::fourier([re, im], [a, b], [cos, sin]);
        for n in 0..nodes {
            let of = if n.is_multiple_of(2) { re[n / 2] } else { -im[n / 2] };
            stress[n] = prestress[n] + of;
        }
    }

    /// The factors on the slip of each of `nodes` in the stress at node `n`.
    pub(super) fn row(&self, n: usize, nodes: usize) -> Vec<f64> {
        let last = self.lags.len() - 1;
        let lag = |m: usize| self.lags[m.min(2 * last - m)];
        let image = |j: usize| match self.image {
            Some(beside) if j + beside > 0 => lag(n + j + beside),
            _ => 0.0,
        };
        (0..nodes).map(|j| lag(n.abs_diff(j)) + image(j)).collect()
    }
}
