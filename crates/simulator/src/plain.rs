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
use crate::{SimulationError, Solver};

/// The solver that takes every step.
#[derive(Debug, Clone)]
pub struct Plain {
    plan: Plan,
    state: ChainState,
    recorder: Recorder,
    /// Whether a block switched in the last step.
    switches: Vec<bool>,
    /// The blocks that did, counted from 0, ascending.
    switched: Vec<usize>,
}

impl Plain {
    /// A solver at the start of a plan.
    pub fn new(plan: Plan) -> Plain {
        let state = ChainState::initial(&plan);
        let recorder = Recorder::new(&plan, &state);
        Plain { switches: vec![false; plan.blocks], plan, state, recorder, switched: Vec::new() }
    }

    /// The state after the last step taken.
    pub fn state(&self) -> &ChainState {
        &self.state
    }

    /// The blocks that switched in the last step, counted from 0.
    pub fn switched(&self) -> &[usize] {
        &self.switched
    }

    /// Takes one step; returns the driving force that it used.
    pub fn take_step(&mut self) -> f64 {
        self.state.step += 1;
        let driving_force_n = self.tangential_force();
        self.advance_blocks();
        driving_force_n
    }

    /// `tau_n` from the old state, the drive taken at the new time.
    fn tangential_force(&mut self) -> f64 {
        let ChainState { step, displacement_m: u, velocity_m_per_s: v, tangential_force_n: tau, .. } =
            &mut self.state;
        let (k, eta) = (self.plan.stiffness_n_per_m, self.plan.damping_kg_per_s);
        let last = u.len() - 1;

        for (tau, (u, v)) in tau[1..last].iter_mut().zip(u.windows(3).zip(v.windows(3))) {
            *tau = k * (u[2] - 2.0 * u[1] + u[0]) + eta * (v[2] - 2.0 * v[1] + v[0]);
        }
        tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]);
        tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);

        let driving_force_n = self.plan.drive.force_n(self.plan.grid.time_s(*step), u[0]);
        tau[0] += driving_force_n;
        driving_force_n
    }

    /// Friction, new velocities and positions, and the switches.
    fn advance_blocks(&mut self) {
        let ChainState {
            displacement_m, velocity_m_per_s, stick_position_m, detached, tangential_force_n, ..
        } = &mut self.state;
        let (dt, kt) = (self.plan.grid.step_s(), self.plan.friction.interfacial_stiffness_n_per_m);
        let dt_over_m = dt / self.plan.block_mass_kg;
        let two_way = self.plan.friction.reattach == Reattach::TwoWay;

        // Slices of one length, so that no bounds are checked inside the sweep.
        let blocks = self.plan.blocks;
        let u = &mut displacement_m[..blocks];
        let v = &mut velocity_m_per_s[..blocks];
        let u_stick = &stick_position_m[..blocks];
        let detached = &detached[..blocks];
        let tau = &tangential_force_n[..blocks];
        let threshold = &self.plan.friction.static_threshold_n[..blocks];
        let sliding_friction = &self.plan.friction.dynamic_friction_n[..blocks];
        let switches = &mut self.switches[..blocks];

        let mut any_switch = false;
        let mut sliding = 0;
        for n in 0..blocks {
            let v_old = v[n];
            let stuck_force = -kt * (u[n] - u_stick[n]);
            let sliding_force = -sliding_friction[n] * sign(v_old);
            let friction = if detached[n] { sliding_force } else { stuck_force };

            let v_new = v_old + (tau[n] + friction) * dt_over_m;
            v[n] = v_new;
            u[n] += v_new * dt;

            let at_rest = if two_way { v_new * v_old <= 0.0 } else { v_new <= 0.0 };
            let overloaded = tau[n].abs() >= threshold[n];
            switches[n] = if detached[n] { at_rest } else { overloaded };
            any_switch |= switches[n];
            sliding += u32::from(detached[n]);
        }
        self.state.sliding = sliding;
        self.switched.clear();
        if any_switch {
            self.switch_blocks();
        }
    }

    /// Puts the switches of this step in force for the next.
    fn switch_blocks(&mut self) {
        let ChainState { displacement_m: u, stick_position_m, detached, tangential_force_n: tau, .. } =
            &mut self.state;
        for n in (0..self.switches.len()).filter(|&n| self.switches[n]) {
            if detached[n] {
                stick_position_m[n] = u[n] - tau[n] / self.plan.friction.interfacial_stiffness_n_per_m;
            }
            detached[n] = !detached[n];
            self.switched.push(n);
        }
    }
}

impl Solver for Plain {
    fn name(&self) -> &'static str {
        "plain"
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
            let edge = was_sliding != (self.state.sliding > 0);
            if edge || !self.switched.is_empty() || self.recorder.is_due(self.state.step) {
                self.recorder.record(&self.plan, &self.state, driving_force_n, &self.switched, edge)?;
            }
        }
    }

    fn step(&self) -> u64 {
        self.state.step
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

/// The sign of a velocity; 0 for 0, where `v / |v|` would be no number.
fn sign(velocity: f64) -> f64 {
    f64::from(i8::from(velocity > 0.0) - i8::from(velocity < 0.0))
}
