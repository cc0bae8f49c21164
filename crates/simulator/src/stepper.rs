//! The stepper: one step after the other, as the equations of Chapter 5 read. Both solvers
//! take their single steps with it.
//!
//! Nodes move, contacts rub; node `n` of a chain carries contact `n`. One step from `t - dt`
//! to `t`, everything from the old state:
//!
//! 1. the tangential force on a node without friction (5.6, 5.7, 5.8), from its neighbours
//!    ([`asperity_model::Elastic`]) and the drive:
//!    `tau_n = k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1}) + F_n`,
//!    and the constant prestress where there is one;
//! 2. friction: the spring of a stuck contact pulls with `-k_t (u_n - u_stick,n)` (5.12), a
//!    sliding one with `-mu_d p_n sign(v_n)` (5.14);
//! 3. Euler-Cromer (4.13, 4.14): `v_n += dt (tau_n + f_n) / m`, then `u_n += dt v_n`;
//! 4. switches, in force from the next step: a stuck contact detaches at
//!    `|tau_n| >= mu_s p_n` (5.13); a sliding one whose new velocity has come to
//!    rest re-attaches at `u_stick,n = u_n - tau_n / k_t` (5.15), with the new
//!    position, this step's `tau_n`, and its velocity kept.
//!
//! What `mu_s p_n` and `mu_d p_n` are in a step is told by [`crate::contacts`]; 1 to 3, and whether
//! anything switches, are one sweep ([`crate::sweep`]).

use std::sync::Arc;

use asperity_model::{Law, Plan, Reattach};
use asperity_record::Energy;

use crate::contacts::{Contacts, Load, StopForce, aged_threshold_n};
use crate::counters::Counters;
use crate::energy::{Accounts, Bookkeeping, Velocities};
use crate::state::ChainState;
use crate::sweep::{After, Blocks, Constants, Steps, Sweeps};

/// A slider, and how it gets from one step to the next.
#[derive(Debug, Clone)]
pub(crate) struct Stepper {
    plan: Arc<Plan>,
    state: ChainState,
    sweeps: Sweeps,
    constants: Constants,
    /// Displacements and velocities after the step, while those before it are still
    /// needed.
    new_displacement_m: Vec<f64>,
    new_velocity_m_per_s: Vec<f64>,
    /// Tangential forces of the step before.
    old_tangential_force_n: Vec<f64>,
    /// Force from outside on each node in the last step, by the drive and the prestress; whether
    /// the drive pulls both ways, and whether any but the ends are pulled.
    outer_force_n: Vec<f64>,
    pulls_both_ways: bool,
    pulls_inside: bool,
    /// What the contacts bear in the last step.
    contacts: Contacts,
    /// The contacts that may switch, as bits.
    marks: Vec<u64>,
    /// The contacts that switched in the last step, counted from 0, ascending.
    switched: Vec<usize>,
    counters: Counters,
    accounts: Accounts,
}

/// What the drive does in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driving {
    /// Sum of the forces on all nodes, N.
    pub total_n: f64,
    /// The forces on the first and the last block where the drive pulls both ways.
    pub ends_n: Option<[f64; 2]>,
}

