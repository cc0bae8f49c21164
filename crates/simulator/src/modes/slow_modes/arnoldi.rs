//! The slow modes of a stuck lattice, which decay last.
//!
//! With `K = (dt^2 / m) M` and `D = (dt / m) C` a step without forcing turns `(u, w)`, `w = dt v`,
//! into `w' = w - K u - D w`, `u' = u + w'`. A mode is multiplied by `1 + s`, and then
//! `w = s / (1 + s) u` and
//!
//! ```text
//! [s^2 + s (D + K) + K] x = 0,
//! ```
//!
//! which is symmetric. Arnoldi's iteration finds the modes that decay last first in an inverse of the map
//! ([`super::inverse`]).
//!
//! Since the pencil is symmetric, `x` gives the coordinate of a mode as well: as for a chain
//! ([`crate::modes`]) it is `x (w - K (u - w) / s)` over its value on the mode itself.
//!
//! **Their order.** What decays last comes first. A strongly damped lattice has short waves that creep back without
//! swinging, as slow by `|s|` as long waves that swing for ten times as long; so modes are ordered by their decay.
//! In slabs they are ordered by `|s|`, on which the bits of their results rest.
//!
//! **What they leave out.** Jumps do not rely on how accurate the modes are; two numbers bound the error of
//! a state that is composed of them a number of steps later. The residue that they do not span has a norm
//! that never grows ([`crate::leap::norms`]). A mode whose image is off by `(e, e)`,
//! `e = -K x - (D + s) s / (1 + s) x`, adds in every step `sqrt(m) |e| / dt` in this norm, times what is
//! left of its coordinate. Modes with too large an error are rejected.

use asperity_model::mixed;

use crate::kernels;
use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::eigen::Hessenberg;
use crate::modes::slow_modes::inverse::Inverse;
use crate::modes::slow_modes::stuck::StuckLattice;
use crate::modes::{Coordinates, Powers};
use crate::records::stop::Stop;

/// Largest relative error of the image of an accepted mode. Every jump counts the resulting error, so the
/// limit only trades the number of modes against the wait before a jump.
const DEFECT: f64 = 1e-6;

/// The search ends after this number of eigenvalues without an accepted mode.
const MOST_MISSING: usize = 6;

/// Growth in a step, of the square of a size, that rounding may pretend.
const UNDAMPED: f64 = 64.0 * f64::EPSILON;

/// Solves before the iteration, which remove the fastest modes from its start vector.
const FIRST_SOLUTIONS: usize = 2;

/// Slow modes of a stuck lattice, of one class of its motions.
#[derive(Debug, Default)]
pub(crate) struct SlowModes {
    class: usize,
    /// Freedoms in the basis of the class.
    freedoms: usize,
    /// Real and imaginary part of the displacements of each mode, one after the other.
    shapes: Vec<f64>,
    /// `s` of each.
    pub(crate) rates: Vec<Complex>,
    /// `w` over `u` of each, `s / (1 + s)`.
    velocities: Vec<Complex>,
    /// The value of the coordinate on the mode itself, inverted.
    own: Vec<Complex>,
    /// How often the real part counts: 2 for a mode that represents its conjugate too.
    pub(crate) weights: Vec<f64>,
    /// By how much its image is off, in the norm `sqrt(I)`, for a coordinate of size 1 and its
    /// conjugate.
    pub(crate) defects: Vec<f64>,
    pub(crate) powers: Powers,
    /// Relative decay per step of the next modes, as the iteration estimates it: the residue decays about
    /// as fast.
    pub(crate) next_falls_by: f64,
}

