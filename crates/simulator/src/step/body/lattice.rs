//! A lattice in steps ([`asperity_model::body::lattice`], docs/bodies.md): the nodes at its bottom
//! carry the contacts, which have `D` tangential freedoms.
//!
//! Springs and dashpots pull between nodes, `k e (e . (u_j - u_i)) + eta (v_j - v_i)`. Where nodes move
//! upwards, the load of the new time presses on the top; the foundation bears contact `n` with
//! `p_n = -k_f u_z` where `u_z < 0`, and with nothing where the node has lifted off, and friction is in
//! proportion to this `p_n`. Where they do not, in a sheet, the normal load of each contact is given. The
//! loops over the nodes are in [`crate::kernels`], compiled for several instruction sets with the same
//! bits.
//!
//! **Energies.** Forces do the work `F w` on the way `w = dt v'` ([`crate::energy`]). Springs between
//! nodes are linear, so `w M w / 2 = w (F_s - F_{s+1}) / 2` with `F_s` their pull in step `s`. With
//! `d = v' - v` the sum of that over the steps is the sum of `dt F_s d / 2`, less `dt F v / 2` of the
//! last state with the pull that it has: a step costs one product, and [`Body::energy`] adds the last
//! part. The foundation's is `E(u') - E(u)` less its force along the way, since a contact may lift off
//! on it. The work of the normal load takes the place of a chain's prestress work: both are forces from
//! outside.

use std::array;
use std::ops::Range;
use std::sync::Arc;

use asperity_model::plan::outside::Outside;
use asperity_model::{Lattice, Plan, SliderState};
use asperity_record::Energy;

use crate::energy::Bookkeeping;
use crate::energy::lattice_energy::stored_j;
use crate::kernels::{self, After, ContactInputs};
use crate::step::body::{Body, OfPlan};
use crate::step::junctions::JunctionLoops;
use crate::step::law::{ContactLoops, Rubbing, loops, loops_over_area};
use crate::step::strength::Strength;

/// A lattice whose contacts have `D` tangential freedoms.
#[derive(Debug, Clone)]
pub(crate) struct LatticeBody<const D: usize = 1> {
    lattice: Lattice,
    law: Arc<dyn ContactLoops<D>>,
    junctions: Option<JunctionLoops>,
    /// Pull of the springs and of the dashpots between nodes, and forces from outside, on all
    /// freedoms in the last step.
    springs_n: Vec<f64>,
    dashpots_n: Vec<f64>,
    outer_n: Vec<f64>,
    /// Displacements of all freedoms of contacts before the step, axis by axis.
    former_displacement_m: Vec<f64>,
    /// Directions of slip of the contacts before the step, axis by axis
    /// ([`Turn::direction`](asperity_model::law::Turn)).
    direction: Vec<f64>,
    /// `mu_s p` without ageing and `mu_d p`; of contacts on the foundation, at their heights.
    strength: Strength,
    /// Friction of each contact, axis by axis.
    friction_n: Vec<f64>,
    /// The work of the last step ([`kernels::lattice_move`]).
    work: [f64; 3],
    /// Energy at the start of a run that begins in a given state.
    initial_j: f64,
}

impl OfPlan for LatticeBody {
    type Elastic = Lattice;

    fn of_plan(plan: &Plan, lattice: &Lattice, _: &SliderState, _: Bookkeeping) -> LatticeBody {
        let junctions = JunctionLoops::of(plan);
        LatticeBody { junctions, ..LatticeBody::new(plan, *lattice, loops(plan.friction.law)) }
    }
}

impl OfPlan for LatticeBody<2> {
    type Elastic = Lattice;

    fn of_plan(plan: &Plan, lattice: &Lattice, _: &SliderState, _: Bookkeeping) -> Self {
        LatticeBody::new(plan, *lattice, loops_over_area(plan.friction.law))
    }
}

