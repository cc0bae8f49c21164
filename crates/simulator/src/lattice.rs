//! The steps of a slab, as the equations read ([`asperity_model::lattice`], docs/slab.md).
//!
//! Nodes move along `x` and `z`, contacts rub; contact `n` is node `n` of the bottom row. One step
//! from `t - dt` to `t`, everything from the old state:
//!
//! 1. springs and dashpots pull between nodes, `k e (e . (u_j - u_i)) + eta (v_j - v_i)`; the drive
//!    pulls with its point at the new time; the load of the new time presses on the top row;
//! 2. the foundation bears contact `n` with `p_n = -k_f u_z` where `u_z < 0`, and with nothing where
//!    the node has lifted off; all that is tangential on it is `tau_n`;
//! 3. friction is that of a chain (5.12-5.15), with this `p_n`: a stuck contact is pulled by
//!    `-k_t (u_x - u_stick)`, a sliding one by `-mu_d p_n sign(v_x)`;
//! 4. Euler-Cromer: `v += dt f / m`, then `u += dt v`;
//! 5. switches, in force from the next step: a stuck contact detaches at `|tau_n| >= mu_s p_n`, a
//!    sliding one whose new velocity has come to rest re-attaches at `u_stick = u_x - tau_n / k_t`.
//!
//! The loops over the nodes stand in [`crate::sweep`], compiled for several instruction sets with the
//! same bits; what is of the contacts, 57 of 1767 nodes in the default slab, is written out here.
//!
//! **Energies.** Forces do the work `F w` on the way `w = dt v'` ([`crate::energy`]). Springs between
//! nodes are linear, so `w M w / 2 = w (F_s - F_{s+1}) / 2` with `F_s` their pull in step `s`. With
//! `d = v' - v` the sum of that over the steps is the sum of `dt F_s d / 2`, less `dt F v / 2` of the
//! last state with the pull that it has: so a step costs one product, and who asks for energies adds
//! that last part. The foundation's is `E(u') - E(u)` less its force along the way, since a contact
//! may lift off on it. The work of the normal load stands where that of a chain's prestress does: both
//! are forces from outside.

use std::sync::Arc;

use asperity_model::lattice::Bond;
use asperity_model::{Lattice, Plan, Reattach};
use asperity_record::Energy;

use crate::contacts::{Load, StopForce, static_coefficient};
use crate::counters::Counters;
use crate::state::ChainState;
use crate::stepper::Driving;
use crate::sweep::{Forces, MovedWork, Sweeps};

/// A slab, and how it gets from one step to the next.
#[derive(Debug, Clone)]
pub(crate) struct LatticeStepper {
    plan: Arc<Plan>,
    lattice: Lattice,
    sweeps: Sweeps,
    state: ChainState,
    /// Pull of the springs and of the dashpots between nodes, and forces from outside, on all
    /// freedoms in the last step.
    springs_n: Vec<f64>,
    dashpots_n: Vec<f64>,
    outer_n: Vec<f64>,
    /// Velocities of the contacts, and how they stand, before the step.
    old_velocity_m_per_s: Vec<f64>,
    old_rise_m: Vec<f64>,
    /// The contacts that switched in the last step, counted from 0, ascending.
    switched: Vec<usize>,
    counters: Counters,
}

impl LatticeStepper {
    /// The slab at the start of a plan, with sweeps for a certain instruction set.
    ///
    /// # Panics
    /// If the plan is of a chain.
    pub(crate) fn new(plan: Arc<Plan>, sweeps: Sweeps) -> LatticeStepper {
        let lattice = *plan.elastic.lattice().expect("a plan of a slab");
        let zeros = || vec![0.0; lattice.freedoms()];
        LatticeStepper {
            state: ChainState::initial(&plan),
            springs_n: zeros(),
            dashpots_n: zeros(),
            outer_n: zeros(),
            old_velocity_m_per_s: vec![0.0; lattice.columns],
            old_rise_m: vec![0.0; lattice.columns],
            switched: Vec::new(),
            counters: Counters::default(),
            plan,
            lattice,
            sweeps,
        }
    }

    /// The state after the last step taken.
    pub(crate) fn state(&self) -> &ChainState {
        &self.state
    }

    /// The same, for a solver that takes many steps at once.
    pub(crate) fn state_mut(&mut self) -> &mut ChainState {
        &mut self.state
    }

    /// The contacts that switched in the last step, counted from 0.
    pub(crate) fn switched(&self) -> &[usize] {
        &self.switched
    }

    /// What the steps taken up to now were made of.
    pub(crate) fn counters(&self) -> Counters {
        self.counters
    }

    /// Continues from a state.
    ///
    /// # Panics
    /// If it is of a slider of another size.
    pub(crate) fn restore(&mut self, state: &ChainState) {
        let freedoms = self.lattice.freedoms();
        assert_eq!(state.displacement_m.len(), freedoms, "the state of a slider of another size");
        self.state = state.clone();
        self.switched.clear();
    }