impl SlowModes {
    /// Finds modes in `iterations` steps, the slowest first; `None` if there are none, or the stop comes.
    pub(crate) fn of(
        stuck: &StuckLattice,
        class: usize,
        iterations: usize,
        stop: &Stop<'_>,
    ) -> Option<SlowModes> {
        let (freedoms, is_over_area) = (stuck.classes()[class].size(), stuck.lattice.lanes > 1);
        let inverse = Inverse::of(stuck, class, stop)?;
        let most = if is_over_area { 2 * freedoms } else { 2 * freedoms - FIRST_SOLUTIONS };
        let (basis, map) = arnoldi(freedoms, &inverse, iterations.min(most))?;
        let values = map.eigenvalues(stop)?;
        let mut values: Vec<Complex> = values.into_iter().filter(|value| value.im <= 0.0).collect();
        // A rate with a positive imaginary part has an eigenvalue with a negative one.
        if is_over_area {
            let falls_by = |value: &Complex| falls_by(inverse.rate(*value));
            // No motion of a stable lattice grows: what does is rounding, of values near 0.
            values.retain(|value| falls_by(value) >= -DEFECT);
            values.sort_by(|a, b| falls_by(a).total_cmp(&falls_by(b)));
        } else {
            values.sort_by(|a, b| b.size().total_cmp(&a.size()));
        }
        let mut modes = SlowModes { class, freedoms, next_falls_by: 1.0, ..SlowModes::default() };
        let mut missing = 0;
        for value in values {
            let rate = inverse.rate(value);
            if stop.look() {
                return None;
            }
            if !modes.accept(stuck, &basis, &map, [value, rate]) {
                missing += 1;
                modes.next_falls_by = modes.next_falls_by.min(falls_by(rate).abs());
                if missing == MOST_MISSING {
                    break;
                }
            }
        }
        modes.powers = Powers::of(&modes.rates);
        (!modes.rates.is_empty() && modes.powers.none_grows()).then_some(modes)
    }

    /// Accepts the mode of an eigenvalue, if it is accurate enough.
    fn accept(
        &mut self,
        stuck: &StuckLattice,
        basis: &[f64],
        map: &Hessenberg,
        [value, rate]: [Complex; 2],
    ) -> bool {
        let freedoms = self.freedoms;
        let coordinates = map.eigenvector(value);
        // From the first half, `t x`, to which the map was applied once more than to the second.
        let parts: [Vec<f64>; 2] =
            [coordinates.iter().map(|c| c.re).collect(), coordinates.iter().map(|c| c.im).collect()];
        let [mut re, mut im] = parts.map(|times| {
            let mut part = vec![0.0; freedoms];
            kernels::add_columns(&mut part, &basis[..map.size * freedoms], &times);
            part
        });
        let largest = re.iter().zip(&im).fold(0.0, |most: f64, (re, im)| most.max(re * re + im * im)).sqrt();
        let is_found = largest > 0.0;
        if !is_found {
            return false;
        }
        for x in re.iter_mut().chain(&mut im) {
            *x /= largest;
        }
        let (by_stiffness, by_damping) =
            (stuck.step_s * stuck.step_s / stuck.mass_kg, stuck.step_s / stuck.mass_kg);
        let [mut of_re, mut of_im] = [&re, &im].map(|part| stuck.products_in(self.class, part));
        for [stiff, damped] in [&mut of_re, &mut of_im] {
            stiff.iter_mut().for_each(|x| *x *= by_stiffness);
            damped.iter_mut().for_each(|x| *x *= by_damping);
        }
        let ([stiff_re, damped_re], [stiff_im, damped_im]) = (of_re, of_im);
        let both = [&re[..], &im].concat();
        // The products of `x` with `x`, `K x` and `D x`, without conjugates.
        let product = |of_re: &[f64], of_im: &[f64]| {
            let [[re_re, im_re], [re_im, im_im]] =
                [of_re, of_im].map(|of| [&re, &im].map(|part| kernels::product(part, of)));
            Complex::new(re_re - im_im, im_re + re_im)
        };
        let (square, stiff, damped) =
            (product(&re, &im), product(&stiff_re, &stiff_im), product(&damped_re, &damped_im));
        let mut s = rate;
        for _ in 0..3 {
            let value = s * s * square + s * (damped + stiff) + stiff;
            let slope = s * square.scale(2.0) + (damped + stiff);
            s -= value / slope;
        }
        let is_rate = s.re.is_finite() && s.im >= 0.0 && s.size() > 0.0;
        if !is_rate {
            return false;
        }
        // A mode that is not damped neither grows nor decays, but for rounding.
        let grows_by = s.re * (2.0 + s.re) + s.im * s.im;
        if grows_by > 0.0 && grows_by <= UNDAMPED {
            s.re = -s.im * s.im / (1.0 + (1.0 - s.im * s.im).sqrt());
        }
        // A real rate has real displacements, and no conjugate.
        let is_real = value.im == 0.0;
        if is_real != (s.im == 0.0) {
            return false;
        }
        let velocity = s / (Complex::ONE + s);
        let mut defect = 0.0;
        for n in 0..freedoms {
            let (x, damped) = (Complex::new(re[n], im[n]), Complex::new(damped_re[n], damped_im[n]));
            let e = Complex::new(stiff_re[n], stiff_im[n]) + velocity * (damped + s * x);
            defect += e.re * e.re + e.im * e.im;
        }
        let length: f64 = re.iter().zip(&im).map(|(re, im)| re * re + im * im).sum();
        let share = (defect / length).sqrt() / velocity.size();
        let is_near = share <= DEFECT;
        if !is_near {
            return false;
        }
        let weight = if is_real { 1.0 } else { 2.0 };
        self.shapes.extend(both);
        self.rates.push(s);
        self.velocities.push(velocity);
        let own = velocity * square - stiff / (s * (Complex::ONE + s));
        self.own.push(Complex::ONE / own);
        self.weights.push(weight);
        self.defects.push(weight * defect.sqrt() * stuck.mass_kg.sqrt() / stuck.step_s);
        true
    }

