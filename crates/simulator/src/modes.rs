//! Bounds on how a stuck chain's vibration may swing, mode by mode.
//!
//! With `M = k_t + k Lambda + K e_1 e_1'` the stiffness of chain, drive and friction
//! springs, the damping is `C = eta Lambda = c(M) - (eta K / k) e_1 e_1'` with
//! `c(mu) = (eta / k)(mu - k_t)`: in the modes of `M` it is diagonal but for the drive's
//! own spring, which acts as a small force `(eta K / k) v_1` on block 1.
//!
//! Without that force each mode `(u_j, v_j)` is advanced by a matrix of two rows.
//! A left eigenvector `(1, w)` with eigenvalue `lambda` gives a coordinate `z = u + w v` that
//! is multiplied by `lambda` in every step; `|lambda| <= 1` within the stability of the
//! scheme. A pair of complex ones is one coordinate with `|lambda|^2 = 1 - c dt / m`,
//! two real ones are two. So `|z|` never grows by itself, and the small force adds
//! at most its largest kick times the number of steps, or times `1 / (1 - |lambda|)`.
//! The force on block `n` is `sum_j psi_jn (-(mu_j - k_t) u_j - c_j v_j) + (eta K / k) v_1 [n = 1]`, and
//! each bracket is at most a constant times `|z|`.

use asperity_model::Plan;

use crate::sweep::Sweeps;

/// Below this distance of a mode's eigenvalues, relative to its turn in a step,
/// it counts as critical: its coordinates tell too little of it.
const CRITICAL: f64 = 1e-6;

/// The modes of a stuck chain.
#[derive(Debug, Clone)]
pub(crate) struct Modes {
    sweeps: Sweeps,
    /// `|psi|`, mode by mode.
    magnitudes: Vec<f64>,
    /// `psi` by block, to project with.
    by_block: Vec<f64>,
    coordinates: Vec<Coordinate>,
    /// `(eta K / k)`.
    coupling: f64,
    projected_u: Vec<f64>,
    projected_v: Vec<f64>,
    weights: Vec<f64>,
}

/// How one mode's coordinates follow from it, and what they bound.
#[derive(Debug, Clone, Copy)]
enum Coordinate {
    /// One complex coordinate `u + (re + i im) v`; `fading` is `1 - |lambda|`.
    Complex { re: f64, im: f64, fading: f64, gain: f64, kick: f64 },
    /// Two real ones.
    Real { w: [f64; 2], fading: [f64; 2], gain: [f64; 2], kick: [f64; 2] },
}

impl Modes {
    /// The modes of a plan's chain; `None` where two coordinates of a mode all
    /// but coincide, at critical damping, and bound nothing.
    pub(crate) fn of(plan: &Plan, sweeps: Sweeps) -> Option<Modes> {
        let blocks = plan.blocks;
        let (k, eta, dt) = (plan.stiffness_n_per_m, plan.damping_kg_per_s, plan.grid.step_s());
        let (kt, m) = (plan.friction.interfacial_stiffness_n_per_m, plan.block_mass_kg);
        let mut diagonal: Vec<f64> =
            (0..blocks).map(|n| kt + if n == 0 || n + 1 == blocks { k } else { 2.0 * k }).collect();
        diagonal[0] += plan.drive.stiffness_n_per_m;
        let (values, shapes) = symmetric_tridiagonal(diagonal, vec![-k; blocks - 1])?;
        let coupling = eta * plan.drive.stiffness_n_per_m / k;
        let mut coordinates = Vec::with_capacity(blocks);
        for (j, mu) in values.into_iter().enumerate() {
            let stiffness = (mu - kt).max(0.0);
            let (damping, omega2) = (eta / k * stiffness / m, mu / m);
            // Eigenvalues 1 - x +- root of the two-row matrix, with `root^2 = x^2 - (omega dt)^2`:
            // written with small numbers throughout, since 1 would swallow their digits.
            let (rate, turn) = (damping * dt, omega2.sqrt() * dt);
            let x = (rate + turn * turn) / 2.0;
            let discriminant = (x - turn) * (x + turn);
            let root = discriminant.abs().sqrt();
            if root < CRITICAL * turn {
                return None;
            }
            let w = |offset: f64| (x - turn * turn + offset) / (dt * omega2);
            let (alpha, beta) = (stiffness, eta / k * stiffness);
            let push = dt / m * coupling * shapes[j * blocks].abs();
            let coordinate = if discriminant < 0.0 {
                let (re, im) = (w(0.0), root / (dt * omega2));
                let across = (beta - alpha * re) / im;
                Coordinate::Complex {
                    re,
                    im,
                    fading: rate / (1.0 + (1.0 - rate).sqrt()),
                    gain: (alpha * alpha + across * across).sqrt(),
                    kick: push * ((dt + re) * (dt + re) + im * im).sqrt(),
                }
            } else {
                let (w1, w2) = (w(-root), w(root));
                let across = (beta - alpha * w1) / (w1 - w2);
                // 1 - |lambda|, whichever sign lambda has.
                let fading = |lost: f64| lost.min(2.0 - lost);
                Coordinate::Real {
                    w: [w1, w2],
                    fading: [fading(x - root), fading(x + root)],
                    gain: [(alpha + across).abs(), across.abs()],
                    kick: [push * (dt + w1).abs(), push * (dt + w2).abs()],
                }
            };
            coordinates.push(coordinate);
        }
        let mut by_block = vec![0.0; blocks * blocks];
        for j in 0..blocks {
            for n in 0..blocks {
                by_block[n * blocks + j] = shapes[j * blocks + n];
            }
        }
        Some(Modes {
            sweeps,
            magnitudes: shapes.iter().map(|shape| shape.abs()).collect(),
            by_block,
            coordinates,
            coupling,
            projected_u: vec![0.0; blocks],
            projected_v: vec![0.0; blocks],
            weights: vec![0.0; blocks],
        })
    }

