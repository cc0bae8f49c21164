//! The modes of a stuck chain: coordinates in which its map is a multiplication.
//!
//! With `M` the stiffness of chain, drive and friction springs and `C` the damping,
//! a mode's displacements `x` are multiplied by `1 + z` in every step where
//!
//! ```text
//! [z^2 + z (dt / m) C + (1 + z)(dt^2 / m) M] x = 0,
//! ```
//!
//! and its velocities, in units of `1 / dt`, are `z / (1 + z) x`. The matrix is symmetric, so `x` also
//! determines the coordinate that belongs to the mode: it is `P u + (x - P) v dt` with
//! `P = -(dt^2 / m) M x / z`, divided by its value on the mode itself.
//!
//! The matrix is also tridiagonal, so its eigenvalues are found without forming it: Ehrlich and Aberth's
//! iteration for all roots at once (Aberth 1973), with the determinant's logarithmic derivative from its
//! pivots, and eigenvectors from pivots from both ends that meet where they fit worst (Parlett and
//! Dhillon 1997).
//!
//! The results are checked: every eigenvalue by how far it would still move ([`SETTLED`]), and modes and
//! coordinates by their product, which must be the identity to within [`DEFECT`]. A chain that fails has
//! no stored modes, as at critical damping, where two modes coincide.

pub(crate) mod complex;
pub(crate) mod nonuniform_cosines;
pub(crate) mod operator_cache;
pub(crate) mod propagator;
pub(crate) mod slow_modes;
pub(crate) mod standing_waves;

use std::borrow::Cow;
use std::sync::Arc;

use asperity_model::body::ends::EndBond;

use crate::kernels;
use crate::modes::complex::{Complex, Functions};
use crate::modes::propagator::Propagator;

/// Largest deviation of modes times coordinates from the identity.
const DEFECT: f64 = 1e-11;

/// How far an eigenvalue may still move, relative to itself. Over 10^8 steps that changes a mode's phase
/// no more than the rounding of the plain stepper does.
const SETTLED: f64 = 1e-13;

/// Most rounds of the iteration; some ten are usual.
const MOST_ROUNDS: usize = 100;

/// Binary digits of a number of steps.
const BITS: usize = 64;

/// The tridiagonal matrix of a chain as a function of `z`.
struct Pencil {
    /// `(dt^2 / m) M` and `(dt / m) C` on the diagonal, and the magnitudes beside it.
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    stiffness_beside: f64,
    damping_beside: f64,
}

impl Pencil {
    fn of(map: &Propagator) -> Pencil {
        let Propagator { step_s: dt, block_mass_kg: m, chain, drive_n_per_m: drive, .. } = map;
        let (by_stiffness, by_damping) = (dt * dt / m, dt / m);
        let elastic = map.elastic();
        // Of walls; a chain whose ends are joined has no such matrix.
        let at_wall = |n: usize, of: fn(&EndBond) -> f64| {
            let bonds = map.end_bonds.iter().filter(|bond| bond.block == n);
            bonds.map(of).sum::<f64>()
        };
        let held = |n: usize| map.springs_n_per_m[n] + drive[n] + at_wall(n, |bond| bond.stiffness_n_per_m);
        let damped =
            |n: usize| elastic.damping_diagonal_kg_per_s(n) + at_wall(n, |bond| bond.damping_kg_per_s);
        Pencil {
            stiffness: (0..map.blocks())
                .map(|n| by_stiffness * (held(n) + elastic.diagonal_n_per_m(n)))
                .collect(),
            damping: (0..map.blocks()).map(|n| by_damping * damped(n)).collect(),
            stiffness_beside: by_stiffness * chain.stiffness_n_per_m,
            damping_beside: by_damping * chain.damping_kg_per_s,
        }
    }

    fn diagonal(&self, n: usize, z: Complex) -> Complex {
        z * z + z.scale(self.damping[n] + self.stiffness[n]) + Complex::new(self.stiffness[n], 0.0)
    }