    /// The coordinates of a state without forcing, from `w` and `M (u - w)`.
    pub(crate) fn project(&self, stuck: &StuckLattice, w: &[f64], stiff: &[f64]) -> Coordinates {
        let count = self.rates.len();
        let by_stiffness = stuck.step_s * stuck.step_s / stuck.mass_kg;
        let motions = &stuck.classes()[self.class];
        let (w, stiff) = (motions.component(w), motions.component(stiff));
        let (mut of_w, mut of_stiff) = (vec![0.0; 2 * count], vec![0.0; 2 * count]);
        kernels::dots(&mut of_w, &self.shapes, &w);
        kernels::dots(&mut of_stiff, &self.shapes, &stiff);
        let of = |products: &[f64], m: usize| Complex::new(products[2 * m], products[2 * m + 1]);
        let coordinate =
            |m: usize| (of(&of_w, m) - of(&of_stiff, m).scale(by_stiffness) / self.rates[m]) * self.own[m];
        (0..count).map(coordinate).collect()
    }

    /// Adds the first `modes` modes with these coordinates to `u` and `w`.
    pub(crate) fn add(
        &self,
        stuck: &StuckLattice,
        coordinates: &Coordinates,
        modes: usize,
        u: &mut [f64],
        w: &mut [f64],
    ) {
        let (mut of_u, mut of_w) = (Vec::with_capacity(2 * modes), Vec::with_capacity(2 * modes));
        for m in 0..modes {
            let coordinate = coordinates.at(m);
            let (moving, weight) = (coordinate * self.velocities[m], self.weights[m]);
            of_u.extend([weight * coordinate.re, -weight * coordinate.im]);
            of_w.extend([weight * moving.re, -weight * moving.im]);
        }
        let shapes = &self.shapes[..2 * modes * self.freedoms];
        let motions = &stuck.classes()[self.class];
        for (all, times) in [(u, of_u), (w, of_w)] {
            if motions.are_all() {
                kernels::add_columns(all, shapes, &times);
            } else {
                let mut own = vec![0.0; self.freedoms];
                kernels::add_columns(&mut own, shapes, &times);
                motions.add(all, &own);
            }
        }
    }

    /// The displacements of all freedoms of the lattice in a mode, real and imaginary.
    pub(crate) fn shape(&self, stuck: &StuckLattice, mode: usize) -> [Vec<f64>; 2] {
        [0, 1].map(|part| {
            let own = &self.shapes[(2 * mode + part) * self.freedoms..][..self.freedoms];
            let mut all = vec![0.0; stuck.freedoms()];
            stuck.classes()[self.class].add(&mut all, own);
            all
        })
    }
}

/// By which share a mode falls in a step.
fn falls_by(rate: Complex) -> f64 {
    1.0 - (Complex::ONE + rate).size()
}

/// Vectors that a new one is made orthogonal to at once, while they are at hand.
const AT_ONCE: usize = 8;

