//! The chain in steps: every node carries a contact.
//!
//! Its loops go over arrays of all blocks at once ([`crate::kernels`]); displacements and velocities of
//! a step are written beside those of the step before.

use std::sync::Arc;

use asperity_model::body::elastic::Chain;
use asperity_model::law::magnitude;
use asperity_model::plan::outside::Outside;
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use crate::energy::{Accounts, Bookkeeping};
use crate::kernels::{self, After, Blocks, Moved};
use crate::step::body::{Body, OfPlan};
use crate::step::junctions::JunctionLoops;
use crate::step::law::{ChainLoops, Rubbing, loops};
use crate::step::strength::Strength;

/// A chain of blocks.
#[derive(Debug, Clone)]
pub(crate) struct ChainBody {
    chain: Chain,
    law: Arc<dyn ChainLoops>,
    /// Contacts of junctions, which pull at the blocks from outside: for all other loops the blocks are free.
    junctions: Option<JunctionLoops>,
    /// 1 for every block.
    free: Vec<f64>,
    /// Displacements, velocities and tangential forces before the step.
    former_displacement_m: Vec<f64>,
    former_velocity_m_per_s: Vec<f64>,
    former_tangential_force_n: Vec<f64>,
    /// Forces of the friction springs in the last step and in the next, by a law by which these detach contacts.
    by_springs: Option<[Vec<f64>; 2]>,
    /// External force on each node, from the drive and the prestress, and whether any node but two ends is
    /// pulled.
    outer_force_n: Vec<f64>,
    prestress_n: Vec<f64>,
    is_pulled_inside: bool,
    /// Normal loads of the contacts in the last step.
    strength: Strength,
    accounts: Accounts,
    /// Whether the current step is added by itself, outside any span.
    adds_alone: bool,
}

impl ChainBody {
    /// The energies' accounts.
    pub(crate) fn accounts_mut(&mut self) -> &mut Accounts {
        &mut self.accounts
    }

    /// Steps until the first contact would switch, by linear extrapolation of forces and velocities from
    /// the last two steps, in which none may have switched.
    pub(crate) fn foreseen_steps(&self, plan: &Plan, state: &SliderState) -> f64 {
        let forces_n: [&[f64]; 2] = match &self.by_springs {
            Some([last_n, next_n]) => [next_n, last_n],
            None => [&state.tangential_force_n, &self.former_tangential_force_n],
        };
        let velocities: [&[f64]; 2] = [&state.velocity_m_per_s, &self.former_velocity_m_per_s];
        let decline = if self.strength.changes() {
            self.strength.load.fall_to(plan.outside(state.step + 1, state.hold_step).load())
        } else {
            0.0
        };
        kernels::crossing_ahead(forces_n, velocities, &state.slip, &self.strength.threshold_n, decline)
    }
}

impl OfPlan for ChainBody {
    type Elastic = Chain;

    fn of_plan(plan: &Plan, &chain: &Chain, state: &SliderState, keeping: Bookkeeping) -> ChainBody {
        let zeros = || vec![0.0; chain.nodes];
        ChainBody {
            law: loops(plan.friction.law),
            junctions: JunctionLoops::of(plan),
            free: vec![1.0; chain.nodes],
            former_displacement_m: zeros(),
            former_velocity_m_per_s: zeros(),
            former_tangential_force_n: zeros(),
            by_springs: plan.friction.law.detaches_by_spring().then(|| [zeros(), zeros()]),
            outer_force_n: zeros(),
            prestress_n: plan.outside(state.step, state.hold_step).prestress_n().into_owned(),
            // Both ends of one block are the same node.
            is_pulled_inside: chain.nodes == 1
                || plan.drive.pulls_inside(chain.nodes)
                || !plan.prestress_n.is_empty()
                || plan.prestress_course.is_some()
                || plan.friction.law.holds()
                || plan.friction.law.junctions().is_some(),
            strength: Strength::new(plan),
            accounts: Accounts::new(plan, chain, state, keeping),
            adds_alone: true,
            chain,
        }
    }
}

