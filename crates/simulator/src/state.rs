//! The state of a slider between two steps.

use asperity_model::{Plan, slab};
use serde::{Deserialize, Serialize};

use crate::cost::FIRST_SAVED_STEPS;
use crate::ledger::Ledger;

/// Everything that the next step depends on, and the last step's forces.
///
/// Structure of arrays, one value per freedom of a node or per contact, which are the same blocks
/// in a chain: the sweeps over them are what a run spends its time in, and compilers vectorise them
/// in this form. The first freedoms of a slab are those of its contacts along the sliding direction
/// ([`asperity_model::lattice`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChainState {
    /// The last step taken; 0 initially.
    pub step: u64,
    /// Displacement `u_n` of each freedom from the initial grid. Absolute positions would lose
    /// seven digits and change the events.
    pub displacement_m: Vec<f64>,
    /// Velocity `v_n` of each freedom.
    pub velocity_m_per_s: Vec<f64>,
    /// Anchor `u_stick,n` of each contact's friction spring; stale while it slides.
    pub stick_position_m: Vec<f64>,
    /// 1 for a contact that enters the next step detached, 0 for one that is
    /// stuck: as numbers, so that a sweep can choose without branching.
    pub slip: Vec<f64>,
    /// How many contacts enter the next step detached.
    pub detached: u32,
    /// Tangential force without friction `tau_n` on each contact in the last step.
    pub tangential_force_n: Vec<f64>,
    /// Normal load `p_n` on each contact of a slab in the last step; empty in a chain, whose plan
    /// gives it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normal_load_n: Vec<f64>,
    /// How many contacts slid in the last step.
    pub sliding: u32,
    /// Steps that a solver has decided to take one by one before it tries again
    /// for many at once: part of the state, so that a restored run is cut up, and
    /// rounds, as the one that it continues.
    pub single_steps: u64,
    /// The same for jumps: none is tried before this step.
    pub no_jump_before_step: u64,
    /// Steps that leaps have saved over what was spent on them, up to a limit.
    #[serde(default)]
    pub saved_steps: u64,
    /// The step in which the drive point stopped or will stop; `u64::MAX` for none that is
    /// known.
    #[serde(default = "never")]
    pub hold_step: u64,
    /// Energies up to the last step.
    #[serde(default)]
    pub energy: Ledger,
    /// Where contacts age, the step in which each stuck last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stuck_since_step: Vec<u64>,
    /// Where the contacts of a chain age, what the threshold of each stuck one is no less than, at
    /// the load of the start.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub aged_threshold_n: Vec<f64>,
}

fn never() -> u64 {
    u64::MAX
}

impl ChainState {
    /// The slider before the first step, every contact stuck.
    pub fn initial(plan: &Plan) -> ChainState {
        let initial = &plan.initial;
        let u = &initial.displacement_m;
        let hold_step = plan.drive.hold_from_step.unwrap_or(u64::MAX);
        let point_m = plan.drive_point_m(initial.step, hold_step);
        let tangential_force_n = match plan.elastic.lattice() {
            // Its driving springs are relaxed.
            Some(_) => slab::tangential_force_n(plan),
            None => {
                let v = &initial.velocity_m_per_s;
                let mut tau_n: Vec<f64> = (0..plan.blocks).map(|n| plan.elastic.pull_n(u, v, n)).collect();
                for spring in &plan.drive.springs {
                    tau_n[spring.block] += spring.force_n(point_m, u[spring.block]);
                }
                for (tau, prestress) in tau_n.iter_mut().zip(&plan.prestress_n) {
                    *tau += prestress;
                }
                tau_n
            }
        };
        let is_slab = plan.elastic.lattice().is_some();
        let ages = plan.friction.ageing.is_some();
        ChainState {
            step: initial.step,
            displacement_m: u.clone(),
            velocity_m_per_s: initial.velocity_m_per_s.clone(),
            stick_position_m: initial.stick_position_m.clone(),
            slip: vec![0.0; plan.blocks],
            detached: 0,
            tangential_force_n,
            normal_load_n: if is_slab { plan.normal_load_n.clone() } else { Vec::new() },
            sliding: 0,
            single_steps: 0,
            no_jump_before_step: 0,
            saved_steps: FIRST_SAVED_STEPS,
            hold_step,
            energy: Ledger::default(),
            stuck_since_step: if ages { vec![initial.step; plan.blocks] } else { Vec::new() },
            aged_threshold_n: if ages && !is_slab {
                plan.friction.static_threshold_n.clone()
            } else {
                Vec::new()
            },
        }
    }

    /// Whether this can be a state of that plan: that it is of as many blocks, finite, within the
    /// run's steps, and that its drive stops no later than it may.
    /// What is read from a file is to be asked before a solver restores it.
    pub fn fits(&self, plan: &Plan) -> bool {
        let are_finite =
            |values: &[f64], count| values.len() == count && values.iter().all(|x| x.is_finite());
        let finite = |values: &[f64]| are_finite(values, plan.blocks);
        let freedoms = plan.elastic.freedoms();
        let ages = plan.friction.ageing.is_some();
        let slipping = self.slip.iter().filter(|&&slip| slip == 1.0).count();
        let sticking = self.slip.iter().filter(|&&slip| slip == 0.0).count();
        (plan.initial.step..=plan.steps).contains(&self.step)
            && are_finite(&self.displacement_m, freedoms)
            && are_finite(&self.velocity_m_per_s, freedoms)
            && finite(&self.stick_position_m)
            && finite(&self.tangential_force_n)
            && slipping + sticking == plan.blocks
            && self.slip.len() == plan.blocks
            && self.detached as usize == slipping
            && self.sliding as usize <= plan.blocks
            && match plan.drive.until_load_ratio {
                None => self.hold_step == plan.drive.hold_from_step.unwrap_or(u64::MAX),
                Some(_) => self.hold_step == u64::MAX || self.hold_step <= self.step,
            }
            && self.energy.is_finite()
            && self.energy.span.is_none_or(|span| span.from_step <= self.step)
            && self.stuck_since_step.len() == if ages { plan.blocks } else { 0 }
            && self.stuck_since_step.iter().all(|&step| step <= self.step)
            && match plan.elastic.lattice() {
                Some(_) => {
                    finite(&self.normal_load_n)
                        && self.normal_load_n.iter().all(|load_n| *load_n >= 0.0)
                        && self.aged_threshold_n.is_empty()
                }
                None if ages => finite(&self.aged_threshold_n) && self.normal_load_n.is_empty(),
                None => self.aged_threshold_n.is_empty() && self.normal_load_n.is_empty(),
            }
    }
}
