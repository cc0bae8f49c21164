//! The state of a slider between two steps: the start of a plan, what a checkpoint saves, and what one run leaves to
//! another.

use serde::{Deserialize, Serialize};

use crate::plan::Plan;
use crate::plan::adaptive_state::AdaptiveState;
use crate::plan::junction_state::JunctionState;
use crate::plan::ledger::Ledger;

/// Everything that the next step depends on, and the forces of the last step.
///
/// Arrays have one value per freedom of a node, per contact, or per tangential freedom of a contact, axis by
/// axis; in a chain these are all the same blocks. Loops over them take most of a run's time, and this layout
/// lets compilers vectorise them. The first freedoms of a lattice are those of its contacts along the sliding
/// direction ([`crate::body::lattice`]).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliderState {
    /// The last step taken; 0 initially.
    pub step: u64,
    /// Displacement `u_n` of each freedom from the initial grid. Absolute positions would lose
    /// seven digits and change the events.
    pub displacement_m: Vec<f64>,
    /// Velocity `v_n` of each freedom.
    pub velocity_m_per_s: Vec<f64>,
    /// Anchor `u_stick,n` of each contact's friction spring, axis by axis; stale while it slides. Of junctions,
    /// the mean of their anchors.
    pub stick_position_m: Vec<f64>,
    /// 1 for a contact that enters the next step detached, 0 for a stuck one; numbers, so that loops
    /// select without branches.
    pub slip: Vec<f64>,
    /// How many contacts enter the next step detached.
    pub detached: u32,
    /// Tangential force without friction `tau_n` on each contact in the last step, axis by axis.
    pub tangential_force_n: Vec<f64>,
    /// Over an area, the contacts that detached in the last step, counted from 0, ascending: in the next one,
    /// the force of the last step is the direction of their slip.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub just_detached: Vec<u32>,
    /// Normal load `p_n` on each contact of a body on a foundation in the last step, and on contacts whose loads
    /// follow courses of their own; empty for others, whose normal load the plan has.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normal_load_n: Vec<f64>,
    /// How many contacts slid in the last step.
    pub sliding: u32,
    /// The step in which the drive point stopped or will stop; `u64::MAX` if none is known.
    pub hold_step: u64,
    /// Energies up to the last step.
    pub energy: Ledger,
    /// The step in which each contact last began to stick, where contacts age.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stuck_since_step: Vec<u64>,
    /// Lower bound on the threshold of each stuck contact at the initial load, where the contacts of a
    /// chain age.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub aged_threshold_n: Vec<f64>,
    /// What each contact remembers, contact by contact
    /// ([`ContactLaw::MEMORY`](crate::law::ContactLaw::MEMORY)).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub memory: Vec<f64>,
    /// The junctions of the contacts, by the law that has them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub junctions: Option<Box<JunctionState>>,
    /// The state `psi_n` of rate-and-state friction of each contact; empty by other laws.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub friction_state: Vec<f64>,
    /// Largest speed of any block since the last step record, by rate-and-state friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_velocity_m_per_s: Option<f64>,
    /// The motion under rate-and-state friction, at the start and in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<Box<AdaptiveState>>,
}

