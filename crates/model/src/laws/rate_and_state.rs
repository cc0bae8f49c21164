//! Rate-and-state friction ([`crate::rate_and_state`]), as the list of laws sees it.

use crate::law::{ContactLaw, LawKeys, Sliding, Turn};
pub(super) use crate::rate_and_state::RateAndState;

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

    fn of(keys: &LawKeys) -> RateAndState {
        keys.rate_and_state
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
