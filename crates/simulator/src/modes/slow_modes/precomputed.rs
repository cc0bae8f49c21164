//! Quantities shared by all jumps of a plan: the stuck lattice, its slow modes, and their effect on contacts,
//! drive and load.

use std::array;
use std::sync::{Arc, OnceLock};

use asperity_model::law::magnitude;
use asperity_model::{Lattice, Plan};

use crate::leap::norms::Norms;
use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::arnoldi::SlowModes;
use crate::modes::slow_modes::mirror::Motions;
use crate::modes::slow_modes::stuck::StuckLattice;
use crate::records::stop::Stop;

/// Computed once for all jumps of a lattice whose contacts have `D` tangential freedoms.
#[derive(Debug)]
pub(crate) struct Precomputed<const D: usize> {
    pub(crate) stuck: StuckLattice,
    pub(crate) norms: Norms,
    /// `M^-1` times the change of the forces in a step due to a moving drive, and due to a load that grows
    /// by its initial value.
    pub(crate) by_drive_m: Vec<f64>,
    pub(crate) by_load_m: Vec<f64>,
    /// The modes of each class of motions, found when a state first has such a motion.
    modes: Vec<OnceLock<Option<Arc<ClassModes<D>>>>>,
    iterations: usize,
}

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
    /// The sum of the driving forces, and the way of the load, `sum F_n u_z`, by each mode.
    pub(crate) drive_n: Vec<Complex>,
    pub(crate) pressed_j: Vec<Complex>,
}

/// The nodes of the top row that a load presses on, as their freedoms along the normal, with the load at the
/// start.
pub(crate) fn pressed<'a>(plan: &'a Plan, lattice: &Lattice) -> impl Iterator<Item = (usize, f64)> + 'a {
    let normal = lattice.first_normal().unwrap_or(0);
    lattice.top_row().zip(&plan.top_load_n).map(move |(node, load_n)| (normal + node, *load_n))
}

impl<const D: usize> Precomputed<D> {
    /// `None` if the stiffness cannot be solved with, or the stop comes.
    pub(crate) fn of(
        plan: &Plan,
        stuck: StuckLattice,
        iterations: usize,
        stop: &Stop<'_>,
    ) -> Option<Precomputed<D>> {
        let mut by_drive_m = vec![0.0; stuck.freedoms()];
        let advance_m = plan.drive.velocity_m_per_s * stuck.step_s;
        for spring in &plan.drive.springs {
            by_drive_m[spring.block] += spring.stiffness_n_per_m * spring.direction * advance_m;
        }
        let mut by_load_m = vec![0.0; stuck.freedoms()];
        for (freedom, load_n) in pressed(plan, &stuck.lattice) {
            by_load_m[freedom] = -load_n;
        }
        let are_solved = stuck.solve(&mut by_drive_m, stop) && stuck.solve(&mut by_load_m, stop);
        are_solved.then(|| Precomputed {
            norms: Norms::of(plan),
            modes: stuck.classes().iter().map(|_| OnceLock::new()).collect(),
            stuck,
            by_drive_m,
            by_load_m,
            iterations,
        })
    }

    /// The modes of a class of motions; `None` if it has no slow modes, or the stop comes.
    pub(crate) fn modes(&self, plan: &Plan, class: usize, stop: &Stop<'_>) -> Option<Arc<ClassModes<D>>> {
        stop.get_or_find(&self.modes[class], || self.find(plan, class, stop).map(Arc::new)).cloned()
    }

    fn find(&self, plan: &Plan, class: usize, stop: &Stop<'_>) -> Option<ClassModes<D>> {
        let stuck = &self.stuck;
        let slow = SlowModes::of(stuck, class, self.iterations, stop)?;
        let (nodes, contacts) = (stuck.lattice.nodes(), plan.blocks);
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let inertia = stuck.mass_kg / (stuck.step_s * stuck.step_s);
        let (mut force_n, mut load_n) = (Vec::new(), Vec::new());
        let (mut drive_n, mut pressed_j) = (Vec::new(), Vec::new());
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
            pressed_j.push(
                pressed(plan, &stuck.lattice)
                    .fold(Complex::ZERO, |sum, (freedom, load_n)| sum + shape(freedom) * (weight * load_n)),
            );
        }
        let most = |force_n: &[Complex; D]| magnitude(force_n.map(|part| part.size()));
        Some(ClassModes {
            slow,
            most_force_n: force_n.iter().map(most).collect(),
            most_load_n: load_n.iter().map(|load| load.size()).collect(),
            force_n,
            load_n,
            drive_n,
            pressed_j,
        })
    }

    /// The classes of which some arrays over all freedoms have a component. The first is always among them.
    pub(crate) fn classes_of<'a>(&'a self, arrays: [&'a [f64]; 3]) -> impl Iterator<Item = usize> + 'a {
        let has_part = move |motions: &Motions| arrays.iter().any(|all| !motions.lack(all));
        let classes = self.stuck.classes().iter().enumerate();
        classes.filter(move |(class, motions)| *class == 0 || has_part(motions)).map(|(class, _)| class)
    }
}
