//! The state that a slider leaves to another run, which [`SliderState::initial`] takes over.

use asperity_model::Plan;
use asperity_model::plan::initial_state::{Carried, CarriedDrive, CarriedSolver, InitialState};

use crate::modes::slow_modes::mirrors_itself;
use crate::records::pace::{Pace, Snapshot};
use crate::step::state::SliderState;

impl Snapshot {
    /// The state in which another run can begin, from the plan of this run and the keys that both must share.
    pub fn to_initial(&self, plan: &Plan, keys: Vec<(String, String)>) -> InitialState {
        let Snapshot { slider, pace } = self;
        let detached = (0..).zip(&slider.slip).filter(|(_, slip)| **slip != 0.0).map(|(n, _)| n).collect();
        InitialState {
            step: slider.step,
            displacement_m: slider.displacement_m.clone(),
            velocity_m_per_s: slider.velocity_m_per_s.clone(),
            stick_position_m: slider.stick_position_m.clone(),
            state: slider.friction_state.clone(),
            carried: Some(Box::new(Carried {
                keys,
                detached,
                just_detached: slider.just_detached.iter().map(|n| u64::from(*n)).collect(),
                normal_load_n: slider.normal_load_n.clone(),
                stuck_since_step: slider.stuck_since_step.clone(),
                memory: slider.memory.clone(),
                hold_step: slider.hold_step,
                drive: Some(CarriedDrive {
                    point_m: plan.outside(slider.step, slider.hold_step).point_m,
                    offset_m: plan.drive.offset_m,
                    until_load_ratio: plan.drive.until_load_ratio,
                    rest_m: plan.drive.springs.iter().map(|spring| spring.rest_m).collect(),
                    ends_m: plan.end_bonds.iter().map(|bond| bond.rest_m).collect(),
                }),
                junctions: slider.junctions.as_ref().map(|junctions| junctions.carried()),
                solver: Some(carried_solver(slider, *pace, plan)),
            })),
        }
    }
}

fn carried_solver(slider: &SliderState, pace: Pace, plan: &Plan) -> CarriedSolver {
    let tau_n = &slider.tangential_force_n;
    let of_contacts = |n: &u32| *n as usize;
    CarriedSolver {
        motion: plan.motion_hash(),
        sliding: slider.sliding,
        tangential_force_n: match plan.elastic.as_chain() {
            Some(_) => tau_n.clone(),
            None => tau_n
                .chunks_exact(plan.blocks)
                .flat_map(|of_axis| slider.just_detached.iter().map(|n| of_axis[of_contacts(n)]))
                .collect(),
        },
        aged_threshold_n: slider.aged_threshold_n.clone(),
        has_open_span: slider.energy.span.is_some(),
        pace: [pace.single_steps, pace.no_jump_before_step, pace.saved_steps],
        mirrors: plan.elastic.as_chain().is_none() && mirrors_itself(plan, &plan.elastic),
        adaptive: slider
            .adaptive
            .as_ref()
            .map(|open| (slider.peak_velocity_m_per_s.unwrap_or(0.0), open.carried(plan.blocks))),
    }
}