impl<const D: usize> LatticeBody<D> {
    /// A lattice at rest, with this law at its contacts.
    pub(crate) fn new(plan: &Plan, lattice: Lattice, law: Arc<dyn ContactLoops<D>>) -> LatticeBody<D> {
        let (contacts, zeros) = (lattice.contacts(), || vec![0.0; lattice.freedoms()]);
        let of_axes = || vec![0.0; lattice.axes() * contacts];
        LatticeBody {
            springs_n: zeros(),
            dashpots_n: zeros(),
            outer_n: zeros(),
            former_displacement_m: of_axes(),
            direction: vec![0.0; D * contacts],
            strength: Strength::new(plan),
            friction_n: vec![0.0; D * contacts],
            work: [0.0; 3],
            initial_j: 0.0,
            lattice,
            law,
            junctions: None,
        }
    }

    /// The freedoms along the normal; `None` if nodes do not move along it.
    fn upward(&self) -> Option<Range<usize>> {
        let nodes = self.lattice.nodes();
        self.lattice.table.upward().map(|axis| axis * nodes..(axis + 1) * nodes)
    }

    /// Brings the strength of contacts on the foundation to their heights, and returns the normal loads as
    /// forces on their nodes.
    fn apply_foundation(&mut self, plan: &Plan, state: &mut SliderState, upward: Range<usize>) {
        let rise_m = &state.displacement_m[upward.clone()];
        let outer_n = &mut self.outer_n[upward];
        for n in 0..plan.blocks {
            let normal_load_n = self.lattice.normal_load_n(rise_m[n]);
            state.normal_load_n[n] = normal_load_n;
            outer_n[n] = normal_load_n;
        }
        self.strength.update(plan, &state.normal_load_n);
    }
}

/// Splits an array into its `D` axes, each of that many consecutive numbers.
fn along<const D: usize>(values: &[f64], from_one_to_next: usize, count: usize) -> [&[f64]; D] {
    array::from_fn(|axis| &values[axis * from_one_to_next..][..count])
}

impl<const D: usize> Body for LatticeBody<D> {
    fn begin_in(&mut self, plan: &Plan, state: &mut SliderState) {
        let energy = self.energy(plan, state);
        state.energy.scheme_work_j.add(-energy.scheme_work_j);
        self.initial_j = energy.kinetic_j + energy.elastic_j;
    }

    fn apply_load(&mut self, plan: &Plan, state: &mut SliderState, outside: Outside<'_>) {
        let nodes = self.lattice.nodes();
        match self.upward() {
            None => self.strength.follow(plan, state, outside.load()),
            Some(upward) => {
                let (outer_n, load) = (&mut self.outer_n[upward], outside.load());
                for (node, load_n) in self.lattice.top_row().zip(&plan.top_load_n) {
                    outer_n[node] = -load.scaled_n(*load_n);
                }
            }
        }
        for axis in 0..D {
            self.outer_n[axis * nodes..][..plan.blocks].fill(0.0);
        }
        for spring in &plan.drive.springs {
            self.outer_n[spring.block] = 0.0;
        }
    }

    fn add_force(&mut self, freedom: usize, force_n: f64) {
        self.outer_n[freedom] += force_n;
    }

