//! Rate-and-state friction ([`crate::law::rate_and_state`]), as the list of laws sees it.

use crate::law::{ContactLaw, Sliding, Turn};
use crate::scenario::Scenario;
pub(super) use crate::law::rate_and_state::RateAndState;

/// No contact of this law ever sticks, and no solver that takes steps of equal length can run it: friction over
/// velocity is as large as `1e15 / s` times the mass. The adaptive solver computes it, without these functions, so
/// here a contact is free.
impl ContactLaw for RateAndState {
    const STICKS: bool = false;
    const KEYS: &'static [&'static str] = &[
        "friction.direct_effect",
        "friction.evolution_effect",
        "friction.evolution_offsets",
        "friction.critical_slip_m",
        "friction.reference_velocity_m_per_s",
        "friction.reference_coefficient",
        "friction.evolution",
        "friction.inertia",
        "friction.radiation_kg_per_s",
        "friction.initial_kick",
        "friction.event_speed_m_per_s",
        "time.tolerance",
    ];

    fn of(scenario: &Scenario) -> RateAndState {
        let friction = &scenario.friction;
        RateAndState {
            direct_effect: friction.direct_effect,
            evolution_effect: friction.evolution_effect,
            critical_slip_m: friction.critical_slip_m,
            reference_velocity_m_per_s: friction.reference_velocity_m_per_s,
            reference_coefficient: friction.reference_coefficient,
            evolution: friction.evolution,
            inertia: friction.inertia,
            radiation_kg_per_s: friction.radiation_kg_per_s,
            initial_kick: friction.initial_kick,
            event_speed_m_per_s: match friction.event_speed_m_per_s {
                0.0 => scenario.default_event_speed_m_per_s(),
                given_m_per_s => given_m_per_s,
            },
            tolerance: scenario.time.tolerance,
        }
    }

    #[inline(always)]
    fn drag_n(&self, _: &Sliding<'_>) -> [f64; 1] {
        [0.0]
    }

    #[inline(always)]
    fn re_attaches(&self, _: &Turn) -> bool {
        false
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s
    }
}