impl SliderState {
    /// The slider of a plan at its start, with every contact stuck: at the step, with the stop of the drive,
    /// displacements, velocities, anchors and states of rate-and-state friction that the plan has.
    pub fn stuck(plan: &Plan) -> SliderState {
        let initial = &plan.initial;
        let (step, hold_step) = (initial.step, initial.hold_step);
        let (u, v) = (&initial.displacement_m, &initial.velocity_m_per_s);
        let mut tangential_force_n = plan.elastic.tangential_force_n(u);
        for (n, tau) in tangential_force_n.iter_mut().enumerate() {
            *tau += plan.elastic.damping_force_n(v, plan.elastic.tangential_freedom(n));
        }
        let outside = plan.outside(step, hold_step);
        outside.add_n(&mut tangential_force_n[..plan.blocks], [u, v]);
        let (ages, is_given) = (plan.friction.ageing.is_some(), plan.has_given_loads());
        SliderState {
            step,
            hold_step,
            displacement_m: u.clone(),
            velocity_m_per_s: v.clone(),
            stick_position_m: initial.stick_position_m.clone(),
            slip: vec![0.0; plan.blocks],
            tangential_force_n,
            normal_load_n: if is_given { Vec::new() } else { outside.loads_n() },
            stuck_since_step: if ages { vec![step; plan.blocks] } else { Vec::new() },
            aged_threshold_n: if ages && is_given {
                plan.friction.static_threshold_n.clone()
            } else {
                Vec::new()
            },
            memory: vec![0.0; plan.friction.law.memory() * plan.blocks],
            junctions: JunctionState::initial(plan),
            friction_state: initial.friction_state.clone(),
            peak_velocity_m_per_s: plan.friction.law.rate_and_state().map(|_| 0.0),
            adaptive: AdaptiveState::initial(plan),
            ..SliderState::default()
        }
    }

    /// Checks a loaded state against the plan: sizes, finite values, the step, and that the drive stops
    /// no later than it may. A state from a file must pass before a solver restores it.
    pub fn fits(&self, plan: &Plan) -> bool {
        let are_finite =
            |values: &[f64], count| values.len() == count && values.iter().all(|x| x.is_finite());
        let (freedoms, tangential_axes) = (plan.elastic.freedoms(), plan.elastic.tangential_axes());
        let tangential = |values: &[f64]| are_finite(values, tangential_axes * plan.blocks);
        let slides = |n: &u32| self.slip.get(*n as usize).is_some_and(|slip| *slip == 1.0);
        let (ages, is_given) = (plan.friction.ageing.is_some(), plan.has_given_loads());
        let slipping = self.slip.iter().filter(|&&slip| slip == 1.0).count();
        let sticking = self.slip.iter().filter(|&&slip| slip == 0.0).count();
        (plan.initial.step..=plan.steps).contains(&self.step)
            && are_finite(&self.displacement_m, freedoms)
            && are_finite(&self.velocity_m_per_s, freedoms)
            && tangential(&self.stick_position_m)
            && tangential(&self.tangential_force_n)
            && (tangential_axes > 1 || self.just_detached.is_empty())
            && self.just_detached.iter().all(slides)
            && self.just_detached.is_sorted_by(|a, b| a < b)
            && slipping + sticking == plan.blocks
            && self.slip.len() == plan.blocks
            && self.detached as usize == slipping
            && self.sliding as usize <= plan.blocks
            && match plan.drive.until_load_ratio {
                None => self.hold_step == plan.initial.hold_step,
                Some(_) => self.hold_step == u64::MAX || self.hold_step <= self.step,
            }
            && self.energy.is_finite()
            && self.energy.span.is_none_or(|span| span.from_step <= self.step)
            && self.stuck_since_step.len() == if ages { plan.blocks } else { 0 }
            && self.stuck_since_step.iter().all(|&step| step <= self.step)
            && self.normal_load_n.len() == if is_given { 0 } else { plan.blocks }
            && self.normal_load_n.iter().all(|load_n| load_n.is_finite() && *load_n >= 0.0)
            && match &self.junctions {
                None => plan.friction.law.junctions().is_none(),
                Some(junctions) => junctions.fits(plan, self.step, &self.slip),
            }
            && are_finite(&self.friction_state, plan.friction.evolution_effects.len())
            && self.adaptive.is_some() == plan.friction.law.rate_and_state().is_some()
            && self.adaptive.iter().all(|adaptive| adaptive.fits(plan, self.step))
            && self.peak_velocity_m_per_s.is_some() == self.adaptive.is_some()
            && self.peak_velocity_m_per_s.is_none_or(|speed| speed.is_finite() && speed >= 0.0)
            && are_finite(&self.memory, plan.friction.law.memory() * plan.blocks)
            && are_finite(&self.aged_threshold_n, if ages && is_given { plan.blocks } else { 0 })
    }
}
