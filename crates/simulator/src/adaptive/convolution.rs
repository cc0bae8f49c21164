//! The stress that slip on a line causes in an elastic medium, by the fast Fourier transform.
//!
//! Slip `w_j` of cells `dz` wide, none beyond them, changes the shear stress by `sum_j k_|i-j| w_j`, with
//! `k_0 = -pi mu / (4 dz)`, and `mu / (pi m^2 dz)` for odd `m` and 0 for even `m`: the symbol is `-mu |q| / 2` up to
//! Nyquist's wave number. A free surface is a mirror of `w`. The sequence is padded so that the sum is not periodic, except
//! in a periodic medium, whose symbol is `-(mu / 2) sqrt(q^2 + (2 pi / W)^2)`.

use std::f64::consts::PI;

use asperity_model::MediumChoice;
use asperity_model::body::medium::{FirstNode, Medium};

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
        let size = medium.transform_length();
        let (half, angle) = (size / 2, |k: usize| -2.0 * PI * k as f64 / size as f64);
        let turns = |step: usize| {
            [libm::cos, libm::sin].map(|of| (0..size / step).map(|k| of(angle(step * k))).collect::<Vec<_>>())
        };
        let half_turns = turns(1);
        // The transform of an even sequence, given its first half, which is real and even.
        let transformed = |values: Vec<f64>| -> Vec<f64> {
            let mut re: Vec<f64> = (0..size).map(|k| values[k.min(size - k)]).collect();
            let [mut im, mut a, mut b] = [(); 3].map(|()| vec![0.0; size]);
            kernels::fourier([&mut re, &mut im], [&mut a, &mut b], half_turns.each_ref().map(|of| &**of));
            re.truncate(half + 1);
            re
        };
        let (lags, spectrum) = if medium.kind == MediumChoice::Periodic {
            let q = |n: usize| 2.0 * PI * n as f64 / (nodes as f64 * dz);
            let symbol = |n| -0.5 * mu * libm::hypot(q(n), 2.0 * PI / medium.width_m);
            let spectrum: Vec<f64> = (0..=half).map(symbol).collect();
            (transformed(spectrum.iter().map(|s| s / size as f64).collect()), spectrum)
        } else {
            let lag = |m: usize| (m % 2) as f64 * mu / (PI * (m * m) as f64 * dz);
            let lags: Vec<f64> = [-PI * mu / (4.0 * dz)].into_iter().chain((1..=half).map(lag)).collect();
            (lags.clone(), transformed(lags))
        };
        let zeros = || [(); 2].map(|()| vec![0.0; half]);
        Convolution {
            image: (medium.kind == MediumChoice::HalfSpace)
                .then_some(usize::from(medium.first_node == FirstNode::HalfCell)),
            lags,
            spectrum,
            turns: turns(2),
            half_turns,
            values: zeros(),
            scratch: zeros(),
        }
    }

    /// Adds the stress of slip `w` to a prestress.
    pub(super) fn stress(&mut self, stress: &mut [f64], prestress: &[f64], w: &[f64]) {
        let [re, im] = &mut self.values;
        re.fill(0.0);
        im.fill(0.0);
        for (j, w) in w.iter().enumerate() {
            let image = self.image.filter(|beside| j + beside > 0);
            let image = image.map(|beside| 2 * re.len() - beside - j);
            for place in [Some(j), image].into_iter().flatten() {
                [&mut *re, &mut *im][place % 2][place / 2] = *w;
            }
        }
        let ([a, b], [cos, sin]) = (&mut self.scratch, &self.turns);
        kernels::fourier([re, im], [a, b], [cos, sin]);
        kernels::multiply([re, im], &self.spectrum, self.half_turns.each_ref().map(|turns| &**turns));
        kernels::fourier([re, im], [a, b], [cos, sin]);
        for n in 0..w.len() {
            let of = if n.is_multiple_of(2) { re[n / 2] } else { -im[n / 2] };
            stress[n] = prestress[n] + of;
        }
    }

    /// The factors on the slip of each of `nodes` in the stress at node `n`.
    pub(super) fn row(&self, n: usize, nodes: usize) -> Vec<f64> {
        let last = self.lags.len() - 1;
        let lag = |m: usize| self.lags[m.min(2 * last - m)];
        let image = |j| self.image.filter(|beside| j + beside > 0).map_or(0.0, |beside| lag(n + j + beside));
        (0..nodes).map(|j| lag(n.abs_diff(j)) + image(j)).collect()
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::MediumChoice;
    use asperity_model::body::medium::{FirstNode, Medium};

    use super::Convolution;
    use crate::kernels::{by_all, product};

    fn medium(kind: MediumChoice, first_node: FirstNode, nodes: usize, spacing_m: f64) -> Medium {
        let of_nodes = || vec![1.0; nodes];
        Medium {
            kind,
            width_m: 3e4,
            first_node,
            shear_modulus_pa: 30e9,
            density_kg_per_m3: 2670.0,
            spacing_m,
            direct_effect: of_nodes(),
            evolution_effect: of_nodes(),
            critical_slip_m: of_nodes(),
            normal_stress_pa: of_nodes(),
            prestress_pa: of_nodes(),
        }
    }

    fn stress(medium: &Medium, w: &[f64]) -> Vec<f64> {
        let mut stress = vec![0.0; w.len()];
        Convolution::of(medium).stress(&mut stress, &vec![0.0; w.len()], w);
        stress
    }

    const KINDS: [(MediumChoice, FirstNode); 4] = [
        (MediumChoice::HalfSpace, FirstNode::Surface),
        (MediumChoice::HalfSpace, FirstNode::HalfCell),
        (MediumChoice::WholeSpace, FirstNode::Surface),
        (MediumChoice::Periodic, FirstNode::HalfCell),
    ];

    #[test]
    fn stresses_are_the_direct_sums_on_every_instruction_set() {
        for (kind, first_node) in KINDS {
            for nodes in [2_usize, 4, 16, 64, 1024, 50, 333]
                .into_iter()
                .filter(|n| n.is_power_of_two() || kind != MediumChoice::Periodic)
            {
                let medium = medium(kind, first_node, nodes, 25.0);
                let w: Vec<f64> =
                    (0..nodes).map(|n| ((n * n * 7919 + n) % 101) as f64 / 101.0 - 0.3).collect();
                let found = by_all(|| stress(&medium, &w));
                let convolution = Convolution::of(&medium);
                let most = found.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                for (n, found) in found.iter().enumerate() {
                    let direct = product(&convolution.row(n, nodes), &w);
                    assert!((found - direct).abs() < 1e-14 * most, "{kind:?} {nodes} {n}: {found} {direct}");
                }
            }
        }
    }

    /// The half-space of QDYN, which tabulates the kernel of Cochard and Rice (1997) for 1024 cells in 10 km.
    #[test]
    fn lags_are_those_of_another_code() {
        let lags =
            Convolution::of(&medium(MediumChoice::HalfSpace, FirstNode::HalfCell, 1024, 1e4 / 1024.0)).lags;
        for (m, expected) in [
            (0, -2412743336.2),
            (1, 977848099.61),
            (2, -95.873847435),
            (3, 108649874.07),
            (4, -95.873982913),
            (5, 39114016.023),
            (7, 19956177.583),
            (10, -95.874930506),
            (15, 4346087.004),
            (31, 1017627.6263),
            (32, -95.885354227),
            (63, 246467.29771),
            (100, -95.986708013),
            (127, 60722.753497),
            (255, 15134.643347),
            (511, 3843.7006229),
            (777, 1722.7681593),
            (1023, 1043.3128729),
            (1500, -127.77713246),
            (2047, 404.30138177),
        ] {
            assert!((lags[m] - expected).abs() < 1e-7 * lags[0].abs(), "{m}: {} {expected}", lags[m]);
        }
    }

    /// The crack of half-length `c` whose slip is `(2 D / mu) sqrt(c^2 - z^2)`, and its half at a surface.
    #[test]
    fn a_crack_has_its_drop_and_its_stress_outside() {
        for (per_c, share) in [(32, 6.6e-2), (128, 1.9e-2), (512, 2.3e-3), (2048, 3e-4)] {
            for (kind, middle) in [(MediumChoice::WholeSpace, 3 * per_c), (MediumChoice::HalfSpace, 0)] {
                let medium = medium(kind, FirstNode::Surface, middle + 3 * per_c, 1e4 / per_c as f64);
                let z = |n: usize| (n as f64 - middle as f64) / per_c as f64;
                let slip = |n: usize| 2e4 / 30e9 * (1.0 - z(n) * z(n)).max(0.0).sqrt();
                let w: Vec<f64> = (0..medium.nodes()).map(slip).collect();
                for (n, found) in stress(&medium, &w).into_iter().enumerate() {
                    let z = z(n).abs();
                    let expected = if z < 1.0 { -1.0 } else { z / (z * z - 1.0).sqrt() - 1.0 };
                    let counts = !(0.9..=1.1).contains(&z);
                    assert!(!counts || (found - expected).abs() < share, "{kind:?} {per_c} {z}: {found}");
                }
            }
        }
    }

    /// The slip of a drop: `w = 0` at the tips, which makes a crack shorter by a share of a cell.
    #[test]
    fn a_drop_has_the_slip_of_a_crack_less_a_share_of_a_cell() {
        for per_c in [16, 64] {
            let nodes = 2 * per_c - 1;
            let medium = medium(MediumChoice::WholeSpace, FirstNode::Surface, nodes, 1e4 / per_c as f64);
            // Conjugate gradients, of -K.
            let apply = |x: &[f64]| -> Vec<f64> { stress(&medium, x).iter().map(|x| -x).collect() };
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (mut w, mut rest) = (vec![0.0; nodes], vec![1.0; nodes]);
            let mut along = rest.clone();
            for _ in 0..nodes {
                let (of_along, before) = (apply(&along), dot(&rest, &rest));
                let step = before / dot(&along, &of_along);
                w.iter_mut().zip(&along).for_each(|(w, along)| *w += step * along);
                rest.iter_mut().zip(&of_along).for_each(|(rest, of)| *rest -= step * of);
                let ratio = dot(&rest, &rest) / before;
                along.iter_mut().zip(&rest).for_each(|(along, rest)| *along = rest + ratio * *along);
                if dot(&rest, &rest) < 1e-24 {
                    break;
                }
            }
            let per_n = per_c as f64;
            let potency = w.iter().sum::<f64>() * medium.spacing_m / (std::f64::consts::PI * 1e8 / 30e9);
            let middle = w[per_c - 1] / (2e4 / 30e9);
            let [of_potency, of_middle] = [(1.0 - potency) * per_n, (1.0 - middle) * per_n];
            assert!(
                (of_potency - 0.62).abs() < 0.02 && (of_middle - 0.31).abs() < 0.02,
                "{of_potency} {of_middle}"
            );
        }
    }
}