    /// Derivative of the diagonal with respect to `z`.
    fn diagonal_slope(&self, n: usize, z: Complex) -> Complex {
        z.scale(2.0) + Complex::new(self.damping[n] + self.stiffness[n], 0.0)
    }

    fn beside(&self, z: Complex) -> Complex {
        z.scale(-self.damping_beside - self.stiffness_beside) + Complex::new(-self.stiffness_beside, 0.0)
    }

    /// The logarithmic derivative of the determinant.
    fn log_slope(&self, z: Complex) -> Complex {
        let beside = self.beside(z);
        let square = beside * beside;
        let square_slope = beside.scale(-2.0 * (self.damping_beside + self.stiffness_beside));
        let (mut pivot, mut slope) = (self.diagonal(0, z), self.diagonal_slope(0, z));
        let mut sum = slope / pivot;
        for n in 1..self.stiffness.len() {
            // pivot = diagonal - beside^2 / pivot before
            let ratio = Complex::ONE / pivot;
            slope = self.diagonal_slope(n, z) - (square_slope - square * slope * ratio) * ratio;
            pivot = self.diagonal(n, z) - square * ratio;
            sum += slope / pivot;
        }
        sum
    }

    /// An approximate null vector of the matrix.
    fn null_vector(&self, z: Complex) -> Vec<Complex> {
        let blocks = self.stiffness.len();
        let beside = self.beside(z);
        let square = beside * beside;
        let mut below = vec![self.diagonal(0, z)];
        for n in 1..blocks {
            below.push(self.diagonal(n, z) - square / below[n - 1]);
        }
        let mut above = vec![self.diagonal(blocks - 1, z); blocks];
        for n in (0..blocks - 1).rev() {
            above[n] = self.diagonal(n, z) - square / above[n + 1];
        }
        let misfit = |n: usize| (below[n] + above[n] - self.diagonal(n, z)).size();
        let meet = (0..blocks).min_by(|&a, &b| misfit(a).total_cmp(&misfit(b))).unwrap_or(0);
        let mut x = vec![Complex::ZERO; blocks];
        x[meet] = Complex::ONE;
        for n in (0..meet).rev() {
            x[n] = Complex::ZERO - beside * x[n + 1] / below[n];
        }
        for n in meet + 1..blocks {
            x[n] = Complex::ZERO - beside * x[n - 1] / above[n];
        }
        x
    }

    /// The distance that an eigenvalue would still move, from Rayleigh's quotient with its vector.
    fn correction(&self, z: Complex, x: &[Complex]) -> Complex {
        let beside = self.beside(z);
        let beside_slope = Complex::from(-self.damping_beside - self.stiffness_beside);
        let (mut value, mut slope) = (Complex::ZERO, Complex::ZERO);
        for n in 0..x.len() {
            let square = x[n] * x[n];
            value += square * self.diagonal(n, z);
            slope += square * self.diagonal_slope(n, z);
            if n > 0 {
                let product = (x[n] * x[n - 1]).scale(2.0);
                value += product * beside;
                slope += product * beside_slope;
            }
        }
        value / slope
    }

    /// `(dt^2 / m) M x`.
    fn stiffness_times(&self, x: &[Complex]) -> Vec<Complex> {
        (0..x.len())
            .map(|n| {
                let left = if n > 0 { x[n - 1] } else { Complex::ZERO };
                let right = if n + 1 < x.len() { x[n + 1] } else { Complex::ZERO };
                x[n].scale(self.stiffness[n]) - (left + right).scale(self.stiffness_beside)
            })
            .collect()
    }

