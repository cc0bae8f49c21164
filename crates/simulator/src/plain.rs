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

use asperity_model::{Law, Plan, Reattach};
use asperity_record::Record;

use crate::recorder::Recorder;
use crate::state::{ChainState, aged_threshold_n};
use crate::sweep::{After, Blocks, Constants, Steps, Sweeps};
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
    /// Driving force on each block in the last step; whether the drive pulls both ways, and
    /// whether it pulls any but the ends.
    driving_force_n: Vec<f64>,
    pulls_both_ways: bool,
    pulls_inside: bool,
    /// Whether thresholds or sliding friction change with time.
    loads_change: bool,
    /// Thresholds, no less than these, and sliding friction in the last step, and the load
    /// factor that they are for.
    threshold_n: Vec<f64>,
    sliding_friction_n: Vec<f64>,
    load_factor: f64,
    /// The blocks that may switch, as bits.
    marks: Vec<u64>,
    /// The blocks that switched in the last step, counted from 0, ascending.
    switched: Vec<usize>,
    counters: Counters,
}

/// What the drive does in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driving {
    /// Sum of the forces on all blocks, N.
    pub total_n: f64,
    /// The forces on the first and the last block where the drive pulls both ways.
    pub ends_n: Option<[f64; 2]>,
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
                weakening: match plan.friction.law {
                    Law::Springs => 0.0,
                    Law::Rigid { weakening_s_per_m, .. } => weakening_s_per_m,
                },
                radiation: match plan.friction.law {
                    Law::Springs => 0.0,
                    Law::Rigid { radiation_kg_per_s, .. } => radiation_kg_per_s,
                },
            },
            driving_force_n: vec![0.0; plan.blocks],
            pulls_both_ways: plan.drive.pulls_both_ways(),
            pulls_inside: plan.drive.pulls_inside(plan.blocks),
            loads_change: !plan.load_course.is_constant() || plan.friction.ageing.is_some(),
            threshold_n: plan.friction.static_threshold_n.clone(),
            sliding_friction_n: plan.friction.dynamic_friction_n.clone(),
            load_factor: 1.0,
            marks: vec![0; plan.blocks.div_ceil(64)],
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

    /// Takes one step; returns the driving forces that it used.
    pub fn take_step(&mut self) -> Driving {
        self.state.step += 1;
        self.state.sliding = self.state.detached;
        if self.loads_change {
            self.follow_load();
        }
        let (plan, state) = (&self.plan, &mut self.state);
        // The drive is taken at the new time, the blocks where they were.
        let point_m = plan.drive_point_m(state.step, state.hold_step);
        let mut total_n = 0.0;
        for spring in &plan.drive.springs {
            let force_n = spring.force_n(point_m, state.displacement_m[spring.block]);
            self.driving_force_n[spring.block] = force_n;
            total_n += force_n;
        }
        let driving = Driving {
            total_n,
            ends_n: self
                .pulls_both_ways
                .then(|| [self.driving_force_n[0], self.driving_force_n[plan.blocks - 1]]),
        };
        let old = Blocks {
            u: &state.displacement_m,
            v: &state.velocity_m_per_s,
            u_stick: &state.stick_position_m,
            slip: &state.slip,
            threshold: &self.threshold_n,
            sliding_friction: &self.sliding_friction_n,
            driving_force: &self.driving_force_n,
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
        if any_switch {
            self.switch_blocks();
        }
        std::mem::swap(&mut self.state.velocity_m_per_s, &mut self.new_velocity_m_per_s);
        self.counters.plain_steps += 1;
        self.counters.switches += self.switched.len() as u64;
        self.stop_at_load(total_n);
        driving
    }

    /// Brings thresholds and sliding friction to the load of the step.
    fn follow_load(&mut self) {
        let (plan, state) = (&self.plan, &self.state);
        let factor = plan.load_factor(state.step, state.hold_step);
        let ages = plan.friction.ageing.is_some();
        if factor == self.load_factor && !ages {
            return;
        }
        self.load_factor = factor;
        let scale = |to: &mut [f64], from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = factor * from;
            }
        };
        scale(&mut self.threshold_n, state.least_threshold_n(plan));
        scale(&mut self.sliding_friction_n, &plan.friction.dynamic_friction_n);
    }

    /// Stops the drive point where the load has been reached that it is to be driven to.
    fn stop_at_load(&mut self, total_n: f64) {
        let (plan, state) = (&self.plan, &mut self.state);
        let Some(ratio) = plan.drive.until_load_ratio.filter(|_| state.hold_step == u64::MAX) else { return };
        let normal_load_n = plan.total_normal_load_n * self.load_factor;
        if total_n >= ratio * normal_load_n {
            state.hold_step = state.step;
        }
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
        let decline = if self.loads_change {
            1.0 - self.plan.load_factor(state.step + 1, state.hold_step) / self.load_factor
        } else {
            0.0
        };
        self.sweeps.crossing_ahead(&steps, &state.slip, &self.threshold_n, decline)
    }

    /// Puts the switches of this step in force for the next.
    fn switch_blocks(&mut self) {
        let (plan, state) = (&self.plan, &mut self.state);
        let friction = &plan.friction;
        let rigid = friction.law != Law::Springs;
        let after = After {
            slip: &state.slip,
            v: &state.velocity_m_per_s,
            v_new: &self.new_velocity_m_per_s,
            tau: &state.tangential_force_n,
            threshold: &self.threshold_n,
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
                        if tau.abs() < self.load_factor * aged {
                            continue;
                        }
                    }
                    state.slip[n] = 1.0;
                    state.detached += 1;
                }
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
            let driving = self.take_step();
            let Plain { plan, state, recorder, switched, .. } = self;
            recorder.observe(plan, state, was_sliding, driving, switched)?;
        }
    }

    fn step(&self) -> u64 {
        self.state.step
    }

    fn is_between_records(&self) -> bool {
        self.recorder.is_empty()
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
        if self.loads_change {
            // Of no step: thresholds are to be brought to the next one's in any case.
            self.load_factor = f64::NAN;
        }
        self.switched.clear();
        self.recorder.continue_after(&self.plan, state.step);
    }
}
