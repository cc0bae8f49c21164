//! Quantities shared by all jumps of a slab's plan: the stuck slab, its slow modes, and their effect on
//! contacts, drive and load.

use asperity_model::Plan;

use crate::complex::Complex;
use crate::norms::Norms;
use crate::slow_modes::arnoldi::SlowModes;
use crate::slow_modes::stuck::StuckLattice;

/// Computed once for all jumps.
#[derive(Debug)]
pub(crate) struct Precomputed {
    pub(crate) stuck: StuckLattice,
    pub(crate) modes: SlowModes,
    pub(crate) norms: Norms,
    /// Tangential force and normal load of each contact due to each mode, mode by mode.
    pub(crate) force_n: Vec<Complex>,
    pub(crate) load_n: Vec<Complex>,
    /// Their magnitudes.
    pub(crate) most_force_n: Vec<f64>,
    pub(crate) most_load_n: Vec<f64>,
    /// The sum of the driving forces, and the way of the load, `sum F_n u_z`, by each mode.
    pub(crate) drive_n: Vec<Complex>,
    pub(crate) pressed_j: Vec<Complex>,
    /// `M^-1` times the change of the forces in a step due to a moving drive, and due to a load that grows
    /// by its initial value.
    pub(crate) by_drive_m: Vec<f64>,
    pub(crate) by_load_m: Vec<f64>,
}

impl Precomputed {
    /// `None` if no slow modes are found.
    pub(crate) fn of(plan: &Plan, stuck: StuckLattice, iterations: usize) -> Option<Precomputed> {
        let modes = SlowModes::of(&stuck, iterations)?;
        let (freedoms, contacts) = (stuck.freedoms(), plan.blocks);
        let nodes = freedoms / 2;
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let inertia = stuck.mass_kg / (stuck.step_s * stuck.step_s);
        let (mut force_n, mut load_n) = (Vec::new(), Vec::new());
        let (mut drive_n, mut pressed_j) = (Vec::new(), Vec::new());
        for (mode, &s) in modes.rates.iter().enumerate() {
            let weight = modes.weights[mode];
            // `tau = m (v' - v) / dt + k_t u`.
            let factor = s * s / (Complex::ONE + s) * inertia + Complex::from(kt);
            for n in 0..contacts {
                force_n.push(modes.shape(mode, n) * factor * weight);
                load_n.push(modes.shape(mode, nodes + n) * (-weight * stuck.lattice.foundation_n_per_m));
            }
            let springs = plan.drive.springs.iter();
            drive_n.push(springs.fold(Complex::ZERO, |sum, spring| {
                sum + modes.shape(mode, spring.block) * (-weight * spring.stiffness_n_per_m)
            }));
            let parts = stuck.lattice.top_row().zip(&plan.top_load_n);
            pressed_j.push(parts.fold(Complex::ZERO, |sum, (node, load_n)| {
                sum + modes.shape(mode, nodes + node) * (weight * load_n)
            }));
        }
        let mut scratch = vec![0.0; freedoms];
        let mut by_drive_m = vec![0.0; freedoms];
        let advance_m = plan.drive.velocity_m_per_s * stuck.step_s;
        for spring in &plan.drive.springs {
            by_drive_m[spring.block] += spring.stiffness_n_per_m * spring.direction * advance_m;
        }
        stuck.solve(&mut by_drive_m, &mut scratch);
        let mut by_load_m = vec![0.0; freedoms];
        for (node, load_n) in stuck.lattice.top_row().zip(&plan.top_load_n) {
            by_load_m[nodes + node] = -load_n;
        }
        stuck.solve(&mut by_load_m, &mut scratch);
        Some(Precomputed {
            norms: Norms::of(plan),
            stuck,
            modes,
            most_force_n: force_n.iter().map(|force| force.size()).collect(),
            most_load_n: load_n.iter().map(|load| load.size()).collect(),
            force_n,
            load_n,
            drive_n,
            pressed_j,
            by_drive_m,
            by_load_m,
        })
    }
}
