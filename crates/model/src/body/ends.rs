//! The ends of a chain: what joins its first and last block to a wall or to each other.
//!
//! Every end that is not free is one bond, a spring and a dashpot from an end block to a wall at rest or to the
//! other end. It is relaxed in the state of the start:
//!
//! - *clamped*: the bond `k`, `eta` of the chain, to the wall;
//! - *absorbing*: a dashpot of the impedance of long waves, `Z = sqrt(k m)`, to the wall;
//! - *periodic*: the bond `k`, `eta` from block `N` to block 1.
//!
//! A wave `u_n = e^{i (n q a - w t)} + r e^{-i (n q a + w t)}` that meets the last block, `n = 0`, obeys the equation of
//! all blocks if a block `n = 1` moves along with it: the bond at the end must pull as that block would, with
//! `(k - i w eta)(u_1 - u_0)`. A free end has `u_1 = u_0`, so `r = e^{i q a}`; a clamped one `u_1 = 0`, so
//! `r = -e^{2 i q a}`; both reflect all of it. For an absorbing end see [`absorbed_reflection`].

use crate::body::elastic::Chain;
use crate::scenario::choices::End;

/// A spring and a dashpot that join an end block of a chain to a wall at rest or to the other end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndBond {
    /// The end block, counted from 0.
    pub block: usize,
    /// The block that it is joined to, counted from 0; `None` for a wall.
    pub other: Option<usize>,
    /// Stiffness of its spring; 0 without one.
    pub stiffness_n_per_m: f64,
    /// Coefficient of its dashpot.
    pub damping_kg_per_s: f64,
    /// The displacement of the block from the other one at which the spring is relaxed.
    pub rest_m: f64,
    /// Whether the work of its dashpot counts as radiated, not as lost to viscosity.
    pub radiates: bool,
}

impl EndBond {
    /// The bonds of a chain whose blocks have a mass, with these ends, relaxed at these displacements.
    pub fn of(ends: [End; 2], chain: &Chain, block_mass_kg: f64, displacement_m: &[f64]) -> Vec<EndBond> {
        let last = chain.nodes - 1;
        let bond = |block: usize, other: Option<usize>| EndBond {
            block,
            other,
            stiffness_n_per_m: chain.stiffness_n_per_m,
            damping_kg_per_s: chain.damping_kg_per_s,
            rest_m: 0.0,
            radiates: false,
        };
        let of_end = |(end, block): (End, usize)| match end {
            End::Free => None,
            End::Clamped => Some(bond(block, None)),
            End::Absorbing => Some(EndBond {
                stiffness_n_per_m: 0.0,
                damping_kg_per_s: impedance_kg_per_s(chain.stiffness_n_per_m, block_mass_kg),
                radiates: true,
                ..bond(block, None)
            }),
            // Both ends are, and one bond is all of it.
            End::Periodic => (block == last).then(|| bond(last, Some(0))),
        };
        let mut bonds: Vec<EndBond> = ends.into_iter().zip([0, last]).filter_map(of_end).collect();
        for bond in &mut bonds {
            bond.rest_m = bond.stretch(displacement_m);
        }
        bonds
    }

    /// What the block has more than the other: of displacements the stretch, not counted from rest.
    #[inline]
    pub fn stretch(&self, values: &[f64]) -> f64 {
        values[self.block] - self.other.map_or(0.0, |other| values[other])
    }

    /// The pull on the block, N.
    #[inline]
    pub fn pull_n(&self, displacement_m: &[f64], velocity_m_per_s: &[f64]) -> f64 {
        let stretch_m = self.stretch(displacement_m) - self.rest_m;
        -(self.stiffness_n_per_m * stretch_m + self.damping_kg_per_s * self.stretch(velocity_m_per_s))
    }

    /// The pull of changes: of displacements and velocities counted from any state.
    #[inline]
    pub fn pull_of_changes(&self, displacement: &[f64], velocity: &[f64]) -> f64 {
        -(self.stiffness_n_per_m * self.stretch(displacement)
            + self.damping_kg_per_s * self.stretch(velocity))
    }

    /// Adds a pull on the block, and its opposite on the other one, to forces.
    #[inline]
    pub fn add(&self, pull_n: f64, force_n: &mut [f64]) {
        force_n[self.block] += pull_n;
        if let Some(other) = self.other {
            force_n[other] -= pull_n;
        }
    }

    /// The energy of its spring, J.
    pub fn energy_j(&self, displacement_m: &[f64]) -> f64 {
        let stretch_m = self.stretch(displacement_m) - self.rest_m;
        0.5 * self.stiffness_n_per_m * stretch_m * stretch_m
    }

