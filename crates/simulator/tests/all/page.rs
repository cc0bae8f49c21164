//! The equations of docs/bodies.md literally, one bond and one contact after the other, beside the plain
//! stepper.

use asperity_model::body::lattice::Bond;
use asperity_model::{Lattice, Plan};
use asperity_record::Direction;
use asperity_simulator::{Plain, Solver};

use crate::fast_and_plain::switched;

/// Contacts and the direction in which they switch.
pub(crate) type Switches = Vec<(u32, Direction)>;

/// The law of the contacts.
pub(crate) trait Contacts {
    /// Takes what contacts under these loads resist in a step from the forces on their nodes.
    fn resist(&mut self, page: &Page, loads_n: &[f64], force_n: &mut [f64]);

    /// Which contacts switch after the step, in which they had these loads.
    fn switch(&mut self, page: &Page, loads_n: &[f64]) -> Switches;
}

/// A lattice on contacts in its steps.
pub(crate) struct Page {
    pub(crate) plan: Plan,
    pub(crate) lattice: Lattice,
    bonds: Vec<Bond>,
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) step: u64,
    hold_step: u64,
    /// Steps of contacts in the air.
    pub(crate) in_air: u64,
}

impl Page {
    fn of(plan: &Plan) -> Page {
        let (lattice, mut bonds) = (plan.elastic, Vec::new());
        lattice.over_bonds(|bond| bonds.push(bond));
        Page {
            lattice,
            bonds,
            u: plan.initial.displacement_m.clone(),
            v: vec![0.0; plan.elastic.freedoms()],
            step: 0,
            hold_step: plan.drive.hold_from_step.unwrap_or(u64::MAX),
            in_air: 0,
            plan: plan.clone(),
        }
    }

    /// Takes a step; returns the contacts that switched, and the sum of the drive's forces.
    fn step(&mut self, contacts: &mut impl Contacts) -> (Switches, f64) {
        let (lattice, plan) = (&self.lattice, &self.plan);
        let (nodes, axes, upward) = (lattice.nodes(), lattice.axes(), lattice.table.upward());
        self.step += 1;
        let load = plan.outside(self.step, self.hold_step).load().scaled_n(1.0);
        let mut force_n = vec![0.0; axes * nodes];
        for bond in &self.bonds {
            let of = |values: &[f64], axis: usize| {
                values[axis * nodes + bond.to] - values[axis * nodes + bond.from]
            };
            let stretch_m: f64 = (0..axes).map(|axis| bond.along[axis] * of(&self.u, axis)).sum();
            for axis in 0..axes {
                let pull_n = bond.stiffness_n_per_m * bond.along[axis] * stretch_m
                    + lattice.damping_kg_per_s * of(&self.v, axis);
                force_n[axis * nodes + bond.from] += pull_n;
                force_n[axis * nodes + bond.to] -= pull_n;
            }
        }
        let point_m = plan.drive.velocity_m_per_s * plan.grid.time_s(self.step.min(self.hold_step));
        let mut driving_n = 0.0;
        for spring in &plan.drive.springs {
            let pull_n = spring.stiffness_n_per_m * (point_m - (self.u[spring.block] - spring.rest_m));
            force_n[spring.block] += pull_n;
            driving_n += pull_n;
        }
        let mut loads_n: Vec<f64> = plan.normal_load_n.iter().map(|load_n| load * load_n).collect();
        if let Some(up) = upward.map(|axis| axis * nodes) {
            for (node, load_n) in lattice.top_row().zip(&plan.top_load_n) {
                force_n[up + node] -= load * load_n;
            }
            for (n, load_n) in loads_n.iter_mut().enumerate() {
                *load_n = (-lattice.foundation_n_per_m * self.u[up + n]).max(0.0);
                force_n[up + n] += *load_n;
                self.in_air += u64::from(*load_n == 0.0);
            }
        }
        contacts.resist(self, &loads_n, &mut force_n);
        let dt = self.plan.grid.step_s();
        for (force_n, (u, v)) in force_n.iter().zip(self.u.iter_mut().zip(&mut self.v)) {
            *v += dt * force_n / self.plan.block_mass_kg;
            *u += dt * *v;
        }
        let switches = contacts.switch(self, &loads_n);
        let held_n =
            self.plan.drive.until_load_ratio.map(|ratio| ratio * load * self.plan.total_normal_load_n);
        if self.hold_step == u64::MAX && held_n.is_some_and(|held_n| driving_n >= held_n) {
            self.hold_step = self.step;
        }
        (switches, driving_n)
    }
}

/// Takes all steps of a plan: equal switches in equal steps, and numbers equal within a share of the largest. Returns
/// how often contacts detach backwards and how often across, and the steps of contacts in the air.
pub(crate) fn does_what_the_page_says(
    plan: &Plan,
    mut contacts: impl Contacts,
    share: f64,
    what: &str,
) -> [u64; 3] {
    let near = |a: f64, b: f64, largest: f64| (a - b).abs() <= share * largest;
    let (mut page, mut plain) = (Page::of(plan), Plain::new(plan.clone()));
    let (mut count, mut largest_n, [mut backwards, mut across]) = (0, 1.0_f64, [0, 0]);
    for step in 1..=plan.steps {
        let driving_n = plain.take_step().total_n;
        let (switches, expected_n) = page.step(&mut contacts);
        largest_n = largest_n.max(expected_n.abs());
        assert!(near(driving_n, expected_n, largest_n), "{what}, step {step}: {driving_n} {expected_n}");
        assert_eq!(switched(&plain), switches, "{what}, step {step}");
        let tau_n = &plain.state().tangential_force_n;
        for (contact, _) in switches.iter().filter(|(_, way)| *way == Direction::Detach) {
            let n = *contact as usize - 1;
            backwards += u64::from(tau_n[n] < 0.0);
            let across_n = tau_n.get(plan.blocks + n).copied().unwrap_or_default();
            across += u64::from(across_n.abs() > 0.1 * tau_n[n].abs());
        }
        count += switches.len();
    }
    let state = plain.state();
    for (found, expected) in [(&state.displacement_m, &page.u), (&state.velocity_m_per_s, &page.v)] {
        let largest = expected.iter().fold(1e-9, |most: f64, value| most.max(value.abs()));
        assert!(found.iter().zip(expected).all(|(a, b)| near(*a, *b, largest)), "{what}");
    }
    assert_eq!(state.hold_step, page.hold_step, "{what}");
    assert!(count > 10, "{what}: {count} switches");
    assert_eq!(plain.counters().contact_steps_in_air, page.in_air, "{what}");
    [backwards, across, page.in_air]
}