    fn advance(&mut self, plan: &Plan, state: &mut SliderState) -> bool {
        let (nodes, contacts, upward) = (self.lattice.nodes(), plan.blocks, self.upward());
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let LatticeBody { lattice, springs_n, dashpots_n, outer_n, .. } = self;
        kernels::lattice_springs(springs_n, u, lattice);
        kernels::lattice_dashpots(dashpots_n, v, lattice);
        let first = if plan.friction.law.holds() || plan.friction.weakens() { 0 } else { D };
        for axis in first..lattice.axes() {
            let former = axis * contacts..(axis + 1) * contacts;
            self.former_displacement_m[former].copy_from_slice(&u[axis * nodes..][..contacts]);
        }
        for axis in 0..D {
            let of_contacts = axis * contacts..(axis + 1) * contacts;
            let tau_n = &mut state.tangential_force_n[of_contacts.clone()];
            if state.sliding > 0 {
                let direction = &mut self.direction[of_contacts];
                direction.copy_from_slice(&v[axis * nodes..][..contacts]);
                for n in &state.just_detached {
                    direction[*n as usize] = tau_n[*n as usize];
                }
            }
            let of_nodes = axis * nodes..axis * nodes + contacts;
            let [springs_n, dashpots_n, outer_n] =
                [&springs_n, &dashpots_n, &outer_n].map(|force_n| &force_n[of_nodes.clone()]);
            kernels::tangential_force(tau_n, springs_n, dashpots_n, outer_n);
        }
        if let Some(upward) = upward {
            self.apply_foundation(plan, state, upward);
        }
        let LatticeBody { outer_n, .. } = self;
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let dt = plan.grid.step_s();
        let dt_over_m = dt / plan.block_mass_kg;
        let may_switch = match (&mut self.junctions, &mut state.junctions) {
            (Some(junctions), Some(pinned)) => {
                let anchor_m = &mut state.stick_position_m;
                junctions.pull(pinned, anchor_m, outer_n, &self.strength, (state.step, u));
                true
            }
            _ => {
                let mut friction_n = self.friction_n.chunks_exact_mut(contacts);
                let mut outer_n = outer_n.chunks_exact_mut(nodes).map(|of_nodes| &mut of_nodes[..contacts]);
                let contacts = &mut ContactInputs {
                    u: along(u, nodes, contacts),
                    v: along(v, nodes, contacts),
                    anchor: along(&state.stick_position_m, contacts, contacts),
                    tau: along(&state.tangential_force_n, contacts, contacts),
                    slip: &state.slip,
                    any_slides: state.sliding > 0,
                    strengths: self.strength.of_contacts(plan, &state.memory),
                    kt: plan.friction.interfacial_stiffness_n_per_m,
                    dt_over_m,
                    outer: array::from_fn(|_| outer_n.next().expect("one for each axis")),
                    friction: array::from_fn(|_| friction_n.next().expect("one for each axis")),
                };
                self.law.apply_friction(contacts)
            }
        };
        let LatticeBody { springs_n, dashpots_n, outer_n, .. } = self;
        let (u, v) = (&mut state.displacement_m, &mut state.velocity_m_per_s);
        self.work = kernels::lattice_move(u, v, [springs_n, dashpots_n, outer_n], dt, dt_over_m);
        if let (Some(junctions), Some(pinned)) = (&mut self.junctions, &mut state.junctions) {
            let after = (state.step, &state.displacement_m[..]);
            return junctions.repin(pinned, &mut state.stick_position_m, &state.slip, &self.strength, after);
        }
        may_switch
    }

    fn mark_switches(&self, plan: &Plan, state: &SliderState, marks: &mut [u64]) {
        if let (Some(junctions), Some(pinned)) = (&self.junctions, &state.junctions) {
            return junctions.mark_switches(pinned, &state.slip, marks);
        }
        let (nodes, contacts) = (self.lattice.nodes(), state.slip.len());
        let after = After {
            slip: &state.slip,
            direction: along(&self.direction, contacts, contacts),
            v_new: along(&state.velocity_m_per_s, nodes, contacts),
            tau: along(&state.tangential_force_n, contacts, contacts),
            strengths: self.strength.of_contacts(plan, &state.memory),
        };
        self.law.switching(marks, &after);
    }

    fn remember(&self, plan: &Plan, state: &mut SliderState, switched: &[usize]) {
        self.law.remember(plan, state, &self.strength.sliding_friction_n, switched);
    }

    fn former_displacement_m(&self, freedom: usize) -> f64 {
        let (axis, n) = (freedom / self.lattice.nodes(), freedom % self.lattice.nodes());
        self.former_displacement_m[axis * self.lattice.contacts() + n]
    }