/// Arnoldi's iteration: an orthonormal basis, and the map in it; `None` if the stiffness cannot be solved with, or the
/// stop comes.
fn arnoldi(freedoms: usize, inverse: &Inverse<'_>, iterations: usize) -> Option<(Vec<f64>, Hessenberg)> {
    // Both halves of the vectors, each in a matrix of its own.
    let mut halves = [0, 1].map(|_| Vec::with_capacity((iterations + 1) * freedoms));
    let number = |n: usize| mixed(n as u64) as f64 / u64::MAX as f64 - 0.5;
    let (mut a, mut b): (Vec<f64>, Vec<f64>) = (vec![0.0; freedoms], (0..freedoms).map(number).collect());
    let mut image = [a.clone(), b.clone()];
    for _ in 0..FIRST_SOLUTIONS {
        let [to_a, to_b] = &mut image;
        if !inverse.apply(&a, &b, to_a, to_b) {
            return None;
        }
        std::mem::swap(&mut a, to_a);
        std::mem::swap(&mut b, to_b);
    }
    let square = |a: &[f64], b: &[f64]| kernels::product(a, a) + kernels::product(b, b);
    let scale = 1.0 / square(&a, &b).sqrt();
    for (half, x) in halves.iter_mut().zip([&a, &b]) {
        half.extend(x.iter().map(|x| scale * x));
    }
    let mut map = Hessenberg::zero(iterations);
    let (mut products, mut more) = (vec![0.0; iterations], vec![0.0; iterations]);
    let mut size = iterations;
    for j in 0..iterations {
        let from = j * freedoms;
        let [of_a, of_b] = [0, 1].map(|half| &halves[half][from..][..freedoms]);
        if !inverse.apply(of_a, of_b, &mut a, &mut b) {
            return None;
        }
        let whole = square(&a, &b);
        for from in (0..=j).step_by(AT_ONCE) {
            let count = AT_ONCE.min(j + 1 - from);
            let columns = from * freedoms..(from + count) * freedoms;
            let (products, more) = (&mut products[..count], &mut more[..count]);
            kernels::dots(products, &halves[0][columns.clone()], &a);
            kernels::dots(more, &halves[1][columns.clone()], &b);
            for (i, (product, more)) in products.iter_mut().zip(more).enumerate() {
                *product += *more;
                *map.entry(from + i, j) += *product;
                *product = -*product;
            }
            kernels::add_columns(&mut a, &halves[0][columns.clone()], products);
            kernels::add_columns(&mut b, &halves[1][columns], products);
        }
        let left = square(&a, &b);
        if j + 1 == iterations {
            break;
        }
        let goes_on = left > 1e-28 * whole;
        if !goes_on {
            // All that the start can lead to has been found.
            size = j + 1;
            break;
        }
        *map.entry(j + 1, j) = left.sqrt();
        for (half, x) in halves.iter_mut().zip([&a, &b]) {
            half.extend(x.iter().map(|x| x / left.sqrt()));
        }
    }
    let [basis, _] = halves;
    let mut small = Hessenberg::zero(size);
    for i in 0..size {
        small.rows[i * size..][..size].copy_from_slice(&map.rows[i * iterations..][..size]);
    }
    Some((basis, small))
}

#[cfg(test)]
mod tests {
    use asperity_model::Plan;
    use asperity_model::resolve;

    use super::{SlowModes, falls_by};
    use crate::modes::Coordinates;
    use crate::modes::complex::Functions;
    use crate::modes::slow_modes::stuck::StuckLattice;
    use crate::records::stop::Stop;