    /// All eigenvalues: those with positive imaginary part, one for each pair, and
    /// the real ones. `None` if the iteration does not converge to such a set.
    fn eigenvalues(&self) -> Option<(Vec<Complex>, Vec<f64>)> {
        let blocks = self.stiffness.len();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / blocks as f64;
        // Initial guesses: the modes of a free chain whose blocks all have the same springs.
        let held =
            mean(&self.stiffness) - 2.0 * self.stiffness_beside * (blocks as f64 - 1.0) / blocks as f64;
        let mut roots = Vec::with_capacity(2 * blocks);
        for j in 0..blocks {
            let half = std::f64::consts::PI * j as f64 / (2.0 * blocks as f64);
            let shape = 4.0 * libm::sin(half) * libm::sin(half);
            let t = held + self.stiffness_beside * shape;
            let r = t + self.damping_beside * shape;
            let discriminant = r * r / 4.0 - t;
            let root = discriminant.abs().sqrt();
            // Off the real axis and apart from each other, so that roots can become real or complex.
            let off = Complex::new(0.0, 1e-3 * t.sqrt());
            if discriminant.abs() < 0.01 * t {
                roots.push(Complex::new(-r / 2.0 + root, 0.0) + off);
                roots.push(Complex::new(-r / 2.0 - root, 0.0) - off);
            } else if discriminant < 0.0 {
                roots.push(Complex::new(-r / 2.0, root));
                roots.push(Complex::new(-r / 2.0, -root));
            } else {
                roots.push(Complex::new(-t / (r / 2.0 + root), 0.0));
                roots.push(Complex::new(-r / 2.0 - root, 0.0));
            }
        }
        let mut settled = vec![false; roots.len()];
        for _ in 0..MOST_ROUNDS {
            let mut moving = false;
            for i in 0..roots.len() {
                if settled[i] {
                    continue;
                }
                let z = roots[i];
                let others = (0..roots.len()).filter(|&j| j != i);
                let push = others.fold(Complex::ZERO, |sum, j| sum + Complex::ONE / (z - roots[j]));
                let step = Complex::ONE / (self.log_slope(z) - push);
                if !(step.re.is_finite() && step.im.is_finite()) {
                    // The derivative is undefined at the root itself.
                    settled[i] = true;
                    continue;
                }
                roots[i] = z - step;
                // Convergence is cubic: the remaining error after this step is below rounding.
                settled[i] = step.size() < 1e-9 * z.size();
                moving |= !settled[i];
            }
            if !moving {
                break;
            }
        }
        if !settled.iter().all(|&settled| settled) {
            return None;
        }
        let is_real = |z: &Complex| z.im.abs() < 1e-9 * z.size();
        let real: Vec<f64> = roots.iter().filter(|z| is_real(z)).map(|z| z.re).collect();
        let complex: Vec<Complex> = roots.into_iter().filter(|z| !is_real(z) && z.im > 0.0).collect();
        (real.len() + 2 * complex.len() == 2 * blocks).then_some((complex, real))
    }
}

/// The modes of a stuck chain. Coordinates are complex; the first `pairs` of them represent a mode and
/// its conjugate, the others are real.
#[derive(Debug)]
pub(crate) struct Modes {
    blocks: usize,
    pairs: usize,
    /// Unit of time that makes velocities comparable with displacements.
    unit_s: f64,
    /// From a state to the real parts of coordinates and the imaginary ones of pairs, and back: matrices stored by
    /// columns.
    to: Vec<f64>,
    from_re: Vec<f64>,
    from_im: Vec<f64>,
    /// Largest force on each block by each mode of amplitude 1, stored by modes.
    force_n: Vec<f64>,
    /// Largest ratio of the norm `sqrt(I)` to the Euclidean norm, between two states.
    spread: f64,
    pub(crate) powers: Powers,
}

/// One complex number per mode.
#[derive(Debug, Clone, Default)]
pub(crate) struct Coordinates {
    pub(crate) re: Vec<f64>,
    pub(crate) im: Vec<f64>,
}

