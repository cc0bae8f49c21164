//! The polynomials of a step's map that windows use.
//!
//! With `B = A - 1`, the linear part of `k` steps is a polynomial of `B`. Powers of `B` are a poor
//! basis: their terms grow before they cancel. Used instead are
//!
//! ```text
//! w_0 = w,  w_1 = X w_0,  w_{j+1} = 2 X w_j - sigma w_{j-1},    X = (B - centre) / focus,
//! ```
//!
//! These are Chebyshev polynomials of an ellipse that contains the eigenvalues of `B`. Its foci are
//! `centre +- focus` on the real axis (`sigma = 1`, where damping dominates the spectrum) or
//! `centre +- i focus` (`sigma = -1`, where vibration does; powers of `i` are absorbed, so that all numbers are
//! real). A term costs as much as a power of `B`, and far fewer are needed for as many steps.
//!
//! **Where the eigenvalues lie.** For an eigenvector `x` of unit length let `t = dt^2 x*Mx / m` and
//! `r = t + dt x*Cx / m`. Its eigenvalue solves `z^2 + r z + t = 0`. Stiffness and damping of the chain go
//! together, so all of them, for any set of stuck blocks, lie on the roots for `x*Cx = eta L`,
//! `x*Mx = k L + s`, with `0 <= L <= 4` and `0 <= s <= k_t + K`; radiation adds `e` to `x*Cx`, with
//! `0 <= e <= E`, and absorbing ends with `0 <= e <= Z`; clamped and joined ends leave `L` in its range. The ellipse only determines how many terms
//! are needed: each window is certified with the terms it actually uses.
//!
//! **Coefficients.** `A^i w = sum_j c_j(i) w_j`, with `c_0(0) = 1` and
//! `c(i + 1)` from `c(i)` by `A w_j = (1 + centre) w_j + (focus / 2)(w_{j+1} + sigma w_{j-1})`.
//! A window needs `sum_{l<i-1} (i - 1 - l) A^l`, whose coefficients `s_j(i)` are `c_j` summed up twice;
//! a third summation gives the sum of the states on the way.
//!
//! **What is left out.** Stopping before `w_J` satisfies the recurrence of the exact solution except for
//! `(focus / 2)(sigma c_J(i) w_{J-1} - c_{J-1}(i) w_J)` in each step. In a norm in which `A` does not
//! expand, what is left out of `A^i w` is therefore at most
//! `(focus / 2) sum_l (|c_J(l)| |w_{J-1}| + |c_{J-1}(l)| |w_J|)`. For the double sum this bound is summed
//! up twice as well.

use asperity_model::body::elastic::Chain;
use asperity_model::body::ends::absorbing_kg_per_s;

use crate::kernels::{self, Coefficients, FOLLOWED};
use crate::leap::cost::GRID_STEPS;
use crate::modes::propagator::Propagator;

/// Most terms of a window. A few more coefficients are computed, since `c_J` bounds what `J` terms leave
/// out.
pub(crate) const MOST_TERMS: usize = FOLLOWED - 16;

/// Longest window: bounds the tables.
pub(crate) const MOST_STEPS: u64 = 16_384;

/// Approximate ratio of successive window lengths.
const RATIO: f64 = 1.1;

/// Largest growth of the terms relative to the map itself, as an exponent: it bounds the digits lost by
/// cancellation.
const MOST_GROWTH: f64 = 4.0;

/// Share of the linear part that the full number of terms for a length omits. Most windows need fewer
/// terms, because only the truncation relative to the whole state matters.
const NEGLIGIBLE: f64 = 1e-14;

/// One possible length of a window. Arrays are indexed by term; a window uses as many entries as it has
/// terms, whichever length it ends with.
#[derive(Debug, Clone)]
pub(crate) struct Length {
    pub(crate) steps: u64,
    /// Most terms for this length.
    pub(crate) terms: usize,
    /// Largest `|c_j(i)|` for `i` up to `steps`.
    pub(crate) whole: [f64; FOLLOWED],
    /// Largest `|c_j(i)|` for `i` between the next shorter length and `steps`.
    pub(crate) last: [f64; FOLLOWED],
    /// Largest `|s_j(steps)|`.
    pub(crate) largest: f64,
    /// `(focus / 2) sum_{l<steps} |c_j(l)|`, and this summed up twice.
    sums: [[f64; MOST_TERMS + 1]; 2],
}

impl Length {
    /// Factors on the sizes of the last of `terms` terms and of the next one, which bound what is left
    /// out of `A^i w` for any `i` up to `steps`. They do not decrease with the number of steps.
    pub(crate) fn left_out(&self, terms: usize) -> [f64; 2] {
        [self.sums[0][terms], self.sums[0][terms - 1]]
    }

    /// Factors as [`Length::left_out`], for the double sum.
    pub(crate) fn left_out_of_sum(&self, terms: usize) -> [f64; 2] {
        [self.sums[1][terms], self.sums[1][terms - 1]]
    }