    /// Takes one step; returns the driving forces that it used.
    pub(crate) fn take_step(&mut self) -> Driving {
        let LatticeStepper { plan, lattice, sweeps, state, springs_n, dashpots_n, outer_n, .. } = self;
        let (nodes, contacts) = (lattice.nodes(), lattice.columns);
        let dt = plan.grid.step_s();
        state.step += 1;
        state.sliding = state.detached;
        let load = Load::in_step(plan, state.step, state.hold_step);
        sweeps.lattice_pull(springs_n, dashpots_n, &state.displacement_m, &state.velocity_m_per_s, lattice);
        for (node, load_n) in lattice.top_row().zip(&plan.top_load_n) {
            outer_n[nodes + node] = -load.scaled_n(*load_n);
        }
        // The drive is taken at the new time, the nodes where they were.
        let point_m = plan.drive_point_m(state.step, state.hold_step);
        outer_n[..contacts].fill(0.0);
        let mut total_n = 0.0;
        for spring in &plan.drive.springs {
            let force_n = spring.force_n(point_m, state.displacement_m[spring.block]);
            outer_n[spring.block] = force_n;
            total_n += force_n;
        }
        let (kt, friction) = (plan.friction.interfacial_stiffness_n_per_m, &plan.friction);
        let mut in_air = 0;
        for n in 0..contacts {
            let (u, v) = (state.displacement_m[n], state.velocity_m_per_s[n]);
            let rise_m = state.displacement_m[nodes + n];
            let normal_load_n = lattice.normal_load_n(rise_m);
            in_air += u64::from(normal_load_n == 0.0);
            let tau = (springs_n[n] + dashpots_n[n]) + outer_n[n];
            let friction_n = if state.slip[n] == 0.0 {
                -kt * (u - state.stick_position_m[n])
            } else if v == 0.0 {
                0.0
            } else {
                -(friction.dynamic_coefficients[n] * normal_load_n).copysign(v)
            };
            state.tangential_force_n[n] = tau;
            state.normal_load_n[n] = normal_load_n;
            outer_n[n] += friction_n;
            outer_n[nodes + n] = normal_load_n;
            self.old_velocity_m_per_s[n] = v;
            self.old_rise_m[n] = rise_m;
        }
        let forces = Forces {
            springs: springs_n,
            dashpots: dashpots_n,
            outer: outer_n,
            dt,
            dt_over_m: dt / plan.block_mass_kg,
        };
        let work = sweeps.lattice_move(&mut state.displacement_m, &mut state.velocity_m_per_s, &forces);
        self.add_step(&work, point_m, load);
        self.switch_contacts();
        self.counters.plain_steps += 1;
        self.counters.contact_steps_in_air += in_air;
        self.counters.switches += self.switched.len() as u64;
        let stop = StopForce::of(&self.plan, self.state.hold_step);
        if stop.is_some_and(|stop| total_n >= stop.under_n(load)) {
            self.state.hold_step = self.state.step;
        }
        Driving { total_n, ends_n: None }
    }

    /// Puts the switches of this step in force for the next.
    fn switch_contacts(&mut self) {
        let (plan, state) = (&*self.plan, &mut self.state);
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let two_way = plan.friction.reattach == Reattach::TwoWay;
        let held_j = |state: &ChainState, n: usize| {
            let stretch_m = state.displacement_m[n] - state.stick_position_m[n];
            0.5 * kt * stretch_m * stretch_m
        };
        // Energy of the friction springs that take hold, less of those that let go.
        let mut anchored_j = 0.0;
        self.switched.clear();
        for n in 0..plan.blocks {
            let (tau, new_v) = (state.tangential_force_n[n], state.velocity_m_per_s[n]);
            if state.slip[n] != 0.0 {
                let rests = if two_way { new_v * self.old_velocity_m_per_s[n] <= 0.0 } else { new_v <= 0.0 };
                if !rests {
                    continue;
                }
                state.slip[n] = 0.0;
                state.detached -= 1;
                state.stick_position_m[n] = state.displacement_m[n] - tau / kt;
                if plan.friction.ageing.is_some() {
                    state.stuck_since_step[n] = state.step;
                }
                anchored_j += held_j(state, n);
            } else {
                // No contact is weaker than a young one, and logarithms take time.
                let normal_load_n = state.normal_load_n[n];
                if tau.abs() < plan.friction.static_coefficients[n] * normal_load_n
                    || tau.abs() < static_coefficient(plan, state, n) * normal_load_n
                {
                    continue;
                }
                state.slip[n] = 1.0;
                state.detached += 1;
                anchored_j -= held_j(state, n);
            }
            self.switched.push(n);
        }
        if !self.switched.is_empty() {
            state.energy.anchor_change_j.add(anchored_j);
        }
    }