    fn add_step(&mut self, plan: &Plan, state: &mut SliderState, outside: Outside<'_>) {
        let (nodes, contacts, upward) = (self.lattice.nodes(), plan.blocks, self.upward());
        let lattice = &self.lattice;
        let [springs_w, dashpots_w, square] = self.work;
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let dt = plan.grid.step_s();
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let (point_m, advance_m) = (outside.point_m, outside.moved_m());
        let (mut drive_n, mut bent_j) = (0.0, 0.0);
        for spring in &plan.drive.springs {
            let (k, moved_m) = (spring.stiffness_n_per_m, dt * v[spring.block]);
            // Its pull with the drive point halfway through its step and the node at its old position.
            let stretch_m = (point_m - 0.5 * advance_m) - (u[spring.block] - moved_m - spring.rest_m);
            drive_n += k * stretch_m;
            bent_j += 0.5 * k * moved_m * moved_m;
        }
        let mut heat_j = 0.0;
        // Over an area contacts may be many, and are summed by a kernel.
        if D > 1 {
            let (v, friction) = (along(v, nodes, contacts), along(&self.friction_n, contacts, contacts));
            let [square, power_w] = kernels::friction_work::<D>(v, friction, &state.slip, state.sliding > 0);
            (heat_j, bent_j) = (dt * power_w, bent_j + 0.5 * kt * dt * dt * square);
        }
        let sums_contacts = D == 1 && self.junctions.is_none();
        let former_z_m = &self.former_displacement_m[D * contacts..];
        for n in 0..if sums_contacts || upward.is_some() { contacts } else { 0 } {
            if sums_contacts {
                let moved_m = dt * v[n];
                if state.slip[n] == 0.0 {
                    bent_j += 0.5 * kt * moved_m * moved_m;
                } else {
                    heat_j += self.friction_n[n] * moved_m;
                }
            }
            if let Some(upward) = &upward {
                bent_j += foundation_scheme_j(lattice, former_z_m[n], u[upward.start + n]);
            }
        }
        if let Some(junctions) = &self.junctions {
            let [of_junctions_j, scheme_j] = junctions.heat_and_scheme_j(&v[..contacts]);
            (heat_j, bent_j) = (of_junctions_j, bent_j + scheme_j);
        }
        let pressed_w: f64 = upward.map_or(0.0, |upward| {
            let parts = lattice.top_row().zip(&plan.top_load_n);
            parts.map(|(node, load_n)| -outside.load().scaled_n(*load_n) * v[upward.start + node]).sum()
        });
        if plan.friction.weakens() && state.sliding > 0 {
            let rubbing = Rubbing {
                u: along(&self.former_displacement_m, contacts, contacts),
                v: along(&self.direction, contacts, contacts),
                tau: along(&state.tangential_force_n, contacts, contacts),
                slip: &state.slip,
                strengths: self.strength.of_contacts(plan, &state.memory),
                dt_over_m: dt / plan.block_mass_kg,
            };
            let fracture_w = self.law.fracture_w(&rubbing, along(v, nodes, contacts));
            state.energy.fracture_energy_j.add(dt * fracture_w);
        }
        let ledger = &mut state.energy;
        ledger.drive_work_j.add(advance_m * drive_n);
        ledger.load_work_j.add(dt * pressed_w);
        ledger.friction_heat_j.add(heat_j);
        ledger.viscous_loss_j.add(-dt * dashpots_w);
        ledger.scheme_work_j.add(0.5 * dt * springs_w - 0.5 * plan.block_mass_kg * square + bent_j);
    }

    /// At rest it keeps the energy that its load has compressed into it.
    fn initial_j(&self) -> f64 {
        self.initial_j
    }

    fn energy(&mut self, plan: &Plan, state: &SliderState) -> Energy {
        let (ledger, u, v) = (&state.energy, &state.displacement_m, &state.velocity_m_per_s);
        let LatticeBody { lattice, springs_n, .. } = self;
        kernels::lattice_springs(springs_n, u, lattice);
        let ahead_w: f64 = springs_n.iter().zip(v).map(|(force, v)| force * v).sum();
        let (kinetic_j, elastic_j) = stored_j(plan, lattice, state);
        Energy {
            drive_work_j: ledger.drive_work_j.value(),
            prestress_work_j: ledger.load_work_j.value(),
            friction_heat_j: ledger.friction_heat_j.value(),
            anchor_change_j: ledger.anchor_change_j.value(),
            viscous_loss_j: ledger.viscous_loss_j.value(),
            kinetic_j,
            elastic_j,
            scheme_work_j: ledger.scheme_work_j.value() - 0.5 * plan.grid.step_s() * ahead_w,
            fracture_energy_j: plan.friction.weakens().then(|| ledger.fracture_energy_j.value()),
            ..Energy::default()
        }
    }
}