impl Modes {
    /// The modes of the stuck chain; `None` if they do not span its states well enough, or its ends are joined.
    pub(crate) fn of(map: &Propagator) -> Option<Arc<Modes>> {
        if map.end_bonds.iter().any(|bond| bond.other.is_some()) {
            return None;
        }
        let blocks = map.blocks();
        let pencil = Pencil::of(map);
        let (complex, real) = pencil.eigenvalues()?;
        let pairs = complex.len();
        let values: Vec<Complex> = complex.into_iter().chain(real.into_iter().map(Complex::from)).collect();
        let (count, rows) = (values.len(), values.len() + pairs);
        let dt = map.step_s;
        let unit_s = (map.block_mass_kg
            / (map.elastic().spectral_bound_n_per_m() + map.stiffest_spring_n_per_m))
            .sqrt();
        let mut modes = Modes {
            blocks,
            pairs,
            unit_s,
            to: vec![0.0; rows * 2 * blocks],
            from_re: Vec::with_capacity(count * 2 * blocks),
            from_im: Vec::with_capacity(pairs * 2 * blocks),
            force_n: Vec::with_capacity(count * blocks),
            spread: ((map.elastic().spectral_bound_n_per_m() + map.stiffest_drive_n_per_m)
                / map.springs_n_per_m.iter().copied().fold(f64::INFINITY, f64::min)
                + 1.0)
                .sqrt(),
            powers: Powers::of(&values),
        };
        let driven = &map.drive_n_per_m;
        for (e, &z) in values.iter().enumerate() {
            let x = pencil.null_vector(z);
            let settled = pencil.correction(z, &x).size() <= SETTLED * z.size();
            if !settled {
                return None;
            }
            let by_velocity = z / (Complex::ONE + z);
            let project: Vec<Complex> =
                pencil.stiffness_times(&x).into_iter().map(|held| Complex::ZERO - held / z).collect();
            let own = (0..blocks).fold(Complex::ZERO, |sum, n| {
                sum + project[n] * x[n] + (x[n] - project[n]) * by_velocity * x[n]
            });
            for n in 0..blocks {
                let (u, v) = (project[n] / own, (x[n] - project[n]).scale(dt / unit_s) / own);
                for (column, of) in [(n, u), (blocks + n, v)] {
                    modes.to[column * rows + e] = of.re;
                    if e < pairs {
                        modes.to[column * rows + count + e] = of.im;
                    }
                }
            }
            // A pair adds its coordinate's part and the conjugate of that: twice the real part.
            let times = if e < pairs { 2.0 } else { 1.0 };
            let velocity: Vec<Complex> = x.iter().map(|x| (*x * by_velocity).scale(1.0 / dt)).collect();
            let state = || x.iter().copied().chain(velocity.iter().map(|v| v.scale(unit_s)));
            modes.from_re.extend(state().map(|y| times * y.re));
            if e < pairs {
                modes.from_im.extend(state().map(|y| -times * y.im));
            }
            modes.force_n.extend((0..blocks).map(|n| {
                if map.detaches_by_spring {
                    return times * x[n].scale(map.springs_n_per_m[n]).size();
                }
                let drive = x[n].scale(-driven[n]);
                let walls = map.end_bonds.iter().filter(|bond| bond.block == n);
                let walls = walls.fold(Complex::ZERO, |sum, bond| {
                    let pull = x[n].scale(bond.stiffness_n_per_m) + velocity[n].scale(bond.damping_kg_per_s);
                    sum - pull
                });
                times * (map.elastic().pull_n(&x, &velocity, n) + drive + walls).size()
            }));
        }
        (modes.powers.none_grows() && modes.span_states()).then(|| Arc::new(modes))
    }

    /// Bytes of memory used.
    pub(crate) fn bytes(&self) -> usize {
        let Modes { to, from_re, from_im, force_n, powers, .. } = self;
        let numbers: usize = [to, from_re, from_im, force_n].iter().map(|matrix| matrix.len()).sum();
        (numbers + 2 * BITS * powers.count()) * size_of::<f64>()
    }

    /// Bound on the share of a state, in the norm `sqrt(I)`, that its coordinates may miss, from the
    /// largest accepted deviation of each.
    pub(crate) fn missed(&self) -> f64 {
        (2 * self.blocks) as f64 * DEFECT * self.spread
    }