    /// Bounds on what is left out of the double sum, of displacements and of velocities, from the sizes
    /// of the last of `terms` terms and of the next one.
    pub(crate) fn left_out_of(&self, terms: usize, ends: [[f64; 2]; 2]) -> [f64; 2] {
        let factors = self.left_out_of_sum(terms);
        [0, 1].map(|part| factors[0] * ends[0][part] + factors[1] * ends[1][part])
    }
}

/// The basis for a step's map, and its coefficients; without lengths by default, for maps that are not affine.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chebyshev {
    pub(crate) centre: f64,
    pub(crate) focus: f64,
    pub(crate) sigma: f64,
    /// In ascending order of steps; empty if the time step is too coarse for windows.
    pub(crate) lengths: Vec<Length>,
    /// `s_j` for every [`GRID_STEPS`]-th number of steps, from 0.
    double_sums: Vec<[f64; FOLLOWED]>,
    /// `sum_{l<i} s_j(l)` for the same numbers of steps.
    triple_sums: Vec<[f64; FOLLOWED]>,
}

impl Chebyshev {
    pub(crate) fn of(map: &Propagator) -> Chebyshev {
        let (ellipse, longest) = Ellipse::best(&spectrum(map));
        let mut basis = Chebyshev {
            centre: ellipse.centre,
            focus: ellipse.focus,
            sigma: ellipse.sigma,
            ..Chebyshev::default()
        };
        let mut steps = vec![];
        let mut next = (longest.min(MOST_STEPS as f64) / GRID_STEPS as f64).floor();
        while next >= 1.0 {
            steps.push(next as u64 * GRID_STEPS);
            next = (next / RATIO).floor().min(next - 1.0);
        }
        steps.reverse();
        basis.tabulate(&steps, &ellipse);
        basis
    }

    /// Bytes of memory used.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.lengths) + size_of_val(&*self.double_sums) + size_of_val(&*self.triple_sums)
    }

    /// `s_j` of a number of steps on the grid.
    pub(crate) fn double_sum(&self, steps: u64) -> &[f64; FOLLOWED] {
        &self.double_sums[(steps / GRID_STEPS) as usize]
    }

    /// `sum_{l<steps} s_j(l)` of a number of steps on the grid.
    pub(crate) fn triple_sum(&self, steps: u64) -> &[f64; FOLLOWED] {
        &self.triple_sums[(steps / GRID_STEPS) as usize]
    }

    /// Advances the coefficients step by step, and stores the extremes and sums that lengths need.
    fn tabulate(&mut self, lengths: &[u64], ellipse: &Ellipse) {
        let mut c = Coefficients::of_no_step(self.centre, self.focus, self.sigma);
        let mut done = 0;
        for i in 0..=lengths.last().copied().unwrap_or(0) {
            // The coefficients are now those of `i` steps.
            if i % GRID_STEPS == 0 {
                self.double_sums.push(c.double);
                self.triple_sums.push(c.triple);
            }
            if lengths.get(done) == Some(&i) {
                let terms = ellipse.terms(i as f64).min(MOST_TERMS);
                let half = self.focus / 2.0;
                self.lengths.push(Length {
                    steps: i,
                    terms,
                    whole: c.whole,
                    last: c.last,
                    largest: c.double.iter().fold(0.0, |max, s: &f64| max.max(s.abs())),
                    sums: [0, 2].map(|order| std::array::from_fn(|j| half * c.sums[order][j])),
                });
                c.last = c.now.map(f64::abs);
                done += 1;
            }
            kernels::next_coefficients(&mut c);
        }
    }
}

/// A point of the complex plane.
type Point = (f64, f64);

/// A dense sample of `B`'s spectrum in the upper half plane.
fn spectrum(map: &Propagator) -> Vec<Point> {
    const ALONG: u32 = 64;
    let (dt, m) = (map.step_s, map.block_mass_kg);
    let chain = &map.chain;
    let held = map.stiffest_spring_n_per_m + map.stiffest_drive_n_per_m;
    let mut points = Vec::new();
    let shares = [0.0, 0.25, 0.5, 0.75, 1.0];
    // Without radiation its five shares are the same.
    let radiation_kg_per_s = map.radiation_kg_per_s + absorbing_kg_per_s(&map.end_bonds);
    let radiating = if radiation_kg_per_s > 0.0 { &shares[..] } else { &shares[..1] };
    for (share, radiating) in shares.iter().flat_map(|share| radiating.iter().map(move |of| (share, of))) {
        for along in 0..=ALONG {
            let x = f64::from(along) / f64::from(ALONG);
            let l = Chain::LARGEST_EIGENVALUE * x * x;
            let t = dt * dt * (chain.stiffness_n_per_m * l + share * held) / m;
            let radiated = dt * (radiating * radiation_kg_per_s) / m;
            let r = t + dt * chain.damping_kg_per_s * l / m + radiated;
            let discriminant = r * r / 4.0 - t;
            let root = discriminant.abs().sqrt();
            if discriminant < 0.0 {
                points.push((-r / 2.0, root));
            } else {
                points.push((-r / 2.0 - root, 0.0));
                points.push((-r / 2.0 + root, 0.0));
            }
        }
    }
    points
}

