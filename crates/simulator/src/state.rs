//! The state of a chain between two steps.

use asperity_model::Plan;
use serde::{Deserialize, Serialize};

/// Everything that the next step depends on, and the last step's forces.
///
/// Structure of arrays, one value per block: the sweeps over them are what a
/// run spends its time in, and compilers vectorise them in this form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChainState {
    /// The last step taken; 0 initially.
    pub step: u64,
    /// Displacement `u_n` from the initial grid. Absolute positions would lose
    /// seven digits and change the events.
    pub displacement_m: Vec<f64>,
    /// Velocity `v_n`.
    pub velocity_m_per_s: Vec<f64>,
    /// Anchor `u_stick,n` of the friction spring; stale while a block slides.
    pub stick_position_m: Vec<f64>,
    /// 1 for a block that enters the next step detached, 0 for one that is
    /// stuck: as numbers, so that a sweep can choose without branching.
    pub slip: Vec<f64>,
    /// How many blocks enter the next step detached.
    pub detached: u32,
    /// Tangential force without friction `tau_n` of the last step.
    pub tangential_force_n: Vec<f64>,
    /// How many blocks slid in the last step.
    pub sliding: u32,
    /// Steps that a solver has decided to take one by one before it tries again
    /// for many at once: part of the state, so that a restored run is cut up, and
    /// rounds, as the one that it continues.
    pub single_steps: u64,
    /// The same for jumps: none is tried before this step.
    pub no_jump_before_step: u64,
}

impl ChainState {
    /// The chain before the first step, every block stuck.
    pub fn initial(plan: &Plan) -> ChainState {
        let initial = &plan.initial;
        let u = &initial.displacement_m;
        let tangential_force_n = (0..plan.blocks)
            .map(|n| {
                let drive = if n == 0 { plan.drive.force_n(0.0, u[0]) } else { 0.0 };
                plan.stiffness_n_per_m * asperity_model::initial::neighbour_pull(u, n)
                    + plan.damping_kg_per_s
                        * asperity_model::initial::neighbour_pull(&initial.velocity_m_per_s, n)
                    + drive
            })
            .collect();
        ChainState {
            step: 0,
            displacement_m: u.clone(),
            velocity_m_per_s: initial.velocity_m_per_s.clone(),
            stick_position_m: initial.stick_position_m.clone(),
            slip: vec![0.0; plan.blocks],
            detached: 0,
            tangential_force_n,
            sliding: 0,
            single_steps: 0,
            no_jump_before_step: 0,
        }
    }
}
