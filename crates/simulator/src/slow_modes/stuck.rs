//! The stuck slab: its stiffness and damping, and its equilibrium.
//!
//! While every contact sticks and bears load, all forces are linear: springs and dashpots between
//! nodes, the friction spring `k_t` and the foundation `k_f` of each contact, the drive. With the nodes
//! numbered column by column (or row by row, if columns are longer) the stiffness `M` is a band, half
//! as wide as two columns, and Cholesky's factor of it stays within.

use asperity_model::{Lattice, Plan};

use crate::kernels::Simd;

/// Stiffness and damping of a stuck slab.
#[derive(Debug, Clone)]
pub(crate) struct StuckLattice {
    pub(crate) simd: Simd,
    pub(crate) lattice: Lattice,
    /// Stiffness on each freedom from springs other than those between nodes, if any.
    held_n_per_m: Vec<(usize, f64)>,
    pub(crate) step_s: f64,
    pub(crate) mass_kg: f64,
    band: Vec<f64>,
    width: usize,
    /// The index of each freedom in the band.
    place: Vec<usize>,
}

impl StuckLattice {
    /// Numbers that the factor of a lattice has.
    pub(crate) fn numbers(lattice: &Lattice) -> usize {
        lattice.freedoms() * width(lattice)
    }

    /// `None` if the stiffness is not positive by its numbers.
    pub(crate) fn of(plan: &Plan, lattice: Lattice, simd: Simd) -> Option<StuckLattice> {
        let (nodes, width) = (lattice.nodes(), width(&lattice));
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let friction = lattice.row(0).map(|n| (n, kt));
        let foundation = lattice.row(0).map(|n| (nodes + n, lattice.foundation_n_per_m));
        let drive = plan.drive.springs.iter().map(|spring| (spring.block, spring.stiffness_n_per_m));
        let held_n_per_m: Vec<(usize, f64)> = friction.chain(foundation).chain(drive).collect();
        let by_columns = lattice.rows <= lattice.columns;
        let place: Vec<usize> = (0..2 * nodes)
            .map(|freedom| {
                let (axis, node) = (freedom / nodes, freedom % nodes);
                let (row, column) = (node / lattice.columns, node % lattice.columns);
                let number = if by_columns { column * lattice.rows + row } else { node };
                2 * number + axis
            })
            .collect();
        let mut band = vec![0.0; 2 * nodes * width];
        let mut add = |a: usize, b: usize, stiffness_n_per_m: f64| {
            let (row, column) = (place[a].max(place[b]), place[a].min(place[b]));
            band[row * width + column + width - 1 - row] += stiffness_n_per_m;
        };
        lattice.over_bonds(|bond| {
            let freedoms = [bond.from, nodes + bond.from, bond.to, nodes + bond.to];
            let pull = [-bond.along[0], -bond.along[1], bond.along[0], bond.along[1]];
            for i in 0..4 {
                for j in 0..=i {
                    add(freedoms[i], freedoms[j], bond.stiffness_n_per_m * (pull[i] * pull[j]));
                }
            }
        });
        for &(freedom, stiffness_n_per_m) in &held_n_per_m {
            add(freedom, freedom, stiffness_n_per_m);
        }
        simd.factor_band(&mut band, width).then(|| StuckLattice {
            simd,
            lattice,
            held_n_per_m,
            step_s: plan.grid.step_s(),
            mass_kg: plan.block_mass_kg,
            band,
            width,
            place,
        })
    }

    pub(crate) fn freedoms(&self) -> usize {
        self.place.len()
    }

    /// Turns forces into the displacements `x` with `M x = force`.
    pub(crate) fn solve(&self, force: &mut [f64], scratch: &mut [f64]) {
        for (place, force) in self.place.iter().zip(&*force) {
            scratch[*place] = *force;
        }
        self.simd.solve_band(scratch, &self.band, self.width);
        for (place, x) in self.place.iter().zip(force) {
            *x = scratch[*place];
        }
    }

    /// `M u` and `C v`.
    pub(crate) fn products(&self, stiff: &mut [f64], damped: &mut [f64], u: &[f64], v: &[f64]) {
        self.simd.lattice_pull(stiff, damped, u, v, &self.lattice);
        for force in stiff.iter_mut().chain(damped) {
            *force = -*force;
        }
        for &(freedom, stiffness_n_per_m) in &self.held_n_per_m {
            stiff[freedom] += stiffness_n_per_m * u[freedom];
        }
    }
}

/// Numbers in a row of the band: a node and its neighbours lie within two columns.
fn width(lattice: &Lattice) -> usize {
    2 * lattice.rows.min(lattice.columns) + 4
}

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, mixed, resolve};

    use super::StuckLattice;
    use crate::kernels::Simd;

    #[test]
    fn what_is_solved_is_the_stuck_slab() {
        for sets in [
            &["slider.blocks=9", "slider.rows=5", "slider.height_m=0.07", "drive.height_m=0.0175"][..],
            &["slider.blocks=4", "slider.rows=9", "slider.height_m=0.37333333333333335", "time.step_s=1e-8"],
        ] {
            let plan = Plan::new(&resolve("slab", sets).unwrap_or_else(|error| panic!("{error}")));
            let stuck =
                StuckLattice::of(&plan, plan.elastic.as_lattice(), Simd::detect()).expect("it is positive");
            let freedoms = stuck.freedoms();
            let numbers = |n: usize| mixed(n as u64) as f64 / u64::MAX as f64 - 0.5;
            let u: Vec<f64> = (0..freedoms).map(numbers).collect();
            let (mut force, mut damped, mut scratch) =
                (vec![0.0; freedoms], vec![0.0; freedoms], vec![0.0; freedoms]);
            stuck.products(&mut force, &mut damped, &u, &u);
            stuck.solve(&mut force, &mut scratch);
            for (found, u) in force.iter().zip(&u) {
                assert!((found - u).abs() < 1e-11, "{found} {u}");
            }
            // The state of rest is at rest in it.
            let rest = &plan.initial.displacement_m;
            stuck.products(&mut force, &mut damped, rest, rest);
            for spring in &plan.drive.springs {
                force[spring.block] -= spring.stiffness_n_per_m * spring.rest_m;
            }
            for (node, load_n) in stuck.lattice.top_row().zip(&plan.top_load_n) {
                force[freedoms / 2 + node] += load_n;
            }
            assert!(force.iter().all(|force| force.abs() < 1e-9), "{force:?}");
        }
    }
}