impl Body for ChainBody {
    fn begin_in(&mut self, plan: &Plan, state: &mut SliderState) {
        if state.energy.span.take().is_some() {
            self.accounts.begin(plan, state, state.step);
        }
    }

    #[inline]
    fn begin_step(&mut self, plan: &Plan, state: &mut SliderState, steps_ahead: u64) {
        self.adds_alone = self.accounts.adds_single_steps(state, steps_ahead);
        if !self.adds_alone {
            let next_step = state.step + 1;
            self.accounts.begin(plan, state, next_step);
        }
    }

    #[inline]
    fn apply_load(&mut self, plan: &Plan, state: &mut SliderState, outside: Outside<'_>) {
        if plan.contact_load_course.is_some() {
            state.normal_load_n = outside.loads_n();
            self.strength.update(plan, &state.normal_load_n);
        } else if self.strength.changes() {
            self.strength.follow(plan, state, outside.load());
        }
        if plan.prestress_course.is_some() {
            self.prestress_n = outside.prestress_n().into_owned();
        }
        match self.prestress_n.as_slice() {
            [] if self.is_pulled_inside => self.outer_force_n.fill(0.0),
            // Only its ends are pulled.
            [] => [0, self.chain.nodes - 1].into_iter().for_each(|end| self.outer_force_n[end] = 0.0),
            prestress_n => self.outer_force_n.copy_from_slice(prestress_n),
        }
    }

    #[inline]
    fn add_force(&mut self, freedom: usize, force_n: f64) {
        self.outer_force_n[freedom] += force_n;
    }

    #[inline]
    fn add_drive(&mut self, state: &mut SliderState, along_n: f64, moved_m: f64) {
        self.accounts.add_drive_step(&mut state.energy, along_n, moved_m);
    }

    #[inline]
    fn advance(&mut self, plan: &Plan, state: &mut SliderState) -> bool {
        let dt = plan.grid.step_s();
        let (step, strength) = (state.step, &self.strength);
        if let (Some(junctions), Some(pinned)) = (&mut self.junctions, &mut state.junctions) {
            let (outer_n, anchor_m) = (&mut self.outer_force_n, &mut state.stick_position_m);
            junctions.pull(pinned, anchor_m, outer_n, strength, (step, &state.displacement_m));
        }
        std::mem::swap(&mut state.tangential_force_n, &mut self.former_tangential_force_n);
        let old = Blocks {
            chain: &self.chain,
            u: &state.displacement_m,
            v: &state.velocity_m_per_s,
            outer_force: &self.outer_force_n,
            is_pulled_inside: self.is_pulled_inside,
            u_stick: &state.stick_position_m,
            slip: if self.junctions.is_some() { &self.free } else { &state.slip },
            strengths: self.strength.of_contacts(plan, &state.memory),
            dt,
            dt_over_m: dt / plan.block_mass_kg,
            kt: &plan.friction.springs_n_per_m,
        };
        let new = (&mut self.former_displacement_m[..], &mut self.former_velocity_m_per_s[..]);
        let may_switch = self.law.step(new, &mut state.tangential_force_n, &old);
        // The arrays just written become the new state; the old one is kept for the energies.
        std::mem::swap(&mut state.displacement_m, &mut self.former_displacement_m);
        std::mem::swap(&mut state.velocity_m_per_s, &mut self.former_velocity_m_per_s);
        if let Some([last_n, next_n]) = &mut self.by_springs {
            let springs = &plan.friction.springs_n_per_m;
            for (force_n, u) in [(last_n, &self.former_displacement_m), (next_n, &state.displacement_m)] {
                let anchored = u.iter().zip(&state.stick_position_m).zip(springs);
                for (force_n, ((u, u_stick), kt)) in force_n.iter_mut().zip(anchored) {
                    *force_n = kt * (u - u_stick);
                }
            }
        }
        let (Some(junctions), Some(pinned)) = (&mut self.junctions, &mut state.junctions) else {
            return may_switch;
        };
        // The tangential force is that without friction.
        for (tau_n, friction_n) in state.tangential_force_n.iter_mut().zip(&junctions.friction_n) {
            *tau_n += friction_n;
        }
        let after = (step, &state.displacement_m[..]);
        junctions.repin(pinned, &mut state.stick_position_m, &state.slip, strength, after)
    }