    /// A state composed of modes evolves as the modes predict, in each class of motions.
    #[test]
    fn modes_are_multiplied_in_every_step() {
        let slab = ["slider.blocks=9", "slider.rows=5", "slider.height_m=0.07", "drive.height_m=0.0175"];
        let body = [
            "slider.blocks=5",
            "slider.across=4",
            "slider.rows=3",
            "slider.width_m=0.105",
            "slider.height_m=0.07",
            "slider.mass_kg=7.56",
            "drive.height_m=0.035",
        ];
        let sheet = ["slider.blocks=7", "slider.across=4", "slider.width_m=0.05"];
        let with = |sets: &[&'static str], more: &'static str| [sets, &[more]].concat();
        for (scenario, sets) in [
            ("slab", slab.to_vec()),
            ("body-coarse", body.to_vec()),
            ("body-coarse", with(&body, "drive.across=1")),
            ("sheet-coarse", sheet.to_vec()),
            ("sheet-coarse", with(&sheet, "drive.across=2")),
        ] {
            let stuck = stuck(scenario, &sets);
            for class in 0..stuck.classes().len() {
                evolves_as_predicted(&stuck, class);
            }
        }
    }

    fn stuck(scenario: &str, sets: &[&str]) -> StuckLattice {
        let plan = Plan::new(&resolve(scenario, sets).unwrap_or_else(|error| panic!("{error}")));
        StuckLattice::of(&plan, plan.elastic, &Stop::never()).expect("it is positive")
    }

    /// Where the iteration comes to the end of its space, rounding adds eigenvalues of no mode.
    #[test]
    fn modes_are_found_however_long_the_iteration_is() {
        for across in [8, 9, 11] {
            let width = format!("slider.width_m={}", f64::from(across - 1) * 0.004);
            let mass = format!("slider.mass_kg={}", f64::from(across) * 0.002);
            let stuck = stuck("sheet-coarse", &[&format!("slider.across={across}"), &width, &mass]);
            for class in 0..stuck.classes().len() {
                for iterations in [60, 400] {
                    let found = SlowModes::of(&stuck, class, iterations, &Stop::never())
                        .map_or(0, |modes| modes.rates.len());
                    assert!(found >= 10, "{across} rows, class {class}, {iterations} iterations: {found}");
                }
            }
        }
    }

    fn evolves_as_predicted(stuck: &StuckLattice, class: usize) {
        let (freedoms, name) = (stuck.freedoms(), stuck.lattice.table.name);
        let modes = SlowModes::of(stuck, class, 60, &Stop::never()).expect("there are modes");
        let count = modes.rates.len();
        assert!(count > 10, "{name} {class}: {count}");
        let by_decay = modes.rates.is_sorted_by(|a, b| falls_by(*a) <= falls_by(*b));
        assert!(if name == "slab" {
            modes.rates.is_sorted_by(|a, b| a.size() <= b.size())
        } else {
            by_decay
        });
        let coordinates = Coordinates {
            re: (0..count).map(|m| 1.0 + m as f64).collect(),
            im: (0..count).map(|m| if modes.weights[m] == 2.0 { 0.5 * m as f64 } else { 0.0 }).collect(),
        };
        let (mut u, mut w) = (vec![0.0; freedoms], vec![0.0; freedoms]);
        modes.add(stuck, &coordinates, count, &mut u, &mut w);
        // Decomposing a composed state returns its coordinates.
        let moving: Vec<f64> = u.iter().zip(&w).map(|(u, w)| u - w).collect();
        let [stiff, _] = stuck.products(&moving, &w);
        let found = modes.project(stuck, &w, &stiff);
        let parts = |of: &Coordinates| of.re.iter().chain(&of.im).copied().collect::<Vec<f64>>();
        for (found, own) in parts(&found).into_iter().zip(parts(&coordinates)) {
            assert!((found - own).abs() < 1e-4 * count as f64, "{name} {class}: {found} {own}");
        }
        const STEPS: u64 = 500;
        let largest = |of: &[f64]| of.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut most = 0.0_f64;
        for _ in 0..STEPS {
            let [stiff, damped] = stuck.products(&u, &w);
            for n in 0..freedoms {
                w[n] -= (stuck.step_s * stuck.step_s * stiff[n] + stuck.step_s * damped[n]) / stuck.mass_kg;
                u[n] += w[n];
            }
            most = most.max(largest(&u));
        }
        let mut grown = coordinates.clone();
        grown.grow_by(&modes.powers.growth(STEPS));
        let (mut u_grown, mut w_grown) = (vec![0.0; freedoms], vec![0.0; freedoms]);
        modes.add(stuck, &grown, count, &mut u_grown, &mut w_grown);
        for n in 0..freedoms {
            let off = (u[n] - u_grown[n]).abs().max((w[n] - w_grown[n]).abs());
            assert!(off < 2e-5 * count as f64, "{name} {class}, freedom {n}: {off}");
        }
        assert!(most > 0.1, "they are slow");
    }
}
