//! Plane waves in the lattice of a slab.
//!
//! The dispersion is computed with the lattice itself: displacements `U cos(q . r)` are applied to a node
//! and its eight neighbours, and the pull on that node is `-D(q) U` with a symmetric matrix `D`, since the
//! bonds of a node come in opposite pairs. Its eigenvalues over the mass are the squares of two
//! frequencies. The formula beside it is derived from the bonds: with `q_x` and `q_z` the phases from node
//! to node,
//!
//! ```text
//! D_xx = k (2 (1 - cos q_x) + 1 - cos q_x cos q_z)
//! D_zz = k (2 (1 - cos q_z) + 1 - cos q_x cos q_z)
//! D_xz = k sin q_x sin q_z
//! ```
//!
//! so that along a row `w = sqrt(6 k / m) sin(q / 2)` for a longitudinal wave and
//! `w = sqrt(2 k / m) sin(q / 2)` for a shear wave. Damping and time steps are left out.

use asperity_model::Lattice;

/// The two waves of one direction and length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waves {
    /// Frequency of the shear wave, over `sqrt(k / m)`: the lower one.
    pub shear: f64,
    /// That of the longitudinal wave.
    pub longitudinal: f64,
}

impl Waves {
    /// From the matrix over `k`.
    fn of([[xx, xz], [_, zz]]: [[f64; 2]; 2]) -> Waves {
        let (middle, half) = (0.5 * (xx + zz), (0.25 * (xx - zz) * (xx - zz) + xz * xz).sqrt());
        // For long waves the lower one may consist of rounding only.
        Waves { shear: (middle - half).max(0.0).sqrt(), longitudinal: (middle + half).sqrt() }
    }

    /// Computed from the pull of the bonds of a lattice, with phases along `x` and the next axis along
    /// which its nodes move.
    pub fn in_lattice(lattice: &Lattice, phase: [f64; 2]) -> Waves {
        let counts = [0, 1, 2].map(|axis| if lattice.table.freedom(axis).is_some() { 3 } else { 1 });
        let second = lattice.table.axes[1];
        let patch =
            Lattice { stiffness_n_per_m: lattice.stiffness_n_per_m, ..Lattice::of(lattice.table, counts) };
        let (nodes, freedoms) = (patch.nodes(), patch.freedoms());
        let middle = nodes / 2;
        let still = vec![0.0; freedoms];
        let pulled = |along: usize| {
            let mut u = still.clone();
            for node in 0..nodes {
                let place = |axis: usize| patch.place(node)[axis] as f64 - 1.0;
                let (x, z) = (place(0), place(second));
                u[along * nodes + node] = (phase[0] * x + phase[1] * z).cos();
            }
            let mut springs_n = still.clone();
            patch.pull_of_springs(&mut springs_n, &u);
            [middle, nodes + middle].map(|at| -springs_n[at] / lattice.stiffness_n_per_m)
        };
        Waves::of([pulled(0), pulled(1)])
    }

    /// By the formula.
    pub fn in_theory(phase: [f64; 2]) -> Waves {
        let [x, z] = phase;
        let both = 1.0 - x.cos() * z.cos();
        let xz = x.sin() * z.sin();
        Waves::of([[2.0 * (1.0 - x.cos()) + both, xz], [xz, 2.0 * (1.0 - z.cos()) + both]])
    }
}

/// The speeds, m/s, of waves along a row whose length is this many spacings; `None` for a chain.
pub fn speeds_along_rows_m_per_s(plan: &asperity_model::Plan, spacings: f64) -> Option<[f64; 2]> {
    plan.elastic.longitudinal_over_shear()?;
    let lattice = plan.elastic;
    let phase = 2.0 * std::f64::consts::PI / spacings;
    let Waves { shear, longitudinal } = Waves::in_lattice(&lattice, [phase, 0.0]);
    let rate = (lattice.stiffness_n_per_m / plan.block_mass_kg).sqrt();
    Some([shear, longitudinal].map(|frequency| frequency * rate / phase * plan.spacing_m))
}

#[cfg(test)]
mod tests {
    use asperity_model::Plan;
    use asperity_model::resolve;

    use super::{Waves, speeds_along_rows_m_per_s};

    #[test]
    fn the_bonds_make_the_waves_of_the_formula() {
        let plan = Plan::new(&resolve("slab", &["slider.rows=31"]).unwrap());
        let lattice = &plan.elastic;
        for n in 0..200 {
            let phase = [f64::from(n % 20) * 0.157, f64::from(n / 20) * 0.314];
            let (found, expected) = (Waves::in_lattice(lattice, phase), Waves::in_theory(phase));
            assert!((found.shear - expected.shear).abs() < 1e-7, "{phase:?} {found:?} {expected:?}");
            assert!((found.longitudinal - expected.longitudinal).abs() < 1e-12, "{phase:?} {found:?}");
        }
        // Along a row, and the shortest waves along x.
        let Waves { shear, longitudinal } = Waves::in_lattice(lattice, [std::f64::consts::PI, 0.0]);
        assert!((shear - 2f64.sqrt()).abs() < 1e-12 && (longitudinal - 6f64.sqrt()).abs() < 1e-12);
        let long = speeds_along_rows_m_per_s(&plan, 1000.0).unwrap();
        assert!((long[0] - 993.0).abs() < 0.5 && (long[1] - 1720.0).abs() < 0.5, "{long:?}");
        let chain = Plan::new(&resolve("default", &["slider.blocks=3"]).unwrap());
        assert_eq!(speeds_along_rows_m_per_s(&chain, 1000.0), None);
    }
}