/// An ellipse given by its foci, and how far around them the spectrum extends.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    centre: f64,
    focus: f64,
    sigma: f64,
    /// Sum of the half axes of the confocal ellipse through the outermost
    /// eigenvalue, relative to `focus`.
    rho: f64,
}

impl Ellipse {
    /// The ellipse that covers most steps with [`MOST_TERMS`], and that number of steps.
    fn best(spectrum: &[Point]) -> (Ellipse, f64) {
        let left = spectrum.iter().fold(0.0, |least: f64, point| least.min(point.0));
        let high = spectrum.iter().fold(0.0, |most: f64, point| most.max(point.1));
        let size = high.max(-left);
        let mut best = None;
        for beyond in [0.0, 0.01, 0.02, 0.05, 0.1, 0.2] {
            let right = beyond * size;
            for share in [0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0] {
                for sigma in [1.0, -1.0] {
                    // Rounded so that `1 + centre` is exact.
                    let centre = (1.0 + (left + right) / 2.0) - 1.0;
                    let focus = share * if sigma > 0.0 { (right - left) / 2.0 } else { high };
                    if focus < 0.1 * size {
                        continue;
                    }
                    let mut ellipse = Ellipse { centre, focus, sigma, rho: 1.0 };
                    ellipse.rho =
                        spectrum.iter().fold(1.0, |rho: f64, point| rho.max(ellipse.rho_of(*point)));
                    let reach = ellipse.reach();
                    if best.is_none_or(|(_, most)| reach > most) {
                        best = Some((ellipse, reach));
                    }
                }
            }
        }
        best.expect("a chain has stiffness: its spectrum is more than a point")
    }

    /// Sum of the half axes, relative to the focus, of the confocal ellipse through
    /// a point: `|x + sqrt(x^2 - 1)|` with `x` the point in units of the foci.
    fn rho_of(&self, point: Point) -> f64 {
        let (re, im) = ((point.0 - self.centre) / self.focus, point.1 / self.focus);
        // Rotated, so that foci on the imaginary axis become real.
        let (re, im) = if self.sigma > 0.0 { (re, im) } else { (im, re) };
        let axes = ((re + 1.0) * (re + 1.0) + im * im).sqrt() + ((re - 1.0) * (re - 1.0) + im * im).sqrt();
        // The sum of the distances to the foci is twice the semi-major axis.
        let long = (axes / 2.0).max(1.0);
        long + (long * long - 1.0).max(0.0).sqrt()
    }

    /// Largest number of steps for which [`MOST_TERMS`] suffice.
    fn reach(&self) -> f64 {
        let growth = libm::log(self.farthest(self.rho));
        let (mut low, mut high) = (1.0f64, if growth > 0.0 { MOST_GROWTH / growth } else { 1e9 });
        if self.terms(high) <= MOST_TERMS {
            return high;
        }
        while high > 1.02 * low {
            let middle = (low * high).sqrt();
            if self.terms(middle) <= MOST_TERMS {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// The largest `|1 + z|` on a confocal ellipse.
    fn farthest(&self, rho: f64) -> f64 {
        let (long, short) = (self.focus * (rho + 1.0 / rho) / 2.0, self.focus * (rho - 1.0 / rho) / 2.0);
        let (across, up) = if self.sigma > 0.0 { (long, short) } else { (short, long) };
        // At the vertices, and at points between them.
        let corner = std::f64::consts::FRAC_1_SQRT_2;
        [(across, 0.0), (-across, 0.0), (0.0, up), (corner * across, corner * up)]
            .into_iter()
            .map(|(x, y)| (1.0 + self.centre + x, y))
            .fold(0.0, |most: f64, (x, y)| most.max((x * x + y * y).sqrt()))
    }

    /// Number of terms needed for `steps` steps, by the decay of the coefficients of `(1 + z)^steps`:
    /// each is at most the maximum of that on a larger confocal ellipse, over the ellipse's `rho^j`,
    /// times the `rho^j` to which a term may have grown.
    fn terms(&self, steps: f64) -> usize {
        let mut fewest = f64::INFINITY;
        let mut log_ratio = 0.1;
        while log_ratio < 20.0 {
            let growth = steps * libm::log(self.farthest(self.rho * libm::exp(log_ratio)));
            fewest = fewest.min((growth - libm::log(NEGLIGIBLE)) / log_ratio);
            log_ratio *= 1.3;
        }
        (fewest.ceil() as usize).max(4)
    }
}
