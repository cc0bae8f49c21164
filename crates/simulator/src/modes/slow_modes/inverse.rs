//! The maps in which Arnoldi's iteration finds modes: inverses of a step's map, in which the modes that are looked
//! for are the largest.
//!
//! **Around 0.** The slowest modes of a body decay last. With `t = S / s` for a unit of rates `S`, `(t x, x)` is
//! an eigenvector to `t` of
//!
//! ```text
//! (a, b) -> (-S a - K^-1 (S D a + S^2 b), a).
//! ```
//!
//! **Around the swing.** All nodes of a sheet are contacts and stand on friction springs `k_t`. So no mode is
//! slower than the swing of the whole sheet, at `s = +- i omega_t`, `omega_t^2 = dt^2 k_t / m`, which is hardly
//! damped at all; short waves are faster and decay. These modes are the largest in the inverse of the map less
//! `s_0 = i omega_0`, just below the swing: with `y = s x` it maps `(f, g)` to
//!
//! ```text
//! x = -T(s_0)^-1 (g + (D + K + s_0) f),  y = f + s_0 x,  T(s) = s^2 + s (D + K) + K,
//! ```
//!
//! and its real part (Parlett and Saad 1987) an eigenvector to `t = s / (s^2 + omega_0^2)`. Divided by `1 + s_0`,
//! `T(s_0)` has the real part `K - (1 - D) omega_0^2 / (1 + omega_0^2)`, positive for `omega_0 < omega_t`, and an
//! imaginary part that is positive as well. Numbers in the elimination of such a symmetric matrix grow less than
//! threefold (Higham 1998): it needs no pivoting.

use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::factor::Factor;
use crate::modes::slow_modes::stuck::StuckLattice;
use crate::records::stop::Stop;

/// `omega_0` over `omega_t`.
const SHIFT: f64 = 0.95;

/// Such a map, in the basis of a class of motions.
pub(crate) struct Inverse<'a> {
    stuck: &'a StuckLattice,
    class: usize,
    stop: &'a Stop<'a>,
    /// `S`, and that of `y` in a shifted map.
    unit: f64,
    /// `T(s_0) / (1 + s_0)` of a shifted map.
    shifted: Option<Factor<Complex>>,
}

impl<'a> Inverse<'a> {
    /// `None` if the stop comes.
    pub(crate) fn of(stuck: &'a StuckLattice, class: usize, stop: &'a Stop<'_>) -> Option<Inverse<'a>> {
        // All nodes are contacts: none is without a friction spring.
        if stuck.lattice.nodes() > stuck.lattice.contacts() {
            return Some(Inverse { stuck, class, stop, unit: unit_of_rates(stuck), shifted: None });
        }
        let unit = SHIFT * stuck.swing_rate();
        let s = Complex::new(0.0, unit);
        let over = |of: Complex| of / (Complex::ONE + s);
        let factor = stuck.complex_factor(class, [over(s * s), over(s)], stop)?;
        Some(Inverse { stuck, class, stop, unit, shifted: Some(factor) })
    }

    /// The image of `(a, b)`; `false` if the stiffness cannot be solved with, or the stop has come.
    pub(crate) fn apply(&self, a: &[f64], b: &[f64], to_a: &mut [f64], to_b: &mut [f64]) -> bool {
        if self.stop.look() {
            return false;
        }
        let &Inverse { stuck, class, stop, unit, ref shifted } = self;
        let (dt, mass) = (stuck.step_s, stuck.mass_kg);
        let [stiff, damped] = stuck.products_in(class, a);
        let Some(factor) = shifted else {
            for n in 0..a.len() {
                // `M^-1` is `dt^2 / m` times `K^-1`.
                to_a[n] = unit / dt * damped[n] + unit * unit * mass / (dt * dt) * b[n];
            }
            let is_solved = stuck.solve_in(class, to_a, stop);
            for (image, a) in to_a.iter_mut().zip(a) {
                *image = -*image - unit * a;
            }
            to_b.copy_from_slice(a);
            return is_solved;
        };
        let s = Complex::new(0.0, unit);
        let (by_stiffness, by_damping) = (dt * dt / mass, dt / mass);
        let right = (0..a.len()).map(|n| {
            let moved = by_damping * damped[n] + by_stiffness * stiff[n];
            Complex::new(-(unit * b[n] + moved), -(unit * a[n])) / (Complex::ONE + s)
        });
        let mut x: Vec<Complex> = right.collect();
        factor.solve(&mut x);
        for (n, x) in x.into_iter().enumerate() {
            (to_a[n], to_b[n]) = (x.re, a[n] / unit - x.im);
        }
        true
    }

    /// The rate of the mode with this eigenvalue. Of the two in a shifted map, whose product is `omega_0^2`, it
    /// is the larger one.
    pub(crate) fn rate(&self, value: Complex) -> Complex {
        if self.shifted.is_none() {
            return Complex::from(self.unit) / value;
        }
        let half = Complex::from(0.5) / value;
        let root = (half * half - Complex::from(self.unit * self.unit)).root();
        let (one, other) = (half + root, half - root);
        if one.size() >= other.size() { one } else { other }
    }
}

/// Some times the slowest rate: that of a shear wave across the longer side.
fn unit_of_rates(stuck: &StuckLattice) -> f64 {
    let lattice = &stuck.lattice;
    let rate = stuck.step_s * (lattice.stiffness_n_per_m / stuck.mass_kg).sqrt();
    8.0 * rate / lattice.columns.max(lattice.rows).max(lattice.lanes) as f64
}