impl Stepper {
    /// The slider at the start of a plan, with sweeps for a certain instruction set.
    pub(crate) fn new(plan: Arc<Plan>, sweeps: Sweeps, keeping: Bookkeeping) -> Stepper {
        let state = ChainState::initial(&plan);
        let dt = plan.grid.step_s();
        let (nodes, contacts) = (plan.elastic.nodes(), plan.elastic.contacts());
        Stepper {
            constants: Constants {
                dt,
                dt_over_m: dt / plan.block_mass_kg,
                kt: plan.friction.interfacial_stiffness_n_per_m,
                two_way: plan.friction.reattach == Reattach::TwoWay,
                weakening: match plan.friction.law {
                    Law::Springs => 0.0,
                    Law::Rigid { weakening_s_per_m, .. } => weakening_s_per_m,
                },
                radiation: match plan.friction.law {
                    Law::Springs => 0.0,
                    Law::Rigid { radiation_kg_per_s, .. } => radiation_kg_per_s,
                },
            },
            outer_force_n: if plan.prestress_n.is_empty() {
                vec![0.0; nodes]
            } else {
                plan.prestress_n.clone()
            },
            pulls_both_ways: plan.drive.pulls_both_ways(),
            pulls_inside: plan.drive.pulls_inside(plan.blocks) || !plan.prestress_n.is_empty(),
            contacts: Contacts::new(&plan),
            marks: vec![0; contacts.div_ceil(64)],
            new_displacement_m: vec![0.0; nodes],
            new_velocity_m_per_s: vec![0.0; nodes],
            old_tangential_force_n: vec![0.0; nodes],
            accounts: Accounts::new(&plan, &state, sweeps, keeping),
            plan,
            state,
            sweeps,
            switched: Vec::new(),
            counters: Counters::default(),
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

    /// Energies at the end of the last step.
    pub(crate) fn energy(&mut self) -> Energy {
        self.accounts.energy(&self.plan, &self.state)
    }

    /// The energies' accounts, and the state that they are kept in.
    pub(crate) fn accounts_mut(&mut self) -> (&mut Accounts, &mut ChainState) {
        (&mut self.accounts, &mut self.state)
    }

    /// Has single steps add up what they do where so few lie between one record and the next that the
    /// ends of a span would take longer.
    pub(crate) fn add_up(&mut self, steps: u64) {
        if self.accounts.adds_so_few(steps) {
            self.accounts.end(&self.plan, &mut self.state);
            self.state.single_steps = u64::MAX;
        }
    }

    /// Takes one step; returns the driving forces that it used.
    pub(crate) fn take_step(&mut self) -> Driving {
        let hold_step = self.state.hold_step;
        let by_steps = self.accounts.adds_single_steps(&self.state);
        if !by_steps {
            let next_step = self.state.step + 1;
            self.accounts.begin(&self.plan, &mut self.state, next_step);
        }
        self.state.step += 1;
        self.state.sliding = self.state.detached;
        if self.contacts.change() {
            let load = Load::in_step(&self.plan, self.state.step, self.state.hold_step);
            self.contacts.follow(&self.plan, &self.state, load);
        }
        let (plan, state) = (&*self.plan, &mut self.state);
        // The drive is taken at the new time, the nodes where they were.
        let point_m = plan.drive_point_m(state.step, state.hold_step);
        let (mut total_n, mut ends_n, mut along_n) = (0.0, [0.0; 2], 0.0);
        for spring in &plan.drive.springs {
            let force_n = spring.force_n(point_m, state.displacement_m[spring.block]);
            self.outer_force_n[spring.block] = match plan.prestress_n.get(spring.block) {
                None => force_n,
                Some(prestress_n) => prestress_n + force_n,
            };
            total_n += force_n;
            along_n += spring.direction * force_n;
            if spring.block == 0 {
                ends_n[0] = force_n;
            } else if spring.block == plan.blocks - 1 {
                ends_n[1] = force_n;
            }
        }
        self.accounts.add_drive_step(&mut state.energy, along_n, state.step <= state.hold_step);
        let driving = Driving { total_n, ends_n: self.pulls_both_ways.then_some(ends_n) };
        let old = Blocks {
            elastic: &plan.elastic,
            u: &state.displacement_m,
            v: &state.velocity_m_per_s,
            u_stick: &state.stick_position_m,
            slip: &state.slip,
            threshold: &self.contacts.threshold_n,
            sliding_friction: &self.contacts.sliding_friction_n,
            outer_force: &self.outer_force_n,
        };
        std::mem::swap(&mut state.tangential_force_n, &mut self.old_tangential_force_n);
        let new = (&mut self.new_displacement_m[..], &mut self.new_velocity_m_per_s[..]);
        let (tau, constants) = (&mut state.tangential_force_n[..], &self.constants);
        let any_switch = match plan.friction.law {
            Law::Springs if self.pulls_inside => {
                self.sweeps.step_driven_everywhere(new.0, new.1, tau, &old, constants)
            }
            Law::Springs => self.sweeps.step(new.0, new.1, tau, &old, constants),
            Law::Rigid { .. } => self.sweeps.rigid_step(new.0, new.1, tau, &old, constants),
        };
        std::mem::swap(&mut state.displacement_m, &mut self.new_displacement_m);
        self.switched.clear();
        // By the laws without friction springs, blocks that stop do so in this step.
        let rigid = self.plan.friction.law != Law::Springs;
        if by_steps && !rigid {
            self.add_step();
        }
        if any_switch {
            self.switch_blocks();
        }
        if by_steps && rigid {
            self.add_step();
        }
        std::mem::swap(&mut self.state.velocity_m_per_s, &mut self.new_velocity_m_per_s);
        self.counters.plain_steps += 1;
        self.counters.switches += self.switched.len() as u64;
        self.stop_at_load(total_n);
        if !by_steps {
            let is_last = !self.switched.is_empty() || self.state.hold_step != hold_step;
            self.accounts.pass(&self.plan, &mut self.state, is_last);
        }
        driving
    }

    /// Adds what the step did to the energies.
    fn add_step(&mut self) {
        let step = Velocities {
            before: &self.state.velocity_m_per_s,
            after: &self.new_velocity_m_per_s,
            slip: &self.state.slip,
            sliding_friction_n: &self.contacts.sliding_friction_n,
        };
        self.accounts.add_step(&self.plan, &mut self.state.energy, &step);
    }

    /// Stops the drive point where the load has been reached that it is to be driven to.
    fn stop_at_load(&mut self, total_n: f64) {
        let stop = StopForce::of(&self.plan, self.state.hold_step);
        if stop.is_some_and(|stop| total_n >= stop.under_n(self.contacts.load)) {
            self.state.hold_step = self.state.step;
        }
    }

    /// Steps until the first contact would switch, if forces and velocities went on as they
    /// did from the step before the last to the last, in which none may have switched.
    pub(crate) fn foreseen_steps(&self) -> f64 {
        let state = &self.state;
        let steps = Steps {
            tau: &state.tangential_force_n,
            tau_before: &self.old_tangential_force_n,
            v: &state.velocity_m_per_s,
            v_before: &self.new_velocity_m_per_s,
        };
        let decline = if self.contacts.change() {
            self.contacts.load.fall_to(Load::in_step(&self.plan, state.step + 1, state.hold_step))
        } else {
            0.0
        };
        self.sweeps.crossing_ahead(&steps, &state.slip, &self.contacts.threshold_n, decline)
    }

    /// Puts the switches of this step in force for the next.
    fn switch_blocks(&mut self) {
        let (plan, state) = (&*self.plan, &mut self.state);
        let friction = &plan.friction;
        let rigid = friction.law != Law::Springs;
        // Energy of the friction springs that take hold, less of those that let go.
        let kt = friction.interfacial_stiffness_n_per_m;
        let held_j = |state: &ChainState, n: usize| {
            let stretch_m = state.displacement_m[n] - state.stick_position_m[n];
            0.5 * kt * stretch_m * stretch_m
        };
        let mut anchored_j = 0.0;
        let after = After {
            slip: &state.slip,
            v: &state.velocity_m_per_s,
            v_new: &self.new_velocity_m_per_s,
            tau: &state.tangential_force_n,
            threshold: &self.contacts.threshold_n,
            two_way: friction.reattach == Reattach::TwoWay,
            rigid,
        };
        self.sweeps.switching(&mut self.marks, &after);
        for group in 0..self.marks.len() {
            let mut mark = self.marks[group];
            while mark != 0 {
                let n = group * 64 + mark.trailing_zeros() as usize;
                mark &= mark - 1;
                let tau = state.tangential_force_n[n];
                if state.slip[n] != 0.0 {
                    state.slip[n] = 0.0;
                    if rigid {
                        // It stays where it was before the step that would have turned it round.
                        self.new_velocity_m_per_s[n] = 0.0;
                        state.displacement_m[n] = self.new_displacement_m[n];
                        state.stick_position_m[n] = state.displacement_m[n];
                    } else {
                        state.stick_position_m[n] =
                            state.displacement_m[n] - tau / friction.interfacial_stiffness_n_per_m;
                        anchored_j += held_j(state, n);
                    }
                    if friction.ageing.is_some() {
                        state.stuck_since_step[n] = state.step;
                        state.aged_threshold_n[n] = friction.static_threshold_n[n];
                    }
                    state.detached -= 1;
                } else {
                    if friction.ageing.is_some() {
                        // The threshold that was known may be behind.
                        let aged = aged_threshold_n(plan, n, &state.stuck_since_step, state.step);
                        state.aged_threshold_n[n] = aged;
                        if tau.abs() < self.contacts.load.scaled_n(aged) {
                            continue;
                        }
                    }
                    anchored_j -= held_j(state, n);
                    state.slip[n] = 1.0;
                    state.detached += 1;
                }
                self.switched.push(n);
            }
        }
        state.energy.anchor_change_j.add(anchored_j);
    }

    /// What the steps taken up to now were made of.
    pub(crate) fn counters(&self) -> Counters {
        self.counters
    }

    /// Continues from a state.
    ///
    /// # Panics
    /// If it is of a chain of another size.
    pub(crate) fn restore(&mut self, state: &ChainState) {
        assert_eq!(state.displacement_m.len(), self.plan.blocks, "the state of a chain of another size");
        self.state = state.clone();
        self.switched.clear();
        self.accounts.follow(&self.plan, &self.state);
    }
}