    /// Writes into `swing` how large the force on each block may become within
    /// `steps` steps from a residue `u, v`, whose velocity on block 1 never
    /// exceeds `first_velocity`.
    pub(crate) fn bound(&mut self, u: &[f64], v: &[f64], first_velocity: f64, steps: u64, swing: &mut [f64]) {
        self.sweeps.multiply(&mut self.projected_u, &self.by_block, u);
        self.sweeps.multiply(&mut self.projected_v, &self.by_block, v);
        let steps = steps as f64;
        let forced = |kick: f64, fading: f64| {
            let lasting = if fading > 0.0 { steps.min(1.0 / fading) } else { steps };
            kick * first_velocity * lasting
        };
        for (j, coordinate) in self.coordinates.iter().enumerate() {
            let (u, v) = (self.projected_u[j], self.projected_v[j]);
            self.weights[j] = match *coordinate {
                Coordinate::Complex { re, im, fading, gain, kick } => {
                    let (x, y) = (u + re * v, im * v);
                    gain * ((x * x + y * y).sqrt() + forced(kick, fading))
                }
                Coordinate::Real { w, fading, gain, kick } => {
                    (0..2).map(|i| gain[i] * ((u + w[i] * v).abs() + forced(kick[i], fading[i]))).sum()
                }
            };
        }
        self.sweeps.multiply(swing, &self.magnitudes, &self.weights);
        swing[0] += self.coupling * first_velocity;
    }
}

/// Most iterations that one eigenvalue may take; two or three are usual.
const MOST_ITERATIONS: usize = 60;

/// Eigenvalues and orthonormal eigenvectors, one after the other, of a symmetric
/// tridiagonal matrix: QL iteration with implicit shifts (Martin and Wilkinson
/// 1968). `None` if it does not converge.
fn symmetric_tridiagonal(mut diagonal: Vec<f64>, mut beside: Vec<f64>) -> Option<(Vec<f64>, Vec<f64>)> {
    let size = diagonal.len();
    beside.push(0.0);
    let mut vectors = vec![0.0; size * size];
    for n in 0..size {
        vectors[n * size + n] = 1.0;
    }
    for low in 0..size {
        let mut iterations = 0;
        loop {
            // A negligible entry beside the diagonal splits the matrix.
            let split = (low..size - 1)
                .find(|&n| beside[n].abs() <= f64::EPSILON * (diagonal[n].abs() + diagonal[n + 1].abs()));
            let high = split.unwrap_or(size - 1);
            if high == low {
                break;
            }
            iterations += 1;
            if iterations > MOST_ITERATIONS {
                return None;
            }
            let half = (diagonal[low + 1] - diagonal[low]) / (2.0 * beside[low]);
            let root = (half * half + 1.0).sqrt();
            let mut g = diagonal[high] - diagonal[low] + beside[low] / (half + root.copysign(half));
            let (mut sine, mut cosine, mut carried) = (1.0, 1.0, 0.0);
            let mut deflated = false;
            for n in (low..high).rev() {
                let f = sine * beside[n];
                let b = cosine * beside[n];
                let r = (f * f + g * g).sqrt();
                beside[n + 1] = r;
                if r == 0.0 {
                    diagonal[n + 1] -= carried;
                    beside[high] = 0.0;
                    deflated = true;
                    break;
                }
                sine = f / r;
                cosine = g / r;
                g = diagonal[n + 1] - carried;
                let t = (diagonal[n] - g) * sine + 2.0 * cosine * b;
                carried = sine * t;
                diagonal[n + 1] = g + carried;
                g = cosine * t - b;
                let (lower, upper) = vectors.split_at_mut((n + 1) * size);
                for (a, b) in lower[n * size..].iter_mut().zip(&mut upper[..size]) {
                    let (x, y) = (*a, *b);
                    *b = sine * x + cosine * y;
                    *a = cosine * x - sine * y;
                }
            }
            if !deflated {
                diagonal[low] -= carried;
                beside[low] = g;
                beside[high] = 0.0;
            }
        }
    }
    Some((diagonal, vectors))
}

#[cfg(test)]
mod tests {
    use super::symmetric_tridiagonal;

    #[test]
    fn free_chain_has_its_known_spectrum_and_orthonormal_modes() {
        let size = 37;
        let diagonal = (0..size).map(|n| if n == 0 || n == size - 1 { 1.0 } else { 2.0 }).collect();
        let (values, vectors) = symmetric_tridiagonal(diagonal, vec![-1.0; size - 1]).unwrap();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        for (j, value) in sorted.iter().enumerate() {
            let expected = 4.0 * (std::f64::consts::PI * j as f64 / (2.0 * size as f64)).sin().powi(2);
            assert!((value - expected).abs() < 1e-13, "{j}: {value} {expected}");
        }
        for a in 0..size {
            for b in 0..size {
                let dot: f64 = (0..size).map(|n| vectors[a * size + n] * vectors[b * size + n]).sum();
                assert!((dot - f64::from(u8::from(a == b))).abs() < 1e-13, "{a} {b}: {dot}");
            }
            let x = |n: usize| vectors[a * size + n];
            for n in 1..size - 1 {
                let product = 2.0 * x(n) - x(n - 1) - x(n + 1);
                assert!((product - values[a] * x(n)).abs() < 1e-13);
            }
        }
    }
}