    /// Whether modes times coordinates is the identity within [`DEFECT`].
    fn span_states(&self) -> bool {
        let (rows, size) = (self.powers.count() + self.pairs, 2 * self.blocks);
        let mut back = vec![0.0; size];
        (0..size).all(|column| {
            // The coordinates of a unit vector are a column of the projection.
            let coordinates = self.coordinates(self.to[column * rows..][..rows].to_vec());
            self.compose(&coordinates, f64::NEG_INFINITY, &mut back);
            (0..size).all(|row| {
                let unit = if row < self.blocks { 1.0 } else { self.unit_s };
                (back[row] * unit - f64::from(u8::from(row == column))).abs() < DEFECT
            })
        })
    }

    /// A state's coordinates; displacements, then velocities.
    pub(crate) fn project(&self, state: &[f64]) -> Coordinates {
        let mut state = state.to_vec();
        for v in &mut state[self.blocks..] {
            *v *= self.unit_s;
        }
        let mut parts = vec![0.0; self.powers.count() + self.pairs];
        kernels::add_columns(&mut parts, &self.to, &state);
        self.coordinates(parts)
    }

    /// From all real parts and the imaginary parts of pairs.
    fn coordinates(&self, mut re: Vec<f64>) -> Coordinates {
        let mut im = re.split_off(self.powers.count());
        im.resize(re.len(), 0.0);
        Coordinates { re, im }
    }

    /// The state with these coordinates, without the last modes as long as they are no larger than
    /// `least`: those of short waves, which damping removes first.
    pub(crate) fn compose(&self, coordinates: &Coordinates, least: f64, state: &mut [f64]) {
        let modes = coordinates.count_above(least);
        let (size, pairs) = (state.len(), modes.min(self.pairs));
        let mut by_im = vec![0.0; size];
        state.fill(0.0);
        kernels::add_columns(state, &self.from_re[..modes * size], &coordinates.re[..modes]);
        kernels::add_columns(&mut by_im, &self.from_im[..pairs * size], &coordinates.im[..pairs]);
        for (y, im) in state.iter_mut().zip(by_im) {
            *y += im;
        }
        for v in &mut state[self.blocks..] {
            *v /= self.unit_s;
        }
    }

    /// The sum, over some steps, of the products of a block's velocities before and after each, given the coordinates at the
    /// start and their growth over these steps.
    ///
    /// With `v(i) = Re sum_m A_m l_m^i` and `l = 1 + z` a product is `Re sum_mn [A_m A_n l_n (l_m l_n)^i +
    /// A_m A_n* l_n* (l_m l_n*)^i] / 2`, and `sum_i (l_m l_n)^i = ((l_m l_n)^steps - 1) / (l_m l_n - 1)`, without adding to 1.
    pub(crate) fn products(&self, coordinates: &Coordinates, growth: &Coordinates, block: usize) -> f64 {
        let (size, row) = (2 * self.blocks, self.blocks + block);
        let amplitude = |m: usize| {
            let im = if m < self.pairs { -self.from_im[m * size + row] } else { 0.0 };
            let shape = Complex::new(self.from_re[m * size + row], im);
            (shape * coordinates.at(m)).scale(1.0 / self.unit_s)
        };
        let modes: Vec<[Complex; 3]> =
            (0..self.powers.count()).map(|m| [amplitude(m), self.powers.0[0].at(m), growth.at(m)]).collect();
        let conjugate = |x: Complex| Complex::new(x.re, -x.im);
        let mut sum = 0.0;
        for &[a, z, grown] in &modes {
            for other in &modes {
                for [b, y, grown_b] in [*other, other.map(conjugate)] {
                    let both = grown + grown_b + grown * grown_b;
                    sum += 0.5 * (a * b * (Complex::ONE + y) * both / (z + y + z * y)).re;
                }
            }
        }
        sum
    }

    /// Writes into `swing` how large the force on each block may become from now on.
    pub(crate) fn bound(&self, coordinates: &Coordinates, swing: &mut [f64]) {
        swing.fill(0.0);
        kernels::add_columns(swing, &self.force_n, &coordinates.sizes());
    }
}

/// `(1 + z)^(2^p) - 1` of every mode, for all `p` that a number of steps may need.
#[derive(Debug, Clone, Default)]
pub(crate) struct Powers(Arc<[Coordinates]>);