/// Energy that the time step adds at the foundation of a contact that moves from one height to another: the
/// change of the stored energy, less the work of its force.
fn foundation_scheme_j(lattice: &Lattice, from_m: f64, to_m: f64) -> f64 {
    let k = lattice.foundation_n_per_m;
    match (from_m < 0.0, to_m < 0.0) {
        (true, true) => 0.5 * k * (to_m - from_m) * (to_m - from_m),
        (true, false) => 0.5 * k * from_m * (from_m - 2.0 * to_m),
        (false, true) => 0.5 * k * to_m * to_m,
        (false, false) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::body::lattice::{BLOCK, SHEET};
    use asperity_model::law::magnitude;
    use asperity_model::plan::DriveSpring;
    use asperity_model::{Lattice, Plan};
    use asperity_model::{SliderState, resolve};

    use super::LatticeBody;
    use crate::energy::Bookkeeping;
    use crate::step::body::ChainBody;
    use crate::step::law::loops_over_area;
    use crate::step::single_step::SingleSteps;
    use crate::step::stepper::Stepper;

    const COUNTS: [usize; 3] = [4, 4, 3];

    /// A cubic block whose top layer is pressed down and pulled along `x` and along `y` at these
    /// velocities, starting from relaxed drive springs.
    fn block(velocities: [f64; 2]) -> (Arc<Plan>, Stepper<LatticeBody<2>>) {
        let scenario = resolve("slab", &["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7"]).unwrap();
        let mut plan = Plan::new(&scenario);
        let [columns, lanes, rows] = COUNTS;
        let lattice = Lattice {
            stiffness_n_per_m: 1e6,
            damping_kg_per_s: 20.0,
            foundation_n_per_m: 8e5,
            ..Lattice::of(&BLOCK, [columns, lanes, rows])
        };
        let (nodes, contacts) = (lattice.nodes(), lattice.contacts());
        plan.elastic = lattice;
        plan.blocks = contacts;
        plan.block_mass_kg = 1e-3;
        plan.top_load_n = vec![20.0; contacts];
        plan.normal_load_n = vec![20.0; contacts];
        plan.prestress_n = Vec::new();
        let friction = &mut plan.friction;
        friction.interfacial_stiffness_n_per_m = 1e6;
        friction.springs_n_per_m = vec![1e6; contacts];
        friction.static_coefficients = vec![0.4; contacts];
        friction.dynamic_coefficients = vec![0.2; contacts];
        friction.static_threshold_n = vec![8.0; contacts];
        friction.dynamic_friction_n = vec![4.0; contacts];
        plan.drive.velocity_m_per_s = 0.5;
        let top = lattice.top_row();
        let springs = [0, 1].into_iter().flat_map(|axis| top.clone().map(move |node| (axis, node)));
        plan.drive.springs = springs
            .filter(|(axis, _)| velocities[*axis] != 0.0)
            .map(|(axis, node)| DriveSpring {
                block: axis * nodes + node,
                stiffness_n_per_m: 1e5,
                rest_m: 0.0,
                direction: velocities[axis],
            })
            .collect();
        plan.initial = SliderState {
            displacement_m: vec![0.0; 3 * nodes],
            velocity_m_per_s: vec![0.0; 3 * nodes],
            stick_position_m: vec![0.0; 2 * contacts],
            hold_step: u64::MAX,
            ..SliderState::default()
        };
        plan.initial = SliderState::stuck(&plan);
        let plan = Arc::new(plan);
        let mut state = plan.initial.clone();
        state.tangential_force_n.resize(2 * contacts, 0.0);
        let body = LatticeBody::new(&plan, lattice, loops_over_area(plan.friction.law));
        (Arc::clone(&plan), Stepper::of(plan, state, body))
    }

    #[test]
    fn a_block_slips_along_the_vector_that_pulls_it_and_its_energies_balance() {
        let (plan, mut stepper) = block([1.0, 1.0]);
        let (nodes, contacts) = (plan.elastic.nodes(), plan.blocks);
        let mut switches = 0;
        for _ in 0..20_000 {
            stepper.take_step(u64::MAX);
            let state = stepper.state();
            for n in stepper.switched() {
                switches += 1;
                let tau = magnitude([state.tangential_force_n[*n], state.tangential_force_n[contacts + n]]);
                let detaches = state.slip[*n] != 0.0;
                assert!(!detaches || tau >= 0.4 * state.normal_load_n[*n], "{tau}");
            }
            // Columns and lanes are as many, so `x` and `y` may be exchanged.
            let [columns, lanes, _] = COUNTS;
            for node in 0..nodes {
                let (layer, at) = (node / (columns * lanes), node % (columns * lanes));
                let other = layer * columns * lanes + at % columns * lanes + at / columns;
                let [x, y] = [state.displacement_m[node], state.displacement_m[nodes + other]];
                assert!((x - y).abs() <= 1e-12, "node {node}: {x} {y}");
            }
        }
        let energy = stepper.energy();
        let ways = &stepper.state().displacement_m[..contacts];
        assert!(switches > 2 * contacts && ways.iter().all(|x| *x > 1e-4), "{switches} {ways:?}");
        let put_in_j = energy.drive_work_j + energy.prestress_work_j;
        let missing_j = energy.balance_j();
        assert!(energy.friction_heat_j > 0.1 * put_in_j, "{energy:?}");
        assert!(missing_j.abs() < 1e-11 * put_in_j, "{missing_j} of {put_in_j} J: {energy:?}");
    }

    /// A sheet of one row is a chain, and its rule of re-attachment the one-way rule: the same switches in the
    /// same steps.
    #[test]
    fn in_one_row_the_law_over_an_area_is_that_of_a_chain() {
        let sets = ["slider.blocks=40", "time.step_s=4e-7", "drive.velocity_m_per_s=2e-3"];
        let plan = Arc::new(Plan::new(&resolve("default", &sets).unwrap()));
        let chain = plan.elastic.as_chain().expect("a chain");
        let mut of_chain = Stepper::<ChainBody>::new(Arc::clone(&plan), &chain, Bookkeeping::EveryStep);
        let mut sheet = Plan::clone(&plan);
        let lattice = Lattice {
            stiffness_n_per_m: chain.stiffness_n_per_m,
            damping_kg_per_s: chain.damping_kg_per_s,
            ..Lattice::of(&SHEET, [40, 1, 1])
        };
        sheet.elastic = lattice;
        for values in [
            &mut sheet.initial.displacement_m,
            &mut sheet.initial.velocity_m_per_s,
            &mut sheet.initial.stick_position_m,
        ] {
            values.resize(80, 0.0);
        }
        sheet.initial = SliderState::stuck(&sheet);
        let sheet = Arc::new(sheet);
        let mut of_sheet = Stepper::<LatticeBody<2>>::new(sheet, &lattice, Bookkeeping::EveryStep);
        let (mut switches, mut largest_n) = (0, 0.0_f64);
        for _ in 0..400_000 {
            let (chain_n, sheet_n) =
                (of_chain.take_step(u64::MAX).total_n, of_sheet.take_step(u64::MAX).total_n);
            largest_n = largest_n.max(chain_n);
            assert!((chain_n - sheet_n).abs() < 1e-9 * largest_n, "{chain_n} {sheet_n}");
            let step = of_chain.state().step;
            assert_eq!(of_chain.switched(), of_sheet.switched(), "step {step}");
            switches += of_chain.switched().len();
        }
        let state = of_sheet.state();
        assert!(state.displacement_m[40..].iter().chain(&state.stick_position_m[40..]).all(|y| *y == 0.0));
        assert!(switches > 200, "{switches}");
    }

    #[test]
    fn pulled_along_one_axis_a_block_keeps_its_mirror_symmetry() {
        let (plan, mut stepper) = block([1.0, 0.0]);
        let (nodes, [columns, lanes, _]) = (plan.elastic.nodes(), COUNTS);
        for _ in 0..20_000 {
            stepper.take_step(u64::MAX);
        }
        let (u, mut slipped) = (&stepper.state().displacement_m, 0.0);
        for node in 0..nodes {
            let (layer, at) = (node / (columns * lanes), node % (columns * lanes));
            let mirrored = layer * columns * lanes + (lanes - 1 - at / columns) * columns + at % columns;
            assert_eq!(u[node], u[mirrored], "along x, node {node}");
            assert_eq!(u[nodes + node], -u[nodes + mirrored], "along y, node {node}");
            slipped += u[node];
        }
        assert!(slipped > 1e-4 * nodes as f64, "{slipped}");
    }
}