    fn mark_switches(&self, plan: &Plan, state: &SliderState, marks: &mut [u64]) {
        if let (Some(junctions), Some(pinned)) = (&self.junctions, &state.junctions) {
            return junctions.mark_switches(pinned, &state.slip, marks);
        }
        let after = After {
            slip: &state.slip,
            direction: [&self.former_velocity_m_per_s],
            v_new: [&state.velocity_m_per_s],
            tau: [self.by_springs.as_ref().map_or(&state.tangential_force_n, |[last_n, _]| last_n)],
            strengths: self.strength.of_contacts(plan, &state.memory),
        };
        self.law.switching(marks, &after);
    }

    fn detaching_force_n(&self, _: &Plan, state: &SliderState, n: usize) -> f64 {
        magnitude([self.by_springs.as_ref().map_or(&state.tangential_force_n, |[last_n, _]| last_n)[n]])
    }

    fn remember(&self, plan: &Plan, state: &mut SliderState, switched: &[usize]) {
        self.law.remember(plan, state, &self.strength.sliding_friction_n, switched);
    }

    fn former_displacement_m(&self, freedom: usize) -> f64 {
        self.former_displacement_m[freedom]
    }

    #[inline]
    fn add_step(&mut self, plan: &Plan, state: &mut SliderState, outside: Outside<'_>) {
        if !self.adds_alone {
            return;
        }
        let moved = Moved {
            chain: &self.chain,
            u: &self.former_displacement_m,
            v: &self.former_velocity_m_per_s,
            v_new: &state.velocity_m_per_s,
            tau: &state.tangential_force_n,
            slip: if self.junctions.is_some() { &self.free } else { &state.slip },
            strengths: self.strength.of_contacts(plan, &state.memory),
            kt: &plan.friction.springs_n_per_m,
            dt: plan.grid.step_s(),
            mass: plan.block_mass_kg,
        };
        let (slip, velocities) = (moved.slip, [moved.v, moved.v_new]);
        if plan.has_contact_courses() {
            let dt = plan.grid.step_s();
            if let Some(force_n) = outside.drive_force_n() {
                state.energy.drive_work_j.add(dt * force_n * moved.v_new[0]);
            }
            if plan.prestress_course.is_some() {
                let work_w =
                    self.prestress_n.iter().zip(moved.v_new).fold(0.0, |sum, (force, v)| sum + force * v);
                state.energy.load_work_j.add(dt * work_w);
            }
        }
        let mut work = self.law.step_work(&moved);
        if plan.friction.weakens() {
            let Moved { u, v, tau, slip, strengths, dt, mass, .. } = moved;
            let contacts = Rubbing { u: [u], v: [v], tau: [tau], slip, strengths, dt_over_m: dt / mass };
            let fracture_w = self.law.fracture_w(&contacts, [moved.v_new]);
            state.energy.fracture_energy_j.add(dt * fracture_w);
        }
        if let Some(junctions) = &self.junctions {
            let [heat_j, scheme_j] = junctions.heat_and_scheme_j(&state.velocity_m_per_s);
            state.energy.friction_heat_j.add(heat_j);
            work.scheme_j += scheme_j;
        }
        self.accounts.add_step(plan, &mut state.energy, &work, slip, velocities);
    }

    #[inline]
    fn end_step(&mut self, plan: &Plan, state: &mut SliderState, is_last: bool) {
        if !self.adds_alone {
            self.accounts.end_single_step(plan, state, is_last);
        }
    }

    fn initial_j(&self) -> f64 {
        self.accounts.initial_j()
    }

    fn energy(&mut self, plan: &Plan, state: &SliderState) -> Energy {
        self.accounts.energy(plan, state)
    }

    fn follow(&mut self, plan: &Plan, state: &SliderState) {
        self.accounts.follow(plan, state);
    }
}