impl Powers {
    pub(crate) fn of(values: &[Complex]) -> Powers {
        let mut power: Coordinates = values.iter().copied().collect();
        let powers = (0..BITS).map(|_| {
            let square = power.clone();
            power.compound(&square);
            square
        });
        Powers(powers.collect())
    }

    /// Number of modes.
    fn count(&self) -> usize {
        self.0[0].re.len()
    }

    /// Whether no mode grows, within rounding.
    pub(crate) fn none_grows(&self) -> bool {
        let Coordinates { re, im } = &self.0[0];
        // |1 + z|^2 - 1
        re.iter().zip(im).all(|(re, im)| 2.0 * re + re * re + im * im <= 4.0 * f64::EPSILON)
    }

    /// `(1 + z)^steps - 1` of every mode.
    pub(crate) fn growth(&self, steps: u64) -> Coordinates {
        let mut growth = Coordinates::zero(self.count());
        for p in (0..BITS).filter(|p| steps >> p & 1 == 1) {
            growth.compound(&self.0[p]);
        }
        growth
    }

    /// Coordinates a number of steps later.
    pub(crate) fn grown(&self, coordinates: &Coordinates, steps: u64) -> Coordinates {
        let mut grown = coordinates.clone();
        grown.grow_by(&self.growth(steps));
        grown
    }
}

/// Coordinates at the start of a jump and later in it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Grown {
    pub(crate) start: Coordinates,
    /// After a number of steps, those at the last sample.
    sampled: (u64, Coordinates),
    /// How they grow over the last interval between samples; mostly these are equal.
    interval: (u64, Coordinates),
}

impl Grown {
    pub(crate) fn begin(&mut self, start: Coordinates) {
        self.sampled = (0, start.clone());
        self.start = start;
    }

    /// Those `into` steps after the start. Only samples, which come in the order of time, advance from one to the next,
    /// which rounds differently: the end of a jump must not depend on the records.
    pub(crate) fn at(&mut self, powers: &Powers, into: u64, is_sample: bool) -> Cow<'_, Coordinates> {
        if !is_sample {
            return Cow::Owned(powers.grown(&self.start, into));
        }
        let steps = into - self.sampled.0;
        if self.interval.0 != steps || steps == 0 {
            self.interval = (steps, powers.growth(steps));
        }
        self.sampled.0 = into;
        self.sampled.1.grow_by(&self.interval.1);
        Cow::Borrowed(&self.sampled.1)
    }
}

impl FromIterator<Complex> for Coordinates {
    fn from_iter<I: IntoIterator<Item = Complex>>(numbers: I) -> Coordinates {
        let (re, im) = numbers.into_iter().map(|z| (z.re, z.im)).unzip();
        Coordinates { re, im }
    }
}

impl Coordinates {
    pub(crate) fn zero(modes: usize) -> Coordinates {
        Coordinates { re: vec![0.0; modes], im: vec![0.0; modes] }
    }

    pub(crate) fn at(&self, mode: usize) -> Complex {
        Complex::new(self.re[mode], self.im[mode])
    }

    /// How large each is.
    pub(crate) fn sizes(&self) -> Vec<f64> {
        self.re.iter().zip(&self.im).map(|(re, im)| (re * re + im * im).sqrt()).collect()
    }

    /// Number of modes up to the last one that is larger than `least`.
    pub(crate) fn count_above(&self, least: f64) -> usize {
        let mut numbers = self.re.iter().zip(&self.im);
        numbers.rposition(|(re, im)| (re * re + im * im).sqrt() > least).map_or(0, |last| last + 1)
    }

    /// The growth over two intervals one after the other.
    fn compound(&mut self, growth: &Coordinates) {
        kernels::compound([&mut self.re, &mut self.im], [&growth.re, &growth.im]);
    }

    /// Multiplies by `1 + growth`.
    pub(crate) fn grow_by(&mut self, growth: &Coordinates) {
        kernels::grow([&mut self.re, &mut self.im], [&growth.re, &growth.im]);
    }
}
