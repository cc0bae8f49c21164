//! The slow modes of a class of motions, and their effect on contacts, drive and load.

use std::array;

use asperity_model::Plan;
use asperity_model::law::magnitude;

use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::arnoldi::SlowModes;
use crate::modes::slow_modes::stuck::StuckLattice;
use crate::records::stop::Stop;

/// The slow modes of a class of motions, and what each does.
#[derive(Debug)]
pub(crate) struct ClassModes<const D: usize> {
    pub(crate) slow: SlowModes,
    /// Tangential force and normal load of each contact due to each mode, mode by mode.
    pub(crate) force_n: Vec<[Complex; D]>,
    pub(crate) load_n: Vec<Complex>,
    /// The most that these come to: the magnitude of a vector is at most that of the sizes of its components.
    pub(crate) most_force_n: Vec<f64>,
    pub(crate) most_load_n: Vec<f64>,
    /// The sum of the driving forces by each mode.
    pub(crate) drive_n: Vec<Complex>,
}

/// The nodes of the top row that a load presses on, as their freedoms along the normal, with the load at the
/// start.
pub(crate) fn top_loads(plan: &Plan) -> impl Iterator<Item = (usize, f64)> {
    let normal = plan.elastic.first_normal().unwrap_or(0);
    plan.elastic.top_row().zip(&plan.top_load_n).map(move |(node, load_n)| (normal + node, *load_n))
}

impl<const D: usize> ClassModes<D> {
    /// `None` if there are no slow modes, or the stop comes.
    pub(crate) fn of(
        plan: &Plan,
        stuck: &StuckLattice,
        class: usize,
        iterations: usize,
        stop: &Stop<'_>,
    ) -> Option<ClassModes<D>> {
        let slow = SlowModes::of(stuck, class, iterations, stop)?;
        let (nodes, contacts) = (stuck.lattice.nodes(), plan.blocks);
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let inertia = stuck.mass_kg / (stuck.step_s * stuck.step_s);
        let (mut force_n, mut load_n, mut drive_n) = (Vec::new(), Vec::new(), Vec::new());
        for (mode, &s) in slow.rates.iter().enumerate() {
            let weight = slow.weights[mode];
            let [re, im] = slow.shape(stuck, mode);
            let shape = |freedom: usize| Complex::new(re[freedom], im[freedom]);
            // `tau = m (v' - v) / dt + k_t u`.
            let factor = s * s / (Complex::ONE + s) * inertia + Complex::from(kt);
            for n in 0..contacts {
                force_n.push(array::from_fn(|axis| shape(axis * nodes + n) * factor * weight));
                let load = stuck.lattice.first_normal().map(|normal| shape(normal + n));
                let foundation = -weight * stuck.lattice.foundation_n_per_m;
                load_n.push(load.map_or(Complex::ZERO, |rise| rise * foundation));
            }
            let springs = plan.drive.springs.iter();
            drive_n.push(springs.fold(Complex::ZERO, |sum, spring| {
                sum + shape(spring.block) * (-weight * spring.stiffness_n_per_m)
            }));
        }
        let most = |force_n: &[Complex; D]| magnitude(force_n.map(|part| part.size()));
        Some(ClassModes {
            slow,
            most_force_n: force_n.iter().map(most).collect(),
            most_load_n: load_n.iter().map(|load| load.size()).collect(),
            force_n,
            load_n,
            drive_n,
        })
    }
}