    /// That of a stretch counted from any state, `k s^2 / 2`.
    pub fn half_form(&self, values: &[f64]) -> f64 {
        let stretch = self.stretch(values);
        0.5 * self.stiffness_n_per_m * stretch * stretch
    }

    /// The power of its dashpot, W, with its force from some velocities and its motion from others.
    pub fn loss_w(&self, velocity_m_per_s: &[f64], moving_m_per_s: &[f64]) -> f64 {
        self.damping_kg_per_s * self.stretch(velocity_m_per_s) * self.stretch(moving_m_per_s)
    }
}

/// The damping that absorbing ends add to that of the chain and its contacts, as a bound on the eigenvalues.
pub fn absorbing_kg_per_s(bonds: &[EndBond]) -> f64 {
    bonds.iter().filter(|bond| bond.radiates).fold(0.0, |most, bond| f64::max(most, bond.damping_kg_per_s))
}

/// The impedance of long waves in a chain, `Z = sqrt(k m)`.
pub fn impedance_kg_per_s(stiffness_n_per_m: f64, block_mass_kg: f64) -> f64 {
    (stiffness_n_per_m * block_mass_kg).sqrt()
}

/// The share of the amplitude of a wave that an absorbing end of an undamped chain reflects, given its phase per block
/// `q a`, from 0 to `pi`, and half of its phase per time step, `d = w dt / 2`: `|sin(q a / 4 - d / 2)| / cos(q a / 4 + d / 2)`,
/// for short steps `tan(q a / 4)`.
///
/// A wave has `sin d = dt sqrt(k / m) sin(q a / 2)` by Euler-Cromer, and the velocity before a step is
/// `-i (2 / dt) sin d e^{i d}` of its displacement. So `k (u_1 - u_0) = Z v`, the [wave](self) with `n = 1` beyond the end, is
/// `u_1 - u_0 = 2 i sin(q a / 2) e^{i d} u_0`, and with `e^{i q a} - 1 = 2 i sin(q a / 2) e^{i q a / 2}` that gives
/// `r = (e^{i q a / 2} - e^{i d}) / (e^{-i q a / 2} + e^{i d})`.
pub fn absorbed_reflection(phase_per_block: f64, half_step_phase: f64) -> f64 {
    let (quarter, half) = (0.25 * phase_per_block, 0.5 * half_step_phase);
    (libm::sin(quarter - half) / libm::cos(quarter + half)).abs()
}

#[cfg(test)]
mod tests {
    use super::absorbed_reflection;
    use crate::Plan;
    use crate::resolve;

    #[test]
    fn short_waves_are_reflected_and_long_ones_absorbed() {
        assert_eq!(absorbed_reflection(0.0, 0.0), 0.0);
        assert!((absorbed_reflection(std::f64::consts::PI, 0.0) - 1.0).abs() < 1e-15);
        assert!((absorbed_reflection(0.4, 0.0) - libm::tan(0.1)).abs() < 1e-15);
    }

    /// In slow loading the load at the first slip is that of the walls and of the contacts, and all ends are relaxed at
    /// the start.
    #[test]
    fn walls_bear_part_of_the_load_of_a_preview() {
        let of = |ends: &[&str]| {
            let scenario =
                resolve("default", &[&["slider.blocks=6", "drive.kind=top"], ends].concat()).unwrap();
            let (plan, preview) = (Plan::new(&scenario), scenario.preview());
            assert!(plan.end_bonds.iter().all(|bond| bond.energy_j(&plan.initial.displacement_m) == 0.0));
            preview.dynamic_load_s.unwrap()
        };
        let (free, clamped) = (of(&[]), of(&["slider.left_end=clamped", "slider.right_end=clamped"]));
        let around = of(&["slider.left_end=periodic", "slider.right_end=periodic"]);
        // All blocks advance alike, with or without the bond.
        assert!((around / free - 1.0).abs() < 1e-12 && clamped < free, "{free} {clamped} {around}");
        // Free blocks move by X K_n / (K_n + k_t); the walls let them move less.
        let (drive, contact) = (0.8e6 / 6.0, 2.5e9 * 5.0 * 0.005 * 0.02 / 0.1);
        let expected_s = 0.45 * 400.0 / (6.0 * drive * contact / (drive + contact)) / 1e-4;
        assert!((free / expected_s - 1.0).abs() < 1e-9, "{free} {expected_s}");
        let stiff_s = 0.45 * 400.0 / (6.0 * drive) / 1e-4;
        assert!(stiff_s < clamped, "{stiff_s} {clamped}");
    }
}
