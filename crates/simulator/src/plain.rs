//! The plain stepper: every step, as the equations of Chapter 5 read.
//!
//! One step from `t - dt` to `t`, all blocks from the old state:
//!
//! 1. the tangential force without friction (5.6, 5.7, 5.8)
//!    `tau_n = k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1}) + F_n`;
//! 2. friction: a stuck block's spring pulls with `-k_t (u_n - u_stick,n)` (5.12), a
//!    sliding block feels `-mu_d p_n sign(v_n)` (5.14);
//! 3. Euler-Cromer (4.13, 4.14): `v_n += dt (tau_n + f_n) / m`, then `u_n += dt v_n`;
//! 4. switches, in force from the next step: a stuck block detaches at
//!    `|tau_n| >= mu_s p_n` (5.13); a sliding block whose new velocity has come to
//!    rest re-attaches at `u_stick,n = u_n - tau_n / k_t` (5.15), with the new
//!    position, this step's `tau_n`, and its velocity kept.

use asperity_model::{Plan, Reattach};
use asperity_record::Record;

use crate::recorder::Recorder;
use crate::state::ChainState;
use crate::sweep::{Blocks, Constants, Steps, Sweeps, comes_to_rest};
use crate::{Counters, SimulationError, Solver, SolverKind};

/// The solver that takes every step.
#[derive(Debug, Clone)]
pub struct Plain {
    plan: Plan,
    state: ChainState,
    recorder: Recorder,
    sweeps: Sweeps,
    constants: Constants,
    /// Displacements and velocities after the step, while those before it are still
    /// needed.
    new_displacement_m: Vec<f64>,
    new_velocity_m_per_s: Vec<f64>,
    /// Tangential forces of the step before.
    old_tangential_force_n: Vec<f64>,
    /// The blocks that switched in the last step, counted from 0, ascending.
    switched: Vec<usize>,
    counters: Counters,
}

impl Plain {
    /// A solver at the start of a plan.
    pub fn new(plan: Plan) -> Plain {
        Plain::with_sweeps(plan, Sweeps::detect())
    }

    /// The same with sweeps for a certain instruction set.
    pub(crate) fn with_sweeps(plan: Plan, sweeps: Sweeps) -> Plain {
        let state = ChainState::initial(&plan);
        let recorder = Recorder::new(&plan, &state);
        let dt = plan.grid.step_s();
        Plain {
            constants: Constants {
                k: plan.stiffness_n_per_m,
                eta: plan.damping_kg_per_s,
                dt,
                dt_over_m: dt / plan.block_mass_kg,
                kt: plan.friction.interfacial_stiffness_n_per_m,
                two_way: plan.friction.reattach == Reattach::TwoWay,
            },
            new_displacement_m: vec![0.0; plan.blocks],
            new_velocity_m_per_s: vec![0.0; plan.blocks],
            old_tangential_force_n: vec![0.0; plan.blocks],
            plan,
            state,
            recorder,
            sweeps,
            switched: Vec::new(),
            counters: Counters::default(),
        }
    }

    /// The state after the last step taken.
    pub fn state(&self) -> &ChainState {
        &self.state
    }

    /// The same, for a solver that takes many steps at once.
    pub(crate) fn state_mut(&mut self) -> &mut ChainState {
        &mut self.state
    }

    /// The blocks that switched in the last step, counted from 0.
    pub fn switched(&self) -> &[usize] {
        &self.switched
    }

    /// Takes one step; returns the driving force that it used.
    pub fn take_step(&mut self) -> f64 {
        let (plan, state) = (&self.plan, &mut self.state);
        state.step += 1;
        state.sliding = state.detached;
        // The drive is taken at the new time, block 1 where it was.
        let driving_force_n = plan.drive.force_n(plan.grid.time_s(state.step), state.displacement_m[0]);
        let old = Blocks {
            u: &state.displacement_m,
            v: &state.velocity_m_per_s,
            u_stick: &state.stick_position_m,
            slip: &state.slip,
            threshold: &plan.friction.static_threshold_n,
            sliding_friction: &plan.friction.dynamic_friction_n,
            driving_force_n,
        };
        std::mem::swap(&mut state.tangential_force_n, &mut self.old_tangential_force_n);
        let any_switch = self.sweeps.step(
            &mut self.new_displacement_m,
            &mut self.new_velocity_m_per_s,
            &mut state.tangential_force_n,
            &old,
            &self.constants,
        );
        std::mem::swap(&mut state.displacement_m, &mut self.new_displacement_m);
        self.switched.clear();
        if any_switch {
            self.switch_blocks();
        }
        std::mem::swap(&mut self.state.velocity_m_per_s, &mut self.new_velocity_m_per_s);
        self.counters.plain_steps += 1;
        self.counters.switches += self.switched.len() as u64;
        driving_force_n
    }

    /// Steps until the first block would switch, if forces and velocities went on as they
    /// did from the step before the last to the last, in which none may have switched.
    pub(crate) fn foreseen_steps(&self) -> f64 {
        let state = &self.state;
        let steps = Steps {
            tau: &state.tangential_force_n,
            tau_before: &self.old_tangential_force_n,
            v: &state.velocity_m_per_s,
            v_before: &self.new_velocity_m_per_s,
        };
        self.sweeps.crossing_ahead(&steps, &state.slip, &self.plan.friction.static_threshold_n)
    }

    /// Puts the switches of this step in force for the next.
    fn switch_blocks(&mut self) {
        let (friction, blocks) = (&self.plan.friction, self.plan.blocks);
        let two_way = friction.reattach == Reattach::TwoWay;
        let state = &mut self.state;
        // All of one length, which spares checking every index.
        let (tau, slip) = (&state.tangential_force_n[..blocks], &mut state.slip[..blocks]);
        let (v, new_v) = (&state.velocity_m_per_s[..blocks], &self.new_velocity_m_per_s[..blocks]);
        let threshold = &friction.static_threshold_n[..blocks];
        for n in 0..blocks {
            let slides = slip[n] != 0.0;
            if slides && comes_to_rest(v[n], new_v[n], two_way) {
                slip[n] = 0.0;
                state.stick_position_m[n] =
                    state.displacement_m[n] - tau[n] / friction.interfacial_stiffness_n_per_m;
                state.detached -= 1;
                self.switched.push(n);
            } else if !slides && tau[n].abs() >= threshold[n] {
                slip[n] = 1.0;
                state.detached += 1;
                self.switched.push(n);
            }
        }
    }
}

impl Solver for Plain {
    fn name(&self) -> &'static str {
        SolverKind::Plain.name()
    }

    fn next_record(&mut self) -> Result<Option<Record>, SimulationError> {
        loop {
            if let Some(record) = self.recorder.pop() {
                return Ok(Some(record));
            }
            if self.state.step == self.plan.steps {
                return Ok(None);
            }
            let was_sliding = self.state.sliding > 0;
            let driving_force_n = self.take_step();
            let Plain { plan, state, recorder, switched, .. } = self;
            recorder.observe(plan, state, was_sliding, driving_force_n, switched)?;
        }
    }

    fn step(&self) -> u64 {
        self.state.step
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn snapshot(&self) -> ChainState {
        self.state.clone()
    }

    fn restore(&mut self, state: &ChainState) {
        assert_eq!(state.displacement_m.len(), self.plan.blocks, "the state of a chain of another size");
        self.state = state.clone();
        self.switched.clear();
        self.recorder.continue_after(&self.plan, state.step);
    }
}