    /// Adds what the step did to the energies.
    fn add_step(&mut self, work: &MovedWork, point_m: f64, load: Load) {
        let (plan, lattice) = (&*self.plan, &self.lattice);
        let (nodes, state) = (lattice.nodes(), &mut self.state);
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let ledger = &mut state.energy;
        let dt = plan.grid.step_s();
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let moves = state.step <= state.hold_step;
        let advance_m = if moves { plan.drive.velocity_m_per_s * dt } else { 0.0 };
        let (mut drive_n, mut bent_j) = (0.0, 0.0);
        for spring in &plan.drive.springs {
            let (k, way_m) = (spring.stiffness_n_per_m, dt * v[spring.block]);
            // Its pull in the middle of the point's way, the node where it was.
            let stretch_m = (point_m - 0.5 * advance_m) - (u[spring.block] - way_m - spring.rest_m);
            drive_n += k * stretch_m;
            bent_j += 0.5 * k * way_m * way_m;
        }
        let mut heat_j = 0.0;
        for n in lattice.row(0) {
            let way_m = dt * v[n];
            if state.slip[n] == 0.0 {
                bent_j += 0.5 * kt * way_m * way_m;
            } else {
                let old_v = self.old_velocity_m_per_s[n];
                let drag_n = plan.friction.dynamic_coefficients[n] * state.normal_load_n[n];
                heat_j += if old_v == 0.0 { 0.0 } else { drag_n.copysign(old_v) * way_m };
            }
            bent_j += foundation_scheme_j(lattice, self.old_rise_m[n], u[nodes + n]);
        }
        let parts = lattice.top_row().zip(&plan.top_load_n);
        let pressed_w: f64 = parts.map(|(node, load_n)| -load.scaled_n(*load_n) * v[nodes + node]).sum();
        ledger.drive_work_j.add(advance_m * drive_n);
        ledger.load_work_j.add(dt * pressed_w);
        ledger.friction_heat_j.add(heat_j);
        ledger.viscous_loss_j.add(-dt * work.dashpots);
        ledger.scheme_work_j.add(0.5 * dt * work.springs - 0.5 * plan.block_mass_kg * work.square + bent_j);
    }

    /// Energies at the end of the last step.
    pub(crate) fn energy(&mut self) -> Energy {
        let ledger = self.state.energy;
        let LatticeStepper { plan, lattice, sweeps, state, springs_n, dashpots_n, .. } = self;
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        sweeps.lattice_pull(springs_n, dashpots_n, u, v, lattice);
        let ahead_w: f64 = springs_n.iter().zip(v).map(|(force, v)| force * v).sum();
        let (kinetic_j, elastic_j) = stored_j(plan, state);
        Energy {
            drive_work_j: ledger.drive_work_j.value(),
            prestress_work_j: ledger.load_work_j.value(),
            friction_heat_j: ledger.friction_heat_j.value(),
            anchor_change_j: ledger.anchor_change_j.value(),
            viscous_loss_j: ledger.viscous_loss_j.value(),
            kinetic_j,
            elastic_j,
            scheme_work_j: ledger.scheme_work_j.value() - 0.5 * plan.grid.step_s() * ahead_w,
        }
    }
}

/// What the time step adds at the foundation of a contact that goes from one height to another: what
/// is stored there then and was not before, and what its force did along the way.
fn foundation_scheme_j(lattice: &Lattice, from_m: f64, to_m: f64) -> f64 {
    let k = lattice.foundation_n_per_m;
    match (from_m < 0.0, to_m < 0.0) {
        (true, true) => 0.5 * k * (to_m - from_m) * (to_m - from_m),
        (true, false) => 0.5 * k * from_m * (from_m - 2.0 * to_m),
        (false, true) => 0.5 * k * to_m * to_m,
        (false, false) => 0.0,
    }
}

/// Kinetic and elastic energy of a state of a slab.
///
/// # Panics
/// If the plan is of a chain.
pub(crate) fn stored_j(plan: &Plan, state: &ChainState) -> (f64, f64) {
    let lattice = plan.elastic.lattice().expect("a plan of a slab");
    let (nodes, u, v) = (lattice.nodes(), &state.displacement_m, &state.velocity_m_per_s);
    let square: f64 = v.iter().map(|v| v * v).sum();
    let mut elastic_j = 0.0;
    lattice.over_bonds(|Bond { from, to, along, stiffness_n_per_m }| {
        let stretch_m = along[0] * (u[to] - u[from]) + along[1] * (u[nodes + to] - u[nodes + from]);
        elastic_j += 0.5 * stiffness_n_per_m * stretch_m * stretch_m;
    });
    let (kt, kf) = (plan.friction.interfacial_stiffness_n_per_m, lattice.foundation_n_per_m);
    for n in lattice.row(0) {
        if state.slip[n] == 0.0 {
            let stretch_m = u[n] - state.stick_position_m[n];
            elastic_j += 0.5 * kt * stretch_m * stretch_m;
        }
        let sunk_m = u[nodes + n].min(0.0);
        elastic_j += 0.5 * kf * sunk_m * sunk_m;
    }
    let point_m = plan.drive_point_m(state.step, state.hold_step);
    for spring in &plan.drive.springs {
        let stretch_m = point_m - (u[spring.block] - spring.rest_m);
        elastic_j += 0.5 * spring.stiffness_n_per_m * stretch_m * stretch_m;
    }
    (0.5 * plan.block_mass_kg * square, elastic_j)
}
